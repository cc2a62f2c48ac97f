//! Tagging: what the cloud encloses, found by the bottleneck flood (algorithms: section 5, "Automatic beta").
//!
//! One flood gives the answer for every threshold at once. Bricks far from the cloud are not stored: all their
//! voxels lie at the same (largest) distance, so a connected region of them has one flood value.

use std::sync::Arc;

use super::distance::Sources;
use crate::error::Result;
use crate::exec::{Boundary, Engine, HaloPlan, Reach, Stage, Workers, checkerboard, one_wave};
use crate::grid::{BrickId, BrickSet, FACES, Slot};
use crate::kernel::level_set::basins::{self, Piece};
use crate::kernel::level_set::flood;
use crate::store::BrickArray;
use crate::tile::HaloTile;

/// A basin persists when its depth is at least this many times its saddle; noise stays below 1.5.
const PERSISTENCE: f32 = 2.0;

/// A space that the cloud encloses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Basin {
    /// Number of voxels deeper than the saddle.
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

/// Floods the grid from its border and finds the basins that persist.
///
/// # Errors
/// When scratch runs out or the run is interrupted.
pub fn tag(stage: &Stage<'_>, engine: &Engine, sources: &Sources<'_>, distance: &BrickArray<f32>) -> Result<Tagging> {
    let mut far = FarRegions::new(distance.set(), distance.absent(0));
    let level = flood_all(stage, engine, distance, &mut far)?;
    let mut basins = find_basins(stage, engine, distance, &level, &far)?;
    locate_saddles(stage, sources, distance, &level, &mut basins)?;
    basins.sort_by(|a, b| b.depth.total_cmp(&a.depth).then(b.voxels.cmp(&a.voxels)));
    Ok(Tagging { level, basins })
}

/// Connected regions of bricks that are not stored; each floods as one.
struct FarRegions {
    /// The region of each brick; meaningless for stored ones.
    region: Vec<u32>,
    level: Vec<f32>,
    farthest: f32,
    bricks: Vec<Vec<BrickId>>,
}

impl FarRegions {
    fn new(set: &Arc<BrickSet>, farthest: f32) -> Self {
        let grid = set.grid();
        let mut regions =
            Self { region: vec![u32::MAX; grid.len() as usize], level: Vec::new(), farthest, bricks: Vec::new() };
        for seed in 0..grid.len() {
            if set.slot(seed).is_some() || regions.region[seed as usize] != u32::MAX {
                continue;
            }
            let name = regions.bricks.len() as u32;
            let (mut bricks, mut next, mut outside) = (vec![seed], 0, false);
            regions.region[seed as usize] = name;
            while let Some(&id) = bricks.get(next) {
                next += 1;
                for face in FACES {
                    match grid.neighbour(id, face.offset()) {
                        None => outside = true,
                        Some(n) if set.slot(n).is_none() && regions.region[n as usize] == u32::MAX => {
                            regions.region[n as usize] = name;
                            bricks.push(n);
                        }
                        Some(_) => {}
                    }
                }
            }
            regions.bricks.push(bricks);
            regions.level.push(if outside { farthest } else { 0.0 });
        }
        regions
    }

    /// Raises the level of the region that a brick belongs to. Returns the region's bricks and level if it rose.
    fn raise(&mut self, id: BrickId, level: f32) -> Option<(&[BrickId], f32)> {
        let region = self.region[id as usize] as usize;
        let level = level.min(self.farthest);
        if level <= self.level[region] {
            return None;
        }
        self.level[region] = level;
        Some((&self.bricks[region], level))
    }
}

/// Relaxes bricks in rounds until nothing rises: even ones, then odd ones, only those beside a change.
fn flood_all(
    stage: &Stage<'_>,
    engine: &Engine,
    distance: &BrickArray<f32>,
    far: &mut FarRegions,
) -> Result<BrickArray<f32>> {
    let set = distance.set().clone();
    let mut level = BrickArray::with_faces(engine.scratch(), &set)?;
    for (region, bricks) in far.bricks.iter().enumerate() {
        bricks.iter().for_each(|&id| level.set_absent(id, far.level[region]));
    }
    let plan = HaloPlan::new(*set.grid(), Reach::Faces);
    let edge = set.grid().edge() as usize;
    let workers = Workers::new(move || HaloTile::new(edge));
    let mut dirty = vec![true; set.len()];
    let mut rounds = 0;
    while dirty.iter().any(|&d| d) {
        let due = checkerboard(&set, |slot| dirty[slot as usize]);
        for wave in due {
            wave.iter().for_each(|&slot| dirty[slot as usize] = false);
            let risen = stage.run(&wave, &workers, |tile, &slot| {
                plan.gather(&level, slot, Boundary::Constant(f32::INFINITY), tile);
                let rose = distance.read(slot, |d| flood::relax(tile, d));
                if rose {
                    plan.scatter(tile, &level, slot);
                }
                Ok(rose)
            })?;
            for (&slot, _) in wave.iter().zip(&risen).filter(|(_, rose)| **rose) {
                wake_neighbours(&set, slot, &mut level, far, &mut dirty);
            }
        }
        rounds += 1;
    }
    stage.iterated(rounds, 0.0);
    Ok(level)
}

/// Marks the bricks beside a changed one; a far region that rises wakes every brick around it.
fn wake_neighbours(set: &BrickSet, slot: Slot, level: &mut BrickArray<f32>, far: &mut FarRegions, dirty: &mut [bool]) {
    for face in FACES {
        let Some(id) = set.grid().neighbour(set.id(slot), face.offset()) else { continue };
        if let Some(neighbour) = set.slot(id) {
            dirty[neighbour as usize] = true;
            continue;
        }
        let highest = level.read_face(slot, face, |f| f.iter().copied().fold(0.0, f32::max));
        let Some((bricks, raised)) = far.raise(id, highest) else { continue };
        for &far_brick in bricks {
            level.set_absent(far_brick, raised);
            for face in FACES {
                if let Some(woken) = set.grid().neighbour(far_brick, face.offset()).and_then(|n| set.slot(n)) {
                    dirty[woken as usize] = true;
                }
            }
        }
    }
}

/// Labels the basins in each brick, joins the pieces across faces and far regions, keeps those that persist.
fn find_basins(
    stage: &Stage<'_>,
    engine: &Engine,
    distance: &BrickArray<f32>,
    level: &BrickArray<f32>,
    far: &FarRegions,
) -> Result<Vec<Basin>> {
    let set = distance.set();
    let labels: BrickArray<u16> = BrickArray::with_faces(engine.scratch(), set)?;
    let edge = set.grid().edge() as usize;
    let found = stage.run(&one_wave(set), &Workers::none(), |(), &slot| {
        let valid = set.grid().brick_box(set.id(slot)).shape().map(|n| n as usize);
        let pieces =
            distance.read(slot, |d| level.read(slot, |b| labels.write(slot, |l| basins::label(d, b, edge, valid, l))));
        labels.refresh_faces(slot);
        Ok(pieces)
    })?;
    let first: Vec<u32> = found
        .iter()
        .scan(0u32, |next, pieces| {
            let at = *next;
            *next += pieces.len() as u32;
            Some(at)
        })
        .collect();
    let mut pieces: Vec<Piece> = found.into_iter().flatten().collect();
    let far_first = pieces.len() as u32;
    let brick_len = set.grid().brick_len() as u64;
    pieces.extend(far.bricks.iter().zip(&far.level).map(|(bricks, &saddle)| Piece {
        // A far region at the flood's own level is exterior: depth 0 keeps it out.
        voxels: bricks.len() as u64 * brick_len,
        depth: if saddle < far.farthest { far.farthest } else { 0.0 },
        saddle,
    }));
    let mut join = DisjointSets::new(pieces.len());
    for slot in 0..set.len() as Slot {
        for face in FACES.into_iter().filter(|f| f.upper) {
            let Some(id) = set.grid().neighbour(set.id(slot), face.offset()) else { continue };
            let here = |l: u16| first[slot as usize] + u32::from(l) - 1;
            labels.read_face(slot, face, |mine| match set.slot(id) {
                Some(other) => labels.read_face(other, face.opposite(), |theirs| {
                    for (&a, &b) in mine.iter().zip(theirs).filter(|(a, b)| **a != 0 && **b != 0) {
                        join.union(here(a), first[other as usize] + u32::from(b) - 1);
                    }
                }),
                None => join_far(mine, here, far, far_first, id, &mut join),
            });
        }
        for face in FACES.into_iter().filter(|f| !f.upper) {
            let beside = set.grid().neighbour(set.id(slot), face.offset()).filter(|&id| set.slot(id).is_none());
            if let Some(id) = beside {
                let here = |l: u16| first[slot as usize] + u32::from(l) - 1;
                labels.read_face(slot, face, |mine| join_far(mine, here, far, far_first, id, &mut join));
            }
        }
    }
    Ok(persisting(&pieces, &mut join))
}

/// Joins the labelled voxels of a face with the far region beyond it, where that is a basin.
fn join_far(
    mine: &[u16],
    here: impl Fn(u16) -> u32,
    far: &FarRegions,
    far_first: u32,
    id: BrickId,
    join: &mut DisjointSets,
) {
    let region = far.region[id as usize];
    if far.level[region as usize] < far.farthest {
        mine.iter().filter(|l| **l != 0).for_each(|&l| join.union(here(l), far_first + region));
    }
}

/// Adds up the joined pieces and keeps the basins that persist.
fn persisting(pieces: &[Piece], join: &mut DisjointSets) -> Vec<Basin> {
    let mut whole: Vec<Piece> = pieces.to_vec();
    for n in 0..pieces.len() as u32 {
        let root = join.find(n);
        if root != n {
            let piece = pieces[n as usize];
            let sum = &mut whole[root as usize];
            sum.voxels += piece.voxels;
            sum.depth = sum.depth.max(piece.depth);
        }
    }
    (0..pieces.len() as u32)
        .filter(|&n| join.find(n) == n)
        .map(|n| whole[n as usize])
        .filter(|p| p.depth > 0.0 && p.depth >= PERSISTENCE * p.saddle)
        .map(|p| Basin { voxels: p.voxels, depth: p.depth, saddle: p.saddle, place: [0; 3] })
        .collect()
}

/// Finds the first voxel in grid order that has the saddle's value both in d and in b: where the flood enters.
fn locate_saddles(
    stage: &Stage<'_>,
    sources: &Sources<'_>,
    distance: &BrickArray<f32>,
    level: &BrickArray<f32>,
    basins: &mut [Basin],
) -> Result<()> {
    let set = distance.set();
    let wanted: Vec<f32> = basins.iter().map(|b| b.saddle).collect();
    let edge = set.grid().edge();
    let found = stage.run(&one_wave(set), &Workers::none(), |(), &slot| {
        let part = set.grid().brick_box(set.id(slot));
        let mut places = vec![None; wanted.len()];
        distance.read(slot, |d| {
            level.read(slot, |b| {
                for (y, z) in part.rows() {
                    let row = (((z - part.lo[2]) * edge + y - part.lo[1]) * edge) as usize;
                    for x in 0..(part.hi[0] - part.lo[0]) {
                        let at = row + x as usize;
                        if d[at] == b[at] {
                            for (n, _) in wanted.iter().enumerate().filter(|(_, w)| **w == d[at]) {
                                places[n].get_or_insert([part.lo[0] + x, y, z]);
                            }
                        }
                    }
                }
            });
        });
        Ok(places)
    })?;
    let order = |v: &[i64; 3]| sources.geometry.domain().offset_of(*v);
    for (n, basin) in basins.iter_mut().enumerate() {
        if let Some(place) = found.iter().filter_map(|places| places[n]).min_by_key(order) {
            basin.place = place;
        }
    }
    Ok(())
}

/// Disjoint sets with path halving.
struct DisjointSets(Vec<u32>);

impl DisjointSets {
    fn new(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    fn find(&mut self, mut n: u32) -> u32 {
        while self.0[n as usize] != n {
            let parent = self.0[self.0[n as usize] as usize];
            self.0[n as usize] = parent;
            n = parent;
        }
        n
    }

    /// The smaller name becomes the set's, so that names do not depend on the order of unions.
    fn union(&mut self, a: u32, b: u32) {
        let (a, b) = (self.find(a), self.find(b));
        let (low, high) = (a.min(b), a.max(b));
        self.0[high as usize] = low;
    }
}
