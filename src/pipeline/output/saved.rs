//! Images that are written visit by visit, in batches between which a run can put by how far it is.
//!
//! Visits come shard by shard (`pyramid::visits`): those of a *part*, a tile as large as the largest shard of the finest levels, one
//! after the other. A batch is some parts, so after it no shard of a finest level is half come, and none of a coarser level either,
//! as these are written in one go. All that comes then depends on how many parts are done, on what is known of coarser levels (the
//! voxels below that are missing, and the bricks that wait for them), on what was found on the way, and on the shards on disk. These
//! are linked, not copied, and checked by their sums when a run goes on with them; parts, unlike visits, are the same for any number
//! of threads.

use std::sync::{Mutex, PoisonError};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::share::{Share, largest_shard, parts};
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
    /// Which parts are done.
    done: Vec<bool>,
    images: Vec<KnownImage>,
    found: F,
}

#[derive(Serialize, Deserialize)]
struct KnownImage {
    form: u32,
    missing: Vec<Vec<u64>>,
    shards: Vec<(String, FileSum)>,
}

/// Makes visits, with `take`, which gets some of them by number and adds to what was `found` by those that it is let `into`; where
/// the run takes checkpoints, in batches, without those that the run which it goes on with has made. Of a live store, which stays as
/// it is when the run ends, there are no checkpoints.
///
/// # Errors
/// Of `take`, when a checkpoint cannot be read, or the run is interrupted.
pub(crate) fn in_batches<F: Serialize + DeserializeOwned>(
    stage: &Stage<'_>,
    images: &[&dyn PartlyWritten],
    visits: &[Vec<Box3>],
    found: &mut F,
    mut take: impl FnMut(&[usize], &Door<'_>, &mut F) -> Result<()>,
) -> Result<()> {
    let is_live = images.iter().any(|image| image.image().is_live());
    let all: Vec<usize> = (0..visits.len()).collect();
    let Some(mut save_point) = (!is_live).then(|| stage.save_point()).flatten().map(SavePoint::each) else {
        stage.expect(visits.len() as u64);
        return take(&all, &Door(None), found);
    };
    let finest = images.iter().filter_map(|image| image.image().levels().first());
    let begins = [parts(visits, largest_shard(finest).unwrap_or([1; 3])), vec![visits.len()]].concat();
    let (mut done, mut steps) = (vec![false; begins.len() - 1], 0);
    if let Some(known) = go_on(stage, &save_point, images, done.len())? {
        (done, *found) = (known.done, known.found);
        steps = known.images.iter().map(|image| image.shards.len()).sum();
    }
    let rest: Vec<usize> = (0..done.len()).filter(|&part| !done[part]).collect();
    let visits_of = |part: &usize| &all[begins[*part]..begins[*part + 1]];
    stage.expect((steps + rest.iter().map(|part| visits_of(part).len()).sum::<usize>()) as u64);
    let mut rest = rest.as_slice();
    while !rest.is_empty() {
        let next;
        (next, rest) = rest.split_at(batch(&begins, rest, VISITS_PER_THREAD * stage.threads()));
        let visits: Vec<usize> = next.iter().flat_map(visits_of).copied().collect();
        let begun = Mutex::new(vec![false; done.len()]);
        take(&visits, &Door(Some(Guard { save_point: &save_point, begins: &begins, begun: &begun })), found)?;
        let begun = begun.into_inner().unwrap_or_else(PoisonError::into_inner);
        done.iter_mut().zip(begun).for_each(|(done, begun)| *done |= begun);
        let waiting: Vec<_> = images.iter().flat_map(|image| image.waiting()).collect();
        let fields: Vec<&dyn SavedField> = waiting.iter().map(AsRef::as_ref).collect();
        save_point.reached_writing(rest.is_empty(), || known(images, &done, &*found), &fields)?;
    }
    Ok(())
}

/// Who lets visits begin.
pub(crate) struct Door<'a>(Option<Guard<'a>>);

struct Guard<'a> {
    save_point: &'a SavePoint<'a>,
    /// The visits with which parts begin.
    begins: &'a [usize],
    /// Which parts are begun, and will be done.
    begun: &'a Mutex<Vec<bool>>,
}

impl Door<'_> {
    /// Whether a visit is to be made: none of a part that is not begun when the run is to end.
    pub(crate) fn opens(&self, visit: usize) -> bool {
        let Some(Guard { save_point, begins, begun }) = &self.0 else { return true };
        let part = begins.partition_point(|&begin| begin <= visit) - 1;
        // All visits of a part get the same answer.
        let mut begun = begun.lock().unwrap_or_else(PoisonError::into_inner);
        begun[part] |= !save_point.is_last();
        begun[part]
    }
}

/// What a checkpoint holds, and the files that it links.
fn known<F>(images: &[&dyn PartlyWritten], done: &[bool], found: F) -> (Known<F>, Vec<Linked>) {
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
    (Known { done: done.to_vec(), images: known, found }, linked)
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
    let Some(saved) = saved.of_this_rank() else {
        save_point.forget("nothing that this one of as many ranks had written is known, and its part is written anew");
        return Ok(None);
    };
    let known: Known<F> = saved.facts()?;
    let is_same = known.images.iter().map(|known| known.form).eq(images.iter().map(|image| image.image().form()));
    let fault = if is_same && known.done.len() == parts {
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
    let done = known.done.iter().filter(|&&done| done).count();
    save_point.note(&format!("goes on where {done} of {parts} parts are written"));
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

/// How many of the parts that are left make a batch: as many as have no more than so many visits, and one at least.
pub(super) fn batch(begins: &[usize], left: &[usize], most: usize) -> usize {
    let visits = left.iter().scan(0, |sum, &part| {
        *sum += begins[part + 1] - begins[part];
        Some(*sum)
    });
    visits.take_while(|&visits| visits <= most).count().max(1)
}
