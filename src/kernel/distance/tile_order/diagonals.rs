//! A tile laid out along diagonals, so that a whole vector of voxels can be swept at once.
//!
//! In a sweep with equal directions along x and y no voxel of a diagonal x + y = s depends on another: those at x - 1
//! and y - 1 lie on diagonal s - 1, those at x + 1 and y + 1 on s + 1, and z neighbours in the planes beside. Stored
//! `[z][x + y][y]` each of the six is a contiguous run. Sweeps with opposite directions want y turned round. Any order
//! that keeps "upwind neighbours first" gives the bits of the triple loop (docs/algorithms.md, "The sweep schedule").

use std::ops::Range;

use crate::tile::HaloTile;

/// Voxels taken at a time at most.
pub(crate) const MOST_LANES: usize = 16;

/// Whether that many are worth it: where vectors of 64 bytes are to be had. Elsewhere half of them are taken at a time.
pub(crate) fn has_wide_vectors() -> bool {
    #[cfg(target_arch = "x86_64")]
    return pulp::x86::V4::try_new().is_some();
    #[cfg(not(target_arch = "x86_64"))]
    false
}

/// Where voxels of a tile of `edge`^3 voxels and their halo lie, and how much of it is in use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Diagonals {
    /// Distance between diagonals; x neighbours are this far apart, y neighbours one more.
    pub(crate) row: usize,
    /// Distance between planes.
    pub(crate) plane: usize,
    /// Voxels in use along each axis.
    pub(crate) valid: [usize; 3],
    /// Whether y is turned round.
    pub(crate) turned: bool,
}

impl Diagonals {
    pub(crate) fn new(edge: usize) -> Self {
        let grown = edge + 2;
        // Vectors may reach past the end of a diagonal.
        let row = grown + MOST_LANES;
        Self { row, plane: (2 * grown - 1) * row, valid: [edge; 3], turned: false }
    }

    /// Voxels along an edge of a whole tile.
    pub(crate) fn edge(&self) -> usize {
        self.row - MOST_LANES - 2
    }

    /// Places of all planes of a tile of `edge`^3 voxels.
    pub(crate) fn len(edge: usize) -> usize {
        Self::new(edge).plane * (edge + 2) + MOST_LANES
    }

    /// Place of a voxel; indices count from the lower ghost.
    #[inline]
    pub(crate) fn at(&self, [x, y, z]: [usize; 3]) -> usize {
        let y = if self.turned { self.valid[1] + 1 - y } else { y };
        z * self.plane + (x + y) * self.row + y
    }

    /// Distance between x neighbours, and between y neighbours.
    fn steps(&self) -> [isize; 2] {
        let row = self.row as isize;
        [row, if self.turned { -row - 1 } else { row + 1 }]
    }

    /// The diagonals of a plane in sweep order: the place in the plane of the first voxel of each, and their number.
    #[inline]
    pub(crate) fn diagonals(&self, upward: bool) -> impl Iterator<Item = (usize, usize)> + use<> {
        let ([nx, ny, _], row) = (self.valid, self.row);
        (0..nx + ny - 1).map(move |n| {
            let s = if upward { n + 2 } else { nx + ny - n };
            let (first, last) = (s.saturating_sub(nx).max(1), ny.min(s - 1));
            (s * row + first, last + 1 - first)
        })
    }

    /// Copies every voxel of `tile` in, by `value(voxel, is a ghost)`; places of no voxel become `nothing`.
    pub(crate) fn load<T: Copy + Default, U: Copy>(
        &self,
        tile: &HaloTile<T>,
        out: &mut [U],
        value: impl Fn(T, bool) -> U,
    ) {
        let [nx, ny, nz] = self.valid;
        let step = self.steps()[0] as usize;
        for z in 0..nz + 2 {
            for y in 0..ny + 2 {
                let from = tile.at(-1, y as isize - 1, z as isize - 1);
                let from = &tile.data()[from..][..nx + 2];
                let out = &mut out[self.at([0, y, z])..][..(nx + 1) * step + 1];
                let beyond = y == 0 || z == 0 || y > ny || z > nz;
                out[0] = value(from[0], true);
                for (out, &voxel) in out.iter_mut().step_by(step).zip(from).skip(1).take(nx) {
                    *out = value(voxel, beyond);
                }
                out[(nx + 1) * step] = value(from[nx + 1], true);
            }
        }
    }

    /// The places of all voxels and ghosts, a diagonal at a time.
    pub(crate) fn whole_diagonals(&self) -> impl Iterator<Item = Range<usize>> + use<> {
        let Self { valid: [nx, ny, nz], row, plane, .. } = *self;
        (0..nz + 2).flat_map(move |z| {
            (0..nx + ny + 3).map(move |s| {
                let (first, last) = (s.saturating_sub(nx + 1), s.min(ny + 1));
                let start = z * plane + s * row;
                start + first..start + last + 1
            })
        })
    }

    /// Copies the voxels in use back into `tile`.
    pub(crate) fn store<T: Copy + Default, U: Copy>(&self, from: &[U], tile: &mut HaloTile<T>, value: impl Fn(U) -> T) {
        let [nx, ny, nz] = self.valid;
        let step = self.steps()[0] as usize;
        for z in 1..=nz {
            for y in 1..=ny {
                let to = tile.at(0, y as isize - 1, z as isize - 1);
                let from = &from[self.at([1, y, z])..][..(nx - 1) * step + 1];
                let to = &mut tile.data_mut()[to..][..nx];
                for (to, &from) in to.iter_mut().zip(from.iter().step_by(step)) {
                    *to = value(from);
                }
            }
        }
    }
}

/// A run of voxels on one diagonal and the six runs beside them.
pub(crate) struct Run<'a, T> {
    pub(crate) here: &'a mut [T],
    /// -x, +x, -y, +y, -z, +z; where y is turned round, its two are exchanged.
    pub(crate) beside: [&'a [T]; 6],
}

impl Diagonals {
    /// Sides of a run's voxels that a sweep passed before them, along x, y and z; y as laid out.
    pub(crate) fn passed(upward: [bool; 2]) -> [usize; 3] {
        let [s, z] = upward.map(|upward| usize::from(!upward));
        [s, 2 + s, 4 + z]
    }

    /// The `count` voxels from place `at` on, and those beside them.
    #[inline(always)]
    pub(crate) fn run<'a, T>(&self, data: &'a mut [T], at: usize, count: usize) -> Run<'a, T> {
        let (row, plane) = (self.row, self.plane);
        let (below, rest) = data.split_at_mut(at);
        let (here, above) = rest.split_at_mut(count);
        let (lower_z, lower_y, lower_x) = (at - plane, at - row - 1, at - row);
        let (upper_x, upper_y, upper_z) = (row - count, row + 1 - count, plane - count);
        let beside = [
            &below[lower_x..][..count],
            &above[upper_x..][..count],
            &below[lower_y..][..count],
            &above[upper_y..][..count],
            &below[lower_z..][..count],
            &above[upper_z..][..count],
        ];
        Run { here, beside }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_are_where_they_should_be_and_voxels_come_back() {
        for (valid, turned) in [([5, 5, 5], false), ([5, 3, 1], true), ([1, 4, 5], true)] {
            let mut tile = HaloTile::<f32>::new(5);
            tile.set_valid(valid);
            tile.data_mut().iter_mut().enumerate().for_each(|(n, v)| *v = n as f32);
            let layout = Diagonals { valid, turned, ..Diagonals::new(5) };
            let mut data = vec![-1.0; Diagonals::len(5)];
            layout.load(&tile, &mut data, |v, _| v);
            let mut seen = 0;
            for z in 1..=valid[2] {
                for (start, count) in layout.diagonals(true) {
                    for n in 0..count {
                        let run = layout.run(&mut data, z * layout.plane + start + n, 1);
                        let here = run.here[0] as usize;
                        let mut expected = [here - 1, here + 1, here - 7, here + 7, here - 49, here + 49];
                        if turned {
                            expected.swap(2, 3);
                        }
                        assert_eq!(run.beside.map(|side| side[0] as usize), expected);
                        seen += 1;
                    }
                }
            }
            assert_eq!(seen, valid.iter().product::<usize>());
            let mut back = HaloTile::<f32>::new(5);
            back.set_valid(valid);
            layout.store(&data, &mut back, |v| v);
            let here = back.at(valid[0] as isize - 1, 0, valid[2] as isize - 1);
            assert_eq!(back.data()[here], tile.data()[here]);
        }
    }
}
