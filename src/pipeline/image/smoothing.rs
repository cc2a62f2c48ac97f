//! The image smoothed by a Gaussian on some of its cells, block by block (`kernel::image::filter::gaussian`).
//!
//! A block is a box of cells around those that are wanted, at most four along each axis: what its cells read of the
//! voxels around them is read and smoothed along x and y once for all of them. Which blocks there are changes no bit.
//! Beyond the domain lies its mirror image, the border voxel repeated (homogeneous Neumann): the solution is then that of
//! the heat equation without flux through the border.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::error::{Error, Result};
use crate::exec::{Engine, Stage, Workers};
use crate::grid::{Box3, BrickSet, Slot};
use crate::kernel::image::filter::gaussian::{Block, Gaussian, Smoothed};
use crate::kernel::level_set::cell::{CELL, CELL_LEN};
use crate::store::{BoxSource, BrickArray};

/// Cells along an axis of a block, at most.
const BLOCK: i64 = 4;
/// Planes of a block that are read in one go.
const SLAB: usize = 32;
/// The widest Gaussian, in voxels: what a thread holds grows with the square of it.
const WIDEST: f64 = 32.0;

/// The cells of a block that are wanted.
struct Part {
    /// Where they are stored, and their place in the grid of cells.
    cells: Vec<(Slot, [i64; 3])>,
    /// The cells of the block.
    around: Box3,
}

/// `image`, smoothed by a Gaussian of width `sigma` along each axis (in the unit of `spacing`; 0 for none), on the
/// cells of `wanted`, with faces.
///
/// # Errors
/// When the width is more than 32 voxels, the image cannot be read, scratch runs out or the run is interrupted.
///
/// # Panics
/// When the bricks of `wanted` are not cells.
pub fn smoothed(
    stage: &Stage<'_>,
    engine: &Engine,
    image: &dyn BoxSource<f32>,
    wanted: &Arc<BrickSet>,
    spacing: [f64; 3],
    sigma: [f64; 3],
) -> Result<BrickArray<f32>> {
    assert_eq!(wanted.grid().edge(), CELL as i64, "smoothing writes cells");
    check_width(spacing, sigma)?;
    let gaussian = Gaussian::new(sigma, spacing);
    let field = BrickArray::with_faces(engine.scratch(), wanted)?;
    stage.voxels((wanted.len() * CELL_LEN) as u64);
    stage.run(&parts(wanted), &Workers::new(Buffers::default), |buffers, part| {
        let block = block(part, wanted, &gaussian);
        read_planes(image, part, &block, &gaussian, buffers)?;
        for (slot, cell) in &part.cells {
            let at = std::array::from_fn(|a| (cell[a] - part.around.lo[a]) as usize);
            field.write(*slot, |values| buffers.smoothed.cell(&block, &gaussian, at, values));
            field.refresh_faces(*slot);
        }
        Ok(())
    })?;
    Ok(field)
}

/// Bytes that a thread holds while it smooths an image of so many bytes a sample.
pub(crate) fn thread_bytes(spacing: [f64; 3], sigma: [f64; 3], sample: u64) -> u64 {
    let edge = BLOCK as u64 * CELL as u64;
    let [x, y, z] = Gaussian::new(sigma, spacing).halo().map(|halo| edge + 2 * halo as u64);
    // A slab as it is read, mirrored and in the image's own type; planes of the block; rows of one.
    x * y * SLAB as u64 * (4 + 4 + sample) + 4 * (edge * edge * z + edge * y)
}

/// Refuses Gaussians too wide to be worth their time and memory.
///
/// # Errors
/// When the width is more than 32 voxels along an axis: says the widest.
pub fn check_width(spacing: [f64; 3], sigma: [f64; 3]) -> Result<()> {
    for (sigma, h) in sigma.into_iter().zip(spacing) {
        if sigma > WIDEST * h {
            return Err(Error::usage(format!(
                "--sigma {sigma} is {:.0} voxels, too wide to smooth by; it is a length: give at most {}",
                sigma / h,
                WIDEST * h
            )));
        }
    }
    Ok(())
}

/// The wanted cells in groups, each within a cube of [`BLOCK`] cells of the grid.
fn parts(wanted: &BrickSet) -> Vec<Part> {
    let mut groups = BTreeMap::<[i64; 3], Vec<(Slot, [i64; 3])>>::new();
    for slot in wanted.owned() {
        let [x, y, z] = wanted.grid().coords(wanted.id(slot));
        groups.entry([z / BLOCK, y / BLOCK, x / BLOCK]).or_default().push((slot, [x, y, z]));
    }
    let part = |cells: Vec<(Slot, [i64; 3])>| {
        let first = cells[0].1;
        let around = cells.iter().fold(Box3::new(first, first), |around, (_, cell)| Box3 {
            lo: std::array::from_fn(|a| around.lo[a].min(cell[a])),
            hi: std::array::from_fn(|a| around.hi[a].max(cell[a] + 1)),
        });
        Part { cells, around }
    };
    groups.into_values().map(part).collect()
}

/// The block of a part, cut off along y and z where the domain ends.
fn block(part: &Part, wanted: &BrickSet, gaussian: &Gaussian) -> Block {
    let (lo, cells) = (part.around.lo, part.around.shape());
    let mut shape = cells.map(|n| n as usize * CELL);
    for a in 1..3 {
        shape[a] = shape[a].min((wanted.grid().shape()[a] - lo[a] * CELL as i64) as usize);
    }
    let mut is_wanted = vec![false; part.around.len()];
    for (_, cell) in &part.cells {
        is_wanted[part.around.offset_of(*cell)] = true;
    }
    Block::new(shape, is_wanted, gaussian)
}

/// What a thread works in.
#[derive(Default)]
struct Buffers {
    smoothed: Smoothed,
    /// Planes of the grown block.
    slab: Vec<f32>,
    /// What of them lies in the domain, where not all does.
    inside: Vec<f32>,
}

/// Reads the planes of the grown block and smooths each along x and y.
fn read_planes(
    image: &dyn BoxSource<f32>,
    part: &Part,
    block: &Block,
    gaussian: &Gaussian,
    buffers: &mut Buffers,
) -> Result<()> {
    let Buffers { smoothed, slab, inside } = buffers;
    smoothed.begin(block);
    let [width, height] = block.grown_plane();
    let lo: [i64; 3] = std::array::from_fn(|a| part.around.lo[a] * CELL as i64 - gaussian.halo()[a] as i64);
    for first in (0..block.grown_planes()).step_by(SLAB) {
        let end = (first + SLAB).min(block.grown_planes());
        let shape = [width, height, end - first].map(|n| n as i64);
        let read = Box3::from_shape(shape).translate([lo[0], lo[1], lo[2] + first as i64]);
        slab.resize(read.len(), 0.0);
        read_mirrored(image, &read, inside, slab)?;
        for (plane, values) in (first..end).zip(slab.chunks_exact(width * height)) {
            smoothed.plane(block, gaussian, plane, values);
        }
    }
    Ok(())
}

/// Reads a box that may reach past the image, which is continued by its mirror image; `inside` is room to work in.
fn read_mirrored(image: &dyn BoxSource<f32>, part: &Box3, inside: &mut Vec<f32>, out: &mut [f32]) -> Result<()> {
    let domain = Box3::from_shape(image.shape());
    if domain.intersect(part) == *part {
        return image.read_box(part, out);
    }
    let folds: [Vec<i64>; 3] =
        std::array::from_fn(|a| (part.lo[a]..part.hi[a]).map(|v| mirrored(v, domain.hi[a])).collect());
    let end = |a: usize, pick: fn(i64, i64) -> i64| folds[a].iter().copied().reduce(pick).unwrap_or_default();
    let source = Box3::new(std::array::from_fn(|a| end(a, i64::min)), std::array::from_fn(|a| end(a, i64::max) + 1));
    inside.resize(source.len(), 0.0);
    image.read_box(&source, inside)?;
    let width = part.shape()[0] as usize;
    let shared = domain.intersect(part).shape()[0] as usize;
    let before = ((-part.lo[0]).max(0) as usize).min(width);
    for ((y, z), row) in part.rows().zip(out.chunks_exact_mut(width)) {
        let [y, z] = [folds[1][(y - part.lo[1]) as usize], folds[2][(z - part.lo[2]) as usize]];
        let from = &inside[source.offset_of([source.lo[0], y, z])..][..source.shape()[0] as usize];
        let at = |x: usize| (folds[0][x] - source.lo[0]) as usize;
        for x in (0..before).chain(before + shared..width) {
            row[x] = from[at(x)];
        }
        if shared > 0 {
            row[before..][..shared].copy_from_slice(&from[at(before)..][..shared]);
        }
    }
    Ok(())
}

/// The voxel of `0..len` that lies where the mirrors at both ends show the voxel `at`.
fn mirrored(at: i64, len: i64) -> i64 {
    let folded = at.rem_euclid(2 * len);
    if folded < len { folded } else { 2 * len - 1 - folded }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mirrors_repeat_the_border_voxel() {
        let seen: Vec<i64> = (-4..8).map(|at| mirrored(at, 3)).collect();
        assert_eq!(seen, [2, 2, 1, 0, 0, 1, 2, 2, 1, 0, 0, 1]);
        assert_eq!(mirrored(-5, 1), 0);
    }

    #[test]
    fn widths_are_refused_in_voxels() {
        check_width([0.5; 3], [16.0; 3]).unwrap();
        let error = check_width([0.5, 0.5, 2.0], [20.0; 3]).unwrap_err();
        assert!(error.to_string().contains("--sigma 20 is 40 voxels") && error.to_string().contains("at most 16"));
    }
}
