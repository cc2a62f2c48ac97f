//! `Box3`: a half-open box of voxel indices. Knows nothing of spacing or data.

use serde::{Deserialize, Serialize};

/// A half-open box of voxels, `lo <= index < hi`, triples in `[x, y, z]` order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Box3 {
    /// The first voxel.
    pub lo: [i64; 3],
    /// One past the last voxel.
    pub hi: [i64; 3],
}

impl Box3 {
    /// The box from `lo` up to, not including, `hi`.
    #[must_use]
    pub const fn new(lo: [i64; 3], hi: [i64; 3]) -> Self {
        Self { lo, hi }
    }

    /// The box of the given shape that starts at the origin.
    #[must_use]
    pub const fn from_shape(shape: [i64; 3]) -> Self {
        Self { lo: [0; 3], hi: shape }
    }

    /// Voxels along each axis; never negative.
    #[must_use]
    pub fn shape(&self) -> [i64; 3] {
        std::array::from_fn(|a| (self.hi[a] - self.lo[a]).max(0))
    }

    /// Number of voxels.
    #[must_use]
    pub fn volume(&self) -> u64 {
        self.shape().iter().map(|&n| n.unsigned_abs()).product()
    }

    /// Number of voxels, as the length of an array in memory.
    #[must_use]
    pub fn len(&self) -> usize {
        self.shape().iter().map(|&n| n as usize).product()
    }

    /// True when the box holds no voxel.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        (0..3).any(|a| self.hi[a] <= self.lo[a])
    }

    /// True when `voxel` lies in the box.
    #[must_use]
    pub fn contains(&self, voxel: [i64; 3]) -> bool {
        (0..3).all(|a| self.lo[a] <= voxel[a] && voxel[a] < self.hi[a])
    }

    /// The voxels that both boxes hold.
    #[must_use]
    pub fn intersect(&self, other: &Self) -> Self {
        Self {
            lo: std::array::from_fn(|a| self.lo[a].max(other.lo[a])),
            hi: std::array::from_fn(|a| self.hi[a].min(other.hi[a])),
        }
    }

    /// The box grown by `layers` voxels on every side.
    #[must_use]
    pub fn grow(&self, layers: i64) -> Self {
        Self { lo: self.lo.map(|v| v - layers), hi: self.hi.map(|v| v + layers) }
    }

    /// The box moved by `offset`.
    #[must_use]
    pub fn translate(&self, offset: [i64; 3]) -> Self {
        Self {
            lo: std::array::from_fn(|a| self.lo[a] + offset[a]),
            hi: std::array::from_fn(|a| self.hi[a] + offset[a]),
        }
    }

    /// The rows of the box as `(y, z)`, z slowest: the order in which arrays lie.
    pub fn rows(self) -> impl Iterator<Item = (i64, i64)> {
        (self.lo[2]..self.hi[2]).flat_map(move |z| (self.lo[1]..self.hi[1]).map(move |y| (y, z)))
    }

    /// The boxes of a shape, laid from voxel (0, 0, 0) on, that hold voxels of this one, cut to it, x fastest.
    pub fn tiles(self, edge: [i64; 3]) -> impl Iterator<Item = Self> {
        let first = |a: usize| self.lo[a].div_euclid(edge[a]);
        let end = |a: usize| (self.hi[a] - 1).div_euclid(edge[a]) + 1;
        let places = Self::new([first(0), first(1), first(2)], [end(0), end(1), end(2)]);
        let cut = move |place: [i64; 3]| {
            let lo: [i64; 3] = std::array::from_fn(|a| place[a] * edge[a]);
            Self::new(lo, std::array::from_fn(|a| lo[a] + edge[a])).intersect(&self)
        };
        places.rows().flat_map(move |(y, z)| (places.lo[0]..places.hi[0]).map(move |x| cut([x, y, z])))
    }

    /// The values of `part`, which lies inside this box, out of those of the whole, both dense `[z][y][x]`.
    pub fn cut<T: Copy>(&self, values: &[T], part: &Self, out: &mut Vec<T>) {
        let width = part.shape()[0] as usize;
        out.clear();
        for (y, z) in part.rows() {
            out.extend_from_slice(&values[self.offset_of([part.lo[0], y, z])..][..width]);
        }
    }

    /// The place of `voxel` in a dense `[z][y][x]` array over this box.
    #[must_use]
    pub fn offset_of(&self, voxel: [i64; 3]) -> usize {
        let shape = self.shape();
        let [x, y, z]: [i64; 3] = std::array::from_fn(|a| voxel[a] - self.lo[a]);
        ((z * shape[1] + y) * shape[0] + x) as usize
    }

    /// The voxel at a place of a dense `[z][y][x]` array over this box, which is not empty: the inverse of
    /// [`Box3::offset_of`].
    #[must_use]
    pub fn voxel_at(&self, offset: usize) -> [i64; 3] {
        let [nx, ny, _] = self.shape().map(|n| n as usize);
        let inside = [offset % nx, offset / nx % ny, offset / (nx * ny)];
        std::array::from_fn(|a| self.lo[a] + inside[a] as i64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn volume_passes_32_bits() {
        assert_eq!(Box3::from_shape([4096, 4096, 4096]).volume(), 1 << 36);
        assert_eq!(Box3::new([0; 3], [-1, 5, 5]).volume(), 0);
    }

    #[test]
    fn places_in_an_array_are_those_of_their_voxels() {
        let part = Box3::new([-3, 5, 2], [4, 8, 7]);
        let voxels = part.rows().flat_map(|(y, z)| (part.lo[0]..part.hi[0]).map(move |x| [x, y, z]));
        for (offset, voxel) in voxels.enumerate() {
            assert_eq!((part.offset_of(voxel), part.voxel_at(offset)), (offset, voxel));
        }
    }

    #[test]
    fn tiles_cover_a_box_once() {
        let part = Box3::new([3, 0, 5], [11, 4, 6]);
        let tiles: Vec<Box3> = part.tiles([4, 3, 2]).collect();
        assert_eq!(tiles[0], Box3::new([3, 0, 5], [4, 3, 6]));
        assert_eq!((tiles.len(), tiles.iter().map(Box3::len).sum::<usize>()), (6, part.len()));
    }

    #[test]
    fn parts_are_cut_out() {
        let whole = Box3::new([1, 2, 3], [4, 4, 5]);
        let values: Vec<usize> = (0..whole.len()).collect();
        let mut out = vec![99];
        whole.cut(&values, &Box3::new([2, 3, 3], [4, 4, 5]), &mut out);
        assert_eq!(out, [4, 5, 10, 11]);
    }

    #[test]
    fn offsets_follow_the_rows() {
        let b = Box3::new([1, -2, 3], [4, 2, 5]);
        let walked: Vec<_> = b.rows().flat_map(|(y, z)| (1..4).map(move |x| [x, y, z])).collect();
        for (place, voxel) in walked.iter().enumerate() {
            assert_eq!(b.offset_of(*voxel), place);
        }
        assert_eq!(walked.len(), b.len());
    }
}
