//! Numbers for the edges of the voxel grid: the same for every brick, so that patches know their common vertices.

/// The number of a grid edge: between a voxel centre and the next one along an axis.
pub type EdgeKey = u64;

/// Numbers the grid edges of a domain, including those to the layer of voxels around it.
///
/// The key is `3 * (place of the lower voxel) + axis`, the place counted z slowest in the domain grown by one
/// voxel: a surface closed at the domain's border has vertices on edges that start at index -1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EdgeKeys {
    /// Voxels along x and y of the grown domain.
    row: [u64; 2],
}

impl EdgeKeys {
    /// The numbering for a domain of `shape` voxels, `[x, y, z]`.
    #[must_use]
    pub fn new(shape: [i64; 3]) -> Self {
        Self { row: [(shape[0] + 2) as u64, (shape[1] + 2) as u64] }
    }

    /// The key of the edge from `lower` to the next voxel along `axis` (0, 1, 2 for x, y, z).
    #[inline]
    #[must_use]
    pub fn key(&self, lower: [i64; 3], axis: usize) -> EdgeKey {
        let [x, y, z] = lower.map(|v| (v + 1) as u64);
        ((z * self.row[1] + y) * self.row[0] + x) * 3 + axis as u64
    }

    /// The z index of the edge's lower voxel.
    #[must_use]
    pub fn plane(&self, key: EdgeKey) -> i64 {
        (key / 3 / self.row[0] / self.row[1]) as i64 - 1
    }

    /// The edge's lower voxel and its axis.
    #[must_use]
    pub fn edge(&self, key: EdgeKey) -> ([i64; 3], usize) {
        let place = key / 3;
        let lower = [place % self.row[0], place / self.row[0] % self.row[1], place / self.row[0] / self.row[1]];
        (lower.map(|v| v as i64 - 1), (key % 3) as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn keys_are_unique_and_tell_their_edge() {
        let keys = EdgeKeys::new([4, 2, 3]);
        let mut seen = HashSet::new();
        for (z, y, x, axis) in (0..5 * 4 * 6 * 3).map(|n| (n / 72 - 1, n / 18 % 4 - 1, n / 3 % 6 - 1, n % 3)) {
            let key = keys.key([x, y, z], axis as usize);
            assert!(seen.insert(key));
            assert_eq!(keys.edge(key), ([x, y, z], axis as usize));
            assert_eq!(keys.plane(key), z);
        }
    }

    #[test]
    fn keys_pass_32_bits() {
        let keys = EdgeKeys::new([4096; 3]);
        assert_eq!(keys.edge(keys.key([4095, 4095, 4095], 2)), ([4095; 3], 2));
    }
}
