//! Presmoothing: the exact solution of the heat equation, a Gaussian, on a block of cells (Koenderink 1984;
//! docs/algorithms.md, "Grey range and presmoothing").
//!
//! `I_t = 1/2 Laplace I` solved up to `t = sigma^2` is `I` convolved with a Gaussian of width sigma, which is separable:
//! along each axis, x first, then y, then z,
//!
//! ```text
//! S_i = I_i + sum over k = 1 .. r of w_k (I_(i-k) - 2 I_i + I_(i+k))        w_k = q^(k^2) / sum over |k| <= r of q^(k^2)
//! ```
//!
//! This is the convolution with `w_0 = 1 - 2 sum w_k` written as differences: the weights sum to 1 whatever is rounded,
//! and a constant stays what it is to the bit. `q = exp(-1 / (2 s^2))`, s in voxels, is the sampled Gaussian. From
//! two voxels on `s = sigma / h`. A narrow one must not be sampled at its own width, which leaves it too little variance
//! (at 0.3 voxels a twelfth of it), nor integrated over voxels, which adds that of a voxel (1/12): s is the one for which
//! the weights have the variance `(sigma / h)^2`. At one voxel it is sigma to seven digits already.
//!
//! In: the block grown by [`Gaussian::halo`], f32, plane by plane. Out: cells. Sums are made in f32, from near to far, of
//! the same voxels wherever blocks begin: the bits at a voxel depend on nothing but the image. `r` is four sigma, rounded
//! up: beyond lie 6e-5 of the sum. Cost: four operations for each voxel, axis and weight of one side, in whole vectors.

use crate::kernel::level_set::cell::CELL;

/// Widths from which the sampled Gaussian has its own variance to all digits.
const WIDE: f64 = 2.0;
/// Where weights end, in widths.
const REACH: f64 = 4.0;

/// The weights along the three axes.
#[derive(Clone, Debug, PartialEq)]
pub struct Gaussian {
    /// `w_1 .. w_r` along each axis.
    sides: [Vec<f32>; 3],
}

impl Gaussian {
    /// Of width `sigma` along each axis, on a grid of `spacing`, in the same unit; 0 leaves an axis as it is.
    #[must_use]
    pub fn new(sigma: [f64; 3], spacing: [f64; 3]) -> Self {
        Self { sides: std::array::from_fn(|a| side(sigma[a] / spacing[a])) }
    }

    /// Layers of voxels that are read on either side, along each axis.
    #[must_use]
    pub fn halo(&self) -> [usize; 3] {
        std::array::from_fn(|a| self.sides[a].len())
    }
}

/// `w_1 .. w_r` for a width in voxels.
fn side(sigma: f64) -> Vec<f32> {
    if sigma <= 0.0 {
        return Vec::new();
    }
    let width = if sigma < WIDE { width_of_variance(sigma * sigma) } else { sigma };
    let reach = (REACH * sigma).ceil() as i32;
    let total = 1.0 + 2.0 * (1..=reach).map(|k| sample(k, width)).sum::<f64>();
    (1..=reach).map(|k| (sample(k, width) / total) as f32).collect()
}

fn sample(k: i32, width: f64) -> f64 {
    let x = f64::from(k) / width;
    libm::exp(-0.5 * x * x)
}

/// The width at which samples of a Gaussian have this variance (voxels squared, at most `WIDE^2`), by bisection.
fn width_of_variance(wanted: f64) -> f64 {
    let variance = |width: f64| {
        let [sum, second] = (1..=(12.0 * WIDE) as i32).fold([0.0, 0.0], |[sum, second], k| {
            let w = sample(k, width);
            [sum + w, second + w * f64::from(k * k)]
        });
        2.0 * second / (1.0 + 2.0 * sum)
    };
    // Samples have less variance than the function, by half a voxel of width at most.
    let (mut low, mut high) = (0.0, wanted.sqrt() + 0.5);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if variance(middle) < wanted { low = middle } else { high = middle }
    }
    high
}

/// A block of cells, of which some are wanted; only what these read is computed.
#[derive(Clone, Debug)]
pub struct Block {
    cells: [usize; 3],
    /// Rows and planes of the block that lie in the domain.
    rows: usize,
    planes: usize,
    wanted: Vec<bool>,
    halo: [usize; 3],
}

impl Block {
    /// `wanted` for each cell, `[z][y][x]`; `shape` in voxels is shorter than the cells where the domain ends.
    ///
    /// # Panics
    /// When `wanted` has not one entry for each cell of the shape.
    #[must_use]
    pub fn new(shape: [usize; 3], wanted: Vec<bool>, gaussian: &Gaussian) -> Self {
        let cells = shape.map(|n| n.div_ceil(CELL));
        assert_eq!(wanted.len(), cells.iter().product::<usize>(), "one entry for each cell");
        Self { cells, rows: shape[1], planes: shape[2], wanted, halo: gaussian.halo() }
    }

    /// Voxels of a plane of the grown block along x and y; whole cells along x.
    #[must_use]
    pub fn grown_plane(&self) -> [usize; 2] {
        [self.width() + 2 * self.halo[0], self.rows + 2 * self.halo[1]]
    }

    /// Planes of the grown block.
    #[must_use]
    pub fn grown_planes(&self) -> usize {
        self.planes + 2 * self.halo[2]
    }

    fn width(&self) -> usize {
        self.cells[0] * CELL
    }

    /// From one plane of the block to the next. One line of cache more than the plane: at a power of two the planes of
    /// a column would all fall into the same few places of the cache.
    fn pitch(&self) -> usize {
        self.width() * self.rows + CELL
    }

    /// True when a wanted cell of the column reads a plane of the grown block.
    fn reads_plane(&self, [x, y]: [usize; 2], plane: usize) -> bool {
        (0..self.cells[2]).any(|z| {
            self.wanted[(z * self.cells[1] + y) * self.cells[0] + x]
                && (z * CELL..(z + 1) * CELL + 2 * self.halo[2]).contains(&plane)
        })
    }
}

/// What is kept of a block between its planes and its cells.
#[derive(Clone, Debug, Default)]
pub struct Smoothed {
    /// The grown plane, smoothed along x.
    along_x: Vec<f32>,
    /// All planes of the grown block, smoothed along x and y.
    planes: Vec<f32>,
}

impl Smoothed {
    /// Makes room for a block.
    pub fn begin(&mut self, block: &Block) {
        self.along_x.resize(block.width() * block.grown_plane()[1], 0.0);
        self.planes.resize(block.pitch() * block.grown_planes(), 0.0);
    }

    /// Smooths a plane of the grown block along x and y; `values` is dense `[y][x]`, [`Block::grown_plane`] long.
    ///
    /// # Panics
    /// When the plane does not fit the block, or nothing was begun.
    pub fn plane(&mut self, block: &Block, gaussian: &Gaussian, plane: usize, values: &[f32]) {
        assert_eq!(values.len(), block.grown_plane().iter().product::<usize>(), "a plane of the grown block");
        let (rows, out) = (&mut self.along_x[..], &mut self.planes[plane * block.pitch()..][..block.pitch()]);
        vectorised!({
            block: &Block, gaussian: &Gaussian, plane: usize, values: &[f32], rows: &mut [f32], out: &mut [f32]
        } => smooth_plane);
    }

    /// Smooths a cell along z, after all planes: `cell` counts cells of the block; `out` is a cell, left as it is beyond
    /// the block's end.
    ///
    /// # Panics
    /// When the cell does not lie in the block, or `out` is none.
    pub fn cell(&self, block: &Block, gaussian: &Gaussian, cell: [usize; 3], out: &mut [f32]) {
        let planes = &self.planes[..];
        vectorised!({
            block: &Block, gaussian: &Gaussian, cell: [usize; 3], planes: &[f32], out: &mut [f32]
        } => smooth_cell);
    }
}

#[inline(always)]
fn smooth_plane(
    block: &Block,
    gaussian: &Gaussian,
    plane: usize,
    values: &[f32],
    along_x: &mut [f32],
    out: &mut [f32],
) {
    let ([halo_x, halo_y, _], width) = (block.halo, block.width());
    let grown = width + 2 * halo_x;
    for x in 0..block.cells[0] {
        let mut made = 0;
        for y in (0..block.cells[1]).filter(|&y| block.reads_plane([x, y], plane)) {
            let (first, end) = (y * CELL, ((y + 1) * CELL).min(block.rows));
            // Rows that this cell shares with the one before are there.
            for row in made.max(first)..end + 2 * halo_y {
                let at = row * grown + halo_x + x * CELL;
                let sums = along(values, at, 1, &gaussian.sides[0]);
                along_x[row * width + x * CELL..][..CELL].copy_from_slice(&sums);
            }
            made = end + 2 * halo_y;
            for row in first..end {
                let at = (row + halo_y) * width + x * CELL;
                let sums = along(along_x, at, width, &gaussian.sides[1]);
                out[row * width + x * CELL..][..CELL].copy_from_slice(&sums);
            }
        }
    }
}

#[inline(always)]
fn smooth_cell(block: &Block, gaussian: &Gaussian, cell: [usize; 3], planes: &[f32], out: &mut [f32]) {
    let (width, pitch) = (block.width(), block.pitch());
    let [height, depth] = [(1, block.rows), (2, block.planes)].map(|(a, n)| CELL.min(n - cell[a] * CELL));
    for y in 0..height {
        for z in 0..depth {
            let row = (cell[1] * CELL + y) * width + cell[0] * CELL;
            let at = (cell[2] * CELL + z + block.halo[2]) * pitch + row;
            let sums = along(planes, at, pitch, &gaussian.sides[2]);
            out[(z * CELL + y) * CELL..][..CELL].copy_from_slice(&sums);
        }
    }
}

/// The sums of a row of a cell, which begins at `at`, over voxels `step` apart.
#[inline(always)]
fn along(values: &[f32], at: usize, step: usize, side: &[f32]) -> [f32; CELL] {
    let row = |at: usize| values[at..].first_chunk::<CELL>().expect("the halo is as wide as the weights");
    let own = row(at);
    let mut sums = *own;
    for (k, w) in (1..).zip(side) {
        let (before, after) = (row(at - k * step), row(at + k * step));
        for i in 0..CELL {
            // 2 I_i is added up before it is taken off: then three equal values give an exact 0.
            sums[i] += w * ((before[i] + after[i]) - (own[i] + own[i]));
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moments(side: &[f32]) -> [f64; 2] {
        (1_u32..).zip(side).fold([0.0, 0.0], |[sum, second], (k, &w)| {
            [sum + 2.0 * f64::from(w), second + 2.0 * f64::from(w) * f64::from(k * k)]
        })
    }

    #[test]
    fn weights_have_the_variance_of_the_gaussian() {
        for sigma in [0.05, 0.1, 0.3, 0.5, 0.7, 1.0, 1.3, 1.9, 2.0, 2.1, 3.7, 8.0, 32.0] {
            let [sum, variance] = moments(&side(sigma));
            assert!((0.0..1.0).contains(&sum), "sigma {sigma}: {sum}");
            // What is cut off at four widths had a thousandth of it.
            let relative = variance / (sigma * sigma);
            assert!((0.9985..1.000_01).contains(&relative), "sigma {sigma}: {relative} of its variance");
        }
    }

    #[test]
    fn wide_weights_are_those_of_the_gaussian() {
        for sigma in [1.0_f64, 1.5, 2.0, 5.0] {
            let side = side(sigma);
            assert_eq!(side.len(), (4.0 * sigma).ceil() as usize);
            for (k, w) in (1_u32..).zip(side) {
                let k = f64::from(k);
                let exact = (-0.5 * k * k / (sigma * sigma)).exp() / (sigma * (2.0 * std::f64::consts::PI).sqrt());
                // What lies beyond four widths, 6e-5, is shared out among the weights.
                assert!((f64::from(w) / exact - 1.0).abs() < 7e-5, "sigma {sigma}, {k}: {w} for {exact}");
            }
        }
    }

    #[test]
    fn the_halo_follows_the_spacing() {
        let gaussian = Gaussian::new([2.0, 2.0, 0.0], [1.0, 0.5, 1.0]);
        assert_eq!(gaussian.halo(), [8, 16, 0]);
    }
}
