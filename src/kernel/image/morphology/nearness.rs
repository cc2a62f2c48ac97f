//! Exact Euclidean distances from sets of voxels on one dense box, as far as a reach: a squared distance is the least
//! sum of three squares, so one pass along each axis finds it (Saito & Toriwaki 1994, New algorithms for Euclidean
//! distance transformation).
//!
//! In: a box of voxels, which of them are in the set. Out: squared physical distances between voxel centres, infinite
//! beyond the reach. Cost: twice the reach in voxels along each axis, for each voxel. Where the box reaches
//! [`Nearness::halo`] voxels around, results do not depend on it.

/// Distances on boxes of one spacing, up to one reach.
#[derive(Clone, Debug)]
pub struct Nearness {
    /// The squares of the lengths of 0, 1, 2, ... steps along each axis, as far as the reach.
    squares: [Vec<f32>; 3],
    limit: f32,
    /// Distances along x, then also along y.
    passes: [Vec<f32>; 2],
}

impl Nearness {
    /// For distances up to `reach`, a length as `spacing` is.
    #[must_use]
    pub fn new(spacing: [f64; 3], reach: f64) -> Self {
        let squares = spacing.map(|h| {
            let steps = (reach / h).floor().max(0.0) as i64;
            (0..=steps).map(|n| (n as f64 * h).powi(2) as f32).collect()
        });
        Self { squares, limit: (reach * reach) as f32, passes: Default::default() }
    }

    /// How many voxels around a box its distances follow from, along each axis.
    #[must_use]
    pub fn halo(&self) -> [i64; 3] {
        [0, 1, 2].map(|a| self.squares[a].len() as i64 - 1)
    }

    /// Fills `out` with the squared distances from the voxels of a box of `shape` for which `is_source` says yes, dense
    /// `[z][y][x]`.
    pub fn squared(&mut self, shape: [i64; 3], is_source: impl Fn(usize) -> bool, out: &mut Vec<f32>) {
        let [width, height, depth] = shape.map(|n| n as usize);
        let [rows, planes] = &mut self.passes;
        rows.clear();
        rows.extend((0..width * height * depth).map(|n| if is_source(n) { 0.0 } else { f32::INFINITY }));
        rows.chunks_exact_mut(width.max(1)).for_each(|row| along_row(row, &self.squares[0]));
        along(rows, planes, [width, height, depth], 1, &self.squares[1]);
        along(planes, out, [width, height, depth], 2, &self.squares[2]);
        out.iter_mut().filter(|d| **d > self.limit).for_each(|d| *d = f32::INFINITY);
    }
}

/// Distances along a row of sources (0) and others, by a look in either direction.
fn along_row(row: &mut [f32], squares: &[f32]) {
    let squared = |steps: usize| squares.get(steps).copied().unwrap_or(f32::INFINITY);
    let mut steps = usize::MAX;
    for d in row.iter_mut() {
        steps = if *d == 0.0 { 0 } else { steps.saturating_add(1) };
        *d = squared(steps);
    }
    steps = usize::MAX;
    for d in row.iter_mut().rev() {
        steps = if *d == 0.0 { 0 } else { steps.saturating_add(1) };
        *d = d.min(squared(steps));
    }
}

/// The least of what lies up to so many rows before and behind along y (1) or z (2), and the square of the way there.
fn along(from: &[f32], to: &mut Vec<f32>, shape: [usize; 3], axis: usize, squares: &[f32]) {
    let [width, height, depth] = shape;
    let count = shape[axis];
    to.clear();
    to.extend_from_slice(from);
    // Most rows of a set that is small in its box have nothing to give.
    let is_near: Vec<bool> = from.chunks_exact(width).map(|row| row.iter().any(|d| d.is_finite())).collect();
    for (row, to) in to.chunks_exact_mut(width).enumerate() {
        let (n, stride) = if axis == 1 { (row % height, 1) } else { (row / height, height) };
        for (steps, &square) in squares.iter().enumerate().skip(1).take(count) {
            let before = (n >= steps).then(|| row - steps * stride);
            let behind = (n + steps < count).then(|| row + steps * stride);
            for other in [before, behind].into_iter().flatten().filter(|&other| is_near[other]) {
                let source = &from[other * width..][..width];
                to.iter_mut().zip(source).for_each(|(d, s)| *d = d.min(s + square));
            }
        }
    }
    debug_assert_eq!(from.len(), width * height * depth, "rows fill the box");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_those_of_the_nearest_source() {
        let (shape, spacing) = ([9_i64, 7, 6], [0.5, 1.0, 0.75]);
        let sources = [[1_i64, 2, 0], [7, 5, 4], [8, 0, 5]];
        let at = |v: [i64; 3]| ((v[2] * shape[1] + v[1]) * shape[0] + v[0]) as usize;
        let mut found = Vec::new();
        let mut nearness = Nearness::new(spacing, 2.6);
        assert_eq!(nearness.halo(), [5, 2, 3]);
        nearness.squared(shape, |n| sources.iter().any(|&s| at(s) == n), &mut found);
        for (n, found) in found.iter().enumerate() {
            let n = n as i64;
            let voxel = [n % shape[0], n / shape[0] % shape[1], n / (shape[0] * shape[1])];
            let squared = |s: &[i64; 3]| (0..3).map(|a| ((s[a] - voxel[a]) as f64 * spacing[a]).powi(2)).sum::<f64>();
            let nearest = sources.iter().map(squared).fold(f64::INFINITY, f64::min);
            let expected = if nearest <= 2.6 * 2.6 { nearest } else { f64::INFINITY };
            assert_eq!(f64::from(*found), expected, "{voxel:?}");
        }
    }
}
