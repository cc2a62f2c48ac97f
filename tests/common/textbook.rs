//! The printed loops over a whole volume (Kósa & Mikula 2023, Alg. 1-3 and 7, errata of the descending loops), plain
//! and in the printed order: nothing is shared with the program.
//!
//! Bits follow from the order of operations, so the arithmetic of one update is stated here as the program states it in
//! its documentation: in f64, counted from the smallest neighbour, rounded once to the stored type.

use half::f16;
use strandline::grid::Geometry;
use strandline::kernel::distance::state::precision::Precision;

use super::lab::PlainGrid;

/// A type that distances are stored as.
pub(crate) trait Stored: Precision {
    /// The value as stored.
    fn store(value: f64) -> Self;
    /// The place of a value that is not negative among all values of its type.
    fn rank(self) -> u64;
}

impl Stored for f64 {
    fn store(value: f64) -> Self {
        value
    }
    fn rank(self) -> u64 {
        self.to_bits()
    }
}

impl Stored for f32 {
    fn store(value: f64) -> Self {
        value as Self
    }
    fn rank(self) -> u64 {
        self.to_bits().into()
    }
}

impl Stored for f16 {
    fn store(value: f64) -> Self {
        Self::from_f32(value as f32)
    }
    fn rank(self) -> u64 {
        self.to_bits().into()
    }
}

/// World position of a voxel's centre.
pub(crate) fn position(geometry: &Geometry, v: [i64; 3]) -> [f64; 3] {
    std::array::from_fn(|a| geometry.origin[a] + v[a] as f64 * geometry.spacing[a])
}

/// The squared distance of two positions.
pub(crate) fn squared(p: [f64; 3], q: [f64; 3]) -> f64 {
    let (x, y, z) = (p[0] - q[0], p[1] - q[1], p[2] - q[2]);
    x * x + y * y + z * z
}

/// Alg. 1: for each voxel the source that fixes it, if any. Points whose cell does not start in the grid are left out.
pub(crate) fn fixing_sources(geometry: &Geometry, cloud: &[[f64; 3]]) -> Vec<Option<usize>> {
    let grid = PlainGrid { shape: geometry.shape };
    let mut fixing: Vec<Option<usize>> = vec![None; grid.len()];
    for (source, p) in cloud.iter().enumerate() {
        let base: [i64; 3] =
            std::array::from_fn(|a| ((p[a] - geometry.origin[a]) / geometry.spacing[a]).floor() as i64);
        if !grid.contains(base) {
            continue;
        }
        for corner in (PlainGrid { shape: [2; 3] }).voxels() {
            let v: [i64; 3] = std::array::from_fn(|a| base[a] + corner[a]);
            if grid.contains(v) {
                let here = position(geometry, v);
                let kept = fixing[grid.at(v)].map_or(f64::INFINITY, |s| squared(here, cloud[s]));
                if squared(here, *p) < kept {
                    fixing[grid.at(v)] = Some(source);
                }
            }
        }
    }
    fixing
}

/// The voxels of one sweep; of eight, x turns round every time, y every second, z every fourth.
fn sweep_order(shape: [i64; 3], sweep: usize) -> impl Iterator<Item = [i64; 3]> {
    PlainGrid { shape }
        .voxels()
        .map(move |v| std::array::from_fn(|a| if sweep >> a & 1 == 0 { v[a] } else { shape[a] - 1 - v[a] }))
}

/// The x with `sum (((x - a) / h)^+)^2 = 1` for the smaller neighbours `a` and spacings `h` along x, y, z (eq. 9).
pub(crate) fn godunov(near: [f64; 3], spacing: [f64; 3]) -> f64 {
    upwind(near, spacing).0
}

/// That x; the axes in order of their `a`, of equal ones x before y before z; and the solutions on the way to x without
/// the second and without the third axis.
fn upwind(near: [f64; 3], spacing: [f64; 3]) -> (f64, [usize; 3], [f64; 2]) {
    let weight = spacing.map(|h| 1.0 / (h * h));
    let mut axes = [0, 1, 2];
    axes.sort_by(|&i: &usize, &j| near[i].total_cmp(&near[j]));
    let [i, j, k] = axes;
    let (b, c) = (near[j] - near[i], near[k] - near[i]);
    let one = near[i] + spacing[i];
    // Both infinite: nothing to compare with.
    if b.is_nan() || spacing[i] <= b {
        return (one, axes, [one, one]);
    }
    let mean = weight[j] * b;
    let two = weight[i] + weight[j];
    let root = (mean * mean - two * (mean * b - 1.0)).max(0.0).sqrt();
    let x = (mean + root) * (1.0 / two);
    if x <= c {
        return (near[i] + x, axes, [one, near[i] + x]);
    }
    let three = weight[0] + weight[1] + weight[2];
    let mean_of_three = mean + weight[k] * c;
    let rest = mean * b + weight[k] * c * c - 1.0;
    let root = (mean_of_three * mean_of_three - three * rest).max(0.0).sqrt();
    (near[i] + (mean_of_three + root) * (1.0 / three), axes, [one, near[i] + x])
}

/// Alg. 7, lines 8 to 20: what the neighbours' values make of a voxel, the offset that its source is taken from, and
/// the offset of the smallest neighbour. Of two equal neighbours along an axis Alg. 7 names the upper one first. An
/// axis enters when the solution without it is above its neighbour, both as they are stored.
fn update<P: Stored>(geometry: &Geometry, v: [i64; 3], value: impl Fn([i64; 3]) -> f64) -> (f64, [i64; 3], [i64; 3]) {
    let n = PlainGrid::around(v).map(value);
    let upper: [bool; 3] = std::array::from_fn(|a| n[2 * a + 1] <= n[2 * a]);
    let near: [f64; 3] = std::array::from_fn(|a| if upper[a] { n[2 * a + 1] } else { n[2 * a] });
    let (x, axes, without) = upwind(near, geometry.spacing);
    let step = |axis: usize| {
        let mut offset = [0; 3];
        offset[axis] = if upper[axis] { 1 } else { -1 };
        offset
    };
    let first = step(axes[0]);
    let mut sum = first;
    for (&axis, without) in axes[1..].iter().zip(without) {
        if P::store(without).to_f64() <= near[axis] {
            break;
        }
        sum[axis] = step(axis)[axis];
    }
    (x, sum, first)
}

/// Alg. 2: distances after so many iterations, or once one changes nothing.
pub(crate) fn fsm<P: Stored>(geometry: &Geometry, cloud: &[[f64; 3]], iterations: u32) -> Vec<P> {
    fsm_with_sources(geometry, cloud, iterations).0
}

/// Alg. 1 and 7: distances and sources.
pub(crate) fn fsm_with_sources<P: Stored>(
    geometry: &Geometry,
    cloud: &[[f64; 3]],
    iterations: u32,
) -> (Vec<P>, Vec<Option<usize>>) {
    let fixing = fixing_sources(geometry, cloud);
    let distance = |(v, s): ([i64; 3], &Option<usize>)| {
        s.map_or(P::UNKNOWN, |s| P::store(squared(position(geometry, v), cloud[s]).sqrt()))
    };
    let d = PlainGrid { shape: geometry.shape }.voxels().zip(&fixing).map(distance).collect();
    fsm_from(geometry, (d, fixing), iterations)
}

/// Alg. 7 from given fixed voxels, those that have a source: distances and sources, both updated in place; where the
/// voxel at the sum of the offsets has no source yet, that of the smallest neighbour.
pub(crate) fn fsm_from<P: Stored>(
    geometry: &Geometry,
    start: (Vec<P>, Vec<Option<usize>>),
    iterations: u32,
) -> (Vec<P>, Vec<Option<usize>>) {
    alg_7(geometry, start, iterations, true)
}

/// Alg. 7 to the letter: where the voxel at the sum of the offsets has no source, none is what is copied.
pub(crate) fn fsm_to_the_letter<P: Stored>(
    geometry: &Geometry,
    start: (Vec<P>, Vec<Option<usize>>),
    iterations: u32,
) -> (Vec<P>, Vec<Option<usize>>) {
    alg_7(geometry, start, iterations, false)
}

fn alg_7<P: Stored>(
    geometry: &Geometry,
    (mut d, mut s): (Vec<P>, Vec<Option<usize>>),
    iterations: u32,
    falls_back: bool,
) -> (Vec<P>, Vec<Option<usize>>) {
    let grid = PlainGrid { shape: geometry.shape };
    let free: Vec<bool> = s.iter().map(Option::is_none).collect();
    for _ in 0..iterations {
        let before = d.clone();
        for sweep in 0..8 {
            for v in sweep_order(geometry.shape, sweep).filter(|v| free[grid.at(*v)]) {
                let value = |q: [i64; 3]| if grid.contains(q) { d[grid.at(q)].to_f64() } else { f64::INFINITY };
                let (x, sum, first) = update::<P>(geometry, v, value);
                let lower = P::store(x);
                if lower < d[grid.at(v)] {
                    let source = |o: [i64; 3]| s[grid.at(std::array::from_fn(|a| v[a] + o[a]))];
                    let found = source(sum).or(if falls_back { source(first) } else { None });
                    d[grid.at(v)] = lower;
                    s[grid.at(v)] = found;
                }
            }
        }
        if d == before {
            break;
        }
    }
    (d, s)
}

/// Alg. 7 on finished distances: voxels in order of their distance copy the source at the sum of the offsets of the
/// neighbours that enter their update, where the distance there is smaller, else that of the smallest neighbour.
pub(crate) fn sources_along<P: Stored>(geometry: &Geometry, cloud: &[[f64; 3]], d: &[P]) -> Vec<Option<usize>> {
    let grid = PlainGrid { shape: geometry.shape };
    let voxels: Vec<[i64; 3]> = grid.voxels().collect();
    let mut s = fixing_sources(geometry, cloud);
    let free = |at: &usize| s[*at].is_none() && d[*at].to_f64().is_finite();
    let mut order: Vec<usize> = (0..d.len()).filter(free).collect();
    order.sort_by_key(|&at| d[at].rank());
    for at in order {
        let v = voxels[at];
        let value = |q: [i64; 3]| if grid.contains(q) { d[grid.at(q)].to_f64() } else { f64::INFINITY };
        let (_, sum, first) = update::<P>(geometry, v, value);
        let beside = [sum, first].map(|o| grid.at(std::array::from_fn(|a| v[a] + o[a])));
        s[at] = beside.into_iter().find(|&q| d[q].rank() < d[at].rank()).and_then(|q| s[q]);
    }
    s
}

/// Alg. 3: the sources that the sweeps leave with each voxel.
pub(crate) fn vdt(geometry: &Geometry, cloud: &[[f64; 3]], iterations: u32) -> Vec<Option<usize>> {
    let grid = PlainGrid { shape: geometry.shape };
    let fixing = fixing_sources(geometry, cloud);
    let mut source = fixing.clone();
    let distance = |v, s: Option<usize>| s.map_or(f64::INFINITY, |s: usize| squared(position(geometry, v), cloud[s]));
    for sweep in (0..iterations).flat_map(|_| 0..8) {
        for v in sweep_order(geometry.shape, sweep).filter(|v| fixing[grid.at(*v)].is_none()) {
            for q in PlainGrid::around(v).into_iter().filter(|q| grid.contains(*q)) {
                if distance(v, source[grid.at(q)]) < distance(v, source[grid.at(v)]) {
                    source[grid.at(v)] = source[grid.at(q)];
                }
            }
        }
    }
    source
}

/// The distances to sources.
pub(crate) fn distances<P: Stored>(geometry: &Geometry, cloud: &[[f64; 3]], sources: &[Option<usize>]) -> Vec<P> {
    let to = |(v, s): ([i64; 3], &Option<usize>)| {
        s.map_or(P::UNKNOWN, |s| P::from_f64(squared(position(geometry, v), cloud[s]).sqrt()))
    };
    PlainGrid { shape: geometry.shape }.voxels().zip(sources).map(to).collect()
}
