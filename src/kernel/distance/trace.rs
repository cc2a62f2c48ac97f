//! Sources for a finished FMM field, tile by tile (Kósa & Mikula 2023, Alg. 8; algorithms: section 4).
//!
//! Alg. 8 gives a voxel, when it freezes, the source of the frozen one of its 26 neighbours with the smallest sum of its
//! distance and the way to it. Voxels freeze in order of distance, of equal ones in order of their places, so which
//! neighbour that is follows from the finished distances alone: a voxel has a *parent*, and its source is the one of
//! the fixed voxel at the end of the chain. Here chains are followed inside a tile, to voxels and ghosts whose source is
//! known. In: grown tiles of distances (sign bit on fixed voxels) and of source states. Out: the states. Halo 1, all
//! 26 directions. Scratch: one byte a voxel. What is found does not depend on the order in which tiles come.

use super::initialise::NO_SOURCE;
use super::precision::{Precision, Real};
use super::tracked::{has_source, source_of};
use crate::grid::{Geometry, NEIGHBOURS_26};
use crate::tile::HaloTile;

/// Finds sources in tiles of one size.
#[derive(Clone, Debug)]
pub struct Tracer {
    /// Steps to the 26 neighbours in the buffer, and their lengths.
    steps: Vec<(isize, f64)>,
    /// Whether a voxel's chain was followed in this tile.
    followed: Vec<bool>,
    chain: Vec<usize>,
}

impl Tracer {
    /// For tiles of `edge`^3 voxels of a grid.
    #[must_use]
    pub fn new(geometry: &Geometry, edge: usize) -> Self {
        let pitch = edge as isize + 2;
        let step = |[x, y, z]: [i64; 3]| (z as isize * pitch + y as isize) * pitch + x as isize;
        let steps = NEIGHBOURS_26.iter().map(|&offset| (step(offset), geometry.length(offset))).collect();
        Self { steps, followed: vec![false; (edge + 2).pow(3)], chain: Vec::new() }
    }

    /// Gives voxels their sources where the chain ends at a known one. Returns whether any got one, and whether any that
    /// has a distance is left without.
    pub fn trace<P: Precision>(&mut self, distance: &HaloTile<P>, state: &mut HaloTile<u32>) -> (bool, bool) {
        let ([nx, ny, nz], pitch) = (distance.valid(), distance.pitch());
        // Chains end at ghosts.
        self.followed.fill(true);
        for z in 1..=nz {
            for y in 1..=ny {
                self.followed[(z * pitch + y) * pitch + 1..][..nx].fill(false);
            }
        }
        let (mut found, mut left) = (false, false);
        for z in 1..=nz {
            for y in 1..=ny {
                for x in 1..=nx {
                    let place = (z * pitch + y) * pitch + x;
                    if distance.data()[place].lane() < P::Lane::INFINITY && !has_source(state.data()[place]) {
                        let known = self.follow(distance.data(), state.data_mut(), place);
                        found |= known;
                        left |= !known;
                    }
                }
            }
        }
        (found, left)
    }

    /// Follows the chain from a voxel; all voxels on it get the source at its end, if that is known.
    fn follow<P: Precision>(&mut self, distance: &[P], state: &mut [u32], from: usize) -> bool {
        self.chain.clear();
        let mut at = from;
        while !has_source(state[at]) && !self.followed[at] {
            self.followed[at] = true;
            self.chain.push(at);
            let Some(parent) = self.parent(distance, at) else { break };
            at = parent;
        }
        let source = source_of(state[at]);
        self.chain.iter().for_each(|&place| state[place] = source);
        source != NO_SOURCE
    }

    /// The neighbour that a voxel takes its source from.
    fn parent<P: Precision>(&self, distance: &[P], place: usize) -> Option<usize> {
        let here = distance[place].lane();
        let mut best = (f64::INFINITY, None);
        for (n, &(step, length)) in self.steps.iter().enumerate() {
            let beside = place.wrapping_add_signed(step);
            let value = distance[beside].lane().magnitude();
            // Of equal distances the lower place freezes first: those are the first 13 steps.
            if value < here || (value == here && n < 13) {
                let way = value.f64() + length;
                if way < best.0 {
                    best = (way, Some(beside));
                }
            }
        }
        best.1
    }
}
