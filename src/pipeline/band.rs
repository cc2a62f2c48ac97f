//! The narrow band and its start (algorithms: section 5, "Initial condition", "Narrow band").
//!
//! What a voxel is at the start is told by `kernel/level_set/start.rs`. Only cells that hold a solved voxel, or touch
//! one, are stored; the others are constant.

use std::sync::Arc;

use crate::error::Result;
use crate::exec::{Boundary, Engine, HaloPlan, Reach, Stage, Workers, one_wave};
use crate::grid::{BrickId, BrickSet, NEIGHBOURS_26, Slot};
use crate::kernel::level_set::mask::CellMask;
use crate::kernel::level_set::start::{self, Sides};
use crate::store::BrickArray;
use crate::tile::HaloTile;

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

/// Makes the band from the distance and the sides, both over the same cells.
///
/// # Errors
/// When scratch runs out or the run is interrupted.
pub fn make_band(
    stage: &Stage<'_>,
    engine: &Engine,
    distance: &BrickArray<f32>,
    inside: &BrickArray<u8>,
    reaches: Reaches,
) -> Result<Band> {
    let near = near_border(stage, engine, distance, inside, reaches)?;
    let known = Known { distance, inside, near: near.as_ref(), reaches };
    let set = Arc::new(known.band_cells(stage)?);
    let new = || BrickArray::<f32>::with_faces(engine.scratch(), &set);
    let mut band =
        Band { u: [new()?, new()?], distance: new()?, solved: BrickArray::new(engine.scratch(), &set)?, voxels: 0 };
    for id in 0..set.grid().len() {
        let start = known.start_of_cell(id);
        band.u.iter_mut().for_each(|u| u.set_absent(id, start));
        band.distance.set_absent(id, distance.absent(id));
    }
    let counts = stage.run(&one_wave(&set), &Workers::none(), |(), &slot| Ok(known.fill_cell(&band, slot)))?;
    band.voxels = counts.iter().sum();
    stage.voxels(band.voxels);
    Ok(band)
}

/// How many voxels are solved on each side of the border where it is far from the cloud.
const NEAR_BORDER: u8 = 4;

/// What is near the border between the sides where that is far from the cloud, which is across holes; none where there
/// are no such holes.
fn near_border(
    stage: &Stage<'_>,
    engine: &Engine,
    distance: &BrickArray<f32>,
    inside: &BrickArray<u8>,
    reaches: Reaches,
) -> Result<Option<BrickArray<u8>>> {
    let set = distance.set();
    let plan = HaloPlan::new(*set.grid(), Reach::Faces);
    let (edge, len) = (set.grid().edge() as usize, set.grid().brick_len());
    let workers = Workers::new(move || (HaloTile::new(edge), vec![0u8; len]));
    let is_wide = stage.run(&one_wave(set), &workers, |(tile, near), &slot| {
        plan.gather(inside, slot, Boundary::Mirror, tile);
        Ok(distance.read(slot, |d| start::border(d, tile, reaches, near)))
    })?;
    if !is_wide.contains(&true) {
        return Ok(None);
    }
    let grown = BrickArray::blank(engine.scratch(), set, 0u8)?;
    let wide: Vec<Slot> = one_wave(set).into_iter().filter(|&slot| is_wide[slot as usize]).collect();
    stage.run(&wide, &workers, |(tile, near), &slot| {
        plan.gather(inside, slot, Boundary::Mirror, tile);
        distance.read(slot, |d| start::border(d, tile, reaches, near));
        write_cell(&grown, slot, near);
        Ok(())
    })?;
    let touches =
        |slot: &Slot| NEIGHBOURS_26.iter().filter_map(|&by| set.neighbour(*slot, by)).any(|n| is_wide[n as usize]);
    let around: Vec<Slot> = one_wave(set).into_iter().filter(|slot| is_wide[*slot as usize] || touches(slot)).collect();
    for step in 1..NEAR_BORDER {
        stage.run(&around, &workers, |(tile, near), &slot| {
            plan.gather(&grown, slot, Boundary::Mirror, tile);
            // What others write in this step is above `step`, so it does not matter who comes first.
            match grown.unwritten(slot) {
                Some(value) => near.fill(value),
                None => grown.read(slot, |now| near.copy_from_slice(now)),
            }
            start::grow(tile, step, near);
            write_cell(&grown, slot, near);
            Ok(())
        })?;
    }
    Ok(Some(grown))
}

fn write_cell(array: &BrickArray<u8>, slot: Slot, values: &[u8]) {
    array.write(slot, |cell| cell.copy_from_slice(values));
    array.refresh_faces(slot);
}

/// What the band is made from.
struct Known<'a> {
    distance: &'a BrickArray<f32>,
    inside: &'a BrickArray<u8>,
    near: Option<&'a BrickArray<u8>>,
    reaches: Reaches,
}

impl Known<'_> {
    /// Lends out a stored cell.
    fn read<R>(&self, slot: Slot, f: impl FnOnce(Sides<'_>) -> R) -> R {
        let near = self.near.filter(|near| near.unwritten(slot).is_none());
        self.distance.read(slot, |d| {
            self.inside.read(slot, |inside| match near {
                Some(near) => near.read(slot, |near| f(Sides { d, inside, near: Some(near) })),
                None => f(Sides { d, inside, near: None }),
            })
        })
    }

    /// The start value of a cell that is constant, told from its first voxel.
    fn start_of_cell(&self, id: BrickId) -> f32 {
        let slot = self.inside.set().slot(id);
        f32::from(slot.map_or_else(|| self.inside.absent(id), |slot| self.inside.read(slot, |inside| inside[0])))
    }

    fn fill_cell(&self, band: &Band, slot: Slot) -> u64 {
        let set = band.solved.set();
        let (id, edge) = (set.id(slot), set.grid().edge() as usize);
        let valid = set.grid().brick_box(id).shape().map(|n| n as usize);
        // A cell of the band's rim may lie where the distance is not stored: it is constant there.
        let fill = |sides: Sides<'_>| {
            band.distance.write(slot, |out| out.copy_from_slice(sides.d));
            band.u[0].write(slot, |u| u.iter_mut().zip(sides.inside).for_each(|(u, &side)| *u = f32::from(side)));
            band.solved.write(slot, |solved| start::mark(sides, edge, valid, self.reaches, solved))
        };
        let count = if let Some(from) = self.distance.set().slot(id) {
            self.read(from, fill)
        } else {
            let len = set.grid().brick_len();
            let (d, inside) = (vec![self.distance.absent(id); len], vec![self.inside.absent(id); len]);
            fill(Sides { d: &d, inside: &inside, near: None })
        };
        band.distance.refresh_faces(slot);
        band.u[0].refresh_faces(slot);
        count
    }

    /// The cells that hold a solved voxel or have one right beside them.
    fn band_cells(&self, stage: &Stage<'_>) -> Result<BrickSet> {
        let set = self.distance.set();
        let grid = *set.grid();
        let edge = grid.edge() as usize;
        let hulls = stage.run(&one_wave(set), &Workers::none(), |(), &slot| {
            let valid = grid.brick_box(set.id(slot)).shape().map(|n| n as usize);
            Ok(self.read(slot, |sides| start::hull(sides, edge, valid, self.reaches)))
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
