//! Sheets: points with the same side all around them, so that a surface would close over them. Outside, the voxels that
//! hold them are held inside, as a thin shell (docs/algorithms.md, "Pockets and sheets"); inside they are held outside,
//! as a slit.

use std::collections::BTreeSet;

use rstar::RTree;

use crate::error::Result;
use crate::exec::{Comm, join_records};
use crate::grid::{Box3, BrickSet, Geometry, Slot};
use crate::kernel::level_set::initial::start::{HELD, value};
use crate::pipeline::level_set::band::Band;
use crate::store::BrickArray;

/// A voxel is held within so many largest spacings of a sheet's point, and of the lines between points beside each
/// other.
const HELD_VOXELS: f64 = 0.7;
/// Lines are as long as so many largest spacings at most.
const NEAR_VOXELS: f64 = 6.0;
/// Lines are drawn to so many nearest points: to those all around, on a sheet.
const LINES: usize = 6;

/// Which of the lost points are taken for a sheet: those with so many others of them so near; the rest is noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Company {
    /// How many others.
    others: usize,
    /// How near, in largest spacings.
    near: f64,
}

impl Company {
    /// For points that have one side all around them before anything was solved.
    pub(crate) const AT_THE_START: Self = Self { others: 3, near: 6.0 };
    /// For points that a solved surface has left: what sticks out by a voxel is two points or three.
    pub(crate) const AT_THE_END: Self = Self { others: 1, near: 3.0 };
}

/// Where sides are told, and voxels can be held on one.
pub(crate) trait Holds {
    /// The bricks that voxels can be held in.
    fn set(&self) -> &BrickSet;
    /// The side of a voxel, a place in the dense brick: 1 inside, 0 outside.
    fn side(&self, slot: Slot, at: usize) -> u8;
    /// Holds it on a side.
    fn hold(&self, slot: Slot, at: usize, side: u8);
    /// Tells the neighbours of a brick in which voxels were held.
    fn refresh(&self, slot: Slot);
}

impl Holds for BrickArray<u8> {
    fn set(&self) -> &BrickSet {
        BrickArray::set(self)
    }

    fn side(&self, slot: Slot, at: usize) -> u8 {
        self.read(slot, |sides| sides[at] & 1)
    }

    fn hold(&self, slot: Slot, at: usize, side: u8) {
        self.write(slot, |sides| sides[at] = side | HELD);
    }

    fn refresh(&self, slot: Slot) {
        self.refresh_faces(slot);
    }
}

impl Holds for Band {
    fn set(&self) -> &BrickSet {
        self.solved.set()
    }

    fn side(&self, slot: Slot, at: usize) -> u8 {
        self.u.read(slot, |u| u8::from(u[at] >= 0.5))
    }

    fn hold(&self, slot: Slot, at: usize, side: u8) {
        self.u.write(slot, |u| u[at] = value(side | HELD));
        self.solved.write(slot, |solved| solved[at] = 0);
    }

    fn refresh(&self, slot: Slot) {
        self.u.refresh_faces(slot);
    }
}

/// Holds the voxels around those of the `lost` points that form sheets, and between them and their neighbours in the
/// cloud, each on the side opposite to what is there; returns these points. Each rank of several does so in its part of the target, and
/// looks after the faces of ghosts itself.
///
/// # Errors
/// When another rank is gone.
pub(crate) fn hold_sheets(
    comm: &dyn Comm,
    geometry: &Geometry,
    positions: &[[f64; 3]],
    lost: &[u32],
    company: Company,
    target: &impl Holds,
) -> Result<Vec<u32>> {
    let tree = RTree::bulk_load(lost.iter().map(|&point| positions[point as usize]).collect());
    let within = (company.near * geometry.max_spacing()).powi(2);
    let is_sheet = |p| tree.locate_within_distance(p, within).take(company.others + 1).count() > company.others;
    // All sides are told before anything is held.
    let side = |&point: &u32| {
        let place = positions[point as usize];
        let (slot, at) = place_of(target.set(), geometry.to_voxels(place).map(|v| v.round() as i64))?;
        is_sheet(place).then(|| (point, target.side(slot, at)))
    };
    let (mut sheet, _) = join_records(comm, lost.iter().filter_map(side).collect())?;
    if sheet.is_empty() {
        return Ok(Vec::new());
    }
    sheet.sort_unstable();
    let all = RTree::bulk_load(positions.to_vec());
    let mut touched = BTreeSet::new();
    let longest = (NEAR_VOXELS * geometry.max_spacing()).powi(2);
    let step = 0.5 * geometry.min_spacing();
    for &(point, side) in &sheet {
        let from = positions[point as usize];
        let mut hold = |place: [f64; 3]| {
            for voxel in voxels_near(geometry, place) {
                if let Some((slot, at)) = place_of(target.set(), voxel) {
                    target.hold(slot, at, 1 - side);
                    touched.insert(slot);
                }
            }
        };
        hold(from);
        for (to, squared) in all.nearest_neighbor_iter_with_distance_2(from).take(LINES + 1).filter(|n| n.1 <= longest)
        {
            let steps = (squared.sqrt() / step).ceil();
            for n in 1..steps as u32 {
                let part = f64::from(n) / steps;
                hold(std::array::from_fn(|a| from[a] + part * (to[a] - from[a])));
            }
        }
    }
    for slot in touched {
        target.refresh(slot);
    }
    Ok(sheet.into_iter().map(|(point, _)| point).collect())
}

/// The brick of a voxel and its place there; none where this rank stores nothing.
fn place_of(set: &BrickSet, voxel: [i64; 3]) -> Option<(Slot, usize)> {
    let id = set.grid().brick_of(voxel)?;
    let (lo, edge) = (set.grid().brick_box(id).lo, set.grid().edge());
    let [x, y, z] = [0, 1, 2].map(|a| voxel[a] - lo[a]);
    Some((set.own_slot(id)?, ((z * edge + y) * edge + x) as usize))
}

/// The voxel nearest to a place, and those within reach of it.
fn voxels_near(geometry: &Geometry, place: [f64; 3]) -> Vec<[i64; 3]> {
    let reach = HELD_VOXELS * geometry.max_spacing();
    let (lo, hi) = (geometry.to_voxels(place.map(|v| v - reach)), geometry.to_voxels(place.map(|v| v + reach)));
    let around = Box3::new(lo.map(|v| v.ceil() as i64), hi.map(|v| v.floor() as i64 + 1));
    let within = |voxel: &[i64; 3]| {
        let at = geometry.position(*voxel);
        (0..3).map(|a| (at[a] - place[a]).powi(2)).sum::<f64>() <= reach * reach
    };
    let near = around.rows().flat_map(|(y, z)| (around.lo[0]..around.hi[0]).map(move |x| [x, y, z])).filter(within);
    near.chain([geometry.to_voxels(place).map(|v| v.round() as i64)]).collect()
}
