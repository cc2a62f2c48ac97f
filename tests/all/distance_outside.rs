//! Distances on grids that sources lie outside of, against a plain search over all sources in f64.

#![allow(clippy::unwrap_used)]

use std::fs;

use strandline::exec::as_threads;
use strandline::grid::{DataSets, Geometry, TriangleMesh};
use strandline::kernel::distance::features::source_trees::SourceTrees;
use strandline::kernel::distance::state::neighbours::Neighbours;
use strandline::pipeline::distance::{DistanceSettings, Init, Method, Reads, Schedule, solve_sets_watched};

use crate::common::around::{Around, Parent, Rest, to_triangle};
use crate::common::ball::Bench;
use crate::common::lab::{Lab, PlainGrid};
use crate::common::meshes::{self, Form};
use crate::common::random::Random;
use crate::common::solve::{Equation, equation, sweeps};
use crate::common::stores::volume;
use crate::common::textbook::{position, squared};

const SWEEP: Schedule = Schedule::Sweep { iterations: 4 };

/// Until an iteration changes nothing.
const TO_REST: Schedule = Schedule::Sweep { iterations: u32::MAX };

fn grid() -> Geometry {
    Geometry { shape: [23, 14, 19], spacing: [0.5, 0.7, 0.6], origin: [3.0, -2.0, 1.0], unit: None }
}

/// Points in the grid and around it, triangles that cut it, reach out of it or lie away, and a label that lies outside
/// with all it has.
fn scene(seed: u64) -> DataSets {
    let (grid, mut random) = (grid(), Random(seed));
    let mut place = |from: f64, to: f64| -> [f64; 3] {
        std::array::from_fn(|a| {
            let extent = (grid.shape[a] - 1) as f64 * grid.spacing[a];
            grid.origin[a] + (from + (to - from) * random.unit()) * extent
        })
    };
    let mut sets = DataSets::default();
    let around: Vec<[f64; 3]> = (0..9).map(|_| place(-0.7, 1.7)).collect();
    sets.add_cloud(&around);
    let mut corners = Vec::new();
    for _ in 0..4 {
        let at = place(-0.8, 1.8);
        let near = |p: [f64; 3]| -> [f64; 3] { std::array::from_fn(|a| at[a] + 0.5 * (p[a] - at[a])) };
        corners.extend([at, near(place(-1.0, 2.0)), near(place(-1.0, 2.0))]);
    }
    let triangles = (0..4).map(|n| [3 * n, 3 * n + 1, 3 * n + 2]).collect();
    sets.add_mesh(&TriangleMesh::new(corners, triangles).unwrap());
    let beside: Vec<[f64; 3]> = (0..5).map(|_| place(1.05, 1.4)).collect();
    sets.add_cloud(&beside);
    sets
}

/// For each voxel the distance to each label's sources, by a plain search.
pub(crate) fn plainly(grid: &Geometry, sets: &DataSets) -> Vec<Vec<f64>> {
    let near = |v| {
        let here = position(grid, v);
        let of = |[cloud, mesh]: [std::ops::Range<u32>; 2]| {
            let points = cloud.map(|n| squared(here, sets.positions[n as usize]).sqrt());
            points.chain(mesh.map(|n| to_triangle(here, sets.mesh.corners(n as usize)))).fold(f64::INFINITY, f64::min)
        };
        sets.places().map(of).collect()
    };
    PlainGrid { shape: grid.shape }.voxels().map(near).collect()
}

pub(crate) fn settings(method: Method, schedule: Schedule, brick: i64) -> DistanceSettings {
    DistanceSettings {
        method,
        schedule,
        neighbours: Neighbours::Faces,
        init: Init::Cell,
        farthest: None,
        signed: false,
        labels: true,
        closest_point: false,
        brick,
        exact: false,
        timed: false,
    }
}

/// Distances and nearest sources on a grid, by so many threads and ranks.
pub(crate) fn solved_on(
    grid: &Geometry,
    sets: &DataSets,
    settings: &DistanceSettings,
    [threads, ranks]: [usize; 2],
) -> (Vec<f32>, Vec<u32>) {
    let part = grid.domain();
    let trees = SourceTrees::new(sets);
    let (all, none) = ([part], []);
    let solved = as_threads(ranks, |comm| {
        let Lab { engine, _folder } = Lab::new(threads);
        let engine = engine.as_rank(comm);
        let reads = Reads { early: None, boxes: if ranks > 1 { &all[..] } else { &none } };
        solve_sets_watched::<f32, _>(&engine, grid, sets, Some(&trees), (settings, reads), |solved, _| {
            let (mut values, mut sources) = (vec![0.0; part.len()], vec![0; part.len()]);
            solved.values.read_box(&part, &mut values)?;
            solved.sources.read_box(&part, &mut sources)?;
            Ok((values, sources))
        })
    });
    solved.unwrap().swap_remove(0)
}

/// Distances, and the label of the nearest source.
fn solved(sets: &DataSets, settings: &DistanceSettings, ranks: usize) -> (Vec<f32>, Vec<u32>) {
    let (values, sources) = solved_on(&grid(), sets, settings, [2, ranks]);
    (values, sources.into_iter().map(|source| sets.label(source)).collect())
}

/// Every method by every schedule, held to what it promises: FSM and FMM come to rest where every voxel is fixed or solves
/// the upwind equation; VDT and DP where every voxel has the best source that it was told of, and in the end the nearest of
/// all if that lies outside. By the front they are told of sources in the grid too that were lost, here of all.
#[test]
fn every_source_counts_wherever_it_lies() {
    let points_alone = |seed| {
        let (all, mut alone) = (scene(seed), DataSets::default());
        all.clouds().filter(|cloud| !cloud.is_empty()).for_each(|cloud| {
            alone.add_cloud(&all.positions[cloud.start as usize..cloud.end as usize]);
        });
        alone
    };
    // With triangles these methods have other kernels than for points alone.
    let scenes = (1..5).flat_map(|seed| [("", scene(seed)), ("points alone, ", points_alone(seed))].map(|s| (seed, s)));
    for (seed, (kind, sets)) in scenes {
        let grid = grid();
        let around = Around::new(&grid, &sets);
        for method in Method::all() {
            for schedule in [Schedule::Front, TO_REST] {
                let (values, sources) = solved_on(&grid, &sets, &settings(method, schedule, 16), [2, 1]);
                let values: Vec<f64> = values.into_iter().map(f64::from).collect();
                let held = match (equation(method), schedule) {
                    (Equation::Eikonal, _) => {
                        let parent = if method == Method::FMM { Parent::ShortestWay } else { Parent::UpwindSum };
                        let solved = around.solves_upwind(&values);
                        solved.and_then(|()| around.takes_sources(&values, &sources, parent))
                    }
                    (Equation::Euclidean, Schedule::Front) => {
                        let best = around.keeps_the_best(&values, &sources, Rest::OfSweeps);
                        best.and_then(|()| around.is_exact(&values))
                    }
                    (Equation::Euclidean, _) => {
                        let rest = if sweeps(method) { Rest::OfSweeps } else { Rest::OfHeap };
                        around.keeps_the_best(&values, &sources, rest)
                    }
                };
                if let Err(what) = held {
                    panic!("{} {schedule:?}, {kind}seed {seed}: {what}", method.name());
                }
            }
        }
    }
}

/// Bricks change no bit of sweeps, ranks none of anything.
#[test]
fn bricks_and_ranks_change_nothing_outside_either() {
    let sets = scene(7);
    for method in Method::all() {
        for schedule in [Schedule::Front, SWEEP] {
            let one = solved(&sets, &settings(method, schedule, 16), 1);
            assert_eq!(one, solved(&sets, &settings(method, schedule, 16), 3), "{} {schedule:?}", method.name());
            if schedule == SWEEP {
                assert_eq!(one, solved(&sets, &settings(method, schedule, 32), 2), "{}", method.name());
            }
        }
    }
}

/// Sources far outside change nothing of what those in the grid give.
#[test]
fn what_is_far_away_changes_no_bit() {
    let mut sets = DataSets::default();
    let geometry = grid();
    sets.add_cloud(&[[5, 3, 4], [17, 9, 11], [9, 12, 2]].map(|v| geometry.position(v)));
    let mut more = sets.clone();
    more.add_cloud(&[[900.0, 0.0, 0.0], [0.0, -800.0, 7.0]]);
    for method in Method::all() {
        for schedule in [Schedule::Front, SWEEP] {
            let settings = settings(method, schedule, 16);
            assert_eq!(solved(&sets, &settings, 1), solved(&more, &settings, 1), "{} {schedule:?}", method.name());
        }
    }
}

/// What a run wrote, held to what its method promises.
fn check(around: &Around<'_>, method: &str, values: &[f64]) {
    let is_eikonal = method.starts_with('f');
    let held = if is_eikonal { around.solves_upwind(values) } else { around.is_exact(values) };
    if let Err(what) = held {
        panic!("{method}: {what}");
    }
}

/// Two points of which one lies beside the grid, and balls around the grid and away from it, with signs.
#[test]
fn distances_through_the_faces_of_a_grid() {
    let bench = Bench::bare();
    let ball = meshes::sphere([0.0; 3], 5.0, 40, std::f64::consts::PI);
    bench.write("two.xyz", "0 0 0\n12 5 5\n");
    fs::write(bench.path("ball.ply"), Form::PlyText.write(&ball)).unwrap();
    let (mut two, mut round) = (DataSets::default(), DataSets::default());
    two.add_cloud(&[[0.0; 3], [12.0, 5.0, 5.0]]);
    round.add_mesh(&ball);
    let grid = |origin: [f64; 3], n: i64, h: f64| Geometry { shape: [n; 3], spacing: [h; 3], origin, unit: None };
    let grids = [grid([5.0, 0.0, 0.0], 11, 1.0), grid([-2.0; 3], 9, 0.5), grid([6.0, 0.0, 0.0], 9, 0.5)];
    let [beside, inside, away] =
        [(&grids[0], &two), (&grids[1], &round), (&grids[2], &round)].map(|(grid, sets)| Around::new(grid, sets));
    for method in ["vdt", "dp", "fsm", "fmm"] {
        let run = format!("--method {method} --overwrite -q -o out/x.zarr");
        bench.succeed(&format!("distance two.xyz --origin 5,0,0 --shape 11,11,11 --spacing 1 --labels {run}"));
        check(&beside, method, &volume(&bench.path("out/x.zarr")));
        let run = format!("distance ball.ply --shape 9,9,9 --spacing 0.5 --signed --closest-point {run}");
        bench.succeed(&format!("{run} --origin -2,-2,-2"));
        let found: Vec<f64> = volume(&bench.path("out/x.zarr")).into_iter().map(|d| -d).collect();
        check(&inside, method, &found);
        let largest = bench.json("out/x.zarr/report.json")["result"]["max"].as_f64().unwrap();
        assert_eq!(largest, found.iter().copied().fold(0.0, f64::max), "{method}");
        // The corner is fixed through a face, so its closest point is so by every method.
        let at = |name: &str| volume(&bench.path(&format!("out/x.zarr/closest-point/{name}")))[0];
        let closest = [at("x"), at("y"), at("z")];
        let (far, off) = (squared(closest, [-2.0; 3]).sqrt(), to_mesh(closest, &round));
        assert!((far - found[0]).abs() < 1e-5 && off < 1e-5, "{method}: {closest:?} is {off} off, {far} away");
        bench.succeed(&format!("{run} --origin 6,0,0"));
        check(&away, method, &volume(&bench.path("out/x.zarr")));
    }
}

/// How far a place is from the triangles.
fn to_mesh(place: [f64; 3], sets: &DataSets) -> f64 {
    (0..sets.mesh.len()).map(|n| to_triangle(place, sets.mesh.corners(n))).fold(f64::INFINITY, f64::min)
}

/// A label that is the nearest nowhere is told with no voxel; within a largest distance, what lies farther is that far.
#[test]
fn labels_without_a_voxel_and_distances_beyond_the_largest() {
    let bench = Bench::bare();
    bench.write("near.xyz", "2 2 2\n");
    bench.write("away.xyz", "90 0 0\n");
    let grid = "--origin 0,0,0 --shape 5,5,5 --spacing 1 --overwrite -o out/x.zarr";
    let printed = bench.succeed(&format!("distance near.xyz away.xyz {grid} --labels"));
    assert!(printed.contains("label 1: 125 voxels") && printed.contains("label 2: 0 voxels"), "{printed}");
    bench.succeed(&format!("distance away.xyz {grid} --max-distance 3 -q"));
    assert!(volume(&bench.path("out/x.zarr")).iter().all(|&d| d == 3.0));
    let text =
        bench.fail("distance away.xyz --origin -9e9,0,0 --shape 5,5,5 --spacing 1 --precision f16 -q -o none", 2);
    assert!(text.contains("--precision float16"), "{text}");
}
