//! The narrow band and its start (algorithms: section 5, "Initial condition", "Narrow band").
//!
//! What a voxel is at the start is told by `kernel/level_set/start.rs`. Only cells that hold a solved voxel, or touch
//! one, are stored; the others are constant.

use std::sync::Arc;

use crate::error::Result;
use crate::exec::{Engine, Stage, Workers, one_wave};
use crate::grid::{BrickSet, NEIGHBOURS_26, Slot};
use crate::kernel::level_set::mask::CellMask;
use crate::kernel::level_set::start;
use crate::store::BrickArray;

pub use crate::kernel::level_set::start::Reaches;

/// The fields of the band before the first time step; all over the same set of cells.
pub struct Band {
    /// Segmentation function, two time levels; the first holds the start.
    pub u: [BrickArray<f32>; 2],
    /// Distance to the cloud.
    pub distance: BrickArray<f32>,
    /// 1 where a voxel is solved.
    pub solved: BrickArray<u8>,
    /// Number of solved voxels.
    pub voxels: u64,
}

/// Makes the band from the distance and the flood's level, both over the same cells.
///
/// # Errors
/// When scratch runs out or the run is interrupted.
pub fn make_band(
    stage: &Stage<'_>,
    engine: &Engine,
    distance: &BrickArray<f32>,
    level: &BrickArray<f32>,
    reaches: &Reaches,
) -> Result<Band> {
    let set = Arc::new(band_cells(stage, distance, level, reaches)?);
    let new = || BrickArray::<f32>::with_faces(engine.scratch(), &set);
    let mut band =
        Band { u: [new()?, new()?], distance: new()?, solved: BrickArray::new(engine.scratch(), &set)?, voxels: 0 };
    for id in 0..set.grid().len() {
        let start = start_of_cell(level, id, reaches);
        band.u.iter_mut().for_each(|u| u.set_absent(id, start));
        band.distance.set_absent(id, distance.absent(id));
    }
    let counts = stage
        .run(&one_wave(&set), &Workers::none(), |(), &slot| Ok(fill_cell(&band, distance, level, reaches, slot)))?;
    band.voxels = counts.iter().sum();
    stage.voxels(band.voxels);
    Ok(band)
}

/// The start value of a cell that is constant, told from its first voxel.
fn start_of_cell(level: &BrickArray<f32>, id: u64, reaches: &Reaches) -> f32 {
    let first = level.set().slot(id).map_or_else(|| level.absent(id), |slot| level.read(slot, |b| b[0]));
    reaches.start(first)
}

fn fill_cell(band: &Band, distance: &BrickArray<f32>, level: &BrickArray<f32>, reaches: &Reaches, slot: Slot) -> u64 {
    let set = band.solved.set();
    let (id, edge) = (set.id(slot), set.grid().edge() as usize);
    let valid = set.grid().brick_box(id).shape().map(|n| n as usize);
    // A cell of the band's rim may lie where the distance is not stored: it is constant there.
    let fill = |d: &[f32], b: &[f32]| {
        band.distance.write(slot, |out| out.copy_from_slice(d));
        band.u[0].write(slot, |u| start::fill(b, reaches, u));
        band.solved.write(slot, |solved| start::mark(d, b, edge, valid, reaches, solved))
    };
    let count = if let Some(from) = distance.set().slot(id) {
        distance.read(from, |d| level.read(from, |b| fill(d, b)))
    } else {
        let len = set.grid().brick_len();
        fill(&vec![distance.absent(id); len], &vec![level.absent(id); len])
    };
    band.distance.refresh_faces(slot);
    band.u[0].refresh_faces(slot);
    count
}

/// The cells that hold a solved voxel or have one right beside them.
fn band_cells(
    stage: &Stage<'_>,
    distance: &BrickArray<f32>,
    level: &BrickArray<f32>,
    reaches: &Reaches,
) -> Result<BrickSet> {
    let set = distance.set();
    let grid = *set.grid();
    let edge = grid.edge() as usize;
    let hulls = stage.run(&one_wave(set), &Workers::none(), |(), &slot| {
        let valid = grid.brick_box(set.id(slot)).shape().map(|n| n as usize);
        Ok(distance.read(slot, |d| level.read(slot, |b| start::hull(d, b, edge, valid, reaches))))
    })?;
    let mut keep = vec![false; grid.len() as usize];
    for (slot, hull) in hulls.iter().enumerate().filter_map(|(s, h)| Some((s as Slot, h.as_ref()?))) {
        let id = set.id(slot);
        keep[id as usize] = true;
        for offset in NEIGHBOURS_26 {
            let touches = (0..3).all(|a| match offset[a] {
                -1 => hull[a][0] == 0,
                1 => hull[a][1] == edge - 1,
                _ => true,
            });
            if let Some(neighbour) = grid.neighbour(id, offset).filter(|_| touches) {
                keep[neighbour as usize] = true;
            }
        }
    }
    Ok(BrickSet::from_fn(grid, |id| keep[id as usize]))
}

/// Reads a cell's flags into `mask`, with the domain's borders.
pub fn read_mask(solved: &BrickArray<u8>, slot: Slot, mask: &mut CellMask) {
    let grid = solved.set().grid();
    let id = solved.set().id(slot);
    let (at, counts) = (grid.coords(id), grid.counts());
    let border = std::array::from_fn(|a| [at[a] == 0, at[a] == counts[a] - 1]);
    let valid = grid.brick_box(id).shape().map(|n| n as usize);
    solved.read(slot, |flags| mask.set(flags, valid, border));
}
