//! A smooth field on a coarse lattice, read between its nodes by Catmull & Rom's cubics (1974) along each axis.

use crate::grid::{Box3, Geometry};

/// Values at every n-th voxel of a box, with a margin of a node around it.
#[derive(Clone, Debug)]
pub struct Lattice {
    step: [i64; 3],
    counts: [usize; 3],
    values: Vec<f32>,
}

impl Lattice {
    /// The lattice for a box of voxels with about `most` nodes, `apart` smallest spacings apart at least, not yet filled.
    #[must_use]
    pub fn for_box(shape: [i64; 3], spacing: [f64; 3], most: f64, apart: f64) -> Self {
        let extents: [f64; 3] = std::array::from_fn(|a| shape[a] as f64 * spacing[a]);
        let least = apart * spacing.into_iter().fold(f64::INFINITY, f64::min);
        let length = libm::cbrt(extents.iter().product::<f64>() / most).max(least);
        let step = spacing.map(|h| ((length / h).ceil() as i64).max(1));
        let counts = std::array::from_fn(|a| ((shape[a] - 1) / step[a]) as usize + 4);
        Self { step, counts, values: Vec::new() }
    }

    /// Planes of nodes.
    #[must_use]
    pub fn planes(&self) -> usize {
        self.counts[2]
    }

    /// The values of a function of the position on one plane of nodes of a grid.
    pub fn plane<R>(&self, plane: usize, geometry: &Geometry, of: impl Fn([f64; 3]) -> R) -> Vec<R> {
        let place =
            |n: usize, a: usize| geometry.origin[a] + (n as i64 - 1) as f64 * self.step[a] as f64 * geometry.spacing[a];
        let nodes = (0..self.counts[1]).flat_map(|j| (0..self.counts[0]).map(move |i| [i, j]));
        nodes.map(|[i, j]| of([place(i, 0), place(j, 1), place(plane, 2)])).collect()
    }

    /// Takes over all planes, in order.
    pub fn fill(&mut self, planes: &[Vec<f32>]) {
        self.values = planes.concat();
    }

    /// Reads the voxels of a box, dense.
    pub fn read(&self, part: &Box3, out: &mut [f32]) {
        let width = part.shape()[0] as usize;
        let mut line = vec![0.0; self.counts[0]];
        for ((y, z), out) in part.rows().zip(out.chunks_exact_mut(width)) {
            self.line(y, z, &mut line);
            for (n, out) in out.iter_mut().enumerate() {
                let (first, weights) = self.along(0, part.lo[0] + n as i64);
                *out = (0..4).map(|m| weights[m] * line[first + m]).sum();
            }
        }
    }

    /// The value at a place in units of voxels.
    #[must_use]
    pub fn at(&self, place: [f64; 3]) -> f32 {
        let [x, y, z] = std::array::from_fn(|a| self.place(a, place[a]));
        let row = |m: usize, n: usize| {
            let start = ((z.0 + m) * self.counts[1] + y.0 + n) * self.counts[0] + x.0;
            (0..4).map(|l| x.1[l] * self.values[start + l]).sum::<f32>()
        };
        (0..4).map(|m| z.1[m] * (0..4).map(|n| y.1[n] * row(m, n)).sum::<f32>()).sum()
    }

    fn place(&self, axis: usize, place: f64) -> (usize, [f32; 4]) {
        let step = self.step[axis] as f64;
        let node = (place / step).floor().clamp(0.0, (self.counts[axis] - 4) as f64);
        (node as usize, catmull_rom((place / step - node).clamp(0.0, 1.0)).map(|w| w as f32))
    }

    /// The nodes and weights of a voxel along an axis; beyond the lattice the last ones.
    fn along(&self, axis: usize, voxel: i64) -> (usize, [f32; 4]) {
        self.place(axis, voxel as f64)
    }

    /// The nodes' values along x at a row of voxels.
    fn line(&self, y: i64, z: i64, line: &mut [f32]) {
        line.fill(0.0);
        let ((first_y, in_y), (first_z, in_z)) = (self.along(1, y), self.along(2, z));
        for (m, wz) in in_z.into_iter().enumerate() {
            for (n, wy) in in_y.into_iter().enumerate() {
                let start = ((first_z + m) * self.counts[1] + first_y + n) * self.counts[0];
                let weight = wz * wy;
                line.iter_mut().zip(&self.values[start..]).for_each(|(sum, v)| *sum += weight * v);
            }
        }
    }
}

fn catmull_rom(t: f64) -> [f64; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [0.5 * (-t3 + 2.0 * t2 - t), 0.5 * (3.0 * t3 - 5.0 * t2 + 2.0), 0.5 * (-3.0 * t3 + 4.0 * t2 + t), 0.5 * (t3 - t2)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quadratic_functions_are_read_exactly() {
        let geometry = Geometry { shape: [41, 30, 17], spacing: [0.5, 0.5, 2.0], origin: [3.0, 1.0, -2.0], unit: None };
        let of = |p: [f64; 3]| (0.1 * p[0] * p[0] - p[1] + 0.2 * p[2]) as f32;
        let mut lattice = Lattice::for_box(geometry.shape, geometry.spacing, 300.0, 2.0);
        assert!(lattice.step[0] > 2);
        let planes: Vec<_> = (0..lattice.planes()).map(|n| lattice.plane(n, &geometry, of)).collect();
        lattice.fill(&planes);
        let part = Box3::new([2, 3, 4], [41, 30, 17]);
        let mut values = vec![0.0; part.len()];
        lattice.read(&part, &mut values);
        for (y, z) in part.rows() {
            for x in part.lo[0]..part.hi[0] {
                let (there, wanted) = (values[part.offset_of([x, y, z])], of(geometry.position([x, y, z])));
                assert!((there - wanted).abs() < 2e-4 * wanted.abs().max(1.0), "{x} {y} {z}: {there} {wanted}");
            }
        }
    }
}
