//! One step of a resolution pyramid: blocks of voxels become one voxel, by mean (intensities) or by mode (labels).
//!
//! Output voxel `i` covers the source voxels `i * factor .. (i + 1) * factor`; at the far end of an axis whose extent
//! is no multiple of the factor it covers those that exist. Blocks know nothing of each other, so a pyramid may be made
//! box by box with the same bits as in one piece, as long as every box starts on a multiple of the factors.

use crate::grid::Box3;
use crate::store::Element;

/// Voxels along each axis of the coarser grid: `shape / factors`, rounded up.
#[must_use]
pub fn coarse_shape(shape: [i64; 3], factors: [i64; 3]) -> [i64; 3] {
    std::array::from_fn(|a| shape[a].div_euclid(factors[a]) + i64::from(shape[a].rem_euclid(factors[a]) != 0))
}

/// The voxels of the coarser grid that a box of the finer one is reduced to; the box begins at a multiple of the factors.
#[must_use]
pub fn coarse_box(fine: &Box3, factors: [i64; 3]) -> Box3 {
    let lo = std::array::from_fn(|a| fine.lo[a].div_euclid(factors[a]));
    Box3::from_shape(coarse_shape(fine.shape(), factors)).translate(lo)
}

/// The mean of every block of `factors` voxels, summed in f64 row by row; integers round half away from zero.
///
/// `source` is dense `[z][y][x]` over `source_shape`, `out` over [`coarse_shape`].
///
/// # Panics
/// When a slice's length does not fit its shape, or a factor is not positive.
pub fn mean<T: Element>(source: &[T], source_shape: [i64; 3], factors: [i64; 3], out: &mut [T]) {
    let blocks = Blocks::new(source.len(), source_shape, factors, out.len());
    pulp::Arch::new().dispatch(Means { source, blocks: &blocks, out });
}

/// The means of all blocks; what they are told by is made once for each kind of processor.
struct Means<'a, T> {
    source: &'a [T],
    blocks: &'a Blocks,
    out: &'a mut [T],
}

impl<T: Element> pulp::NullaryFnOnce for Means<'_, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Means { source, blocks, out } = self;
        let width = blocks.coarse[0];
        let mut sums = vec![0.0; width];
        for (row, out) in out.chunks_exact_mut(width.max(1)).enumerate() {
            sums.fill(0.0);
            let rows = blocks.source_rows(row);
            let height = rows.len() as f64;
            for source_row in rows {
                let values = &source[source_row * blocks.source[0]..][..blocks.source[0]];
                match blocks.factors[0] {
                    1 => add_row::<T, 1>(values, &mut sums),
                    2 => add_row::<T, 2>(values, &mut sums),
                    factor => add_blocks(values.chunks(factor), &mut sums),
                }
            }
            // All blocks are as wide but the last.
            let whole = height * blocks.factors[0] as f64;
            out.iter_mut().zip(&sums).for_each(|(value, sum)| *value = T::from_f64(sum / whole));
            if let (Some(last), Some(sum)) = (out.last_mut(), sums.last()) {
                *last = T::from_f64(sum / (height * blocks.width(width - 1) as f64));
            }
        }
    }
}

/// Adds a row to the sums of blocks that are `N` voxels wide.
#[inline(always)]
fn add_row<T: Element, const N: usize>(values: &[T], sums: &mut [f64]) {
    let (blocks, rest) = values.as_chunks::<N>();
    let whole = blocks.len();
    for (sum, block) in sums.iter_mut().zip(blocks) {
        *sum += block.iter().fold(0.0, |total, value| total + value.to_f64());
    }
    add_blocks([rest].into_iter().filter(|rest| !rest.is_empty()), &mut sums[whole..]);
}

#[inline(always)]
fn add_blocks<'a, T: Element>(blocks: impl Iterator<Item = &'a [T]>, sums: &mut [f64]) {
    for (sum, block) in sums.iter_mut().zip(blocks) {
        *sum += block.iter().fold(0.0, |total, value| total + value.to_f64());
    }
}

/// The most frequent value of every block of `factors` voxels.
///
/// Among equally frequent values the background (zero) gives way, and of the others the smallest is taken: so a
/// structure one voxel thin does not vanish at the first step, and the result depends on no order.
///
/// # Panics
/// When a slice's length does not fit its shape, or a factor is not positive.
pub fn mode<T: Element>(source: &[T], source_shape: [i64; 3], factors: [i64; 3], out: &mut [T]) {
    let blocks = Blocks::new(source.len(), source_shape, factors, out.len());
    let mut block = Vec::with_capacity(blocks.factors.iter().product());
    for (row, out) in out.chunks_exact_mut(blocks.coarse[0].max(1)).enumerate() {
        let rows = blocks.source_rows(row);
        let rows: Vec<&[T]> = rows.iter().map(|row| &source[row * blocks.source[0]..][..blocks.source[0]]).collect();
        // Most rows lie within one label.
        let first = rows[0][0];
        if rows.iter().all(|row| row.iter().all(|&value| value == first)) {
            out.fill(first);
            continue;
        }
        for (x, value) in out.iter_mut().enumerate() {
            let start = x * blocks.factors[0];
            let part = start..start + blocks.width(x);
            block.clear();
            for row in &rows {
                block.extend_from_slice(&row[part.clone()]);
            }
            *value = most_frequent(&block);
        }
    }
}

/// The block's most frequent value, by the rule of [`mode`].
fn most_frequent<T: Element>(block: &[T]) -> T {
    let first = block[0];
    if block.iter().all(|&value| value == first) {
        return first;
    }
    let zero = T::default();
    let mut best = (0, zero);
    for &value in block {
        let count = block.iter().filter(|&&other| other == value).count();
        let wins_tie = value != zero && (best.1 == zero || value < best.1);
        if count > best.0 || (count == best.0 && wins_tie) {
            best = (count, value);
        }
    }
    best.1
}

/// How the rows of two grids belong together.
struct Blocks {
    source: [usize; 3],
    factors: [usize; 3],
    coarse: [usize; 3],
}

impl Blocks {
    fn new(source_len: usize, source_shape: [i64; 3], factors: [i64; 3], out_len: usize) -> Self {
        assert!(factors.iter().all(|&f| f > 0), "downsampling factors must be positive");
        let coarse = Box3::from_shape(coarse_shape(source_shape, factors));
        assert_eq!(source_len, Box3::from_shape(source_shape).len(), "the source does not fit its shape");
        assert_eq!(out_len, coarse.len(), "the output does not fit the coarser shape");
        let sizes = |shape: [i64; 3]| shape.map(|n| n as usize);
        Self { source: sizes(source_shape), factors: sizes(factors), coarse: sizes(coarse.shape()) }
    }

    /// The numbers of the source rows under a row of the coarser grid, in the order in which they lie.
    fn source_rows(&self, row: usize) -> Vec<usize> {
        let span =
            |axis: usize, at: usize| at * self.factors[axis]..((at + 1) * self.factors[axis]).min(self.source[axis]);
        let (y, z) = (row % self.coarse[1], row / self.coarse[1]);
        span(2, z).flat_map(|z| span(1, y).map(move |y| z * self.source[1] + y)).collect()
    }

    /// Source voxels along x under voxel `x` of the coarser grid.
    fn width(&self, x: usize) -> usize {
        self.factors[0].min(self.source[0] - x * self.factors[0])
    }
}

/// Adds the values of a box to the sums of the blocks that they lie in, counted from voxel 0 on, in f64. `part` begins and ends
/// along x where blocks do; `values` are dense over it, `sums` over the box `coarse` of blocks.
pub fn add_to_blocks<T: Element>(values: &[T], part: &Box3, factors: [i64; 3], coarse: &Box3, sums: &mut [f64]) {
    for (row, (y, z)) in values.chunks_exact(part.shape()[0] as usize).zip(part.rows()) {
        let first = [part.lo[0], y, z];
        let at = coarse.offset_of(std::array::from_fn(|a| first[a].div_euclid(factors[a])));
        for (block, sum) in row.chunks_exact(factors[0] as usize).zip(&mut sums[at..]) {
            *sum += block.iter().map(|value| value.to_f64()).sum::<f64>();
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use half::f16;
    use proptest::prelude::*;

    use super::*;

    /// The block of every output voxel, gathered voxel by voxel.
    fn blocks_of<T: Element>(source: &[T], shape: [i64; 3], factors: [i64; 3]) -> Vec<Vec<T>> {
        let domain = Box3::from_shape(shape);
        let mut found = BTreeMap::<[i64; 3], Vec<T>>::new();
        for (y, z) in domain.rows() {
            for x in 0..shape[0] {
                let key = [z / factors[2], y / factors[1], x / factors[0]];
                found.entry(key).or_default().push(source[domain.offset_of([x, y, z])]);
            }
        }
        found.into_values().collect()
    }

    fn mode_by_counting(block: &[u16]) -> u16 {
        let mut counts = BTreeMap::<u16, usize>::new();
        for &value in block {
            *counts.entry(value).or_default() += 1;
        }
        let most = counts.values().copied().max().unwrap();
        let tied: Vec<u16> = counts.iter().filter(|entry| *entry.1 == most).map(|entry| *entry.0).collect();
        tied.iter().copied().find(|&value| value != 0).unwrap_or(0)
    }

    fn volume() -> impl Strategy<Value = ([i64; 3], [i64; 3], Vec<u16>)> {
        ([1_i64..8, 1_i64..8, 1_i64..8], [1_i64..4, 1_i64..4, 1_i64..4], 1_u16..5).prop_flat_map(
            |(shape, factors, top)| {
                let len = Box3::from_shape(shape).len();
                prop::collection::vec(0..=top, len).prop_map(move |values| (shape, factors, values))
            },
        )
    }

    proptest! {
        #[test]
        fn mode_counts_every_block((shape, factors, values) in volume()) {
            let mut out = vec![9; Box3::from_shape(coarse_shape(shape, factors)).len()];
            mode(&values, shape, factors, &mut out);
            let expected: Vec<u16> = blocks_of(&values, shape, factors).iter().map(|b| mode_by_counting(b)).collect();
            prop_assert_eq!(out, expected);
        }

        #[test]
        fn integer_mean_is_the_rounded_quotient((shape, factors, values) in volume()) {
            let values: Vec<u16> = values.iter().map(|v| v * 16001).collect();
            let mut out = vec![9; Box3::from_shape(coarse_shape(shape, factors)).len()];
            mean(&values, shape, factors, &mut out);
            // Half rounds up: floor((2 sum + n) / 2n), in whole numbers.
            let rounded = |b: &Vec<u16>| {
                let (sum, n) = (b.iter().map(|&v| u64::from(v)).sum::<u64>(), b.len() as u64);
                ((2 * sum + n) / (2 * n)) as u16
            };
            let expected: Vec<u16> = blocks_of(&values, shape, factors).iter().map(rounded).collect();
            prop_assert_eq!(out, expected);
        }
    }

    #[test]
    fn a_linear_ramp_keeps_its_values_at_the_new_centres() {
        // The mean of a linear function over a block is its value at the block's centre, (factor - 1) / 2 further on.
        let (shape, factors) = ([8, 6, 4], [2, 2, 1]);
        let ramp = |p: [f64; 3]| 3.0 * p[0] - 2.0 * p[1] + 0.5 * p[2];
        let source: Vec<f64> = Box3::from_shape(shape)
            .rows()
            .flat_map(|(y, z)| (0..8).map(move |x| ramp([x as f64, y as f64, z as f64])))
            .collect();
        let mut out = vec![0.0; 4 * 3 * 4];
        mean(&source, shape, factors, &mut out);
        for (y, z) in Box3::from_shape([4, 3, 4]).rows() {
            for x in 0..4 {
                let at = Box3::from_shape([4, 3, 4]).offset_of([x, y, z]);
                assert_eq!(out[at], ramp([2.0 * x as f64 + 0.5, 2.0 * y as f64 + 0.5, z as f64]));
            }
        }
    }

    #[test]
    fn every_type_has_a_mean() {
        let mut out = [f16::ZERO];
        mean(&[f16::from_f64(1.0), f16::from_f64(2.0)], [2, 1, 1], [2, 1, 1], &mut out);
        assert_eq!(out[0].to_f64(), 1.5);
        let mut out = [0_u32];
        mean(&[u32::MAX, u32::MAX - 1], [1, 1, 2], [1, 1, 2], &mut out);
        assert_eq!(out[0], u32::MAX, "a half rounds away from zero");
    }

    #[test]
    fn boxes_give_the_bits_of_the_whole() {
        let (shape, factors) = ([13, 9, 7], [2, 2, 2]);
        let domain = Box3::from_shape(shape);
        let source: Vec<f32> = (0..domain.len()).map(|i| (i as f32 * 0.77).sin()).collect();
        let coarse = Box3::from_shape(coarse_shape(shape, factors));
        assert_eq!(coarse.shape(), [7, 5, 4]);
        let mut whole = vec![0.0; coarse.len()];
        mean(&source, shape, factors, &mut whole);
        let part = Box3::new([3, 1, 2], [7, 5, 4]);
        let from = Box3::new([6, 2, 4], [13, 9, 7]);
        assert_eq!(coarse_box(&from, factors), part);
        let gathered: Vec<f32> = from
            .rows()
            .flat_map(|(y, z)| source[domain.offset_of([from.lo[0], y, z])..][..from.shape()[0] as usize].to_vec())
            .collect();
        let mut out = vec![0.0; part.len()];
        mean(&gathered, from.shape(), factors, &mut out);
        for (y, z) in part.rows() {
            for x in part.lo[0]..part.hi[0] {
                assert_eq!(out[part.offset_of([x, y, z])], whole[coarse.offset_of([x, y, z])]);
            }
        }
    }

    #[test]
    fn ties_go_to_the_smallest_label_that_is_not_background() {
        let mut out = [0_u8; 1];
        mode(&[0, 0, 0, 0, 7, 7, 3, 3_u8], [2, 2, 2], [2, 2, 2], &mut out);
        assert_eq!(out, [0], "the background wins with more voxels");
        mode(&[0, 0, 0, 7, 7, 7, 3, 3_u8], [2, 2, 2], [2, 2, 2], &mut out);
        assert_eq!(out, [7]);
        mode(&[9, 9, 0, 0, 7, 7, 3, 3_u8], [2, 2, 2], [2, 2, 2], &mut out);
        assert_eq!(out, [3]);
    }

    #[test]
    fn sums_of_blocks_by_slabs_are_their_means_by_their_voxels() {
        let (factors, part) = ([2, 1, 3], Box3::new([-4, 2, 3], [4, 5, 9]));
        let coarse = Box3::new([-2, 2, 1], [2, 5, 3]);
        let values: Vec<u8> = (0..part.len()).map(|n| (n * 37 % 251) as u8).collect();
        let mut sums = vec![0.0; coarse.len()];
        let (low, high) = values.split_at(part.len() / 2);
        add_to_blocks(low, &Box3::new(part.lo, [4, 5, 6]), factors, &coarse, &mut sums);
        add_to_blocks(high, &Box3::new([-4, 2, 6], part.hi), factors, &coarse, &mut sums);
        let mut means = vec![0.0_f64; coarse.len()];
        let exact: Vec<f64> = values.iter().map(|value| f64::from(*value)).collect();
        mean(&exact, part.shape(), factors, &mut means);
        assert!(sums.iter().zip(&means).all(|(sum, mean)| (sum / 6.0 - mean).abs() < 1e-9));
    }
}
