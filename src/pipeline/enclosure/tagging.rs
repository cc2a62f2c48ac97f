//! Tagging: what the cloud encloses, found by the bottleneck flood (docs/algorithms.md, "Bottleneck flood").
//!
//! One flood gives the answer for every threshold at once. Bricks far from the cloud are not stored: all their
//! voxels lie at the same (largest) distance, so a connected region of them has one flood value.

use serde::{Deserialize, Serialize};

use super::far_regions::FarRegions;
use super::near::Near;
use crate::error::Result;
use crate::exec::{Boundary, Comm, Engine, Exchange, FixedPoint, HaloPlan, Hold, Reach, Stage, Workers};
use crate::exec::{gather_records, join_records, one_wave, relax_to_fixed_point, tell_faces};
use crate::grid::{BrickId, FACES, Face, Slot};
use crate::kernel::level_set::initial::basins;
use crate::kernel::level_set::initial::basins::Piece;
use crate::kernel::level_set::initial::flood;
use crate::kernel::level_set::initial::persistence::{Joins, PIECE_BYTES, across, beyond};
use crate::pipeline::distance::Sources;
use crate::store::BrickArray;
use crate::tile::HaloTile;

/// A space that the cloud encloses.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Basin {
    /// Number of its voxels; of the flood's basins those deeper than the saddle.
    pub voxels: u64,
    /// The largest distance to the cloud in it.
    pub depth: f32,
    /// The threshold at which the flood enters: half the width of the cloud's largest hole.
    pub saddle: f32,
    /// Where the flood enters, a voxel of the grid.
    pub place: [i64; 3],
}

/// The flood and what it found.
pub struct Tagging {
    /// For each voxel the largest threshold at which the flood reaches it.
    pub level: BrickArray<f32>,
    /// The basins that persist, deepest first.
    pub basins: Vec<Basin>,
}

impl Tagging {
    /// 1 where the flood at a threshold does not reach, 0 elsewhere.
    ///
    /// # Errors
    /// When scratch runs out or the run is interrupted.
    pub fn inside(&self, stage: &Stage<'_>, engine: &Engine, near: Near<'_>, beta: f32) -> Result<BrickArray<u8>> {
        let set = self.level.set();
        let mut inside = BrickArray::with_faces(engine.scratch(), set)?;
        for id in near.far_bricks() {
            inside.set_absent(id, u8::from(self.level.absent(id) < beta));
        }
        stage.run(&one_wave(set), &Workers::none(), |(), &slot| {
            self.level.read(slot, |level| {
                inside.write(slot, |inside| flood::beyond(level, beta, inside));
            });
            inside.refresh_faces(slot);
            Ok(())
        })?;
        tell_faces(stage.comm(), &inside)?;
        Ok(inside)
    }
}

/// Floods the grid from its border and finds the basins that are so many times as deep as their saddle. Of these the deepest and
/// those that are `wanted` are kept: noise has as many as a cloud has points, and each is looked for at every voxel. All ranks find the
/// same basins.
///
/// # Errors
/// When scratch runs out, the run is interrupted or another rank is gone.
pub fn tag(
    stage: &Stage<'_>,
    engine: &Engine,
    sources: &Sources<'_>,
    near: Near<'_>,
    ratio: f32,
    wanted: impl Fn(&Basin) -> bool,
) -> Result<Tagging> {
    let (mut far, distance) = (near.far_regions(), near.distance);
    let level = flood_all(stage, engine, distance, &mut far)?;
    let (mut basins, mut pieces) = find_basins(stage, engine, [distance, &level], &far, ratio)?;
    let deepest = basins.iter().map(|basin| basin.depth).fold(0.0, f32::max);
    pieces.keep(&mut basins, |basin| basin.depth == deepest || wanted(basin));
    locate_saddles(stage, sources, [distance, &level], &pieces, &mut basins)?;
    basins.sort_by(|a, b| b.depth.total_cmp(&a.depth).then(b.voxels.cmp(&a.voxels)));
    Ok(Tagging { level, basins })
}

/// For each voxel the largest threshold at which the flood reaches it.
///
/// # Errors
/// When scratch runs out or the run is interrupted.
pub fn level_of(stage: &Stage<'_>, engine: &Engine, near: Near<'_>) -> Result<BrickArray<f32>> {
    flood_all(stage, engine, near.distance, &mut near.far_regions())
}

/// Relaxes bricks until nothing rises.
fn flood_all(
    stage: &Stage<'_>,
    engine: &Engine,
    distance: &BrickArray<f32>,
    far: &mut FarRegions,
) -> Result<BrickArray<f32>> {
    let set = distance.set().clone();
    let mut level = BrickArray::with_faces(engine.scratch(), &set)?;
    for (region, bricks) in far.bricks.iter().enumerate() {
        for &id in bricks {
            level.set_absent(id, far.level[region]);
        }
    }
    let plan = HaloPlan::new(*set.grid(), Reach::Faces);
    let edge = set.grid().edge() as usize;
    let mut flood = Flood { distance, level, far, plan };
    relax_to_fixed_point(stage, Reach::Faces, &Workers::new(move || HaloTile::new(edge)), &mut flood)?;
    Ok(flood.level)
}

struct Flood<'a> {
    distance: &'a BrickArray<f32>,
    level: BrickArray<f32>,
    far: &'a mut FarRegions,
    plan: HaloPlan,
}

impl FixedPoint for Flood<'_> {
    type State = f32;
    type Work = HaloTile<f32>;

    fn field(&self) -> &BrickArray<f32> {
        &self.level
    }

    fn relax(&self, tile: &mut HaloTile<f32>, slot: Slot) -> Result<bool> {
        self.plan.gather(&self.level, slot, Boundary::Constant(f32::INFINITY), tile);
        let rose = self.distance.read(slot, |d| flood::relax(tile, d));
        if rose {
            self.plan.scatter(tile, &self.level, slot);
        }
        Ok(rose)
    }

    /// A far region beside a brick that rose may rise too, which marks every brick around it.
    fn changed(&mut self, slot: Slot, mut mark: impl FnMut(Slot)) {
        let set = self.distance.set();
        // Of a ghost that is its owner's to tell.
        if !set.owned().contains(&slot) {
            return;
        }
        for face in FACES {
            let Some(id) = set.grid().neighbour(set.id(slot), face.offset()) else { continue };
            if set.slot(id).is_some() {
                continue;
            }
            let highest = self.level.read_face(slot, face, flood::highest);
            raised(&mut self.level, self.far.raise(id, highest), &mut mark);
        }
    }

    /// A far region may lie beside bricks of any rank.
    fn quiet(&mut self, comm: &dyn Comm, mut mark: impl FnMut(Slot)) -> Result<()> {
        if comm.ranks() == 1 {
            return Ok(());
        }
        for levels in gather_records(comm, &self.far.level)? {
            for (region, level) in levels.into_iter().enumerate() {
                raised(&mut self.level, self.far.raise_region(region, level), &mut mark);
            }
        }
        Ok(())
    }
}

/// A far region rose: the flood has its level there, and the bricks around it are marked.
fn raised(level: &mut BrickArray<f32>, region: Option<(&[BrickId], f32)>, mark: &mut impl FnMut(Slot)) {
    let (Some((bricks, to)), set) = (region, level.set().clone()) else { return };
    for &brick in bricks {
        level.set_absent(brick, to);
        let around = FACES.iter().filter_map(|face| set.grid().neighbour(brick, face.offset()));
        around.filter_map(|id| set.slot(id)).for_each(&mut *mark);
    }
}

/// Labels the basins in each brick, joins the pieces across faces and far regions, keeps those that persist.
fn find_basins(
    stage: &Stage<'_>,
    engine: &Engine,
    [distance, level]: [&BrickArray<f32>; 2],
    far: &FarRegions,
    ratio: f32,
) -> Result<(Vec<Basin>, Pieces)> {
    let (set, comm) = (distance.set(), stage.comm());
    let labels: BrickArray<u16> = BrickArray::with_faces(engine.scratch(), set)?;
    let edge = set.grid().edge() as usize;
    let found = stage.run(&one_wave(set), &Workers::none(), |(), &slot| {
        let valid = set.grid().brick_box(set.id(slot)).shape().map(|n| n as usize);
        let pieces =
            distance.read(slot, |d| level.read(slot, |b| labels.write(slot, |l| basins::label(d, b, edge, valid, l))));
        labels.refresh_faces(slot);
        let held = engine.hold(pieces.len() as u64 * PIECE_BYTES)?;
        Ok((pieces, held))
    })?;
    let (found, _held): (Vec<_>, Vec<Hold>) = found.into_iter().unzip();
    let counts: Vec<u32> = found.iter().map(|pieces: &Vec<Piece>| pieces.len() as u32).collect();
    let own = found.concat();
    let own_count = own.len();
    let (mut pieces, own_first) = join_records(comm, own)?;
    let _of_others = engine.hold((pieces.len() - own_count) as u64 * PIECE_BYTES)?;
    let first = first_pieces(comm, &labels, &counts, own_first as u32)?;
    let far_first = pieces.len() as u32;
    let brick_len = set.grid().brick_len() as u64;
    pieces.extend(far.bricks.iter().zip(&far.level).map(|(bricks, &saddle)| Piece {
        // A far region at the flood's own level is exterior: depth 0 keeps it out.
        voxels: bricks.len() as u64 * brick_len,
        depth: if saddle < far.farthest { far.farthest } else { 0.0 },
        saddle,
    }));
    let mut joins = Joins::new(pieces);
    let touching = touching_pieces(&labels, &first, far, far_first);
    join_records(comm, touching)?.0.into_iter().for_each(|pair| joins.join(pair));
    let (whole, basin) = joins.persisting(ratio);
    let found = |p: &Piece| Basin { voxels: p.voxels, depth: p.depth, saddle: p.saddle, place: [0; 3] };
    let far = (0..set.grid().len()).map(|id| far_first.wrapping_add(far.region[id as usize])).collect();
    Ok((whole.iter().map(found).collect(), Pieces { labels, first, far, basin }))
}

/// The piece that label 1 of each slot's brick stands for, from how many each of this rank's has and which is the first of them all. Ghosts
/// get theirs, and their faces, from their owners.
fn first_pieces(comm: &dyn Comm, labels: &BrickArray<u16>, counts: &[u32], own_first: u32) -> Result<Vec<u32>> {
    let set = labels.set();
    let (mut first, mut next) = (vec![0; set.len()], own_first);
    let mut told = Vec::with_capacity(counts.len());
    for (slot, count) in set.owned().zip(counts) {
        first[slot as usize] = next;
        told.push((slot, [f64::from(next)]));
        next += count;
    }
    let exchange = Exchange::new(comm, set, &HaloPlan::new(*set.grid(), Reach::Faces))?;
    exchange.post(labels, &told)?;
    for (ghost, [of_ghost]) in exchange.collect::<u16, [f64; 1]>(labels)? {
        first[ghost as usize] = of_ghost as u32;
    }
    Ok(first)
}

/// The pieces that touch across the faces of this rank's bricks, and those beside a far region with it, where that is a basin.
fn touching_pieces(labels: &BrickArray<u16>, first: &[u32], far: &FarRegions, far_first: u32) -> Vec<[u32; 2]> {
    let (set, mut touching) = (labels.set(), Vec::new());
    for slot in set.owned() {
        let here = first[slot as usize];
        for face in FACES {
            let Some(id) = set.grid().neighbour(set.id(slot), face.offset()) else { continue };
            match set.slot(id) {
                // Faces between stored bricks are seen from below, once.
                Some(other) if face.upper => labels.read_face(slot, face, |mine| {
                    labels.read_face(other, face.opposite(), |theirs| {
                        across([mine, theirs], [here, first[other as usize]], &mut touching);
                    });
                }),
                Some(_) => {}
                None => {
                    let region = far.region[id as usize];
                    if far.level[region as usize] < far.farthest {
                        labels.read_face(slot, face, |mine| beyond(mine, here, far_first + region, &mut touching));
                    }
                }
            }
        }
    }
    touching
}

/// The labelled pieces and the basins they belong to.
struct Pieces {
    /// Labels within each brick, from 1 on; 0 is no piece.
    labels: BrickArray<u16>,
    /// The piece that label 1 of each slot stands for.
    first: Vec<u32>,
    /// The piece that each brick which is not stored belongs to; meaningless for stored ones.
    far: Vec<u32>,
    /// The basin of each piece, where it persists.
    basin: Vec<Option<u32>>,
}

impl Pieces {
    /// Keeps some of the basins.
    fn keep(&mut self, basins: &mut Vec<Basin>, kept: impl Fn(&Basin) -> bool) {
        let mut count = 0;
        let names: Vec<Option<u32>> = basins
            .iter()
            .map(|basin| {
                let name = kept(basin).then_some(count);
                count += u32::from(name.is_some());
                name
            })
            .collect();
        basins.retain(|basin| kept(basin));
        self.basin.iter_mut().for_each(|basin| *basin = basin.and_then(|name| names[name as usize]));
    }

    /// The basin that a label of a slot's brick belongs to.
    fn basin(&self, slot: Slot, label: u16) -> Option<u32> {
        (label != 0).then(|| self.basin[(self.first[slot as usize] + u32::from(label) - 1) as usize]).flatten()
    }

    /// The basin beyond a face of a slot's brick, beside a ghost with the given label.
    fn basin_beyond(&self, slot: Slot, face: Face, label: u16) -> Option<u32> {
        let set = self.labels.set();
        let id = set.grid().neighbour(set.id(slot), face.offset())?;
        match set.slot(id) {
            Some(neighbour) => self.basin(neighbour, label),
            None => self.basin[self.far[id as usize] as usize],
        }
    }
}

/// Finds where the flood enters each basin: the first voxel in grid order that lies beside it and has the saddle's
/// value both in d and in b. The value alone would not do: equal objects have equal saddles.
fn locate_saddles(
    stage: &Stage<'_>,
    sources: &Sources<'_>,
    [distance, level]: [&BrickArray<f32>; 2],
    pieces: &Pieces,
    basins: &mut [Basin],
) -> Result<()> {
    let set = distance.set();
    let plan = HaloPlan::new(*set.grid(), Reach::Faces);
    let edge = set.grid().edge() as usize;
    let saddles: Vec<f32> = basins.iter().map(|b| b.saddle).collect();
    let found = stage.run(&one_wave(set), &Workers::new(move || HaloTile::new(edge)), |labels, &slot| {
        if saddles.is_empty() {
            return Ok(Vec::new());
        }
        plan.gather(&pieces.labels, slot, Boundary::Constant(0), labels);
        let basin = |beyond: Option<Face>, label| match beyond {
            None => pieces.basin(slot, label),
            Some(face) => pieces.basin_beyond(slot, face, label),
        };
        let entries = distance.read(slot, |d| level.read(slot, |b| basins::entries(labels, d, b, &saddles, basin)));
        let lo = set.grid().brick_box(set.id(slot)).lo;
        let placed = |(name, at): (u32, [usize; 3])| (name, std::array::from_fn(|a| lo[a] + at[a] as i64));
        Ok(entries.into_iter().map(placed).collect::<Vec<(u32, [i64; 3])>>())
    })?;
    let (found, _) = join_records(stage.comm(), found.concat())?;
    let order = |v: &[i64; 3]| sources.geometry.domain().offset_of(*v);
    for (n, basin) in basins.iter_mut().enumerate() {
        let places = found.iter().filter(|(name, _)| *name == n as u32);
        if let Some(place) = places.map(|(_, place)| *place).min_by_key(order) {
            basin.place = place;
        }
    }
    Ok(())
}
