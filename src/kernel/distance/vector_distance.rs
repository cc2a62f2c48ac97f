//! VDT, the vector distance transform (Danielsson 1980; Kósa & Mikula 2023, Alg. 3; algorithms: section 3).
//!
//! Each voxel carries the index of its nearest known source. In the eight ordered passes it looks at the sources of
//! its six face neighbours and keeps the one nearest by exact Euclidean distance; the distance follows from the
//! source. Of equal distances the one already kept stays. In and out: a grown tile of source indices, the top bit
//! set on voxels that a source fixed. Halo 1, faces. Tiles in sweep order give the bits of the triple loop.

use super::initialise::{NO_SOURCE, squared_distance};
use super::ordered;
use crate::grid::{Box3, Geometry};
use crate::tile::HaloTile;

/// Set on the source index of a fixed voxel.
pub const FIXED: u32 = 1 << 31;

/// The source index without its flag.
#[inline]
#[must_use]
pub fn source_of(state: u32) -> u32 {
    state & !FIXED
}

/// One ordered pass over the tile's valid voxels, whose lowest lies at `part.lo`. Returns whether any source changed.
pub fn sweep(
    tile: &mut HaloTile<u32>,
    geometry: &Geometry,
    part: &Box3,
    positions: &[[f64; 3]],
    upward: [bool; 3],
) -> bool {
    let pitch = tile.pitch();
    let strides = [1, pitch, pitch * pitch];
    let valid = tile.valid();
    let mut changed = false;
    for z in ordered(valid[2], upward[2]) {
        for y in ordered(valid[1], upward[1]) {
            let row = tile.at(0, y, z);
            for x in ordered(valid[0], upward[0]) {
                let at = row + x as usize;
                if tile.data()[at] & FIXED != 0 {
                    continue;
                }
                let voxel = [part.lo[0] + x as i64, part.lo[1] + y as i64, part.lo[2] + z as i64];
                let nearest = nearest_of_neighbours(tile.data(), at, strides, geometry.position(voxel), positions);
                if nearest != tile.data()[at] {
                    tile.data_mut()[at] = nearest;
                    changed = true;
                }
            }
        }
    }
    changed
}

/// The nearest among the kept source and those of the six face neighbours.
#[inline]
fn nearest_of_neighbours(state: &[u32], at: usize, strides: [usize; 3], here: [f64; 3], positions: &[[f64; 3]]) -> u32 {
    let mut best = state[at];
    let mut smallest = None;
    for neighbour in strides.iter().flat_map(|&s| [at - s, at + s]) {
        let candidate = source_of(state[neighbour]);
        if candidate == NO_SOURCE || candidate == best {
            continue;
        }
        let kept = *smallest.get_or_insert_with(|| distance_to(best, here, positions));
        let distance = distance_to(candidate, here, positions);
        if distance < kept {
            (best, smallest) = (candidate, Some(distance));
        }
    }
    best
}

#[inline]
fn distance_to(source: u32, here: [f64; 3], positions: &[[f64; 3]]) -> f64 {
    if source == NO_SOURCE { f64::INFINITY } else { squared_distance(here, positions[source as usize]) }
}
