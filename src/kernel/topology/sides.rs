//! How deep in its side each voxel is: how far from the other side, and of voxels as far how much of the side is around.
//!
//! The distance is exact within the box that is looked at (Felzenszwalb and Huttenlocher 2012, the lower envelope taken by trying all offsets,
//! which are few), then rounded to voxels. What is around is the part of the box that is on the same side, summed axis by axis: a strand or a
//! tunnel has less of it than a wall or a gap as thick.

use super::blocks::{EDGE, FAR, INSIDE, LEN, PARTS};

/// Distances that are told apart: so many together with their parts are levels below [`FAR`].
const DISTANCES: u32 = 3;

/// Counts of a tile around a block.
#[derive(Clone, Debug)]
pub struct Tile {
    /// Voxels around the block, along x, y, z: half the box.
    halo: [usize; 3],
    /// Squares of the distances of so many steps along each axis, in thirds of the reach.
    squares: [Vec<f32>; 3],
    counts: Vec<u16>,
    passed: Vec<u16>,
    near: Vec<f32>,
    nearer: Vec<f32>,
}

impl Tile {
    /// For boxes that reach so many voxels to either side, where they are so far apart.
    #[must_use]
    pub fn new(halo: [usize; 3], spacing: [f64; 3]) -> Self {
        let reach = (0..3).map(|a| halo[a] as f64 * spacing[a]).fold(f64::INFINITY, f64::min);
        let unit = reach / f64::from(DISTANCES);
        let squares = |a: usize| (0..=halo[a]).map(|n| (n as f64 * spacing[a] / unit).powi(2) as f32).collect();
        let squares = [0, 1, 2].map(squares);
        Self { halo, squares, counts: Vec::new(), passed: Vec::new(), near: Vec::new(), nearer: Vec::new() }
    }

    /// Half the box.
    #[must_use]
    pub fn halo(&self) -> [usize; 3] {
        self.halo
    }

    /// Voxels of the tile along x, y, z.
    #[must_use]
    pub fn shape(&self) -> [usize; 3] {
        self.halo.map(|halo| EDGE + 2 * halo)
    }

    /// The states of a block's voxels, `values` being those of its tile, `[z][y][x]`, inside where they are at least `surface`; false where
    /// all of the tile is of one side.
    ///
    /// # Panics
    /// When `values` are not the tile's, or `states` not the block's.
    pub fn states(&mut self, values: &[f32], surface: f32, states: &mut [u8]) -> bool {
        assert_eq!((values.len(), states.len()), (self.shape().iter().product(), LEN));
        let is_inside = |value: f32| value >= surface;
        let first = is_inside(values[0]);
        if values.iter().all(|&value| is_inside(value) == first) {
            return false;
        }
        let [nx, ny, _] = self.shape();
        self.counts.clear();
        self.counts.extend(values.iter().map(|&value| u16::from(is_inside(value))));
        for (axis, stride) in [1, nx, nx * ny].into_iter().enumerate() {
            self.pass(axis, stride);
        }
        let halo = self.halo;
        let all: u32 = halo.iter().map(|&halo| 2 * halo as u32 + 1).product();
        for side in [false, true] {
            self.near.clear();
            self.near.extend(values.iter().map(|&value| if is_inside(value) == side { f32::INFINITY } else { 0.0 }));
            for (axis, stride) in [1, nx, nx * ny].into_iter().enumerate() {
                self.approach(axis, stride);
            }
            for (place, state) in states.iter_mut().enumerate() {
                let at = [place % EDGE, place / EDGE % EDGE, place / (EDGE * EDGE)];
                let from = ((at[2] + halo[2]) * ny + at[1] + halo[1]) * nx + at[0] + halo[0];
                if is_inside(values[from]) == side {
                    let count = u32::from(self.counts[from]);
                    let same = if side { count } else { all - count };
                    *state = level(self.near[from], same, all) | if side { INSIDE } else { 0 };
                }
            }
        }
        true
    }

    /// Sums along an axis; sums whose box reaches out of the tile are of no use.
    fn pass(&mut self, axis: usize, stride: usize) {
        let whole = self.shape()[axis] * stride;
        self.passed.clone_from(&self.counts);
        for (counts, passed) in self.counts.chunks_exact(whole).zip(self.passed.chunks_exact_mut(whole)) {
            for steps in 1..=self.halo[axis] {
                let by = steps * stride;
                passed[..whole - by].iter_mut().zip(&counts[by..]).for_each(|(sum, n)| *sum += n);
                passed[by..].iter_mut().zip(&counts[..whole - by]).for_each(|(sum, n)| *sum += n);
            }
        }
        std::mem::swap(&mut self.counts, &mut self.passed);
    }

    /// Squared distances with an axis more; those of the halo may be too large.
    fn approach(&mut self, axis: usize, stride: usize) {
        let whole = self.shape()[axis] * stride;
        self.nearer.clone_from(&self.near);
        for (near, nearer) in self.near.chunks_exact(whole).zip(self.nearer.chunks_exact_mut(whole)) {
            for (steps, &square) in self.squares[axis].iter().enumerate().skip(1) {
                let by = steps * stride;
                nearer[..whole - by].iter_mut().zip(&near[by..]).for_each(|(p, n)| *p = p.min(n + square));
                nearer[by..].iter_mut().zip(&near[..whole - by]).for_each(|(p, n)| *p = p.min(n + square));
            }
        }
        std::mem::swap(&mut self.near, &mut self.nearer);
    }
}

/// The level of a voxel, from the squared distance in thirds of the reach and what of its box is on the same side.
fn level(squared: f32, same: u32, all: u32) -> u8 {
    let distance = (squared.sqrt().round() as u32).max(1);
    if distance > DISTANCES {
        return FAR;
    }
    let parts = u32::from(PARTS);
    ((distance - 1) * parts + 1 + same * (parts - 1) / all) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn states_tell_how_much_of_a_side_is_around() {
        let mut tile = Tile::new([3, 3, 2], [1.0, 1.0, 1.5]);
        let [nx, ny, nz] = tile.shape();
        let value = |x: usize, y: usize, z: usize| ((x * 7 + y * 5 + z * 3 + x * y) % 11) as f32 / 10.0;
        let is_in = |x: usize, y: usize, z: usize| z > 9 || (z > 4 && value(x, y, z) >= 0.5);
        let mut values = Vec::new();
        for z in 0..nz {
            for y in 0..ny {
                values.extend((0..nx).map(|x| f32::from(u8::from(is_in(x, y, z)))));
            }
        }
        let mut states = vec![0; LEN];
        assert!(tile.states(&values, 0.5, &mut states));
        for (place, &state) in states.iter().enumerate() {
            let [x, y, z] = [place % EDGE + 3, place / EDGE % EDGE + 3, place / (EDGE * EDGE) + 2];
            let (mut same, mut nearest, inside) = (0, f64::INFINITY, is_in(x, y, z));
            for c in z - 2..=z + 2 {
                for b in y - 3..=y + 3 {
                    for a in x - 3..=x + 3 {
                        let by = [x.abs_diff(a) as f64, y.abs_diff(b) as f64, 1.5 * z.abs_diff(c) as f64];
                        if is_in(a, b, c) == inside {
                            same += 1;
                        } else {
                            nearest = nearest.min(by.iter().map(|d| d * d).sum::<f64>().sqrt());
                        }
                    }
                }
            }
            let far = nearest.round().max(1.0);
            let level = if far > 3.0 { FAR } else { ((far as u32 - 1) * 40 + 1 + same * 39 / 245) as u8 };
            assert_eq!(state, level | if inside { INSIDE } else { 0 }, "{x} {y} {z}");
        }
        assert!(!tile.states(&vec![1.0; values.len()], 0.5, &mut states));
    }
}
