//! A volume becomes bricks: the boxes in which it is stored (planes, chunks) are decoded in parallel, each once, and written
//! into the bricks that they cross.

use std::sync::{Arc, Mutex, PoisonError};

use super::as_read::AsRead;
use crate::error::{Error, Result};
use crate::exec::{Comm, Engine, Stage, Workers, gather_records, read_by_bricks};
use crate::grid::{Box3, BrickGrid, BrickId, BrickSet};
use crate::kernel::image::grey::grey_range::GreyRange;
use crate::kernel::image::grey::histogram::Histogram;
use crate::store::{BoxSource, BrickArray, Element, Sample, VolumeSource};

/// An image in bricks, with what its histogram tells.
pub struct Image<T: Element> {
    /// The voxels; of several ranks each may keep a part of them.
    pub bricks: BrickArray<T>,
    /// The grey values taken as black and white.
    pub range: GreyRange,
    /// The smallest and largest value.
    pub extremes: [f64; 2],
}

/// What is read of a volume.
pub struct Ingest<'a, T: Element> {
    /// Where it is stored.
    pub volume: &'a dyn VolumeSource,
    /// The part that becomes the image.
    pub crop: &'a Box3,
    /// Voxels along the edge of the bricks.
    pub edge: i64,
    /// What part of its values, 0..100, become black and white.
    pub percentiles: [f64; 2],
    /// Boxes of the image whose bricks are kept; all are where there are none.
    pub parts: Option<&'a [Box3]>,
    /// Who is told of each box that is read.
    pub as_read: Option<&'a AsRead<T>>,
}

/// Boxes for each thread that are read before any later ones, where somebody looks on.
const TOGETHER: usize = 32;

/// What a thread takes next.
enum Step {
    /// Reads a box as it is stored; its values may count.
    Read { part: Box3, counts: bool },
    /// Puts a chunk of which all is read into the coarser levels.
    Reduce(Box3),
}

/// Reads a volume into bricks, by the boxes in which it is stored; `stage` counts those boxes. Each value counts on one rank.
///
/// # Errors
/// When the volume cannot be read, holds a value that is no number, scratch runs out, or another rank is gone.
pub fn ingest<T: Sample>(stage: &Stage<'_>, engine: &Engine, of: &Ingest<'_, T>) -> Result<Image<T>> {
    let Ingest { volume, crop, percentiles, as_read, .. } = *of;
    let bricks = BrickArray::<T>::new(engine.scratch(), &Arc::new(of.set()))?;
    let workers = Workers::new(Vec::new);
    // Counts add up the same in any order, and a histogram for each thread bounds the memory.
    let histograms = Mutex::new(Vec::<Histogram>::new());
    let boxes = of.boxes(engine.comm(), bricks.set());
    // Who looks on sees the first layers before the last: threads then stay near each other.
    let together = if as_read.is_some() { TOGETHER * stage.threads() } else { boxes.len() };
    let read = |voxels: &mut Vec<T>, part: &Box3, counts: bool| {
        voxels.resize(part.len(), T::default());
        volume.read_box(part, T::buffer(voxels))?;
        let own = part.translate(crop.lo.map(|v| -v));
        bricks.write_box(&own, voxels);
        if let Some(as_read) = as_read {
            as_read.read(&own);
        }
        if !counts {
            return Ok(());
        }
        let idle = histograms.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let mut histogram = idle.unwrap_or_default();
        if let Err(place) = histogram.add(voxels) {
            return Err(no_number(volume, part, place));
        }
        histograms.lock().unwrap_or_else(PoisonError::into_inner).push(histogram);
        Ok(())
    };
    stage.expect(boxes.len() as u64 + as_read.map_or(0, AsRead::chunks));
    let step = |voxels: &mut Vec<T>, step: &Step| match step {
        Step::Read { part, counts } => read(voxels, part, *counts),
        Step::Reduce(chunk) => as_read.map_or(Ok(()), |as_read| as_read.reduce(chunk, &bricks)),
    };
    // Chunks of a layer come with the boxes of the next one, so that no thread reduces all of it while others wait.
    let due = || as_read.map(AsRead::take_due).unwrap_or_default().into_iter().map(Step::Reduce);
    for boxes in boxes.chunks(together.max(1)) {
        let reads = boxes.iter().map(|&(part, counts)| Step::Read { part, counts });
        stage.run(&due().chain(reads).collect::<Vec<Step>>(), &workers, step)?;
    }
    stage.run(&due().collect::<Vec<Step>>(), &workers, step)?;
    let mut all = Histogram::default();
    histograms.into_inner().unwrap_or_else(PoisonError::into_inner).iter().for_each(|counts| all.merge(counts));
    if engine.comm().ranks() > 1 {
        let told = gather_records(engine.comm(), &all.told())?;
        all = told.iter().fold(Histogram::default(), Histogram::and_told);
    }
    stage.voxels(crop.volume());
    Ok(Image { bricks, range: all.range(percentiles), extremes: all.extremes() })
}

impl<T: Element> Ingest<'_, T> {
    /// The bricks that are kept.
    fn set(&self) -> BrickSet {
        let grid = BrickGrid::new(self.crop.shape(), self.edge);
        let Some(parts) = self.parts else { return BrickSet::dense(grid) };
        let mut ids: Vec<BrickId> = parts.iter().flat_map(|part| grid.bricks_in(part)).collect();
        ids.sort_unstable();
        ids.dedup();
        BrickSet::from_ids(grid, ids)
    }

    /// The boxes, as they are stored, that this rank reads, and whether it is the one that counts their values.
    fn boxes(&self, comm: &dyn Comm, set: &BrickSet) -> Vec<(Box3, bool)> {
        let all = self.volume.natural_boxes(self.crop);
        let share = |rank: usize| all.len() * rank / comm.ranks();
        let counted = share(comm.rank())..share(comm.rank() + 1);
        let is_kept = |part: &Box3| {
            let own = part.translate(self.crop.lo.map(|v| -v));
            set.grid().bricks_in(&own).any(|id| set.slot(id).is_some())
        };
        let boxes = all.iter().enumerate().map(|(n, &part)| (part, counted.contains(&n)));
        boxes.filter(|(part, counts)| *counts || is_kept(part)).collect()
    }
}

impl<T: Sample> Image<T> {
    /// The whole image: what is not kept is read once more from where it is stored.
    pub fn whole<'a>(&'a self, volume: &'a dyn VolumeSource, crop: &Box3) -> Whole<'a, T> {
        Whole { bricks: &self.bricks, volume, lo: crop.lo }
    }
}

/// An image of which some bricks are kept.
pub struct Whole<'a, T: Element> {
    bricks: &'a BrickArray<T>,
    volume: &'a dyn VolumeSource,
    /// Where the image lies in the volume.
    lo: [i64; 3],
}

impl<T: Element> Whole<'_, T> {
    fn keeps(&self, part: &Box3) -> bool {
        let set = self.bricks.set();
        set.len() as u64 == set.grid().len() || set.grid().bricks_in(part).all(|id| set.slot(id).is_some())
    }
}

impl<T: Sample> BoxSource<T> for Whole<'_, T> {
    fn shape(&self) -> [i64; 3] {
        self.bricks.shape()
    }

    fn read_box(&self, part: &Box3, out: &mut [T]) -> Result<()> {
        if self.keeps(part) {
            return self.bricks.read_box(part, out);
        }
        read_by_bricks(self.bricks.set().grid(), part, out, |id, shared, values| match self.bricks.set().slot(id) {
            Some(_) => self.bricks.read_box(shared, values),
            None => self.volume.read_box(&shared.translate(self.lo), T::buffer(values)),
        })
    }

    fn constant_in(&self, part: &Box3) -> Option<T> {
        if self.keeps(part) { self.bricks.constant_in(part) } else { None }
    }
}

/// Refuses the value at a place of a dense box that was read.
fn no_number(volume: &dyn VolumeSource, part: &Box3, place: usize) -> Error {
    let [width, height, _] = part.shape();
    let place = place as i64;
    let within = [place % width, place / width % height, place / (width * height)];
    let voxel: [i64; 3] = std::array::from_fn(|a| within[a] + part.lo[a]);
    let stored = volume.whereabouts(voxel);
    let of_file = stored.as_ref().map(|stored| &stored.part).filter(|part| !part.is_empty());
    let of_file = of_file.map_or(String::new(), |part| format!(" ({part})"));
    let [x, y, z] = voxel;
    let error = Error::input(format!(
        "plane {z}{of_file} holds a value that is no number (NaN or infinite) at voxel {x}, {y}, {z} (x, y, z, counted from \
         0); crop it away or repair the image"
    ));
    match stored {
        Some(stored) => error.at(&stored.file),
        None => error,
    }
}
