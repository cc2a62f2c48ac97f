//! The gaps between labelled objects on one box: background from which the distances to the nearest object and to the
//! nearest other one are together no more than a width, and that a ball in the background, with six sevenths of this
//! as its radius, does not reach. The first tells places between two objects, the second keeps the outer surface (the
//! morphological closing of Serra 1982): the ball hangs a sixth of the width into a gap as wide as that. A larger one fills
//! more of the groove outside of where two objects meet, and so enlarges their contact; a smaller one shortens it.
//!
//! Where a wall's place is to be found in the image, objects also give back what lies within a small depth of their
//! surface beside another object. Of each object the voxels farthest within stay, so none vanishes.
//!
//! Distances are Euclidean, between voxel centres ([`Nearness`]); widths are between the voxels' faces.

use super::nearness::Nearness;
use crate::grid::{Box3, NEIGHBOURS_26};

/// Belongs to nobody.
pub const OUTSIDE: u8 = 0;
/// Belongs to its object.
pub const SEED: u8 = 1;
/// An object's, to be shared out anew.
pub const GIVEN: u8 = 2;
/// Nobody's, to be shared out.
pub const GAP: u8 = 3;

/// The radius of the ball, of the width.
const BALL: f64 = 0.85;

/// Bins of widths for one smallest spacing.
pub const BINS: f64 = 4.0;

/// Finds gaps box by box; keeps its working memory between boxes.
#[derive(Clone, Debug)]
pub struct Gaps {
    /// As far as the radius of the ball.
    ball: Nearness,
    /// As far as two objects of one gap are apart.
    across: Nearness,
    /// As far as objects give back; none where they keep all.
    depth: Option<Nearness>,
    width: f64,
    least: f64,
    reached: Vec<f32>,
    found: Vec<f32>,
    nearest: [Vec<f32>; 2],
    depths: Vec<f32>,
}

impl Gaps {
    /// For gaps up to `width`, a length; objects give back voxels up to `depth` smallest spacings from their surface.
    #[must_use]
    pub fn new(spacing: [f64; 3], width: f64, depth: f64) -> Self {
        let least = spacing.iter().copied().fold(f64::INFINITY, f64::min);
        Self {
            // From a voxel's centre to its face is half a spacing.
            ball: Nearness::new(spacing, BALL * width + 0.5 * least),
            // From the deepest voxel that is given back to the other object.
            across: Nearness::new(spacing, width + (depth + 0.5) * least),
            depth: (depth > 0.0).then(|| Nearness::new(spacing, (depth + 0.5) * least)),
            width,
            least,
            reached: Vec::new(),
            found: Vec::new(),
            nearest: Default::default(),
            depths: Vec::new(),
        }
    }

    /// How many voxels around a box are looked at, along each axis.
    #[must_use]
    pub fn halo(&self) -> [i64; 3] {
        let depth = self.depth.as_ref().map_or([0; 3], Nearness::halo);
        let (ball, across) = (self.ball.halo(), self.across.halo());
        std::array::from_fn(|a| (2 * ball[a]).max(across[a]).max(depth[a] + 1))
    }

    /// How many of them tell of widths.
    #[must_use]
    pub fn across(&self) -> [i64; 3] {
        self.across.halo()
    }

    /// Tells what each voxel of `part` is, into `out`; `labels` is dense over `around`, which reaches the halo around.
    pub fn classify(&mut self, labels: &[u32], around: &Box3, part: &Box3, out: &mut [u8]) {
        // What lies between two objects, and how deep, is seen from less far than the ball comes from.
        let depth = self.depth.as_ref().map_or([0; 3], Nearness::halo);
        let reach: [i64; 3] = std::array::from_fn(|a| self.across.halo()[a].max(depth[a] + 1));
        let near =
            Box3::new(std::array::from_fn(|a| part.lo[a] - reach[a]), std::array::from_fn(|a| part.hi[a] + reach[a]));
        let labels_near: Vec<u32> = places(around, &near).map(|at| labels[at]).collect();
        let roots = distinct(&labels_near);
        if roots.len() < 2 {
            let own = places(around, part).map(|at| if labels[at] > 0 { SEED } else { OUTSIDE });
            out.iter_mut().zip(own).for_each(|(out, own)| *out = own);
            return;
        }
        self.two_nearest(&labels_near, &roots, &near);
        self.measure_depths(&labels_near, &roots, &near);
        for (at, out) in places(&near, part).zip(out.iter_mut()) {
            *out = match labels_near[at] {
                0 if self.is_narrow(at) => GAP,
                0 => OUTSIDE,
                _ if self.nearest[1][at].is_finite() && self.is_shallow(&labels_near, &near, at) => GIVEN,
                _ => SEED,
            };
        }
        if out.contains(&GAP) {
            self.roll_ball(labels, around);
            let is_reached = |(at, state): &(usize, &mut u8)| **state == GAP && self.reached[*at].is_finite();
            places(around, part).zip(out).filter(is_reached).for_each(|(_, state)| *state = OUTSIDE);
        }
    }

    /// The widths of gaps as seen from the surface voxels in `part`: how many there are of each width, in bins. Of
    /// objects that touch the width is 0.
    #[must_use]
    pub fn widths(&mut self, labels: &[u32], around: &Box3, part: &Box3) -> Vec<u64> {
        let roots = distinct(labels);
        let mut bins = Vec::new();
        if roots.len() < 2 {
            return bins;
        }
        self.two_nearest(labels, &roots, around);
        let strides = strides(around);
        for at in places(around, part) {
            let beside = strides.into_iter().flat_map(|s| [labels[at + s], labels[at - s]]);
            let own = labels[at];
            let faces_other = beside.into_iter().any(|other| other > 0 && other != own);
            let across = self.nearest[1][at];
            if !faces_other || !across.is_finite() {
                continue;
            }
            let width = if own > 0 { 0.0 } else { f64::from(across).sqrt() };
            let bin = (BINS * width / self.least).round() as usize;
            bins.resize(bins.len().max(bin + 1), 0);
            bins[bin] += 1;
        }
        bins
    }

    /// The squared distances to the nearest and to the second nearest object.
    fn two_nearest(&mut self, labels: &[u32], roots: &[u32], around: &Box3) {
        let [first, second] = &mut self.nearest;
        for nearest in [&mut *first, &mut *second] {
            nearest.clear();
            nearest.resize(labels.len(), f32::INFINITY);
        }
        for &root in roots {
            self.across.squared(around.shape(), |n| labels[n] == root, &mut self.found);
            for ((first, second), &d) in first.iter_mut().zip(second.iter_mut()).zip(&self.found) {
                *second = second.min(d.max(*first));
                *first = first.min(d);
            }
        }
    }

    /// Whether two objects are near enough on either side of a voxel.
    fn is_narrow(&self, at: usize) -> bool {
        let [first, second] = [0, 1].map(|n| f64::from(self.nearest[n][at]).sqrt());
        // Between the faces of two voxels there is one spacing less than between their centres.
        first + second <= self.width + self.least * (1.0 + 1e-6)
    }

    /// Which voxels a ball in the background reaches: finite where it does.
    fn roll_ball(&mut self, labels: &[u32], around: &Box3) {
        self.ball.squared(around.shape(), |n| labels[n] > 0, &mut self.found);
        let found = &self.found;
        self.ball.squared(around.shape(), |n| found[n].is_infinite(), &mut self.reached);
    }

    /// How deep voxels lie in their objects, as far as these give back: squared, infinite beyond.
    fn measure_depths(&mut self, labels: &[u32], roots: &[u32], around: &Box3) {
        let Some(depth) = &mut self.depth else { return };
        self.depths.clear();
        self.depths.resize(labels.len(), f32::INFINITY);
        for &root in roots {
            depth.squared(around.shape(), |n| labels[n] != root, &mut self.found);
            for (n, depth) in self.depths.iter_mut().enumerate().filter(|(n, _)| labels[*n] == root) {
                *depth = self.found[n];
            }
        }
    }

    /// Whether a voxel is given back: near its object's surface, and another of the object beside it is deeper.
    fn is_shallow(&self, labels: &[u32], around: &Box3, at: usize) -> bool {
        if self.depth.is_none() || self.depths[at].is_infinite() {
            return false;
        }
        let [x, y, z] = strides(around).map(|s| s as i64);
        NEIGHBOURS_26.iter().any(|step| {
            let beside = (at as i64 + step[0] * x + step[1] * y + step[2] * z) as usize;
            labels[beside] == labels[at] && self.depths[beside] > self.depths[at]
        })
    }
}

/// The labels in a box but 0, sorted.
fn distinct(labels: &[u32]) -> Vec<u32> {
    let mut found: Vec<u32> = labels.chunk_by(|a, b| a == b).map(|run| run[0]).filter(|label| *label > 0).collect();
    found.sort_unstable();
    found.dedup();
    found
}

/// The places of a part's voxels in the box around it.
fn places<'a>(around: &'a Box3, part: &'a Box3) -> impl Iterator<Item = usize> + 'a {
    part.rows().flat_map(|(y, z)| {
        let start = around.offset_of([part.lo[0], y, z]);
        start..start + part.shape()[0] as usize
    })
}

fn strides(around: &Box3) -> [usize; 3] {
    let [width, height, _] = around.shape().map(|n| n as usize);
    [1, width, width * height]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tells the row of voxels along x through the middle of a box that `label` describes.
    fn row(gaps: &mut Gaps, width: i64, label: impl Fn([i64; 3]) -> u32) -> String {
        let part = Box3::new([0; 3], [width, 1, 1]);
        let halo = gaps.halo();
        let around = Box3::new(halo.map(|v| -v), std::array::from_fn(|a| part.hi[a] + halo[a]));
        let voxels = around.rows().flat_map(|(y, z)| (around.lo[0]..around.hi[0]).map(move |x| [x, y, z]));
        let labels: Vec<u32> = voxels.map(label).collect();
        let mut out = vec![9; part.len()];
        gaps.classify(&labels, &around, &part, &mut out);
        out.iter().map(|state| char::from(b'0' + state)).collect()
    }

    #[test]
    fn a_gap_is_as_wide_as_the_ball_at_most() {
        let slabs = |gap: i64| move |v: [i64; 3]| if v[0] < 5 { 1 } else { 2 * u32::from(v[0] >= 5 + gap) };
        assert_eq!(row(&mut Gaps::new([1.0; 3], 3.0, 0.0), 14, slabs(3)), "11111333111111");
        assert_eq!(row(&mut Gaps::new([1.0; 3], 3.0, 0.0), 14, slabs(4)), "11111000011111");
        assert_eq!(row(&mut Gaps::new([1.0; 3], 3.0, 2.0), 14, slabs(3)), "11122333221111");
        assert_eq!(row(&mut Gaps::new([1.0; 3], 3.0, 2.0), 14, slabs(0)), "11122221111111");
        let folded = |v: [i64; 3]| u32::from(v[0] < 5 || v[0] >= 8);
        assert_eq!(row(&mut Gaps::new([1.0; 3], 3.0, 2.0), 14, folded), "11111000111111", "one object's own fold");
    }

    #[test]
    fn the_outer_surface_stays_and_thin_objects_do() {
        // Two blocks with a gap of 2 between, that end above y = 0: the gap is filled up to their ends, not beyond.
        let blocks = |below: i64| {
            move |v: [i64; 3]| match v[0] {
                _ if v[1] >= below => 0,
                ..5 => 1,
                5..7 => 0,
                _ => 2,
            }
        };
        let mut gaps = Gaps::new([1.0; 3], 4.0, 0.0);
        assert_eq!(row(&mut gaps, 12, blocks(3)), "111113311111");
        assert_eq!(row(&mut gaps, 12, blocks(0)), "000000000000");
        // A sheet of two voxels between others keeps its voxels.
        let sheet = |v: [i64; 3]| match v[0] {
            ..4 => 1,
            4..6 => 2,
            _ => 3,
        };
        assert_eq!(row(&mut Gaps::new([1.0; 3], 2.0, 2.0), 10, sheet), "1122112211");
    }

    #[test]
    fn widths_are_counted_as_seen_from_the_surfaces() {
        let around = Box3::new([-6; 3], [12, 7, 7]);
        let part = Box3::new([0; 3], [6, 1, 1]);
        let voxels = || around.rows().flat_map(|(y, z)| (around.lo[0]..around.hi[0]).map(move |x| [x, y, z]));
        let mut gaps = Gaps::new([1.0; 3], 5.0, 0.0);
        let labels: Vec<u32> = voxels().map(|v| u32::from(v[0] < 1) + 2 * u32::from(v[0] >= 4)).collect();
        let bins = gaps.widths(&labels, &around, &part);
        assert_eq!(bins.iter().enumerate().filter(|(_, n)| **n > 0).collect::<Vec<_>>(), [(12, &2)]);
        let labels: Vec<u32> = voxels().map(|v| 1 + u32::from(v[0] >= 4)).collect();
        assert_eq!(gaps.widths(&labels, &around, &part), [2]);
    }
}
