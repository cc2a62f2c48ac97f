//! Label volumes: painting an object where its segmentation function says so, counting voxels, borders.

use std::collections::BTreeMap;

use crate::grid::{Box3, FACES};
use crate::store::Element;

/// Writes `label` into `out` where u is at least 1/2. `u` is dense `[z][y][x]` over the box `from`, `out` over the box
/// `to`, which holds `from`.
pub fn paint<T: Element>(u: &[f32], from: &Box3, label: T, to: &Box3, out: &mut [T]) {
    let width = from.shape()[0] as usize;
    for (row, (y, z)) in u.chunks_exact(width).zip(from.rows()) {
        let out = &mut out[to.offset_of([from.lo[0], y, z])..][..width];
        out.iter_mut().zip(row).filter(|(_, u)| **u >= 0.5).for_each(|(o, _)| *o = label);
    }
}

/// Which objects claim a voxel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Claims {
    /// How many.
    pub count: u32,
    /// The last of them; 0 where none does.
    pub last: u32,
    /// Whether the one whose label the voxel has is among them.
    pub own: bool,
}

/// Adds the claims of an object, at the voxels that [`paint`] would give its label. `labels` and `claims` are dense over `to`.
pub fn claim(u: &[f32], from: &Box3, label: u32, to: &Box3, labels: &[u32], claims: &mut [Claims]) {
    let width = from.shape()[0] as usize;
    for (row, (y, z)) in u.chunks_exact(width).zip(from.rows()) {
        let start = to.offset_of([from.lo[0], y, z]);
        let voxels = claims[start..][..width].iter_mut().zip(&labels[start..]);
        for ((claims, own), _) in voxels.zip(row).filter(|(_, u)| **u >= 0.5) {
            *claims = Claims { count: claims.count + 1, last: label, own: claims.own || *own == label };
        }
    }
}

/// 1 where voxels have a label, else 0.
#[must_use]
pub fn mask(labels: &[u32], label: u32) -> Vec<f32> {
    labels.iter().map(|&other| f32::from(u8::from(other == label))).collect()
}

/// Voxels of each label but 0.
#[must_use]
pub fn count(labels: &[u32]) -> BTreeMap<u32, u64> {
    let mut counts = BTreeMap::new();
    // Equal labels come in long runs.
    for run in labels.chunk_by(|a, b| a == b).filter(|run| run[0] > 0) {
        *counts.entry(run[0]).or_default() += run.len() as u64;
    }
    counts
}

/// Keeps the labels of voxels that have a face neighbour of another label, and sets all others to the default. `labels` is
/// dense over `around`, which reaches one voxel around `part` but for the domain's end; `out` is dense over `part`.
pub fn border<T: Copy + Default + PartialEq>(labels: &[T], around: &Box3, part: &Box3, out: &mut [T]) {
    let strides = [1, around.shape()[0] as usize, (around.shape()[0] * around.shape()[1]) as usize];
    let rows = part.rows().flat_map(|(y, z)| (part.lo[0]..part.hi[0]).map(move |x| [x, y, z]));
    for (out, voxel) in out.iter_mut().zip(rows) {
        let at = around.offset_of(voxel);
        let differs = FACES.into_iter().any(|face| {
            let (here, stride) = (voxel[face.axis], strides[face.axis]);
            let has_next = if face.upper { here + 1 < around.hi[face.axis] } else { here > around.lo[face.axis] };
            has_next && labels[if face.upper { at + stride } else { at - stride }] != labels[at]
        });
        *out = if differs { labels[at] } else { T::default() };
    }
}

/// The voxels of a box that have a label, with it, in the order of the voxels; `labels` is dense over the box.
pub fn labelled<'a>(labels: &'a [u32], part: &'a Box3) -> impl Iterator<Item = ([i64; 3], u32)> + 'a {
    let rows = part.rows().zip(labels.chunks_exact(part.shape()[0] as usize));
    rows.flat_map(|((y, z), row)| (part.lo[0]..).zip(row).map(move |(x, &label)| ([x, y, z], label)))
        .filter(|(_, label)| *label > 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn claims_are_where_paint_paints() {
        let all = Box3::from_shape([6, 5, 4]);
        let boxes = [Box3::new([1, 0, 1], [5, 4, 3]), Box3::new([0, 2, 0], [6, 5, 4])];
        let u = |part: &Box3, seed: usize| (0..part.len()).map(|n| ((n * seed) % 7) as f32 / 6.0).collect::<Vec<f32>>();
        let mut labels = vec![0_u32; all.len()];
        boxes.iter().zip(1..).for_each(|(part, label)| paint(&u(part, 3), part, label, &all, &mut labels));
        let mut claims = vec![Claims::default(); all.len()];
        for (part, label) in boxes.iter().zip(1..) {
            claim(&u(part, 3), part, label, &all, &labels, &mut claims);
        }
        assert!(claims.iter().any(|claims| claims.count == 2));
        for (claims, label) in claims.iter().zip(&labels) {
            assert_eq!((claims.last, claims.own), (*label, *label > 0), "who is painted last is the last to claim");
        }
    }

    #[test]
    fn objects_are_painted_from_one_half_on() {
        let (from, to) = (Box3::new([1, 0, 3], [3, 2, 4]), Box3::new([0, 0, 3], [4, 2, 4]));
        let mut out = [9_u8, 9, 9, 9, 0, 0, 0, 0];
        paint(&[0.5, 0.4999, 0.0, 1.0], &from, 3, &to, &mut out);
        assert_eq!(out, [9, 3, 9, 9, 0, 0, 3, 0]);
    }

    #[test]
    fn labels_are_counted_wherever_they_stand() {
        let counts = count(&[0, 2, 2, 0, 1, 2, 70_000, 1, 1]);
        assert_eq!(counts, BTreeMap::from([(1, 3), (2, 3), (70_000, 1)]));
        assert!(count(&[0, 0]).is_empty() && count(&[]).is_empty());
    }

    #[test]
    fn one_label_is_told_from_others() {
        let labels = [9, 9, 4, 4, 0];
        assert_eq!(mask(&labels, 4), [0.0, 0.0, 1.0, 1.0, 0.0]);
        let part = Box3::new([3, 5, 7], [8, 6, 8]);
        assert_eq!(labelled(&labels, &part).last(), Some(([6, 5, 7], 4)));
        assert_eq!(labelled(&labels, &part).count(), 4);
    }
}
