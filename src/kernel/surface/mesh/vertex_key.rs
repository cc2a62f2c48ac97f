//! Names for the vertices of meshes: the same for every brick, so that patches know their common vertices.
//!
//! A vertex lies on an edge between two corners, in a triangle of three or in a tetrahedron of four. Corners are voxel
//! centres, and places on the edges between these; a vertex is named by its corners, in halves of voxels, where a corner
//! on an edge counts as the edge's middle. A cell is cut such that no two of its edges have one middle.

use serde::{Deserialize, Serialize};

/// How far, in halves of voxels, corners of one cell are apart at most.
const REACH: i64 = 2;
/// Offsets along one axis.
const OFFSETS: i64 = 2 * REACH + 1;
/// Bits for the offset of a corner from the first one; 0 for none.
const STEP_BITS: u32 = 7;

/// The name of a vertex, for domains of up to 2^30 voxels along an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct VertexKey {
    /// The first corner, `[z, y, x]` in halves of voxels.
    first: [i32; 3],
    /// The other corners as seen from there.
    steps: u32,
}

impl VertexKey {
    /// The vertex on the edge from the voxel `lower` to the next one along `axis` (0, 1, 2 for x, y, z).
    #[inline]
    #[must_use]
    pub fn on_edge(lower: [i64; 3], axis: usize) -> Self {
        let lower = lower.map(|v| 2 * v);
        let mut upper = lower;
        upper[axis] += 2;
        Self::within(&[lower, upper])
    }

    /// The vertex within two to four corners of a cell, each `[x, y, z]` in halves of voxels, in order: z slowest.
    #[inline]
    #[must_use]
    pub fn within(corners: &[[i64; 3]]) -> Self {
        let first = corners[0];
        let step = |corner: &[i64; 3]| {
            (0..3).rev().fold(0, |code, a| code * OFFSETS + corner[a] - first[a] + REACH) as u32 + 1
        };
        let steps = corners[1..].iter().rev().fold(0, |code, corner| code << STEP_BITS | step(corner));
        Self { first: [first[2], first[1], first[0]].map(|v| v as i32), steps }
    }

    /// The z index of the layer of cells in which the first corner lies, or at whose lower side.
    #[must_use]
    pub fn layer(&self) -> i64 {
        i64::from(self.first[0]).div_euclid(2)
    }

    /// Whether all corners lie in the plane of voxels with this index along an axis.
    #[must_use]
    pub fn lies_in(&self, axis: usize, index: i64) -> bool {
        let offset = |code: u32| (i64::from(code) - 1) / OFFSETS.pow(axis as u32) % OFFSETS - REACH;
        let codes = (0..3).map(|n| self.steps >> (n * STEP_BITS) & ((1 << STEP_BITS) - 1)).filter(|code| *code > 0);
        i64::from(self.first[2 - axis]) == 2 * index && codes.map(offset).all(|offset| offset == 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn keys_are_unique_and_tell_their_planes() {
        let mut seen = HashSet::new();
        for (z, y, x, axis) in (0..5 * 4 * 6 * 3).map(|n| (n / 72 - 1, n / 18 % 4 - 1, n / 3 % 6 - 1, n % 3)) {
            let key = VertexKey::on_edge([x, y, z], axis as usize);
            assert!(seen.insert(key));
            for (a, index) in [x, y, z].into_iter().enumerate() {
                assert_eq!(key.lies_in(a, index), a != axis as usize);
                assert!(!key.lies_in(a, index + 1));
            }
            assert_eq!(key.layer(), z);
        }
    }

    #[test]
    fn sets_of_corners_have_keys_of_their_own() {
        let first = [2, 4, 6];
        let sets: [&[[i64; 3]]; 6] = [
            &[first, [3, 5, 6]],
            &[first, [4, 6, 6]],
            &[first, [3, 5, 6], [4, 6, 6]],
            &[first, [0, 5, 6], [4, 6, 6]],
            &[first, [0, 6, 6], [3, 5, 6], [4, 6, 6]],
            &[[0, 5, 6], [4, 6, 6]],
        ];
        let keys: HashSet<VertexKey> = sets.iter().map(|corners| VertexKey::within(corners)).collect();
        assert_eq!(keys.len(), sets.len());
        assert!(keys.iter().all(|key| key.lies_in(2, 3) && key.layer() == 3));
        assert!(!VertexKey::within(&[[3, 5, 7], [4, 6, 8]]).lies_in(0, 1));
    }

    #[test]
    fn halves_below_0_belong_to_the_layer_below() {
        assert_eq!(VertexKey::within(&[[-1, -1, -1], [0, 0, 0]]).layer(), -1);
        assert_eq!(VertexKey::on_edge([4095; 3], 2).layer(), 4095);
    }
}
