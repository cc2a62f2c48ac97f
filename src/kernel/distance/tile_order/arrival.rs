//! What a tile tells the bricks beside it once it is settled: the smallest value that may lower one of their voxels, by
//! which the front schedule orders bricks (docs/algorithms.md, "The front schedule").
//!
//! In: a grown tile of states, halo 1, faces or all 26 directions; what those beside were told of a face before. Out: a
//! distance, physical units, or nothing. Faces only are read.

use crate::grid::{Box3, Face};
use crate::kernel::distance::state::method::DistanceState;
use crate::tile::HaloTile;

/// The smallest value that enters the brick across `face`, among voxels that changed since it read its `ghosts`.
#[must_use]
pub fn outgoing<M: DistanceState>(
    method: &M,
    tile: &HaloTile<M::State>,
    part: &Box3,
    face: Face,
    ghosts: Option<&[M::State]>,
) -> Option<f64> {
    let valid = tile.valid();
    let [u, v] = [[1, 2], [0, 2], [0, 1]][face.axis];
    let stride = if u == 0 { 1 } else { tile.pitch() };
    let mut inside = [0; 3];
    inside[face.axis] = if face.upper { valid[face.axis] as isize - 1 } else { 0 };
    let mut least = f64::INFINITY;
    for j in 0..valid[v] {
        inside[v] = j as isize;
        let mut ghost = inside;
        ghost[face.axis] += if face.upper { 1 } else { -1 };
        let line = |[x, y, z]: [isize; 3]| tile.data()[tile.at(x, y, z)..].iter().step_by(stride).take(valid[u]);
        let mut voxel: [i64; 3] = std::array::from_fn(|a| part.lo[a] + ghost[a] as i64);
        let mut enter = |here: M::State, beside: M::State, ghosts: M::State| {
            if here != ghosts {
                least = method.entering(here, beside, voxel).map_or(least, |value| least.min(value));
            }
            voxel[u] += 1;
        };
        let pairs = line(inside).zip(line(ghost));
        match ghosts {
            Some(ghosts) => {
                let ghosts = &ghosts[j * tile.edge()..][..valid[u]];
                pairs.zip(ghosts).for_each(|((&here, &beside), &ghosts)| enter(here, beside, ghosts));
            }
            None => pairs.for_each(|(&here, &beside)| enter(here, beside, M::UNKNOWN)),
        }
    }
    least.is_finite().then_some(least)
}

/// The smallest value that enters the ghosts in a direction from any of their 26 neighbours in the tile.
#[must_use]
pub fn outgoing_anywhere<M: DistanceState>(
    method: &M,
    tile: &HaloTile<M::State>,
    part: &Box3,
    offset: [i64; 3],
) -> Option<f64> {
    let shape = part.shape();
    let inside = Box3::from_shape(shape);
    let ghosts = inside.translate(std::array::from_fn(|a| offset[a] * shape[a])).intersect(&inside.grow(1));
    let at = |[x, y, z]: [i64; 3]| tile.data()[tile.at(x as isize, y as isize, z as isize)];
    let mut least = f64::INFINITY;
    for (z, y, x) in ghosts.rows().flat_map(|(y, z)| (ghosts.lo[0]..ghosts.hi[0]).map(move |x| (z, y, x))) {
        let (ghost, state) = ([x, y, z], at([x, y, z]));
        let beside = Box3::new(ghost, ghost.map(|v| v + 1)).grow(1).intersect(&inside);
        for (j, k) in beside.rows() {
            for i in beside.lo[0]..beside.hi[0] {
                let voxel = std::array::from_fn(|a| part.lo[a] + ghost[a]);
                if let Some(value) = method.entering(at([i, j, k]), state, voxel) {
                    least = least.min(value);
                }
            }
        }
    }
    least.is_finite().then_some(least)
}
