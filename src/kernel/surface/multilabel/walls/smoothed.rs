//! The indicator functions of the labels in a box under three Gaussians, each twice as wide as the one before.
//!
//! Widths are in voxels, as terraces are made of voxels; where these are oblong they are larger along their shorter edges, along
//! which terraces are wider. Cut at 2.5 widths. A label is smoothed only around its own voxels, so many small ones cost no more
//! than a few large ones. Values depend on nothing but the voxels that the Gaussians reach, to the bit: whatever box they are
//! seen in.

use crate::grid::Box3;

/// The middle one's width of cubic voxels; the least and the largest of any.
const WIDTH: f64 = 2.0;
const WIDTHS: [f64; 2] = [1.25, 3.0];
/// The three, as parts of that.
pub(super) const PARTS: [f64; 3] = [0.5, 1.0, 2.0];
/// Where they are cut, in widths.
const CUT: f64 = 2.5;
/// How many voxels around those of a label it is smoothed on: the other end of an edge, and one more for slopes.
const AROUND: i64 = 2;

/// The widths along each axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scales {
    pub(super) widths: [f64; 3],
}

impl Scales {
    pub(super) fn new(spacing: [f64; 3]) -> Self {
        let mean = spacing.iter().sum::<f64>() / 3.0;
        Self { widths: spacing.map(|h| (WIDTH * (mean / h).sqrt()).clamp(WIDTHS[0], WIDTHS[1])) }
    }

    /// How far the widest one reaches.
    pub(super) fn reach(self) -> [i64; 3] {
        self.widths.map(|width| radius(PARTS[2] * width))
    }
}

fn radius(width: f64) -> i64 {
    (CUT * width).round() as i64
}

/// A Gaussian along one axis.
#[derive(Clone, Debug)]
struct Weights {
    radius: i64,
    /// From the middle on.
    of_places: Vec<f32>,
    /// Those of all places before each, from that at which it begins to that behind its end.
    sums: Vec<f32>,
}

impl Weights {
    fn new(width: f64) -> Self {
        let radius = radius(width);
        let value = |n: i64| libm::exp(-0.5 * (n as f64 / width).powi(2));
        let sum: f64 = (-radius..=radius).map(value).sum();
        let sums = (-radius..=radius + 1).map(|n| ((-radius..n).map(value).sum::<f64>() / sum) as f32);
        Self { radius, of_places: (0..=radius).map(|n| (value(n) / sum) as f32).collect(), sums: sums.collect() }
    }

    /// What it sees of the places from one on up to another, counted from its middle.
    fn of_run(&self, from: i64, to: i64) -> f32 {
        let sum = |n: i64| self.sums[(n + self.radius).clamp(0, 2 * self.radius + 1) as usize];
        sum(to) - sum(from)
    }
}

/// A label in a box.
#[derive(Clone, Debug)]
struct Field {
    name: u32,
    part: Box3,
    /// Under each Gaussian, dense over the part.
    values: [Vec<f32>; 3],
}

/// The smoothed labels of a box.
#[derive(Clone, Debug)]
pub(super) struct Smoothed {
    scales: Scales,
    gaussians: [[Weights; 3]; 3],
    /// By name, those in use first; the others keep their memory.
    fields: Vec<Field>,
    used: usize,
    passes: [Vec<f32>; 2],
}

impl Smoothed {
    pub(super) fn new(scales: Scales) -> Self {
        let gaussians = PARTS.map(|part| scales.widths.map(|width| Weights::new(part * width)));
        Self { scales, gaussians, fields: Vec::new(), used: 0, passes: Default::default() }
    }

    pub(super) fn is_one(&self) -> bool {
        self.used < 2
    }

    pub(super) fn bytes(&self) -> u64 {
        let of_fields = self.fields.iter().flat_map(|field| &field.values);
        of_fields.chain(&self.passes).map(|values| (values.capacity() * size_of::<f32>()) as u64).sum()
    }

    /// Smooths the labels of `part`, dense over `around`, which reaches as far around it as the Gaussians, and one voxel more.
    pub(super) fn enter(&mut self, labels: &[u32], around: &Box3, part: &Box3) {
        let extents = extents(labels, around, part);
        self.used = extents.len();
        if self.is_one() {
            return;
        }
        let free = Field { name: 0, part: *part, values: Default::default() };
        self.fields.resize(self.fields.len().max(self.used), free);
        let Self { fields, gaussians, passes, .. } = self;
        for (field, (name, extent)) in fields.iter_mut().zip(extents) {
            (field.name, field.part) = (name, extent.grow(AROUND).intersect(&part.grow(1)));
            for (gaussian, out) in gaussians.iter().zip(&mut field.values) {
                smooth((labels, around), name, gaussian, passes, &field.part, out);
            }
        }
    }

    fn field(&self, name: u32) -> Option<&Field> {
        let used = &self.fields[..self.used];
        used.binary_search_by_key(&name, |field| field.name).ok().map(|n| &used[n])
    }

    /// What there is of two labels at a voxel.
    pub(super) fn seen(&self, labels: [u32; 2], voxel: [i64; 3]) -> [[f64; 2]; 3] {
        let fields = labels.map(|label| self.field(label).filter(|field| field.part.contains(voxel)));
        let places = fields.map(|field| field.map(|field| (field, field.part.offset_of(voxel))));
        [0, 1, 2].map(|n| places.map(|place| place.map_or(0.0, |(field, at)| f64::from(field.values[n][at]))))
    }

    /// A step into a label from one of its voxels at its wall, half the middle width long; none where it has no direction.
    pub(super) fn inward(&self, label: u32, voxel: [i64; 3]) -> Option<[f64; 3]> {
        let field = self.field(label)?;
        let value = |axis: usize, by: i64| {
            let mut beside = voxel;
            beside[axis] += by;
            f64::from(field.values[1][field.part.offset_of(beside)])
        };
        // In units of half the widths.
        let unit = self.scales.widths.map(|width| 0.5 * width);
        let slope: [f64; 3] = std::array::from_fn(|a| (value(a, 1) - value(a, -1)) * unit[a]);
        let length = slope.iter().map(|s| s * s).sum::<f64>().sqrt();
        (length > 1e-6).then(|| std::array::from_fn(|a| slope[a] / length * unit[a]))
    }
}

/// The labels in `part` and the boxes that hold their voxels there, by label.
fn extents(labels: &[u32], around: &Box3, part: &Box3) -> Vec<(u32, Box3)> {
    let mut found: Vec<(u32, Box3)> = Vec::new();
    for (y, z) in part.rows() {
        let row = &labels[around.offset_of([part.lo[0], y, z])..][..part.shape()[0] as usize];
        let mut x = part.lo[0];
        for run in row.chunk_by(|a, b| a == b) {
            let next = x + run.len() as i64;
            let own = Box3::new([x, y, z], [next, y + 1, z + 1]);
            match found.binary_search_by_key(&run[0], |(label, _)| *label) {
                Ok(n) => {
                    let all = &mut found[n].1;
                    *all = Box3::new(
                        std::array::from_fn(|a| all.lo[a].min(own.lo[a])),
                        std::array::from_fn(|a| all.hi[a].max(own.hi[a])),
                    );
                }
                Err(n) => found.insert(n, (run[0], own)),
            }
            x = next;
        }
    }
    found
}

/// Fills `out` with what a Gaussian sees of a label on `part`.
fn smooth(
    (labels, around): (&[u32], &Box3),
    name: u32,
    gaussian: &[Weights; 3],
    [first, second]: &mut [Vec<f32>; 2],
    part: &Box3,
    out: &mut Vec<f32>,
) {
    let [along_x, along_y, along_z] = gaussian;
    let mut slab = *part;
    (slab.lo[2], slab.hi[2]) = (part.lo[2] - along_z.radius, part.hi[2] + along_z.radius);
    let mut wide = slab;
    (wide.lo[1], wide.hi[1]) = (part.lo[1] - along_y.radius, part.hi[1] + along_y.radius);
    let width = part.shape()[0] as usize;
    let (lowest, length) = (part.lo[0] - along_x.radius, width + 2 * along_x.radius as usize);
    first.clear();
    first.resize(wide.len(), 0.0);
    let mut has_any = vec![false; first.len() / width];
    for ((row, any), (y, z)) in first.chunks_exact_mut(width).zip(&mut has_any).zip(wide.rows()) {
        let from = around.offset_of([lowest, y, z]);
        let mut x = lowest;
        for run in labels[from..][..length].chunk_by(|a, b| a == b) {
            let next = x + run.len() as i64;
            if run[0] == name {
                *any = true;
                for (out, here) in row.iter_mut().zip(part.lo[0]..) {
                    *out += along_x.of_run(x - here, next - here);
                }
            }
            x = next;
        }
    }
    second.clear();
    second.resize(slab.len(), 0.0);
    let (rows, height) = (wide.shape()[1] as usize, part.shape()[1] as usize);
    let mut has_any_then = vec![false; slab.len() / width];
    for (n, any) in has_any_then.iter_mut().enumerate() {
        let start = n / height * rows + n % height;
        *any = add_rows(first, &has_any, start, 1, along_y, &mut second[n * width..][..width]);
    }
    out.clear();
    out.resize(part.len(), 0.0);
    for (n, row) in out.chunks_exact_mut(width).enumerate() {
        add_rows(second, &has_any_then, n, height, along_z, row);
    }
}

/// Adds the rows from one on, some apart, by their weights; says whether there was anything in them. What is nothing changes no bit.
fn add_rows(rows: &[f32], has_any: &[bool], start: usize, apart: usize, along: &Weights, out: &mut [f32]) -> bool {
    let mut found = false;
    for n in 0..2 * along.radius as usize + 1 {
        let row = start + n * apart;
        if has_any[row] {
            found = true;
            let weight = along.of_places[n.abs_diff(along.radius as usize)];
            let values = &rows[row * out.len()..][..out.len()];
            out.iter_mut().zip(values).for_each(|(out, value)| *out += weight * value);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_become_their_gaussians_whatever_box_they_are_seen_in() {
        let scales = Scales::new([1.0, 2.0, 0.5]);
        let reach = scales.reach().map(|n| n + 1);
        let seen_in = |part: Box3| {
            let around = Box3::new(
                std::array::from_fn(|a| part.lo[a] - reach[a]),
                std::array::from_fn(|a| part.hi[a] + reach[a]),
            );
            let voxels = around.rows().flat_map(|(y, z)| (around.lo[0]..around.hi[0]).map(move |x| [x, y, z]));
            let label = |[x, y, z]: [i64; 3]| if x + 2 * y + z < 21 { 3 } else { u32::from((x - y) % 7 == 0) };
            let mut smoothed = Smoothed::new(scales);
            smoothed.enter(&voxels.map(label).collect::<Vec<_>>(), &around, &part);
            (smoothed, label)
        };
        let part = Box3::new([4, 3, 5], [9; 3]);
        let ((large, label), (small, _)) = (seen_in(Box3::new([0; 3], [12; 3])), seen_in(part));
        // Walls ask for a label at its voxels and those beside them.
        let is_beside = |here: [i64; 3], name: u32| {
            let around = Box3::new(here.map(|v| v - 1), here.map(|v| v + 2)).intersect(&part);
            around.rows().any(|(y, z)| (around.lo[0]..around.hi[0]).any(|x| label([x, y, z]) == name))
        };
        let mut compared = 0;
        for (y, z) in part.rows() {
            for x in (4..9).filter(|&x| [0, 3].iter().all(|&name| is_beside([x, y, z], name))) {
                let here = [x, y, z];
                compared += 1;
                let found = small.seen([0, 3], here);
                assert_eq!(found, large.seen([0, 3], here), "{here:?}");
                // Term by term.
                let value = |n: i64, width: f64| (-0.5 * (n as f64 / width).powi(2)).exp();
                let (mut sum, mut all) = (0.0, 0.0);
                let [rx, ry, rz] = scales.widths.map(radius);
                for (v, w) in Box3::new([0, -ry, -rz], [1, ry + 1, rz + 1]).rows() {
                    for u in -rx..=rx {
                        let weight: f64 =
                            [u, v, w].iter().zip(scales.widths).map(|(n, width)| value(*n, width)).product();
                        all += weight;
                        sum += if label([x + u, y + v, z + w]) == 3 { weight } else { 0.0 };
                    }
                }
                assert!((found[1][1] - sum / all).abs() < 1e-5, "{here:?}: {found:?}");
            }
        }
        assert!(compared > 30, "{compared}");
    }
}
