//! The different sources in a small box of a field, without a look at each of its voxels.
//!
//! The first voxel of a source in a box, z slowest, has other sources before it along x, y and z, or lies at the box's
//! lower end there. Voxels that differ from the one before are marked once for all boxes, a bit for each axis; then a row
//! of a box is one word.

use crate::grid::{Box3, NO_SOURCE};

/// Voxels along x of a box at most: bytes of a word.
pub(crate) const WIDEST: usize = 8;
/// A bit of each byte: x, y and z.
const LOWEST_BITS: u64 = 0x0101_0101_0101_0101;

/// For each voxel along which axes it differs from the one before, a bit each; [`WIDEST`] bytes more.
#[derive(Clone, Debug, Default)]
pub(crate) struct Distinct {
    differs: Vec<u8>,
}

impl Distinct {
    /// Marks the voxels of a field, dense `[z][y][x]` over `known`.
    pub(crate) fn mark(&mut self, known: &Box3, sources: &[u32]) {
        let [width, height, _] = known.shape().map(|n| n as usize);
        self.differs.clear();
        self.differs.resize(sources.len() + WIDEST, u8::MAX);
        // Before the first row and plane there is nothing: what is compared there, boxes do not read.
        let plane = (width * height).max(1);
        for (n, here) in sources.chunks(plane).enumerate() {
            let below = &sources[plane * n.saturating_sub(1)..];
            mark_plane(here, below, width, &mut self.differs[plane * n..]);
        }
    }

    /// Lists each source in a box of at most [`WIDEST`] voxels along x, once or, where it is in several pieces, more
    /// often; in the order of their first voxels, z slowest.
    pub(crate) fn list(&self, known: &Box3, sources: &[u32], part: &Box3, list: &mut Vec<u32>) {
        let width = part.shape()[0] as usize;
        list.clear();
        list.resize(part.len(), NO_SOURCE);
        let mut count = 0;
        for z in part.lo[2]..part.hi[2] {
            let first_plane = if z == part.lo[2] { 4 * LOWEST_BITS } else { 0 };
            for y in part.lo[1]..part.hi[1] {
                let row = known.offset_of([part.lo[0], y, z]);
                let first_row = if y == part.lo[1] { 2 * LOWEST_BITS } else { 0 };
                let Some(bytes) = self.differs[row..].first_chunk::<WIDEST>() else { return };
                let word = u64::from_le_bytes(*bytes) | 1 | first_row | first_plane;
                let mut firsts = word & word >> 1 & word >> 2;
                // Each is written, and the next over it unless it counts: which do is no pattern to branch on.
                for &source in &sources[row..][..width] {
                    list[count] = source;
                    count += (firsts & 1) as usize & usize::from(source != NO_SOURCE);
                    firsts >>= 8;
                }
            }
        }
        list.truncate(count);
    }
}

/// Marks a plane; `below` is the one before it.
fn mark_plane(here: &[u32], below: &[u32], width: usize, differs: &mut [u8]) {
    let differ = |a: &u32, b: &u32| u8::from(a != b);
    for ((out, a), b) in differs.iter_mut().zip(here).zip(below) {
        *out = differ(a, b) << 2;
    }
    for ((out, a), b) in differs.iter_mut().skip(1).zip(here.iter().skip(1)).zip(here) {
        *out |= differ(a, b);
    }
    for ((out, a), b) in differs.iter_mut().skip(width).zip(here.iter().skip(width)).zip(here) {
        *out |= differ(a, b) << 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn each_source_is_listed_in_order(
            shape in prop::array::uniform3(1_i64..9),
            seed in any::<u64>(),
            kinds in 1_u64..6,
            corners in prop::array::uniform3((0.0..1.0_f64, 0.0..1.0_f64)),
        ) {
            let known = Box3::new([-3, 2, 5], [shape[0] - 3, shape[1] + 2, shape[2] + 5]);
            // Runs of like sources, some of them none.
            let kind = |n: u64| ((n / 3).wrapping_add(seed).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40) % kinds;
            let source = |n| if kind(n) == 4 { NO_SOURCE } else { kind(n) as u32 };
            let sources: Vec<u32> = (0..known.len() as u64).map(source).collect();
            let lo: [i64; 3] = std::array::from_fn(|a| known.lo[a] + (corners[a].0 * shape[a] as f64) as i64);
            let hi = std::array::from_fn(|a| lo[a] + 1 + (corners[a].1 * (known.hi[a] - lo[a]) as f64) as i64);
            let part = Box3::new(lo, hi).intersect(&known);
            let (mut wanted, mut listed) = (Vec::new(), Vec::new());
            for (y, z) in part.rows() {
                for x in part.lo[0]..part.hi[0] {
                    let source = sources[known.offset_of([x, y, z])];
                    if source != NO_SOURCE && !wanted.contains(&source) {
                        wanted.push(source);
                    }
                }
            }
            let mut distinct = Distinct::default();
            distinct.mark(&known, &sources);
            distinct.list(&known, &sources, &part, &mut listed);
            let mut told = Vec::new();
            for source in listed {
                if !told.contains(&source) {
                    told.push(source);
                }
            }
            prop_assert_eq!(told, wanted);
        }
    }
}
