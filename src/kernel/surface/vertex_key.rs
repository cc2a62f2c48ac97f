//! Numbers for the vertices of meshes: the same for every brick, so that patches know their common vertices.
//!
//! A vertex lies on an edge between two voxel centres, in a triangle of three or in a tetrahedron of four. These come
//! from cutting each cell into six tetrahedra along its diagonal (Freudenthal 1942, Kuhn 1960): their voxels form a
//! chain, each one step further along some axes, no axis twice.

/// The number of a vertex.
pub type VertexKey = u64;

/// Bits for the steps of a chain, three for each.
const STEP_BITS: u32 = 9;

/// Numbers the vertices of a domain, including those between it and the layer of voxels around it.
///
/// The key holds the steps of the chain below the place of its first voxel, the place counted z slowest in the domain
/// grown by one voxel: a surface closed at the domain's border has vertices on edges that start at index -1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VertexKeys {
    /// Voxels along x and y of the grown domain.
    row: [u64; 2],
}

impl VertexKeys {
    /// The numbering for a domain of `shape` voxels, `[x, y, z]`.
    #[must_use]
    pub fn new(shape: [i64; 3]) -> Self {
        Self { row: [(shape[0] + 2) as u64, (shape[1] + 2) as u64] }
    }

    /// The key of the vertex on the edge from `lower` to the next voxel along `axis` (0, 1, 2 for x, y, z).
    #[inline]
    #[must_use]
    pub fn on_edge(&self, lower: [i64; 3], axis: usize) -> VertexKey {
        self.within(lower, [1 << axis, 0, 0])
    }

    /// The key of the vertex within a chain of voxels: the first one, and the axes of each step as bits, 0 for no step.
    #[inline]
    #[must_use]
    pub fn within(&self, first: [i64; 3], steps: [u8; 3]) -> VertexKey {
        let [x, y, z] = first.map(|v| (v + 1) as u64);
        let steps = steps.iter().rev().fold(0, |code, &step| code << 3 | u64::from(step));
        ((z * self.row[1] + y) * self.row[0] + x) << STEP_BITS | steps
    }

    /// The z index of the chain's first voxel.
    #[must_use]
    pub fn plane(&self, key: VertexKey) -> i64 {
        ((key >> STEP_BITS) / self.row[0] / self.row[1]) as i64 - 1
    }

    /// The chain's first voxel, and whether its voxels differ along each axis.
    #[must_use]
    pub fn extent(&self, key: VertexKey) -> ([i64; 3], [bool; 3]) {
        let place = key >> STEP_BITS;
        let first = [place % self.row[0], place / self.row[0] % self.row[1], place / self.row[0] / self.row[1]];
        let axes = key | key >> 3 | key >> 6;
        (first.map(|v| v as i64 - 1), std::array::from_fn(|a| axes >> a & 1 == 1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn keys_are_unique_and_tell_their_edge() {
        let keys = VertexKeys::new([4, 2, 3]);
        let mut seen = HashSet::new();
        for (z, y, x, axis) in (0..5 * 4 * 6 * 3).map(|n| (n / 72 - 1, n / 18 % 4 - 1, n / 3 % 6 - 1, n % 3)) {
            let key = keys.on_edge([x, y, z], axis as usize);
            assert!(seen.insert(key));
            assert_eq!(keys.extent(key), ([x, y, z], std::array::from_fn(|a| a == axis as usize)));
            assert_eq!(keys.plane(key), z);
        }
    }

    #[test]
    fn chains_of_one_voxel_have_keys_of_their_own() {
        let keys = VertexKeys::new([4; 3]);
        let chains = [[1, 0, 0], [3, 0, 0], [1, 2, 0], [2, 1, 0], [1, 2, 4], [4, 3, 0], [7, 0, 0]];
        let numbers: HashSet<VertexKey> = chains.iter().map(|&steps| keys.within([1, 2, 3], steps)).collect();
        assert_eq!(numbers.len(), chains.len());
        assert_eq!(keys.extent(keys.within([1, 2, 3], [4, 1, 0])), ([1, 2, 3], [true, false, true]));
    }

    #[test]
    fn keys_pass_32_bits() {
        let keys = VertexKeys::new([4096; 3]);
        assert_eq!(keys.extent(keys.on_edge([4095, 4095, 4095], 2)), ([4095; 3], [false, false, true]));
    }
}
