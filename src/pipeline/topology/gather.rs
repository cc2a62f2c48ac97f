//! The two sides of a solved band, block by block near the surface, room by room beyond.

use crate::error::Result;
use crate::exec::{Stage, Workers};
use crate::grid::{Box3, BrickGrid, BrickId, Geometry};
use crate::kernel::topology::blocks::{Beside, Blocks, EDGE, LEN};
use crate::kernel::topology::neighbourhood::offset;
use crate::kernel::topology::sides::Tile;
use crate::kernel::topology::union_find::Forest;
use crate::pipeline::surface::read_padded;
use crate::store::{BoxSource, BrickArray};

/// Bricks that are read in parallel before their states are joined.
const BATCH: usize = 256;
/// The surface.
const HALF: f32 = 0.5;

/// Blocks and the bricks that they are, in order.
pub(super) struct Gathered {
    pub(super) blocks: Blocks,
    pub(super) bricks: Vec<BrickId>,
}

impl Gathered {
    /// The place of the voxel nearest to each point, in order; points far from the surface have none.
    pub(super) fn places(&self, grid: &BrickGrid, geometry: &Geometry, points: &[[f64; 3]]) -> Vec<usize> {
        let place = |point: &[f64; 3]| {
            let voxel = geometry.to_voxels(*point).map(|v| v.round() as i64);
            let id = grid.brick_of(voxel)?;
            let block = self.bricks.binary_search(&id).ok()?;
            let [x, y, z] = [0, 1, 2].map(|a| (voxel[a] - grid.brick_box(id).lo[a]) as usize);
            Some(block * LEN + (z * EDGE + y) * EDGE + x)
        };
        let mut places: Vec<usize> = points.iter().filter_map(place).collect();
        places.sort_unstable();
        places
    }
}

/// Bricks that may hold a voxel with the surface within so many voxels of it.
pub(super) fn near_surface(u: &BrickArray<f32>, geometry: &Geometry, halo: [usize; 3]) -> Vec<BrickId> {
    let grid = *u.set().grid();
    let halo = halo.into_iter().max().unwrap_or(0) as i64;
    let is_near = |id: &BrickId| {
        let part = grid.brick_box(*id).grow(halo).intersect(&geometry.domain());
        u.constant_in(&part).is_none()
    };
    (0..grid.len()).filter(is_near).collect()
}

/// The sides of all voxels.
///
/// # Errors
/// When the run is interrupted.
pub(super) fn gather(
    stage: &Stage<'_>,
    u: &BrickArray<f32>,
    (halo, spacing): ([usize; 3], [f64; 3]),
    near: &[BrickId],
) -> Result<Gathered> {
    let grid = *u.set().grid();
    let workers = Workers::new(move || (Tile::new(halo, spacing), Vec::new()));
    let (mut bricks, mut states) = (Vec::new(), Vec::new());
    for batch in near.chunks(BATCH) {
        let found = stage.run(batch, &workers, |(tile, values), &id| {
            let lo = grid.brick_box(id).lo;
            let halo = tile.halo().map(|halo| halo as i64);
            let part = Box3::new(
                std::array::from_fn(|a| lo[a] - halo[a]),
                std::array::from_fn(|a| lo[a] + grid.edge() + halo[a]),
            );
            read_padded(u, &part, values)?;
            let mut states = vec![0; LEN];
            Ok(tile.states(values, HALF, &mut states).then_some(states))
        })?;
        for (&id, of_brick) in batch.iter().zip(found) {
            if let Some(of_brick) = of_brick {
                bricks.push(id);
                states.extend(of_brick);
            }
        }
    }
    let (around, rooms) = surroundings(u, &grid, &bricks);
    let origins = bricks.iter().map(|&id| grid.brick_box(id).lo).collect();
    let is_whole = |id: BrickId| grid.brick_box(id).len() == LEN;
    let fixed = bricks.iter().map(|&id| u.set().slot(id).is_none() || !is_whole(id)).collect();
    Ok(Gathered { blocks: Blocks { states, around, rooms, origins, fixed }, bricks })
}

/// What lies around each block, and the sides of the rooms: bricks without surface, joined where they touch, and all that is beyond the grid,
/// which is outside.
fn surroundings(u: &BrickArray<f32>, grid: &BrickGrid, bricks: &[BrickId]) -> (Vec<[Beside; 27]>, Vec<bool>) {
    const ABSENT: u32 = u32::MAX;
    let count = grid.len() as usize;
    let mut block_of = vec![ABSENT; count];
    bricks.iter().zip(0..).for_each(|(&id, block)| block_of[id as usize] = block);
    let side = |id: BrickId| u.set().slot(id).map_or_else(|| u.absent(id), |slot| u.read(slot, |u| u[0])) >= HALF;
    let beyond = count as u32;
    let mut forest = Forest::of_singles(count + 1);
    for id in (0..grid.len()).filter(|&id| block_of[id as usize] == ABSENT) {
        for axis in 0..3 {
            for by in [-1, 1] {
                let mut offset = [0; 3];
                offset[axis] = by;
                match grid.neighbour(id, offset) {
                    Some(other) if block_of[other as usize] == ABSENT => forest.join(id as u32, other as u32),
                    None if !side(id) => forest.join(id as u32, beyond),
                    _ => false,
                };
            }
        }
    }
    // Rooms are numbered as they are met.
    let (mut number_of, mut rooms) = (std::collections::HashMap::new(), Vec::new());
    let mut room = |brick: u32| {
        let root = forest.root(brick);
        *number_of.entry(root).or_insert_with(|| {
            rooms.push(brick != beyond && side(BrickId::from(brick)));
            rooms.len() as u32 - 1
        })
    };
    let mut beside = |id: BrickId, by: [i64; 3]| match grid.neighbour(id, by) {
        Some(other) if block_of[other as usize] != ABSENT => Beside::Block(block_of[other as usize]),
        Some(other) => Beside::Room(room(other as u32)),
        None => Beside::Room(room(beyond)),
    };
    let around = bricks.iter().map(|&id| std::array::from_fn(|bit| beside(id, offset(bit)))).collect();
    (around, rooms)
}
