//! A volume becomes bricks: the boxes in which it is stored (planes, chunks) are decoded in parallel, each once, and written
//! into the bricks that they cross.

use std::sync::{Arc, Mutex, PoisonError};

use super::as_read::AsRead;
use crate::error::{Error, Result};
use crate::exec::{Engine, Stage, Workers};
use crate::grid::{Box3, BrickGrid, BrickSet};
use crate::kernel::image::grey::grey_range::GreyRange;
use crate::kernel::image::grey::histogram::Histogram;
use crate::store::{BrickArray, Element, Sample, VolumeSource};

/// An image in bricks, with what its histogram tells.
pub struct Image<T: Element> {
    /// The voxels.
    pub bricks: BrickArray<T>,
    /// The grey values taken as black and white.
    pub range: GreyRange,
    /// The smallest and largest value.
    pub extremes: [f64; 2],
}

/// Boxes for each thread that are read before any later ones, where somebody looks on.
const TOGETHER: usize = 32;

/// Reads the part `crop` of a volume into bricks, by the boxes in which it is stored; `percentiles` (0..100) of its values
/// become black and white. `stage` counts those boxes; `as_read` is told of each.
///
/// # Errors
/// When the volume cannot be read, holds a value that is no number, or scratch runs out.
pub fn ingest<T: Sample>(
    stage: &Stage<'_>,
    engine: &Engine,
    volume: &dyn VolumeSource,
    crop: &Box3,
    edge: i64,
    percentiles: [f64; 2],
    as_read: Option<&AsRead<T>>,
) -> Result<Image<T>> {
    let set = Arc::new(BrickSet::dense(BrickGrid::new(crop.shape(), edge)));
    let bricks = BrickArray::<T>::new(engine.scratch(), &set)?;
    let workers = Workers::new(Vec::new);
    // Counts add up the same in any order, and a histogram for each thread bounds the memory.
    let histograms = Mutex::new(Vec::<Histogram>::new());
    let boxes = volume.natural_boxes(crop);
    // Who looks on sees the first layers before the last: threads then stay near each other.
    let together = if as_read.is_some() { TOGETHER * stage.threads() } else { boxes.len() };
    let read = |voxels: &mut Vec<T>, part: &Box3| {
        voxels.resize(part.len(), T::default());
        volume.read_box(part, T::buffer(voxels))?;
        let own = part.translate(crop.lo.map(|v| -v));
        bricks.write_box(&own, voxels);
        as_read.map_or(Ok(()), |as_read| as_read.read(&own, &bricks))?;
        let idle = histograms.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let mut histogram = idle.unwrap_or_default();
        if let Err(place) = histogram.add(voxels) {
            return Err(no_number(volume, part, place));
        }
        histograms.lock().unwrap_or_else(PoisonError::into_inner).push(histogram);
        Ok(())
    };
    for boxes in boxes.chunks(together.max(1)) {
        stage.run(boxes, &workers, |voxels, part| read(voxels, part))?;
    }
    let mut all = Histogram::default();
    histograms.into_inner().unwrap_or_else(PoisonError::into_inner).iter().for_each(|counts| all.merge(counts));
    stage.voxels(crop.volume());
    Ok(Image { bricks, range: all.range(percentiles), extremes: all.extremes() })
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
