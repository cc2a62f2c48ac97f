//! Which side of the cloud each voxel is on: the watershed of the distance, its regions joined to spaces and these told
//! inside or outside (`kernel/level_set/initial/ascent.rs`, `kernel/level_set/initial/spaces.rs`; docs/algorithms.md, "Steepest ascent
//! and spaces").
//!
//! A hole is closed at its own saddle, however wide others are, and between its points the cloud is closed by the ridge
//! between both sides.

use std::sync::Arc;

use super::far_regions::FarRegions;
use super::tagging::Basin;
use crate::error::Result;
use crate::exec::{
    Boundary, Engine, FixedPoint, HaloPlan, Hold, Reach, Stage, Workers, one_wave, relax_to_fixed_point,
};
use crate::grid::{Box3, BrickId, BrickSet, Face, Slot};
use crate::kernel::level_set::initial::ascent::{Ascent, OUTSIDE, renumber};
use crate::kernel::level_set::initial::contacts::{Contact, contacts, count};
use crate::kernel::level_set::initial::spaces;
use crate::kernel::level_set::initial::spaces::{Region, Space};
use crate::pipeline::distance::Sources;
use crate::store::{BoxSource, BrickArray};
use crate::tile::HaloTile;

/// A space less deep than so many smallest spacings is a gap between points.
const LEAST_DEPTH_VOXELS: f64 = 1.0;
/// A pocket less deep than so many is a ball's curvature against the grid's steps.
const LEAST_POCKET_VOXELS: f64 = 2.0;

/// So far from the cloud, in spacings, there is no wall: a wall's points are not twice as far apart.
pub(crate) const WALL_VOXELS: f64 = 4.0;

/// The sides of a cloud.
pub struct Sides {
    /// 1 inside, 0 outside.
    pub inside: BrickArray<u8>,
    /// The spaces inside, deepest first.
    pub basins: Vec<Basin>,
    /// The points that have one side all around them: of sheets without an inside, or far from any body.
    pub lost: Vec<u32>,
}

struct Worker {
    ascent: Ascent,
    d: HaloTile<f32>,
    regions: HaloTile<u32>,
}

/// Tells the sides of the cloud that `distance` is measured from; `pockets` says how deep voxels lie in one, 0 for not.
///
/// # Errors
/// When scratch runs out or the run is interrupted.
pub fn watershed(
    stage: &Stage<'_>,
    engine: &Engine,
    sources: &Sources<'_>,
    distance: &BrickArray<f32>,
    pockets: Option<&BrickArray<f32>>,
) -> Result<Sides> {
    let set = distance.set();
    let edge = set.grid().edge() as usize;
    let make = move || Worker { ascent: Ascent::default(), d: HaloTile::new(edge), regions: HaloTile::new(edge) };
    let far = FarRegions::new(set, distance.absent(0));
    let flood = Watershed {
        stage,
        distance,
        pockets,
        spacing: sources.geometry.spacing,
        plan: HaloPlan::new(*set.grid(), Reach::Faces),
        workers: Workers::new(make),
    };
    // A cloud of noise has regions and contacts by the million: what they take is held until they are gone.
    let (of_voxel, mut regions, _of_regions) = flood.peaks(engine, &far)?;
    let mut descent = Descent { watershed: &flood, of_voxel: &of_voxel };
    relax_to_fixed_point(stage, Reach::Faces, &flood.workers, &mut descent)?;
    let Meetings { contacts, _held } = flood.contacts(engine, &of_voxel, &mut regions)?;
    let least = |voxels: f64| (voxels * sources.geometry.min_spacing()) as f32;
    let (is_inside, found) =
        spaces::inside(&regions, &contacts, least(LEAST_DEPTH_VOXELS), least(LEAST_POCKET_VOXELS), least(WALL_VOXELS));
    let inside = flood.sides(engine, &of_voxel, &is_inside)?;
    let basins = found.iter().map(|space| basin(space, &contacts, set)).collect();
    let lost = lost_points(stage, sources, &inside)?;
    Ok(Sides { inside, basins, lost })
}

/// Where regions meet.
struct Meetings {
    /// With the brick that each place is in.
    contacts: Vec<(Contact, BrickId)>,
    /// What holds the memory that they take.
    _held: Vec<Hold>,
}

struct Watershed<'a> {
    stage: &'a Stage<'a>,
    distance: &'a BrickArray<f32>,
    pockets: Option<&'a BrickArray<f32>>,
    spacing: [f64; 3],
    plan: HaloPlan,
    workers: Workers<Worker>,
}

impl Watershed<'_> {
    fn set(&self) -> &Arc<BrickSet> {
        self.distance.set()
    }

    fn gather_distance(&self, slot: Slot, tile: &mut HaloTile<f32>) {
        self.plan.gather(self.distance, slot, Boundary::Constant(f32::INFINITY), tile);
    }

    /// Numbers the maxima of all bricks, in grid order after the far regions; the others' voxels are unknown yet.
    fn peaks(&self, engine: &Engine, far: &FarRegions) -> Result<(BrickArray<u32>, Vec<Region>, Vec<Hold>)> {
        let set = self.set();
        let mut of_voxel = BrickArray::with_faces(engine.scratch(), set)?;
        let peaks = self.stage.run(&one_wave(set), &self.workers, |w, &slot| {
            self.gather_distance(slot, &mut w.d);
            let mut peaks = |pockets: Option<&[f32]>| {
                of_voxel.write(slot, |dense| w.ascent.peaks(&w.d, self.spacing, 0, pockets, dense))
            };
            let peaks = match self.pockets {
                Some(pockets) => pockets.read(slot, |pockets| peaks(Some(pockets))),
                None => peaks(None),
            };
            let held = engine.hold(peaks.len() as u64 * spaces::REGION_BYTES)?;
            Ok((peaks, held))
        })?;
        let mut regions = vec![Region::default()];
        let mut of_far = Vec::with_capacity(far.bricks.len());
        for (bricks, level) in far.bricks.iter().zip(&far.level) {
            if *level == far.farthest {
                of_far.push(OUTSIDE);
            } else {
                of_far.push(regions.len() as u32);
                let voxels = (bricks.len() * set.grid().brick_len()) as u64;
                regions.push(Region { depth: far.farthest, voxels, pocket: 0.0 });
            }
        }
        for (&name, bricks) in of_far.iter().zip(&far.bricks) {
            for &id in bricks {
                of_voxel.set_absent(id, name);
            }
        }
        let mut first = Vec::with_capacity(set.len());
        for (peaks, _) in &peaks {
            first.push(regions.len() as u32);
            regions.extend(peaks.iter().map(|peak| Region { depth: peak.depth, voxels: 0, pocket: peak.pocket }));
        }
        self.stage.run(&one_wave(set), &Workers::none(), |(), &slot| {
            of_voxel.write(slot, |dense| renumber(dense, first[slot as usize]));
            of_voxel.refresh_faces(slot);
            Ok(())
        })?;
        let held = peaks.into_iter().map(|(_, held)| held).collect();
        Ok((of_voxel, regions, held))
    }

    /// Where regions meet; counts the voxels of all regions.
    fn contacts(&self, engine: &Engine, of_voxel: &BrickArray<u32>, regions: &mut [Region]) -> Result<Meetings> {
        let set = self.set();
        let found = self.stage.run(&one_wave(set), &self.workers, |w, &slot| {
            self.gather_distance(slot, &mut w.d);
            self.plan.gather(of_voxel, slot, Boundary::Constant(OUTSIDE), &mut w.regions);
            let stored = |face: Face| set.neighbour(slot, face.offset()).is_some();
            let lower = [0, 1, 2].map(|axis| !stored(Face { axis, upper: false }));
            let (contacts, counts) = (contacts(&w.d, &w.regions, lower), count(&w.regions));
            let held = engine.hold(contacts.len() as u64 * spaces::CONTACT_BYTES)?;
            Ok((contacts, counts, held))
        })?;
        let mut all = Vec::with_capacity(found.iter().map(|(contacts, ..)| contacts.len()).sum());
        let mut held = Vec::with_capacity(found.len());
        for (slot, (contacts, counts, of_brick)) in found.into_iter().enumerate() {
            held.push(of_brick);
            all.extend(contacts.into_iter().map(|contact| (contact, set.id(slot as Slot))));
            for (region, voxels) in counts {
                regions[region as usize].voxels += voxels;
            }
        }
        Ok(Meetings { contacts: spaces::joined(all), _held: held })
    }

    fn sides(&self, engine: &Engine, of_voxel: &BrickArray<u32>, is_inside: &[bool]) -> Result<BrickArray<u8>> {
        let set = self.set();
        let mut inside = BrickArray::with_faces(engine.scratch(), set)?;
        for id in (0..set.grid().len()).filter(|&id| set.slot(id).is_none()) {
            inside.set_absent(id, spaces::side_of(of_voxel.absent(id), is_inside));
        }
        self.stage.run(&one_wave(set), &Workers::none(), |(), &slot| {
            of_voxel.read(slot, |regions| {
                inside.write(slot, |inside| spaces::mark_sides(regions, is_inside, inside));
            });
            inside.refresh_faces(slot);
            Ok(())
        })?;
        Ok(inside)
    }
}

/// Regions on their way down the distance, until every voxel has one.
struct Descent<'a> {
    watershed: &'a Watershed<'a>,
    of_voxel: &'a BrickArray<u32>,
}

impl FixedPoint for Descent<'_> {
    type State = u32;
    type Work = Worker;

    fn field(&self) -> &BrickArray<u32> {
        self.of_voxel
    }

    fn relax(&self, w: &mut Worker, slot: Slot) -> Result<bool> {
        let Watershed { plan, spacing, .. } = self.watershed;
        self.watershed.gather_distance(slot, &mut w.d);
        plan.gather(self.of_voxel, slot, Boundary::Constant(OUTSIDE), &mut w.regions);
        let changed = w.ascent.descend(&w.d, *spacing, &mut w.regions);
        if changed {
            plan.scatter(&w.regions, self.of_voxel, slot);
        }
        Ok(changed)
    }
}

fn basin(space: &Space, contacts: &[(Contact, BrickId)], set: &BrickSet) -> Basin {
    let (hole, brick) = &contacts[space.hole];
    let edge = set.grid().edge();
    let local = [hole.place as i64 % edge, hole.place as i64 / edge % edge, hole.place as i64 / (edge * edge)];
    let lo = set.grid().brick_box(*brick).lo;
    let place = std::array::from_fn(|a| lo[a] + local[a]);
    Basin { voxels: space.voxels, depth: space.depth, saddle: hole.pass, place }
}

/// The points that have not voxels of both sides within two voxels.
fn lost_points(stage: &Stage<'_>, sources: &Sources<'_>, inside: &BrickArray<u8>) -> Result<Vec<u32>> {
    let set = inside.set();
    let domain = Box3::from_shape(set.grid().shape());
    let found = stage.run(&one_wave(set), &Workers::new(Vec::new), |voxels, &slot| {
        let mut lost = Vec::new();
        for &point in sources.bins.of(set.id(slot)) {
            let base = sources.geometry.to_voxels(sources.positions[point as usize]).map(|v| v.floor() as i64);
            let around = Box3::new(base.map(|v| v - 1), base.map(|v| v + 3)).intersect(&domain);
            voxels.resize(around.len(), 0u8);
            inside.read_box(&around, voxels)?;
            if !(voxels.contains(&0) && voxels.contains(&1)) {
                lost.push(point);
            }
        }
        Ok(lost)
    })?;
    let mut lost = found.concat();
    lost.sort_unstable();
    Ok(lost)
}
