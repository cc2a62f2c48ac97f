//! Distance fields against the printed triple loops over the whole volume (Kósa & Mikula 2023, Alg. 1-3), bit for bit,
//! and against the exact distance to every point.

use std::sync::Arc;

use proptest::prelude::*;
use strandline::grid::{BrickSet, Geometry, PointBins};
use strandline::pipeline::distance::{Method, Sources, cloud_distance};

use crate::common::clouds::{grid_around, sphere, sponge};
use crate::common::lab::{Lab, PlainGrid, dense, whole};
use crate::common::random::Random;

/// One edge that makes a single brick of every domain here.
const WHOLE: i64 = 128;

pub(crate) fn position(geometry: &Geometry, v: [i64; 3]) -> [f64; 3] {
    std::array::from_fn(|a| geometry.origin[a] + v[a] as f64 * geometry.spacing[a])
}

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

/// The upwind solution by the weighted mean m of the neighbours taken: `sum w (x - m)^2 = 1 - sum w (a - m)^2`.
pub(crate) fn godunov(mut axes: [(f64, f64); 3]) -> f64 {
    axes.sort_by(|p, q| p.0.total_cmp(&q.0));
    let mut x = f64::INFINITY;
    for taken in 1..=3 {
        let w: f64 = axes[..taken].iter().map(|(_, h)| 1.0 / (h * h)).sum();
        let m = axes[..taken].iter().map(|(a, h)| a / (h * h)).sum::<f64>() / w;
        let spread: f64 = axes[..taken].iter().map(|(a, h)| ((a - m) / h).powi(2)).sum();
        x = m + ((1.0 - spread).max(0.0) / w).sqrt();
        if taken == 3 || x <= axes[taken].0 {
            break;
        }
    }
    x
}

/// Alg. 2, one iteration, stored in f32.
fn textbook_fsm(geometry: &Geometry, cloud: &[[f64; 3]]) -> Vec<f32> {
    let grid = PlainGrid { shape: geometry.shape };
    let fixing = fixing_sources(geometry, cloud);
    let start = |v: [i64; 3]| match fixing[grid.at(v)] {
        Some(s) => squared(position(geometry, v), cloud[s]).sqrt() as f32,
        None => f32::INFINITY,
    };
    let mut d: Vec<f32> = grid.voxels().map(start).collect();
    for sweep in 0..8 {
        for v in sweep_order(geometry.shape, sweep).filter(|v| fixing[grid.at(*v)].is_none()) {
            let value = |q: [i64; 3]| if grid.contains(q) { f64::from(d[grid.at(q)]) } else { f64::INFINITY };
            let n = PlainGrid::around(v).map(value);
            let axes: [(f64, f64); 3] = std::array::from_fn(|a| (n[2 * a].min(n[2 * a + 1]), geometry.spacing[a]));
            if axes.iter().any(|(a, _)| a.is_finite()) {
                let lower = godunov(axes) as f32;
                let kept = &mut d[grid.at(v)];
                *kept = kept.min(lower);
            }
        }
    }
    d
}

/// Alg. 3: distances to the sources that the sweeps leave with each voxel.
fn textbook_vdt(geometry: &Geometry, cloud: &[[f64; 3]]) -> Vec<f32> {
    let grid = PlainGrid { shape: geometry.shape };
    let fixing = fixing_sources(geometry, cloud);
    let mut source = fixing.clone();
    let distance = |v, s: Option<usize>| s.map_or(f64::INFINITY, |s: usize| squared(position(geometry, v), cloud[s]));
    for sweep in 0..8 {
        for v in sweep_order(geometry.shape, sweep).filter(|v| fixing[grid.at(*v)].is_none()) {
            for q in PlainGrid::around(v).into_iter().filter(|q| grid.contains(*q)) {
                if distance(v, source[grid.at(q)]) < distance(v, source[grid.at(v)]) {
                    source[grid.at(v)] = source[grid.at(q)];
                }
            }
        }
    }
    grid.voxels().map(|v| distance(v, source[grid.at(v)]).sqrt() as f32).collect()
}

/// Ours, on all bricks or on those within reach of the cloud only.
fn ours(
    lab: &Lab,
    geometry: &Geometry,
    cloud: &[[f64; 3]],
    edge: i64,
    method: Method,
    farthest: Option<f32>,
) -> (Vec<f32>, usize) {
    let mut set: Arc<BrickSet> = dense(geometry.shape, edge);
    let bins = PointBins::new(*set.grid(), geometry, cloud);
    if let Some(farthest) = farthest {
        let reach = geometry.spacing.map(|h| (f64::from(farthest) / h).ceil() as i64);
        set = Arc::new(bins.bricks_within(geometry, cloud, reach));
    }
    let sources = Sources::cloud(geometry, cloud, &bins);
    let stage = lab.engine.stage("distance", 0);
    let farthest = farthest.unwrap_or(f32::INFINITY);
    let distance = cloud_distance(&stage, &lab.engine, &sources, &set, method, farthest).expect("room for a distance");
    (whole(&distance), set.len())
}

#[track_caller]
pub(crate) fn assert_same_bits(found: &[f32], expected: &[f32], what: &str) {
    assert_eq!(found.len(), expected.len());
    for (at, (f, e)) in found.iter().zip(expected).enumerate() {
        assert_eq!(f.to_bits(), e.to_bits(), "{what}: voxel {at} has {f} for {e}");
    }
}

/// Random points: anywhere in the domain or a little outside, some on grid points, some given twice.
pub(crate) fn random_cloud(geometry: &Geometry, count: usize, seed: u64) -> Vec<[f64; 3]> {
    let mut random = Random(seed);
    let mut cloud: Vec<[f64; 3]> = Vec::new();
    for n in 0..count {
        let snap = random.below(3) == 0;
        let p = std::array::from_fn(|a| {
            let place = random.unit() * (geometry.shape[a] as f64 + 1.0) - 1.0;
            geometry.origin[a] + geometry.spacing[a] * if snap { place.round() } else { place }
        });
        let twice = n > 0 && random.below(8) == 0;
        cloud.push(if twice { cloud[random.below(n)] } else { p });
    }
    cloud
}

pub(crate) fn grid(shape: [i64; 3], spacing: [f64; 3]) -> Geometry {
    Geometry { shape, spacing, origin: [-1.25, 0.5, 30.1], unit: None }
}

fn check_both(labs: &[Lab], geometry: &Geometry, cloud: &[[f64; 3]], edges: &[i64]) {
    let expected = [(Method::FSM, textbook_fsm(geometry, cloud)), (Method::VDT, textbook_vdt(geometry, cloud))];
    for (method, expected) in &expected {
        for lab in labs {
            for &edge in edges {
                let (found, _) = ours(lab, geometry, cloud, edge, *method, None);
                let what = format!("{method:?}, {geometry:?}, bricks of {edge}, {} threads", lab.engine.threads());
                assert_same_bits(&found, expected, &what);
            }
        }
    }
}

#[test]
fn bricks_and_threads_give_the_bits_of_the_triple_loop() {
    let labs = [Lab::new(1), Lab::new(2)];
    let shapes = [[33, 29, 21], [1, 40, 17], [50, 1, 1], [18, 23, 1], [16, 16, 16], [1, 1, 1]];
    for (seed, shape) in shapes.into_iter().enumerate() {
        for spacing in [[0.1; 3], [0.3, 0.17, 0.9]] {
            let geometry = grid(shape, spacing);
            let cloud = random_cloud(&geometry, 25, seed as u64);
            check_both(&labs, &geometry, &cloud, &[4, 8, 16, WHOLE]);
        }
    }
}

#[test]
fn the_sponge_gives_the_bits_of_the_triple_loop() {
    let cloud = sponge();
    check_both(&[Lab::new(2)], &grid_around(&cloud, 0.05), &cloud, &[16, WHOLE]);
}

#[test]
fn without_a_point_in_the_grid_nothing_is_reached() {
    let lab = Lab::new(2);
    let geometry = grid([20, 9, 7], [1.0; 3]);
    for cloud in [vec![], vec![[1e3, 0.0, -5.0]]] {
        for method in [Method::FSM, Method::VDT] {
            let (found, _) = ours(&lab, &geometry, &cloud, 8, method, None);
            assert!(found.iter().all(|d| *d == f32::INFINITY));
        }
    }
}

/// Points at least four voxels apart along some axis: no voxel that one of them fixes is nearer to another.
pub(crate) fn scattered(geometry: &Geometry, count: usize, seed: u64) -> Vec<[f64; 3]> {
    let mut random = Random(seed);
    let mut cloud: Vec<[f64; 3]> = Vec::new();
    while cloud.len() < count {
        let p: [f64; 3] = std::array::from_fn(|a| {
            geometry.origin[a] + geometry.spacing[a] * random.unit() * (geometry.shape[a] - 1) as f64
        });
        let apart = |q: &[f64; 3]| (0..3).any(|a| (p[a] - q[a]).abs() > 4.0 * geometry.spacing[a]);
        if cloud.iter().all(apart) {
            cloud.push(p);
        }
    }
    cloud
}

/// Sweeps cannot find every nearest source (Danielsson 1980): few voxels are wrong, and those by little.
#[test]
fn vector_distance_is_nearly_everywhere_exact() {
    let lab = Lab::new(2);
    for (seed, spacing) in [[0.5; 3], [0.4, 0.4, 1.3]].into_iter().enumerate() {
        let geometry = grid([60, 57, 40], spacing);
        let plain = PlainGrid { shape: geometry.shape };
        let cloud = scattered(&geometry, 120, seed as u64);
        let (found, _) = ours(&lab, &geometry, &cloud, 16, Method::VDT, None);
        let mut wrong = 0;
        for v in plain.voxels() {
            let here = position(&geometry, v);
            let exact = cloud.iter().map(|p| squared(here, *p)).fold(f64::INFINITY, f64::min).sqrt();
            let excess = f64::from(found[plain.at(v)]) - exact;
            assert!(excess > -1e-5 && excess < 0.1 * spacing[0], "{v:?}: {excess} beyond {exact}");
            wrong += usize::from(excess > 1e-5);
        }
        assert!(wrong * 1000 < plain.len(), "{wrong} of {} voxels", plain.len());
    }
}

/// The Eikonal solution lies above the distance and converges to it at first order (up to a logarithm).
#[test]
fn fast_sweeping_converges_to_the_distance() {
    let lab = Lab::new(2);
    let errors = [0.1, 0.05, 0.025].map(|h| {
        let cloud = sphere([0.0; 3], 0.8, 20_000, |_| true);
        let geometry = grid_around(&cloud, h);
        let (found, _) = ours(&lab, &geometry, &cloud, 16, Method::FSM, None);
        let voxels = PlainGrid { shape: geometry.shape }.voxels();
        let error = |v| ((squared(position(&geometry, v), [0.0; 3]).sqrt() - 0.8).abs(), v);
        let errors: Vec<f64> = voxels.map(error).zip(&found).map(|((exact, _), d)| f64::from(*d) - exact).collect();
        errors.iter().map(|e| e.abs()).sum::<f64>() / errors.len() as f64
    });
    assert!(errors[2] < 0.01 && errors[0] / errors[1] > 1.5 && errors[1] / errors[2] > 1.5, "{errors:?}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    #[test]
    fn random_clouds_give_the_bits_of_the_triple_loop(
        shape in prop::array::uniform3(1_i64..24),
        spacing in prop::sample::select(vec![[1.0; 3], [0.1; 3], [0.25, 0.5, 1.0], [0.31, 0.7, 0.113]]),
        count in 1_usize..30,
        edge in prop::sample::select(vec![4, 8, 16, WHOLE]),
        threads in 1_usize..3,
        seed: u64,
    ) {
        let geometry = grid(shape, spacing);
        let cloud = random_cloud(&geometry, count, seed);
        check_both(&[Lab::new(threads)], &geometry, &cloud, &[edge]);
    }

    /// Bricks that are left out because they are far change nothing near, and count as farthest themselves.
    #[test]
    fn a_sparse_set_gives_the_values_of_the_dense_one(
        shape in prop::array::uniform3(20_i64..50),
        spacing in prop::sample::select(vec![[1.0; 3], [0.5, 0.7, 2.0]]),
        count in 1_usize..6,
        edge in prop::sample::select(vec![4, 8]),
        farthest in 1.5_f32..9.0,
        seed: u64,
    ) {
        let geometry = grid(shape, spacing);
        let cloud = random_cloud(&geometry, count, seed);
        let lab = Lab::new(2);
        for method in [Method::FSM, Method::VDT] {
            let (everywhere, bricks) = ours(&lab, &geometry, &cloud, edge, method, None);
            let (found, stored) = ours(&lab, &geometry, &cloud, edge, method, Some(farthest));
            prop_assert!(stored <= bricks);
            let expected: Vec<f32> = everywhere.iter().map(|d| d.min(farthest)).collect();
            assert_same_bits(&found, &expected, &format!("{method:?} up to {farthest}, {stored} of {bricks} bricks"));
        }
    }
}
