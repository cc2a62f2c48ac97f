//! Runs that are ended while they write, and gone on with.

use std::fs;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use super::*;
use crate::error::Error;
use crate::exec::save_points::ending::check_ended_anywhere;
use crate::exec::{Budget, Cancel, Engine, Progress, SavePoints};
use crate::grid::Geometry;
use crate::io::ome_zarr::{Compression, Content, ImageSpec, StoreWriter};
use crate::pipeline::output::saved::batch;
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
        let engine = engine.with_save_points(Some(Arc::new(SavePoints::new(checkpoints, Some(every), Arc::default()))));
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
fn a_run_that_is_terminated_ends_the_parts_that_it_has_begun_and_no_others() {
    let read = AtomicUsize::new(0);
    let run = |engine: &Engine| {
        let folder = tempfile::tempdir().unwrap();
        let field = Field { times: usize::MAX, read: AtomicUsize::new(0) };
        let done = Run::new(folder.path(), 1, usize::MAX).write_with(engine, &field);
        read.fetch_add(field.read.into_inner(), Relaxed);
        done.map(|()| files(folder.path()))
    };
    // Shards that are linked count as steps.
    check_ended_anywhere("writing", 25, 2.5, &run);
    // Each chunk is read once, whatever happens: the undisturbed run, and 24 that were ended.
    assert_eq!(read.into_inner(), 25 * CHUNKS);
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
    let batches = |mut left: &[usize], most: usize| {
        let mut parts = Vec::new();
        while !left.is_empty() {
            parts.push(batch(&begins, left, most));
            left = &left[parts[parts.len() - 1]..];
        }
        parts
    };
    let all: Vec<usize> = (0..10).collect();
    assert_eq!(batches(&all, 16), [2, 2, 3, 3]);
    assert_eq!(batches(&all, 1), [1; 10]);
    assert_eq!(batches(&all, 1000), [10]);
    assert_eq!(batches(&[1, 4, 5, 9], 16), [2, 2]);
}
