//! What a kernel takes for one tile, stated by the kernel: what estimates are made of.

/// The halo that a kernel reads and the scratch that it works in, for bricks of one edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TileCost {
    /// Ghost voxels to each side.
    pub halo: usize,
    /// Bytes of the buffers of one thread, beside the tile itself.
    pub scratch: u64,
}

impl TileCost {
    /// Of a kernel with a halo of 1 and so many bytes of scratch for each voxel of the grown tile.
    #[must_use]
    pub const fn grown(edge: usize, voxel_bytes: u64) -> Self {
        Self { halo: 1, scratch: cube(edge + 2).saturating_mul(voxel_bytes) }
    }

    /// Bytes of one thread with its tile, of values of type `T`.
    #[must_use]
    pub const fn bytes<T>(self, edge: usize) -> u64 {
        cube(edge + 2 * self.halo).saturating_mul(size_of::<T>() as u64).saturating_add(self.scratch)
    }

    /// What two kernels take of which a thread runs one or the other.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        Self { halo: self.halo.max(other.halo), scratch: self.scratch.max(other.scratch) }
    }
}

const fn cube(edge: usize) -> u64 {
    (edge as u64).saturating_mul(edge as u64).saturating_mul(edge as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tile_counts_its_halo() {
        assert_eq!(TileCost { halo: 2, scratch: 100 }.bytes::<f32>(16), 20 * 20 * 20 * 4 + 100);
        let scratch = 18 * 18 * 18 * 5;
        assert_eq!(TileCost::grown(16, 5), TileCost { halo: 1, scratch });
        assert_eq!(TileCost::grown(16, 5).or(TileCost { halo: 2, scratch: 7 }), TileCost { halo: 2, scratch });
        assert_eq!(TileCost::grown(usize::MAX / 2, 5).bytes::<f32>(16), u64::MAX);
    }
}
