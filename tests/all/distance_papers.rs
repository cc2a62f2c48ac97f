//! Figures that the middle-surface paper prints (Kósa & Mikula 2023; docs/algorithms.md, "Readings and figures").

use strandline::error::Result;
use strandline::grid::{Box3, DataSets, Geometry, PointBins};
use strandline::kernel::distance::seeding::initialise::Cube;
use strandline::kernel::distance::state::neighbours::Neighbours;
use strandline::pipeline::distance::{
    DistanceFound, DistanceSettings, Init, Method, Schedule, Solving, Sources, distance as run_distance,
};

use crate::common::clouds::{grid_around, sponge_and_sphere};
use crate::common::lab::{Lab, PlainGrid, dense};
use crate::common::solve::{Equation, equation, everywhere, sweeps};
use crate::common::textbook::{Stored, position};

/// Grid points of the Cube experiment along each axis, and the mean squared error of the Eikonal methods to five
/// digits, cut off: Table 2 and its finer digits in docs/algorithms.md, "Readings and figures".
const TABLE_2: [(i64, f64); 4] = [(10, 2.5692e-3), (19, 9.7901e-4), (37, 3.7697e-4), (73, 1.4352e-4)];

/// The domain [-0.4, 1.4]^3 with so many points along each axis.
fn cube_grid(count: i64) -> Geometry {
    Geometry { shape: [count; 3], spacing: [1.8 / (count - 1) as f64; 3], origin: [-0.4; 3], unit: None }
}

/// Whether a grid point lies on the surface of the unit cube, by whole numbers.
fn on_cube(count: i64, v: [i64; 3]) -> bool {
    let h = (count - 1) / 9;
    let [low, high] = [2 * h, 7 * h];
    v.iter().all(|&i| (low..=high).contains(&i)) && v.iter().any(|&i| i == low || i == high)
}

/// The exact distance to the surface of the unit cube.
fn to_cube(p: [f64; 3]) -> f64 {
    let outside = p.map(|x| (x - x.clamp(0.0, 1.0)).powi(2)).iter().sum::<f64>().sqrt();
    if outside > 0.0 { outside } else { p.map(|x| x.min(1.0 - x)).into_iter().fold(f64::INFINITY, f64::min) }
}

/// The mean squared error of a method whose sources are the grid points on the cube, each fixing itself alone.
fn cube_error<P: Stored>(lab: &Lab, count: i64, method: Method, schedule: Schedule) -> f64 {
    let geometry = cube_grid(count);
    let grid = PlainGrid { shape: geometry.shape };
    let cloud: Vec<[f64; 3]> = grid.voxels().filter(|v| on_cube(count, *v)).map(|v| position(&geometry, v)).collect();
    let set = dense(geometry.shape, 32);
    let bins = PointBins::new(*set.grid(), &geometry, &cloud);
    let cubes = [(cloud.len() as u32, Cube { snaps: true, ..Cube::CELL })];
    let sources = Sources { cubes: &cubes, ..Sources::cloud(&geometry, &cloud, &bins) };
    let stage = lab.engine.stage("distance", 0);
    let row = method.solver::<P>();
    let solved = (row.solve)(&Solving::new(&stage, &lab.engine, &sources, &set, everywhere(false)), schedule)
        .expect("room for a field");
    assert_eq!(solved.fixed_voxels, cloud.len() as u64);
    let part = Box3::from_shape(geometry.shape);
    let mut values = vec![P::default(); part.len()];
    solved.values.read_box(&part, &mut values).expect("memory can be read");
    let error = |(v, d): ([i64; 3], &P)| (d.to_f64() - to_cube(position(&geometry, v))).powi(2);
    grid.voxels().zip(&values).map(error).sum::<f64>() / values.len() as f64
}

/// The schedules that a row of the table has.
fn schedules(method: Method) -> Vec<Schedule> {
    [Schedule::Front].into_iter().chain(sweeps(method).then_some(Schedule::Sweep { iterations: 1 })).collect()
}

#[test]
fn the_cube_has_the_errors_of_table_2() {
    let lab = Lab::new(2);
    for (count, printed) in TABLE_2 {
        for method in Method::all() {
            for schedule in schedules(method) {
                let [wide, single] = [
                    cube_error::<f64>(&lab, count, method, schedule),
                    cube_error::<f32>(&lab, count, method, schedule),
                ];
                let what = format!("{count}^3, {}, {schedule:?}: {wide:e} in f64, {single:e} in f32", method.name());
                println!("{what}");
                if equation(method) == Equation::Euclidean {
                    assert!(wide < 1e-30 && single < 1e-15, "{what}");
                } else {
                    // Digits that are cut off: the last one counts from 0 to just below 1.
                    let place = 10_f64.powf(printed.log10().floor() - 4.0);
                    assert!((0.0..1.0).contains(&((wide - printed) / place + 1e-6)), "{what}");
                    assert!((single / printed - 1.0).abs() < 5e-4, "{what}");
                }
            }
        }
    }
}

/// Runs the whole job on the papers' pair of clouds.
fn pair(lab: &Lab, h: f64, method: Method, schedule: Schedule, init: Init, labels: bool) -> Result<DistanceFound> {
    let clouds = sponge_and_sphere();
    let mut sets = DataSets::default();
    for cloud in &clouds {
        sets.add_cloud(cloud);
    }
    let settings = DistanceSettings {
        method,
        schedule,
        init,
        neighbours: Neighbours::Faces,
        farthest: None,
        signed: false,
        labels,
        closest_point: false,
        brick: 32,
        exact: false,
        timed: false,
    };
    run_distance::<f32>(&lab.engine, &grid_around(&clouds.concat(), h), &sets, &settings, None)
}

/// Tables 7 and 8: voxels that the points fix by Alg. 1 and by the contiguous start.
const FIXED: [(f64, u64, u64); 3] = [(0.1, 1890, 12_357), (0.05, 2716, 86_306), (0.025, 2892, 628_799)];

#[test]
fn sponge_and_sphere_fix_the_printed_numbers_of_voxels() {
    let lab = Lab::new(2);
    for (h, cell, contiguous) in FIXED {
        for (init, count) in [(Init::Cell, cell), (Init::Contiguous, contiguous)] {
            let found = pair(&lab, h, Method::FSM, Schedule::Front, init, false).expect("a distance");
            assert_eq!(found.fixed_voxels, count, "{h}, {init:?}");
            assert_eq!(found.unlabelled_voxels, 0);
        }
    }
}

/// Every voxel belongs to one of the two clouds: by the exact nearest point but for ties and for what Alg. 1 fixes
/// where distances are Euclidean; where they solve the Eikonal equation to first order (Alg. 8), within a voxel of
/// there.
#[test]
fn sponge_and_sphere_share_all_voxels() {
    let lab = Lab::new(2);
    let clouds = sponge_and_sphere();
    let geometry = grid_around(&clouds.concat(), 0.1);
    let nearest = |here, cloud: &[[f64; 3]]| {
        cloud.iter().map(|p| crate::common::textbook::squared(here, *p)).fold(f64::INFINITY, f64::min)
    };
    let mut exact = [0_u64; 2];
    // Voxels between the clouds within one spacing of equal distances.
    let mut between = 0_u64;
    for v in (PlainGrid { shape: geometry.shape }).voxels() {
        let here = position(&geometry, v);
        let [first, second] = [0, 1].map(|n| nearest(here, &clouds[n]));
        exact[usize::from(second < first)] += 1;
        between += u64::from((first.sqrt() - second.sqrt()).abs() < 0.1);
    }
    for method in Method::all() {
        for schedule in schedules(method) {
            let found = pair(&lab, 0.1, method, schedule, Init::Cell, true).expect("a distance");
            let counts = [1, 2].map(|label| found.label_voxels.get(&label).copied().unwrap_or(0));
            assert_eq!(counts[0] + counts[1], geometry.domain().volume(), "{}", method.name());
            let apart = counts[0].abs_diff(exact[0]);
            println!("{}, {schedule:?}: {counts:?}, exact {exact:?}", method.name());
            let allowed = match equation(method) {
                Equation::Euclidean => geometry.domain().volume() / 1000,
                Equation::Eikonal => between,
            };
            assert!(apart < allowed, "{}: {counts:?}, exact {exact:?}, allowed {allowed}", method.name());
        }
    }
}

/// Sec. 4, Experiment 2: the grid points on each vertex, open edge and open face of the cube are a data set of their
/// own. By Alg. 7 all vertices get as many voxels (one has the centre too), all edges, all faces: docs/algorithms.md,
/// "Readings and figures". In single precision: the last bits of f64 differ where distances are equal by symmetry.
#[test]
fn subsets_of_the_cube_share_its_voxels_evenly() {
    let count = 37;
    let grid = PlainGrid { shape: [count; 3] };
    let geometry = cube_grid(count);
    let h = (count - 1) / 9;
    // -1, 0, 1 along each axis: at the lower end, between, at the upper one.
    let side = |i: i64| i64::from(i == 7 * h) - i64::from(i == 2 * h);
    let mut sets = DataSets::default();
    let mut dimensions = Vec::new();
    for subset in (PlainGrid { shape: [3; 3] }).voxels().map(|v| v.map(|n| n - 1)).filter(|o| *o != [0; 3]) {
        let of_subset = grid.voxels().filter(|v| on_cube(count, *v) && v.map(side) == subset);
        sets.add_cloud(&of_subset.map(|v| position(&geometry, v)).collect::<Vec<_>>());
        dimensions.push(subset.iter().filter(|o| **o == 0).count());
    }
    let settings = DistanceSettings {
        method: Method::FSM,
        schedule: Schedule::Sweep { iterations: 1 },
        neighbours: Neighbours::Faces,
        init: Init::Grid,
        farthest: None,
        signed: false,
        labels: true,
        closest_point: false,
        brick: 16,
        exact: false,
        timed: false,
    };
    let found = run_distance::<f32>(&Lab::new(2).engine, &geometry, &sets, &settings, None).expect("a distance");
    let mut voxels = [vec![], vec![], vec![]];
    for (label, dimension) in (1..).zip(dimensions) {
        voxels[dimension].push(found.label_voxels[&label]);
    }
    for voxels in &mut voxels {
        voxels.sort_unstable();
    }
    let vertices = [738, 738, 738, 738, 738, 738, 738, 739];
    assert_eq!(voxels, [vertices.to_vec(), vec![1620; 12], vec![4218; 6]]);
}
