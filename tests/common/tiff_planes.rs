//! Reads whole TIFF stacks for comparison.

use std::path::Path;

use strandline::error::Result;
use strandline::grid::Box3;
use strandline::io::stack::tiff::{Select, StackInfo, TiffStack};
use strandline::io::stack::volume::Stack;
use strandline::store::PlaneSource;

use super::samples::numbers;

/// Plane `z` as f64, exact for every type.
pub(crate) fn plane(stack: &TiffStack, z: i64) -> Result<Vec<f64>> {
    let [width, height, _] = PlaneSource::shape(stack);
    numbers(stack, &Box3::new([0, 0, z], [width, height, z + 1]))
}

/// A channel at a time of a file: what it says of itself, and all voxels, x fastest.
pub(crate) fn stack(path: &Path, channel: u32, time: u32) -> Result<(StackInfo, Vec<f64>)> {
    selected(path, Select { channel, time, ..Select::default() })
}

/// What was chosen of a file: what it says of itself, and all voxels, x fastest.
pub(crate) fn selected(path: &Path, select: Select) -> Result<(StackInfo, Vec<f64>)> {
    let stack = TiffStack::open(path, select)?;
    let mut voxels = Vec::new();
    for z in 0..stack.shape()[2] {
        voxels.extend(plane(&stack, z)?);
    }
    Ok((stack.info().clone(), voxels))
}
