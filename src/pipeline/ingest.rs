//! A stack becomes bricks: planes are decoded in parallel, a slab at a time, and written into the bricks they cross.

use std::sync::{Arc, Mutex, PoisonError};

use crate::error::{Error, Result};
use crate::exec::{Engine, Stage, Workers};
use crate::grid::{Box3, BrickGrid, BrickSet};
use crate::kernel::image::grey_range::GreyRange;
use crate::kernel::image::histogram::Histogram;
use crate::store::{BoxSink, BrickArray, Element, PlaneSource, Sample};

/// An image in bricks, with what its histogram tells.
pub struct Image<T: Element> {
    /// The voxels.
    pub bricks: BrickArray<T>,
    /// The grey values taken as black and white.
    pub range: GreyRange,
    /// The smallest and largest value.
    pub extremes: [f64; 2],
}

/// Reads the part `crop` of a stack into bricks; `percentiles` (0..100) of its values become black and white.
///
/// # Errors
/// When the stack cannot be read, holds a value that is no number, or scratch runs out.
pub fn ingest<T: Sample>(
    stage: &Stage<'_>,
    engine: &Engine,
    stack: &dyn PlaneSource,
    crop: &Box3,
    edge: i64,
    percentiles: [f64; 2],
) -> Result<Image<T>> {
    let [width, height, _] = stack.shape();
    let set = Arc::new(BrickSet::dense(BrickGrid::new(crop.shape(), edge)));
    let bricks = BrickArray::<T>::new(engine.scratch(), &set)?;
    let plane_len = (width * height) as usize;
    let planes: Vec<i64> = (crop.lo[2]..crop.hi[2]).collect();
    let workers = Workers::new(move || vec![T::default(); plane_len]);
    // Counts add up the same in any order, and one histogram for all planes bounds the memory.
    let histogram = Mutex::new(Histogram::default());
    stage.run(&planes, &workers, |plane, &z| {
        stack.read_plane(z, T::buffer(plane))?;
        let part = Box3::new([crop.lo[0], crop.lo[1], z], [crop.hi[0], crop.hi[1], z + 1]);
        let whole = Box3::new([0, 0, z], [width, height, z + 1]);
        let cropped = crop_plane(plane, &whole, &part);
        bricks.write_box(&part.translate(crop.lo.map(|v| -v)), &cropped)?;
        let counts = Histogram::of(&cropped).ok_or_else(|| {
            Error::input(format!(
                "plane {z} holds a value that is no number (NaN or infinite); crop it away or repair the image"
            ))
        })?;
        histogram.lock().unwrap_or_else(PoisonError::into_inner).merge(&counts);
        Ok(())
    })?;
    let histogram = histogram.into_inner().unwrap_or_else(PoisonError::into_inner);
    stage.voxels(crop.volume());
    let range = histogram.range(percentiles);
    Ok(Image { bricks, range, extremes: histogram.extremes() })
}

fn crop_plane<T: Copy>(plane: &[T], whole: &Box3, part: &Box3) -> Vec<T> {
    let row = |(y, z)| &plane[whole.offset_of([part.lo[0], y, z])..][..part.shape()[0] as usize];
    part.rows().flat_map(row).copied().collect()
}
