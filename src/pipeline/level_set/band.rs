//! The narrow band and its start (docs/algorithms.md, "Narrow band").
//!
//! What a voxel is at the start is told by `kernel/level_set/initial/start.rs`. Only cells that hold a solved voxel are stored;
//! the others are constant, for the border between the sides is solved wherever it runs. Beyond the band the distance
//! counts as the farthest: it acts on voxels of the band's rim alone, which are as constant as what is beyond.

use std::sync::Arc;

use crate::error::Result;
use crate::exec::{Boundary, Engine, HaloPlan, Reach, Stage, Workers, one_wave};
use crate::grid::{BrickId, BrickSet, NEIGHBOURS_26, Slot};
use crate::kernel::level_set::initial::start;
use crate::kernel::level_set::initial::start::CellSides;
use crate::kernel::level_set::scheme::mask::CellMask;
use crate::store::BrickArray;
use crate::tile::HaloTile;

pub use crate::kernel::level_set::initial::start::Reaches;

/// The fields of the band before the first time step; all over the same set of cells.
pub struct Band {
    /// Segmentation function, at the start.
    pub u: BrickArray<f32>,
    /// Distance to the cloud.
    pub distance: BrickArray<f32>,
    /// 1 where a voxel is solved.
    pub solved: BrickArray<u8>,
    /// Number of solved voxels.
    pub voxels: u64,
}

impl Band {
    /// A rank's own part of the band, over its own set of cells; the faces of ghosts are for the ranks to exchange.
    ///
    /// # Errors
    /// When scratch runs out.
    pub(crate) fn part(&self, engine: &Engine, own: &Arc<BrickSet>) -> Result<Band> {
        let new = || BrickArray::<f32>::with_faces(engine.scratch(), own);
        let solved = BrickArray::new(engine.scratch(), own)?;
        let mut part = Band { u: new()?, distance: new()?, solved, voxels: self.voxels };
        for id in (0..own.grid().len()).filter(|&id| self.solved.set().slot(id).is_none()) {
            part.u.set_absent(id, self.u.absent(id));
            part.distance.set_absent(id, self.distance.absent(id));
        }
        for to in own.owned() {
            let Some(from) = self.solved.set().slot(own.id(to)) else { continue };
            for (whole, part) in [(&self.u, &part.u), (&self.distance, &part.distance)] {
                whole.read(from, |from| part.write(to, |to| to.copy_from_slice(from)));
                part.refresh_faces(to);
            }
            self.solved.read(from, |from| part.solved.write(to, |to| to.copy_from_slice(from)));
        }
        Ok(part)
    }
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
    let mut band = Band { u: new()?, distance: new()?, solved: BrickArray::new(engine.scratch(), &set)?, voxels: 0 };
    for id in 0..set.grid().len() {
        let start = known.start_of_cell(id);
        band.u.set_absent(id, start);
        let farthest = Some(distance.absent(id)).filter(|d| d.is_finite());
        band.distance.set_absent(id, farthest.unwrap_or(reaches.inner.max(reaches.outer)));
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
    fn read<R>(&self, slot: Slot, f: impl FnOnce(CellSides<'_>) -> R) -> R {
        let near = self.near.filter(|near| near.unwritten(slot).is_none());
        self.distance.read(slot, |d| {
            self.inside.read(slot, |inside| match near {
                Some(near) => near.read(slot, |near| f(CellSides { d, inside, near: Some(near) })),
                None => f(CellSides { d, inside, near: None }),
            })
        })
    }

    /// The start value of a cell that is constant, told from its first voxel.
    fn start_of_cell(&self, id: BrickId) -> f32 {
        let slot = self.inside.set().slot(id);
        let side = slot.map_or_else(|| self.inside.absent(id), |slot| self.inside.read(slot, |inside| inside[0]));
        start::value(side)
    }

    fn fill_cell(&self, band: &Band, slot: Slot) -> u64 {
        let set = band.solved.set();
        let (id, edge) = (set.id(slot), set.grid().edge() as usize);
        let valid = set.grid().brick_box(id).shape().map(|n| n as usize);
        let fill = |sides: CellSides<'_>| {
            band.distance.write(slot, |out| out.copy_from_slice(sides.d));
            band.u.write(slot, |u| {
                u.iter_mut().zip(sides.inside).for_each(|(u, &side)| *u = start::value(side));
            });
            band.solved.write(slot, |solved| start::mark(sides, edge, valid, self.reaches, solved))
        };
        let count = self.distance.set().slot(id).map_or(0, |from| self.read(from, fill));
        band.distance.refresh_faces(slot);
        band.u.refresh_faces(slot);
        count
    }

    /// The cells that hold a solved voxel: all others are constant.
    fn band_cells(&self, stage: &Stage<'_>) -> Result<BrickSet> {
        let set = self.distance.set();
        let grid = *set.grid();
        let edge = grid.edge() as usize;
        let holds = stage.run(&one_wave(set), &Workers::none(), |(), &slot| {
            let valid = grid.brick_box(set.id(slot)).shape().map(|n| n as usize);
            Ok(self.read(slot, |sides| start::holds(sides, edge, valid, self.reaches)))
        })?;
        Ok(BrickSet::from_fn(grid, |id| set.slot(id).is_some_and(|slot| holds[slot as usize])))
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
