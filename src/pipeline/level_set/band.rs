//! The narrow band and its start (docs/algorithms.md, "Narrow band").
//!
//! What a voxel is at the start is told by `kernel/level_set/initial/start.rs`. Only cells that hold a solved voxel are stored;
//! the others are constant, for the border between the sides is solved wherever it runs. Beyond the band the distance
//! counts as the farthest: it acts on voxels of the band's rim alone, which are as constant as what is beyond.

use std::sync::Arc;

use crate::error::Result;
use crate::exec::{Boundary, Engine, Exchange, HaloPlan, Ownership, Reach, Stage, Workers, join_records, one_wave};
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

/// The distance to a cloud and its sides, over the same cells: of several ranks each has its part.
#[derive(Clone, Copy)]
pub struct SidesNear<'a> {
    /// Distance to the cloud, physical lengths.
    pub distance: &'a BrickArray<f32>,
    /// 1 inside, 0 outside; with [`start::HELD`] where it stays so.
    pub inside: &'a BrickArray<u8>,
    /// The cells of all ranks.
    pub cells: &'a BrickSet,
}

/// Makes the band from the distance and the sides; each rank its part of it, and all ranks then have all.
///
/// # Errors
/// When scratch runs out, the run is interrupted or another rank is gone.
pub fn make_band(stage: &Stage<'_>, engine: &Engine, sides: SidesNear<'_>, reaches: Reaches) -> Result<Band> {
    let SidesNear { distance, inside, cells } = sides;
    let comm = stage.comm();
    let near = near_border(stage, engine, distance, inside, reaches)?;
    let known = Known { distance, inside, near: near.as_ref(), reaches };
    let BandCells { of_band, constant } = known.band_cells(stage)?;
    let set = Arc::new(BrickSet::from_ids(*cells.grid(), join_records(comm, of_band)?.0));
    let ownership = Ownership::agreed(comm, distance.set())?;
    let own = Arc::new(ownership.part(&set, comm.rank(), &HaloPlan::new(*set.grid(), Reach::All)));
    let new = || BrickArray::<f32>::with_faces(engine.scratch(), &own);
    let mut band = Band { u: new()?, distance: new()?, solved: BrickArray::new(engine.scratch(), &own)?, voxels: 0 };
    for id in (0..set.grid().len()).filter(|&id| cells.slot(id).is_none()) {
        band.u.set_absent(id, start::value(inside.absent(id)));
    }
    for (id, side) in join_records(comm, constant)?.0 {
        band.u.set_absent(id, start::value(side));
    }
    let farthest = Some(distance.absent(0)).filter(|d| d.is_finite());
    band.distance.set_all_absent(farthest.unwrap_or(reaches.inner.max(reaches.outer)));
    let counts = stage.run(&one_wave(&own), &Workers::none(), |(), &slot| Ok(known.fill_cell(&band, slot)))?;
    band.voxels = comm.sum(&counts.iter().map(|&count| count as f64).collect::<Vec<_>>())? as u64;
    stage.voxels(band.voxels);
    band.whole(stage, &set)
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
    let (set, comm) = (distance.set(), stage.comm());
    let plan = HaloPlan::new(*set.grid(), Reach::Faces);
    let (edge, len) = (set.grid().edge() as usize, set.grid().brick_len());
    let workers = Workers::new(move || (HaloTile::new(edge), vec![0u8; len]));
    let found = stage.run(&one_wave(set), &workers, |(tile, near), &slot| {
        plan.gather(inside, slot, Boundary::Mirror, tile);
        Ok(distance.read(slot, |d| start::border(d, tile, reaches, near)))
    })?;
    if !comm.any(found.contains(&true))? {
        return Ok(None);
    }
    let exchange = Exchange::new(comm, set, &HaloPlan::new(*set.grid(), Reach::All))?;
    let grown = BrickArray::blank(engine.scratch(), set, 0u8)?;
    let wide: Vec<Slot> = set.owned().zip(found).filter_map(|(slot, is_wide)| is_wide.then_some(slot)).collect();
    stage.run(&wide, &workers, |(tile, near), &slot| {
        plan.gather(inside, slot, Boundary::Mirror, tile);
        distance.read(slot, |d| start::border(d, tile, reaches, near));
        write_cell(&grown, slot, near);
        Ok(())
    })?;
    let mut is_wide = vec![false; set.len()];
    wide.iter().chain(&exchange.faces(&grown, &wide)?).for_each(|&slot| is_wide[slot as usize] = true);
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
        exchange.faces(&grown, &around)?;
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

    /// Of this rank's cells those that hold a solved voxel; all others are constant, and what they are their first voxel tells.
    fn band_cells(&self, stage: &Stage<'_>) -> Result<BandCells> {
        let set = self.distance.set();
        let edge = set.grid().edge() as usize;
        let found = stage.run(&one_wave(set), &Workers::none(), |(), &slot| {
            let valid = set.grid().brick_box(set.id(slot)).shape().map(|n| n as usize);
            let holds = self.read(slot, |sides| start::holds(sides, edge, valid, self.reaches));
            Ok((!holds).then(|| self.inside.read(slot, |inside| inside[0])))
        })?;
        let (mut of_band, mut constant) = (Vec::new(), Vec::new());
        for (slot, side) in set.owned().zip(found) {
            match side {
                None => of_band.push(set.id(slot)),
                Some(side) => constant.push((set.id(slot), side)),
            }
        }
        Ok(BandCells { of_band, constant })
    }
}

/// The cells of one rank.
struct BandCells {
    /// Those that hold a solved voxel.
    of_band: Vec<BrickId>,
    /// All others, and the side that they are on.
    constant: Vec<(BrickId, u8)>,
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
