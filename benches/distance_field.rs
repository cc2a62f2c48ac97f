//! Whole distance fields, the Cube experiment (Kósa & Mikula 2023, Table 2): nanoseconds per voxel from the cloud in
//! memory to the finished field, and visits per brick; with and without sources, by both schedules where sweeps are
//! one.
//!
//! ```sh
//! cargo bench --bench distance_field                     # 289^3, all methods, bricks of 32 and 64, 2 threads
//! cargo bench --bench distance_field -- 577 fsm 64 2
//! cargo bench --bench distance_field -- 577 fsm 64 2 1000     # to 1000 random points instead of the cube
//! ```

use std::sync::Arc;
use std::time::Instant;

use strandline::exec::{Budget, Cancel, Engine, Silent};
use strandline::grid::{BrickGrid, BrickSet, Geometry, PointBins};
use strandline::kernel::distance::features::extent::extent;
use strandline::pipeline::distance::{Method, Options, Schedule, Solving, Sources, Textbook};
use strandline::store::Scratch;

/// The grid points on the surface of the unit cube.
fn cube(geometry: &Geometry) -> Vec<[f64; 3]> {
    let h = geometry.spacing[0];
    let (low, high) = ((0.4 / h).round() as i64, (1.4 / h).round() as i64);
    let inside = |n: &i64| (low..=high).contains(n);
    let on = |n: i64| n == low || n == high;
    let n = geometry.shape[0];
    let mut points = Vec::new();
    for z in (0..n).filter(inside) {
        for y in (0..n).filter(inside) {
            for x in (0..n).filter(inside) {
                if on(x) || on(y) || on(z) {
                    points.push(geometry.position([x, y, z]));
                }
            }
        }
    }
    points
}

/// Random points of the whole grid (splitmix64, Steele et al. 2014).
fn random(geometry: &Geometry, count: u64) -> Vec<[f64; 3]> {
    let mut state = 0_u64;
    let mut unit = || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    };
    let mut place = |a: usize| geometry.origin[a] + geometry.spacing[a] * (geometry.shape[a] - 1) as f64 * unit();
    (0..count).map(|_| std::array::from_fn(&mut place)).collect()
}

fn run(n: i64, points: Option<u64>, method: Method, edge: i64, threads: usize) {
    let h = 1.8 / (n - 1) as f64;
    let geometry = Geometry { shape: [n; 3], spacing: [h; 3], origin: [-0.4; 3], unit: None };
    let cloud = points.map_or_else(|| cube(&geometry), |count| random(&geometry, count));
    let dir = tempfile::tempdir().expect("a temporary folder");
    let budget = Budget { total: 8 << 30 };
    let scratch = Scratch::new(dir.path(), budget.total);
    let engine = Engine::new(threads, scratch, budget, Cancel::default(), Arc::new(Silent)).expect("threads");
    let set = Arc::new(BrickSet::dense(BrickGrid::new(geometry.shape, edge)));
    let bins = PointBins::new(*set.grid(), &geometry, &cloud);
    let given = Sources::cloud(&geometry, &cloud, &bins);
    let solver = method.solver::<f32>();
    let sweep = (solver.textbook == Textbook::Sweeps).then_some(Schedule::Sweep { iterations: 1 });
    for schedule in sweep.into_iter().chain([Schedule::Front]) {
        for sources in [false, true, false, true] {
            if sources && solver.source_bytes == 0 {
                continue;
            }
            let started = Instant::now();
            let stage = engine.stage("distance", 0);
            let options = Options { sources, ..Options::up_to(f64::INFINITY) };
            let solved = (solver.solve)(&Solving::new(&stage, &engine, &given, &set, options), schedule).expect("room");
            let report = stage.finish();
            let solve = started.elapsed().as_secs_f64();
            let largest = (0..set.grid().len()).map(|id| {
                let part = set.grid().brick_box(id);
                let mut values = vec![0.0; part.len()];
                solved.values.read_box(&part, &mut values).expect("values");
                extent(&values).0
            });
            let largest = largest.fold(0.0, f64::max);
            let voxels = (n * n * n) as f64;
            println!(
                "{:>4} {n}^3 bricks of {edge}, {threads} threads, {schedule:?}{}: {:.2} ns per voxel to solve; \
                 {:.2} visits per brick, {} rounds; largest {}",
                method.name(),
                if sources { ", sources" } else { "" },
                1e9 * solve / voxels,
                report.bricks as f64 / set.len() as f64,
                report.iterations,
                largest
            );
        }
    }
}

fn main() {
    let mut words = std::env::args().skip(1).filter(|word| !word.starts_with("--"));
    let n = words.next().map_or(289, |n| n.parse().expect("voxels along an edge"));
    let method = words.next().map(|name| Method::named(&name).expect("a method"));
    let edges = words.next().map_or(vec![32, 64], |edge| vec![edge.parse().expect("a brick edge")]);
    let threads = words.next().map_or(2, |n| n.parse().expect("a number of threads"));
    let points = words.next().map(|n| n.parse().expect("a number of points"));
    for method in method.map_or(Method::all().collect::<Vec<_>>(), |method| vec![method]) {
        for &edge in &edges {
            run(n, points, method, edge, threads);
        }
    }
}
