//! Which side of the cloud each voxel is on: the watershed of the distance, its regions joined to spaces and these told
//! inside or outside (`kernel/level_set/initial/ascent.rs`, `kernel/level_set/initial/spaces.rs`; docs/algorithms.md, "Steepest ascent
//! and spaces").
//!
//! A hole is closed at its own saddle, however wide others are, and between its points the cloud is closed by the ridge
//! between both sides.

use std::sync::Arc;

use super::far_regions::FarRegions;
use super::near::Near;
use super::tagging::Basin;
use crate::error::Result;
use crate::exec::{Boundary, Comm, Engine, FixedPoint, HaloPlan, Hold, Reach, Stage, Workers, borrow_bricks};
use crate::exec::{join_records, one_wave, read_by_bricks, relax_to_fixed_point, tell_faces};
use crate::grid::{Box3, BrickId, BrickSet, Face, Slot};
use crate::kernel::level_set::initial::ascent::{Ascent, OUTSIDE, Peak, renumber};
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

/// Tells the sides of the cloud that the distance `near` it is measured from; `pockets` says how deep voxels lie in one, 0 for not. Each rank
/// has its part of what is inside; the regions and where they meet all ranks have.
///
/// # Errors
/// When scratch runs out, the run is interrupted or another rank is gone.
pub fn watershed(
    stage: &Stage<'_>,
    engine: &Engine,
    sources: &Sources<'_>,
    near: Near<'_>,
    pockets: Option<&BrickArray<f32>>,
) -> Result<Sides> {
    let set = near.distance.set();
    let edge = set.grid().edge() as usize;
    let make = move || Worker { ascent: Ascent::default(), d: HaloTile::new(edge), regions: HaloTile::new(edge) };
    let flood = Watershed {
        stage,
        near,
        pockets,
        spacing: sources.geometry.spacing,
        plan: HaloPlan::new(*set.grid(), Reach::Faces),
        workers: Workers::new(make),
    };
    // A cloud of noise has regions and contacts by the million: what they take is held until they are gone.
    let (of_voxel, mut regions, _of_regions) = flood.peaks(engine, &near.far_regions())?;
    tell_faces(stage.comm(), &of_voxel)?;
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
    near: Near<'a>,
    pockets: Option<&'a BrickArray<f32>>,
    spacing: [f64; 3],
    plan: HaloPlan,
    workers: Workers<Worker>,
}

impl Watershed<'_> {
    fn set(&self) -> &Arc<BrickSet> {
        self.near.distance.set()
    }

    fn gather_distance(&self, slot: Slot, tile: &mut HaloTile<f32>) {
        self.plan.gather(self.near.distance, slot, Boundary::Constant(f32::INFINITY), tile);
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
        let (peaks, mut held): (Vec<_>, Vec<_>) = peaks.into_iter().unzip();
        let counts: Vec<u32> = peaks.iter().map(|peaks: &Vec<Peak>| peaks.len() as u32).collect();
        let own = peaks.concat();
        let own_count = own.len();
        let (all, own_first) = join_records(self.stage.comm(), own)?;
        held.push(engine.hold((all.len() - own_count) as u64 * spaces::REGION_BYTES)?);
        let mut next = (regions.len() + own_first) as u32;
        let mut first = Vec::with_capacity(counts.len());
        for count in counts {
            first.push(next);
            next += count;
        }
        regions.extend(all.iter().map(|peak| Region { depth: peak.depth, voxels: 0, pocket: peak.pocket }));
        let owned = set.owned();
        self.stage.run(&one_wave(set), &Workers::none(), |(), &slot| {
            of_voxel.write(slot, |dense| renumber(dense, first[(slot - owned.start) as usize]));
            of_voxel.refresh_faces(slot);
            Ok(())
        })?;
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
        let mut own = Vec::with_capacity(found.iter().map(|(contacts, ..)| contacts.len()).sum());
        let (mut held, mut voxels) = (Vec::with_capacity(found.len()), vec![0; regions.len()]);
        for (slot, (contacts, counts, of_brick)) in set.owned().zip(found) {
            held.push(of_brick);
            own.extend(contacts.into_iter().map(|contact| (contact, set.id(slot))));
            for (region, count) in counts {
                voxels[region as usize] += count;
            }
        }
        let own = spaces::joined(own);
        let own_count = own.len();
        let (all, _) = join_records(self.stage.comm(), own)?;
        held.push(engine.hold((all.len() - own_count) as u64 * spaces::CONTACT_BYTES)?);
        count_voxels(self.stage.comm(), &voxels, regions)?;
        Ok(Meetings { contacts: spaces::joined(all), _held: held })
    }

    fn sides(&self, engine: &Engine, of_voxel: &BrickArray<u32>, is_inside: &[bool]) -> Result<BrickArray<u8>> {
        let set = self.set();
        let mut inside = BrickArray::with_faces(engine.scratch(), set)?;
        for id in self.near.far_bricks() {
            inside.set_absent(id, spaces::side_of(of_voxel.absent(id), is_inside));
        }
        self.stage.run(&one_wave(set), &Workers::none(), |(), &slot| {
            of_voxel.read(slot, |regions| {
                inside.write(slot, |inside| spaces::mark_sides(regions, is_inside, inside));
            });
            inside.refresh_faces(slot);
            Ok(())
        })?;
        tell_faces(self.stage.comm(), &inside)?;
        Ok(inside)
    }
}

/// Adds up how many voxels of each region all ranks have.
fn count_voxels(comm: &dyn Comm, own: &[u64], regions: &mut [Region]) -> Result<()> {
    let counted = (0_u32..).zip(own).filter(|(_, voxels)| **voxels > 0).map(|(region, &voxels)| (region, voxels));
    for (region, voxels) in join_records(comm, counted.collect::<Vec<_>>())?.0 {
        regions[region as usize].voxels += voxels;
    }
    Ok(())
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

/// The points that have not voxels of both sides within two voxels, of all ranks, in order.
fn lost_points(stage: &Stage<'_>, sources: &Sources<'_>, inside: &BrickArray<u8>) -> Result<Vec<u32>> {
    let (set, grid) = (inside.set(), inside.set().grid());
    let domain = Box3::from_shape(grid.shape());
    let around = |point: u32| {
        let base = sources.geometry.to_voxels(sources.positions[point as usize]).map(|v| v.floor() as i64);
        Box3::new(base.map(|v| v - 1), base.map(|v| v + 3)).intersect(&domain)
    };
    // What lies beside this rank's bricks is a ghost, or far from the cloud.
    let is_ghost = |id: &BrickId| set.slot(*id).is_some_and(|slot| !set.owned().contains(&slot));
    let points = set.owned().flat_map(|slot| sources.bins.of(set.id(slot)));
    let mut ghosts: Vec<BrickId> =
        points.flat_map(|&point| grid.bricks_in(&around(point)).filter(is_ghost).collect::<Vec<_>>()).collect();
    ghosts.sort_unstable();
    ghosts.dedup();
    let borrowed = borrow_bricks(stage, inside, 0, &ghosts)?;
    let read = |part: &Box3, voxels: &mut [u8]| match &borrowed {
        Some(borrowed) if grid.bricks_in(part).any(|id| is_ghost(&id)) => {
            read_by_bricks(grid, part, voxels, |id, shared, values| {
                if is_ghost(&id) { borrowed.read_box(shared, values) } else { inside.read_box(shared, values) }
            })
        }
        _ => inside.read_box(part, voxels),
    };
    let found = stage.run(&one_wave(set), &Workers::new(Vec::new), |voxels, &slot| {
        let mut lost = Vec::new();
        for &point in sources.bins.of(set.id(slot)) {
            let part = around(point);
            voxels.resize(part.len(), 0u8);
            read(&part, voxels)?;
            if !(voxels.contains(&0) && voxels.contains(&1)) {
                lost.push(point);
            }
        }
        Ok(lost)
    })?;
    let (mut lost, _) = join_records(stage.comm(), found.concat())?;
    lost.sort_unstable();
    Ok(lost)
}
