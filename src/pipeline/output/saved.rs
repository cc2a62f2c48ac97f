//! Images that are written visit by visit, in batches between which a run can put by how far it is.
//!
//! Visits come shard by shard (`pyramid::visits`): those of a *part*, a tile as large as the largest shard of the finest levels, one
//! after the other. A batch is some parts, so after it no shard of a finest level is half come, and none of a coarser level either,
//! as these are written in one go. All that comes then depends on how many parts are done, on what is known of coarser levels (the
//! voxels below that are missing, and the bricks that wait for them), on what was found on the way, and on the shards on disk. These
//! are linked, not copied, and checked by their sums when a run goes on with them; parts, unlike visits, are the same for any number
//! of threads.

use std::ops::Range;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::share::Share;
use crate::error::Result;
use crate::exec::{SavePoint, Saved, Stage, Workers};
use crate::grid::Box3;
use crate::io::ome_zarr::{FileSum, ImageWriter};
use crate::store::checkpoint::{Linked, SavedField};

/// Visits of a batch for each thread, where a part has no more: enough to keep all threads busy nearly to its end.
const VISITS_PER_THREAD: usize = 16;

/// An image that is written, whatever its type.
pub(crate) trait PartlyWritten: Sync {
    fn image(&self) -> &ImageWriter;

    /// Of each coarser level the voxels below that are still to come, of each of its shards.
    fn missing(&self) -> Vec<Vec<u64>>;

    /// Of each coarser level the bricks that wait for them.
    fn waiting(&self) -> Vec<Box<dyn SavedField + '_>>;

    /// Takes up what another run knew; its bricks are the fields of a checkpoint from the `first` one on.
    ///
    /// # Errors
    /// When they cannot be read.
    fn go_on(&self, missing: &[Vec<u64>], saved: &Saved, first: usize) -> Result<()>;

    /// Writes the coarser shards that lie over the visits of several ranks; all ranks do, when each has made its visits.
    ///
    /// # Errors
    /// When a shard cannot be written or another rank is gone.
    fn join(&self, share: &Share<'_>) -> Result<()>;
}

/// What a run knows between two batches.
#[derive(Serialize, Deserialize)]
struct Known<F> {
    /// Parts that are done.
    parts: usize,
    images: Vec<KnownImage>,
    found: F,
}

#[derive(Serialize, Deserialize)]
struct KnownImage {
    form: u32,
    missing: Vec<Vec<u64>>,
    shards: Vec<(String, FileSum)>,
}

/// Makes visits, with `take`, which adds to what was `found`; where the run takes checkpoints, in batches, without those that the
/// run which it goes on with has made. Of a live store, which stays as it is when the run ends, there are no checkpoints.
///
/// # Errors
/// Of `take`, when a checkpoint cannot be read, or the run is interrupted.
pub(crate) fn in_batches<F: Serialize + DeserializeOwned>(
    stage: &Stage<'_>,
    images: &[&dyn PartlyWritten],
    visits: &[Vec<Box3>],
    found: &mut F,
    mut take: impl FnMut(Range<usize>, &mut F) -> Result<()>,
) -> Result<()> {
    let is_live = images.iter().any(|image| image.image().is_live());
    let Some(mut save_point) = (!is_live).then(|| stage.save_point()).flatten() else {
        stage.expect(visits.len() as u64);
        return take(0..visits.len(), found);
    };
    let begins = parts(visits, images);
    let (mut done, parts, mut steps) = (0, begins.len() - 1, 0);
    if let Some(known) = go_on(stage, &save_point, images, parts)? {
        (done, *found) = (known.parts, known.found);
        steps = known.images.iter().map(|image| image.shards.len()).sum();
    }
    stage.expect((steps + visits.len() - begins[done]) as u64);
    while done < parts {
        let end = batch(&begins, done, VISITS_PER_THREAD * stage.threads());
        take(begins[done]..begins[end], found)?;
        done = end;
        let waiting: Vec<_> = images.iter().flat_map(|image| image.waiting()).collect();
        let fields: Vec<&dyn SavedField> = waiting.iter().map(AsRef::as_ref).collect();
        save_point.reached_writing(done == parts, || known(images, done, &*found), &fields)?;
    }
    Ok(())
}

/// What a checkpoint holds, and the files that it links.
fn known<F>(images: &[&dyn PartlyWritten], parts: usize, found: F) -> (Known<F>, Vec<Linked>) {
    let image = |image: &&dyn PartlyWritten| KnownImage {
        form: image.image().form(),
        missing: image.missing(),
        shards: image.image().written(),
    };
    let known: Vec<KnownImage> = images.iter().map(image).collect();
    let linked = images.iter().zip(&known).flat_map(|(image, known)| {
        known.shards.iter().map(|(path, _)| Linked { path: image.image().file(path), name: path.clone() })
    });
    let linked = linked.collect();
    (Known { parts, images: known, found }, linked)
}

/// Goes on where an earlier run was ended: what it knew, with its shards in place. None where there is no such run, or what it has
/// written is of no use, which is told.
fn go_on<F: DeserializeOwned>(
    stage: &Stage<'_>,
    save_point: &SavePoint<'_>,
    images: &[&dyn PartlyWritten],
    parts: usize,
) -> Result<Option<Known<F>>> {
    let Some(saved) = save_point.saved() else { return Ok(None) };
    let known: Known<F> = saved.facts()?;
    let is_same = known.images.iter().map(|known| known.form).eq(images.iter().map(|image| image.image().form()));
    let fault = if is_same && known.parts <= parts {
        take_over(stage, &saved, images, &known.images)?
    } else {
        Some("it is packed in another way than this run packs it".to_owned())
    };
    if let Some(fault) = fault {
        save_point
            .forget(&format!("what was written before is not gone on with, and all of it is written again: {fault}"));
        return Ok(None);
    }
    let mut field = 0;
    for (image, known) in images.iter().zip(&known.images) {
        image.go_on(&known.missing, &saved, field)?;
        field += known.missing.len();
    }
    save_point.note(&format!("goes on where {} of {parts} parts are written", known.parts));
    Ok(Some(known))
}

/// Checks the shards of a checkpoint and links them into the store; says what is wrong with one, if there is something. Those that
/// are linked by then do no harm: all are written again.
fn take_over(
    stage: &Stage<'_>,
    saved: &Saved,
    images: &[&dyn PartlyWritten],
    known: &[KnownImage],
) -> Result<Option<String>> {
    let images = images.iter().map(|image| image.image());
    let shards = images.zip(known).flat_map(|(image, known)| known.shards.iter().map(move |shard| (image, shard)));
    let shards: Vec<_> = shards.zip(saved.linked()).collect();
    if shards.len() != known.iter().map(|known| known.shards.len()).sum::<usize>() {
        return Ok(Some("shards are missing".into()));
    }
    let faults = stage.run(&shards, &Workers::none(), |(), &((image, (path, sum)), file)| {
        let taken = match FileSum::of(file) {
            Ok(found) if found == *sum => image.take_over(path, file, *sum).map_err(|error| error.to_string()),
            Ok(_) => Err("is damaged".into()),
            Err(error) => Err(error.to_string()),
        };
        Ok(taken.err().map(|fault| format!("{}: {fault}", file.display())))
    })?;
    Ok(faults.into_iter().flatten().next())
}

/// The visits with which parts begin, and their number.
fn parts(visits: &[Vec<Box3>], images: &[&dyn PartlyWritten]) -> Vec<usize> {
    let shards = images.iter().filter_map(|image| Some(image.image().levels().first()?.shard_shape()));
    let edge = shards.max_by_key(|edge| edge.iter().product::<i64>()).unwrap_or([1; 3]);
    let part = |visit: &Vec<Box3>| visit.first().map(|chunk| [0, 1, 2].map(|a| chunk.lo[a] / edge[a]));
    let is_new = |&n: &usize| n == 0 || part(&visits[n]) != part(&visits[n - 1]);
    (0..visits.len()).filter(is_new).chain([visits.len()]).collect()
}

/// Where the batch ends that begins with a part: after as many as have no more than so many visits, and one at least.
fn batch(begins: &[usize], from: usize, most: usize) -> usize {
    let fit = begins[from + 1..].iter().take_while(|&&end| end - begins[from] <= most).count();
    from + fit.max(1)
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::Path;
    use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
    use std::sync::{Arc, Mutex};
    use std::time::Duration;

    use super::*;
    use crate::error::Error;
    use crate::exec::{Budget, Cancel, Engine, Progress, SavePoints};
    use crate::grid::Geometry;
    use crate::io::ome_zarr::{Compression, Content, ImageSpec, StoreWriter};
    use crate::pipeline::output::pyramid::{Reduce, write_levels};
    use crate::store::checkpoint::Checkpoints;
    use crate::store::{BoxSource, ElementType, Scratch};

    /// A row of 50 shards of two chunks each, and coarser levels.
    const SHAPE: [i64; 3] = [6400, 20, 10];
    const CHUNKS: usize = 100;

    /// A field that is zero at one end; it can be read so many times.
    struct Field {
        times: usize,
        read: AtomicUsize,
    }

    impl BoxSource<f32> for Field {
        fn shape(&self) -> [i64; 3] {
            SHAPE
        }

        fn read_box(&self, part: &Box3, out: &mut [f32]) -> Result<()> {
            if self.read.fetch_add(1, Relaxed) >= self.times {
                return Err(Error::failed("no more"));
            }
            for (y, z) in part.rows() {
                for x in part.lo[0]..part.hi[0] {
                    out[part.offset_of([x, y, z])] = if x < 150 { 0.0 } else { (x * 3 + y * 5 + z * z) as f32 };
                }
            }
            Ok(())
        }
    }

    /// Keeps what is told.
    #[derive(Default)]
    struct Notes(Mutex<Vec<String>>);

    impl Progress for Notes {
        fn begin(&self, _name: &str, _total: u64) {}
        fn advance(&self, _steps: u64) {}
        fn note(&self, line: &str) {
            self.0.lock().unwrap().push(line.to_owned());
        }
        fn end(&self) {}
    }

    /// One run in a folder.
    struct Run<'a> {
        folder: &'a Path,
        threads: usize,
        /// Boxes that can be read.
        times: usize,
        compression: Compression,
        is_live: bool,
    }

    impl Run<'_> {
        /// Writes `out.zarr`; tells how many boxes were read, and what was said.
        fn write(&self, checkpoints: Checkpoints, every: Duration) -> (Result<()>, usize, String) {
            let (scratch, budget) = (Scratch::new(self.folder, 1 << 30), Budget { total: 1 << 30 });
            let (notes, field) = (Arc::new(Notes::default()), Field { times: self.times, read: AtomicUsize::new(0) });
            let engine = Engine::new(self.threads, scratch, budget, Cancel::default(), notes.clone()).unwrap();
            let engine =
                engine.with_save_points(Some(Arc::new(SavePoints::new(checkpoints, Some(every), Arc::default()))));
            let written = self.write_with(&engine, &field);
            engine.settle_save_points(&written);
            let said = notes.0.lock().unwrap().join("; ");
            (written, field.read.into_inner(), said)
        }

        fn write_with(&self, engine: &Engine, field: &Field) -> Result<()> {
            let create = if self.is_live { StoreWriter::create_live } else { StoreWriter::create };
            let store = create(&self.folder.join("out.zarr"), true)?.packed(self.compression);
            let geometry = Geometry::new(SHAPE, [1.0; 3], [0.0; 3]);
            let spec = ImageSpec {
                name: "field",
                geometry: &geometry,
                element: ElementType::F32,
                content: Content::Field,
                window: None,
                extremes: None,
            };
            let stage = engine.resumable_stage("write field", 0);
            write_levels::<f32>(&stage, engine, store.image("field", &spec)?, field, Reduce::Mean)?;
            stage.finish();
            store.finish()
        }

        /// One that reads so often in so many threads.
        fn new(folder: &'_ Path, threads: usize, times: usize) -> Run<'_> {
            Run { folder, threads, times, compression: Compression::Fast, is_live: false }
        }

        fn begun(&self) -> Checkpoints {
            Checkpoints::begin(&self.folder.join("c.checkpoint"), Vec::new(), false).unwrap()
        }

        fn resumed(&self) -> Checkpoints {
            let (checkpoints, found) = Checkpoints::resume(&self.folder.join("c.checkpoint"), Vec::new()).unwrap();
            assert_eq!((found.stages, found.torn.len()), (1, 0));
            checkpoints
        }
    }

    /// All files of `out.zarr`.
    fn files(folder: &Path) -> Vec<(String, Vec<u8>)> {
        fn walk(folder: &Path, found: &mut Vec<(String, Vec<u8>)>, name: &str) {
            for entry in fs::read_dir(folder).unwrap().map(|entry| entry.unwrap()) {
                let name = format!("{name}/{}", entry.file_name().to_string_lossy());
                if entry.path().is_dir() {
                    walk(&entry.path(), found, &name);
                } else {
                    found.push((name, fs::read(entry.path()).unwrap()));
                }
            }
        }
        let mut found = Vec::new();
        walk(&folder.join("out.zarr"), &mut found, "");
        found.sort();
        found
    }

    fn whole(compression: Compression) -> Vec<(String, Vec<u8>)> {
        let folder = tempfile::tempdir().unwrap();
        let run = Run { compression, ..Run::new(folder.path(), 2, usize::MAX) };
        let (written, read, _) = run.write(run.begun(), Duration::MAX);
        written.unwrap();
        assert_eq!(read, CHUNKS);
        files(folder.path())
    }

    fn shards(folder: &Path) -> Vec<std::path::PathBuf> {
        let entries = fs::read_dir(folder.join("c.checkpoint")).unwrap().map(|entry| entry.unwrap().path());
        let mut shards: Vec<_> = entries.filter(|path| path.extension().is_some_and(|end| end == "shard")).collect();
        shards.sort();
        shards
    }

    #[test]
    fn a_run_that_fails_is_gone_on_with_by_any_number_of_threads() {
        let wanted = whole(Compression::Fast);
        // Batches are of 32 shards in two threads, and of 16 in one: each run gets one farther than the one before.
        for [(first, before), (second, then)] in [[(1, 40), (2, 66)], [(2, 70), (1, 33)]] {
            let folder = tempfile::tempdir().unwrap();
            let run = Run::new(folder.path(), first, before);
            let (failed, _, said) = run.write(run.begun(), Duration::ZERO);
            assert_eq!((failed.unwrap_err().to_string().as_str(), said.as_str()), ("no more", ""));
            assert!(!folder.path().join("out.zarr").exists());
            let run = Run { threads: second, times: then, ..run };
            let (failed, _, said) = run.write(run.resumed(), Duration::ZERO);
            assert!(failed.is_err() && said.contains("write field: goes on where "), "{said}");
            let run = Run { times: usize::MAX, ..run };
            let (written, read, said) = run.write(run.resumed(), Duration::ZERO);
            written.unwrap();
            assert_eq!((read, said.as_str()), (4, "write field: goes on where 48 of 50 parts are written"));
            assert!(files(folder.path()) == wanted, "{first} and {second} threads");
            assert!(!folder.path().join("c.checkpoint").exists());
        }
    }

    #[test]
    fn what_is_damaged_or_packed_otherwise_is_written_again() {
        let damage: fn(&Path) = |path| {
            let mut bytes = fs::read(path).unwrap();
            let middle = bytes.len() / 2;
            bytes[middle] ^= 1;
            fs::write(path, bytes).unwrap();
        };
        let remove: fn(&Path) = |path| fs::remove_file(path).unwrap();
        let leave: fn(&Path) = |_| ();
        let faults = [
            (damage, Compression::Fast, ".shard: is damaged"),
            (remove, Compression::Fast, ".shard: No such file"),
            (leave, Compression::Small, "it is packed in another way"),
        ];
        for (fault, compression, told) in faults {
            let folder = tempfile::tempdir().unwrap();
            let run = Run::new(folder.path(), 2, 70);
            assert!(run.write(run.begun(), Duration::ZERO).0.is_err());
            fault(&shards(folder.path())[2]);
            // Ended once more: what was of no use is not named again.
            let run = Run { compression, ..run };
            let (failed, _, said) = run.write(run.resumed(), Duration::ZERO);
            assert!(failed.is_err() && said.contains(told) && said.contains("all of it is written again"), "{said}");
            let run = Run { times: usize::MAX, ..run };
            let (written, read, said) = run.write(run.resumed(), Duration::ZERO);
            written.unwrap();
            assert!(read < CHUNKS && said.contains("goes on where"), "{read}: {said}");
            assert!(files(folder.path()) == whole(compression), "{told}");
        }
    }

    #[test]
    fn of_a_live_store_nothing_is_put_by() {
        let folder = tempfile::tempdir().unwrap();
        let run = Run { is_live: true, ..Run::new(folder.path(), 2, 70) };
        assert!(run.write(run.begun(), Duration::ZERO).0.is_err());
        assert!(folder.path().join("out.zarr").exists() && !folder.path().join("c.checkpoint").exists());
    }

    #[test]
    fn batches_are_whole_parts_and_no_longer_than_that_where_they_can() {
        let begins = [0, 8, 16, 24, 32, 40, 44, 48, 52, 56, 60];
        let ends = |most: usize| {
            let mut ends = vec![0];
            while ends[ends.len() - 1] < begins.len() - 1 {
                ends.push(batch(&begins, ends[ends.len() - 1], most));
            }
            ends
        };
        assert_eq!(ends(16), [0, 2, 4, 7, 10]);
        assert_eq!(ends(1), (0..=10).collect::<Vec<_>>());
        assert_eq!(ends(1000), [0, 10]);
    }
}
