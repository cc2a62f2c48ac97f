//! Distance fields against the printed triple loops over the whole volume (Kósa & Mikula 2023, Alg. 1-3, 7), bit for
//! bit, and against the exact distance to every point.

use std::sync::Arc;

use half::f16;
use proptest::prelude::*;
use strandline::grid::{BrickSet, Geometry, PointBins};
use strandline::pipeline::distance::{Method, Schedule, Sources, cloud_distance};

use crate::common::clouds::{grid_around, random_cloud, sphere, sponge};
use crate::common::lab::{Lab, PlainGrid, dense, whole};
use crate::common::random::Random;
use crate::common::solve::{Equation, equation, solve, sweeps, whole_edge};
use crate::common::textbook::{self, Stored, godunov, position, squared};

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
pub(crate) fn assert_same_bits<P: Stored>(found: &[P], expected: &[P], what: &str) {
    assert_eq!(found.len(), expected.len());
    for (at, (f, e)) in found.iter().zip(expected).enumerate() {
        assert_eq!(f.rank(), e.rank(), "{what}: voxel {at} has {f:?} for {e:?}");
    }
}

pub(crate) fn grid(shape: [i64; 3], spacing: [f64; 3]) -> Geometry {
    Geometry { shape, spacing, origin: [-1.25, 0.5, 30.1], unit: None }
}

/// All rows of the table that sweep, stored as `P`, against the printed loops: values and sources.
fn check_sweeps<P: Stored>(labs: &[Lab], geometry: &Geometry, cloud: &[[f64; 3]], edges: &[i64], iterations: u32) {
    let sources = textbook::vdt(geometry, cloud, iterations);
    let euclidean = (textbook::distances::<P>(geometry, cloud, &sources), sources);
    let eikonal = textbook::fsm_with_sources::<P>(geometry, cloud, iterations);
    for method in Method::all().filter(|method| sweeps(*method)) {
        for (lab, &edge) in labs.iter().flat_map(|lab| edges.iter().map(move |edge| (lab, edge))) {
            let found = solve::<P>(lab, geometry, cloud, edge, method, Schedule::Sweep { iterations });
            let threads = lab.engine.threads();
            let what = format!(
                "{}, {:?}, {geometry:?}, bricks of {edge}, {threads} threads, {iterations} iterations",
                method.name(),
                P::TYPE
            );
            let expected = if equation(method) == Equation::Euclidean { &euclidean } else { &eikonal };
            assert_same_bits(&found.values, &expected.0, &what);
            let differ = found.sources.iter().zip(&expected.1).filter(|(found, expected)| found != expected).count();
            assert_eq!(differ, 0, "{what}: voxels whose sources differ");
        }
    }
}

/// Every stored type; the number of threads has no part in it.
fn check_all_types(labs: &[Lab], geometry: &Geometry, cloud: &[[f64; 3]], edges: &[i64], iterations: u32) {
    let some = &labs[labs.len() / 2..][..1];
    check_sweeps::<f64>(some, geometry, cloud, edges, iterations);
    check_sweeps::<f32>(labs, geometry, cloud, edges, iterations);
    check_sweeps::<f16>(some, geometry, cloud, edges, iterations);
}

#[test]
fn bricks_and_threads_give_the_bits_of_the_triple_loop() {
    let labs = [1, 2, 4].map(Lab::new);
    let shapes = [[33, 29, 21], [1, 40, 17], [70, 1, 1], [18, 66, 1], [16, 16, 16], [1, 1, 1]];
    for (seed, shape) in shapes.into_iter().enumerate() {
        for (spacing, iterations) in [([0.1; 3], 1), ([0.3, 0.17, 0.9], 1), ([0.3, 0.17, 0.9], 3)] {
            let geometry = grid(shape, spacing);
            let cloud = random_cloud(&geometry, 25, seed as u64);
            check_all_types(&labs, &geometry, &cloud, &[8, 16, 32, 64, whole_edge(shape)], iterations);
        }
    }
}

#[test]
fn the_sponge_gives_the_bits_of_the_triple_loop() {
    let cloud = sponge();
    let geometry = grid_around(&cloud, 0.05);
    let edges = [64, whole_edge(geometry.shape)];
    check_sweeps::<f32>(&[Lab::new(2)], &geometry, &cloud, &edges, 1);
}

/// The update of the printed loop solves its equation: the sum over the axes below the solution is 1, and leaving an
/// axis out or taking one more in would break the order.
#[test]
fn the_update_solves_its_equation() {
    let mut random = Random(7);
    for _ in 0..10_000 {
        let spacing: [f64; 3] = std::array::from_fn(|_| 0.05 + random.unit());
        let near: [f64; 3] = std::array::from_fn(|_| if random.below(5) == 0 { f64::INFINITY } else { random.unit() });
        if near.iter().all(|a| a.is_infinite()) {
            continue;
        }
        let x = godunov(near, spacing);
        let sum: f64 = (0..3).map(|a| ((x - near[a]).max(0.0) / spacing[a]).powi(2)).sum();
        assert!((sum - 1.0).abs() < 1e-11, "{near:?} {spacing:?}: {x} gives {sum}");
    }
}

#[test]
fn without_a_point_in_the_grid_nothing_is_reached() {
    let lab = Lab::new(2);
    let geometry = grid([20, 9, 7], [1.0; 3]);
    for cloud in [vec![], vec![[1e3, 0.0, -5.0]]] {
        for method in Method::all().filter(|method| sweeps(*method)) {
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
        edge in prop::sample::select(vec![8, 16, 32]),
        threads in prop::sample::select(vec![1_usize, 2, 4]),
        iterations in 1_u32..4,
        seed: u64,
    ) {
        let geometry = grid(shape, spacing);
        let cloud = random_cloud(&geometry, count, seed);
        check_all_types(&[Lab::new(threads)], &geometry, &cloud, &[edge], iterations);
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
