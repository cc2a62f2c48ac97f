//! Distances of vdt and dp where sources outside of the grid lie much denser than its voxels: against a plain search over
//! all sources in f64, exact to rounding.

#![allow(clippy::unwrap_used)]

use strandline::grid::{DataSets, Geometry, TriangleMesh};
use strandline::pipeline::distance::{DistanceSettings, Method, Schedule};

use super::distance_outside::{plainly, settings, solved_on};
use crate::common::around::to_triangle;
use crate::common::lab::PlainGrid;
use crate::common::random::Random;
use crate::common::textbook::{position, squared};

const SCHEDULES: [Schedule; 2] = [Schedule::Front, Schedule::Sweep { iterations: 1 }];

fn grid() -> Geometry {
    Geometry { shape: [19, 7, 10], spacing: [0.5, 0.7, 0.6], origin: [30.0, -2.0, 1.0], unit: None }
}

/// A place just outside of the grid: up to so many voxels beyond one of its faces.
fn beside(random: &mut Random, beyond: f64) -> [f64; 3] {
    let grid = grid();
    let (axis, upper) = (random.below(3), random.below(2) == 1);
    std::array::from_fn(|a| {
        let (last, out) = ((grid.shape[a] - 1) as f64, beyond * (0.001 + 0.999 * random.unit()));
        let at = match (a == axis, upper) {
            (true, true) => last + out,
            (true, false) => -out,
            (false, _) => (last + 2.0) * random.unit() - 1.0,
        };
        grid.origin[a] + at * grid.spacing[a]
    })
}

/// Voxels of the grid's faces.
fn face_voxels() -> usize {
    let [x, y, z] = grid().shape.map(|n| n as usize);
    2 * (x * y + y * z + z * x)
}

fn points_beside(random: &mut Random, each: usize, beyond: f64) -> Vec<[f64; 3]> {
    (0..each * face_voxels()).map(|_| beside(random, beyond)).collect()
}

/// Triangles of less than a voxel around the grid, each with a corner outside; some reach into it.
fn triangles_beside(random: &mut Random, count: usize, size: f64) -> TriangleMesh {
    let mut corners = Vec::new();
    for _ in 0..count {
        let at = beside(random, 1.5);
        corners.push(at);
        corners.extend((0..2).map(|_| -> [f64; 3] { std::array::from_fn(|a| at[a] + size * (random.unit() - 0.5)) }));
    }
    let count = count as u32;
    TriangleMesh::new(corners, (0..count).map(|n| [3 * n, 3 * n + 1, 3 * n + 2]).collect()).unwrap()
}

/// Scenes, and which of them have sources in the grid too.
fn scenes() -> Vec<(&'static str, DataSets, bool)> {
    let random = &mut Random(11);
    let scene = |parts: &[&[[f64; 3]]], meshes: &[TriangleMesh]| {
        let mut sets = DataSets::default();
        for points in parts {
            sets.add_cloud(points);
        }
        for mesh in meshes {
            sets.add_mesh(mesh);
        }
        sets
    };
    let dense = points_beside(random, 50, 0.3);
    let (some, loose) = (points_beside(random, 3, 2.0), points_beside(random, 1, 9.0));
    let small = [triangles_beside(random, 1000, 0.25)];
    let within: Vec<[f64; 3]> = [[4, 3, 5], [13, 4, 6], [9, 3, 3]].map(|v| position(&grid(), v)).into();
    vec![
        ("50 points a voxel", scene(&[&dense], &[]), false),
        ("points of two labels", scene(&[&some, &loose], &[]), false),
        ("triangles", scene(&[], &small), false),
        ("points and triangles", scene(&[&loose], &small), false),
        ("50 points a voxel, three within", scene(&[&within, &dense], &[]), true),
        ("triangles, three points within", scene(&[&within], &small), true),
    ]
}

fn is_outside(place: [f64; 3]) -> bool {
    let grid = grid();
    let at: [f64; 3] = std::array::from_fn(|a| (place[a] - grid.origin[a]) / grid.spacing[a]);
    (0..3).any(|a| at[a] < 0.0 || at[a] > (grid.shape[a] - 1) as f64)
}

/// The distance to a source.
fn to_source(sets: &DataSets, here: [f64; 3], source: u32) -> f64 {
    let source = source as usize;
    let points = sets.positions.len();
    sets.positions
        .get(source)
        .map_or_else(|| to_triangle(here, sets.mesh.corners(source - points)), |&point| squared(here, point).sqrt())
}

/// For each voxel how far the nearest source is that lies in the grid with all of it.
fn within(sets: &DataSets) -> Vec<f64> {
    let points = sets.positions.len();
    let is_within = |&source: &u32| {
        let n = source as usize;
        let corners = || sets.mesh.corners(n - points).into_iter().all(|corner| !is_outside(corner));
        sets.positions.get(n).map_or_else(corners, |&point| !is_outside(point))
    };
    let sources: Vec<u32> = (0..sets.len() as u32).filter(is_within).collect();
    let nearest = |v| {
        let here = position(&grid(), v);
        sources.iter().map(|&source| to_source(sets, here, source)).fold(f64::INFINITY, f64::min)
    };
    PlainGrid { shape: grid().shape }.voxels().map(nearest).collect()
}

#[test]
fn sources_denser_than_voxels_are_exact_through_the_faces() {
    for (name, sets, is_mixed) in scenes() {
        let exact: Vec<f64> =
            plainly(&grid(), &sets).iter().map(|each| each.iter().copied().fold(f64::INFINITY, f64::min)).collect();
        let within = within(&sets);
        // There these methods may miss the nearest of the sources in the grid.
        let is_within = |at: usize| within[at] <= exact[at] * (1.0 + 1e-9);
        assert_eq!((0..exact.len()).any(is_within), is_mixed, "{name}");
        for method in [Method::VDT, Method::DP] {
            for schedule in SCHEDULES {
                let (values, sources) = solved_on(&grid(), &sets, &settings(method, schedule, 16), [2, 1]);
                let mut from_outside = 0;
                for (at, v) in (PlainGrid { shape: grid().shape }).voxels().enumerate() {
                    let (here, exact, value) = (position(&grid(), v), exact[at], f64::from(values[at]));
                    // Of f32 a distance has 24 bits; squares and roots in f64 add nothing to that.
                    let rounding = exact * f64::from(f32::EPSILON);
                    let told = format!("{} {schedule:?}, {name}, {v:?}: {value} for {exact}", method.name());
                    assert!(value >= exact - rounding, "{told}");
                    assert!((to_source(&sets, here, sources[at]) - value).abs() <= rounding, "{told}: source");
                    if is_within(at) {
                        continue;
                    }
                    assert!(value - exact <= rounding, "{told}");
                    from_outside += 1;
                }
                assert!(from_outside > 200, "{name}: {from_outside}");
            }
        }
    }
}

/// Neither bricks, threads nor ranks change a bit of distance or source where all sources lie outside, nor of equally near
/// sources which is taken.
#[test]
fn dense_sources_outside_give_the_same_bits_everywhere() {
    let mut sets = DataSets::default();
    // Every place twice, under two labels.
    let points = points_beside(&mut Random(5), 4, 0.5);
    sets.add_cloud(&points);
    sets.add_cloud(&points);
    for method in [Method::VDT, Method::DP] {
        for schedule in SCHEDULES {
            let with = |brick, farthest| DistanceSettings { farthest, ..settings(method, schedule, brick) };
            let one = solved_on(&grid(), &sets, &with(16, None), [1, 1]);
            assert!(one.1.iter().all(|source| sets.label(*source) == 1));
            for (brick, many) in [(32, [1, 1]), (16, [2, 1]), (16, [2, 3]), (32, [3, 2])] {
                assert_eq!(one, solved_on(&grid(), &sets, &with(brick, None), many), "{} {brick}", method.name());
            }
            if schedule == Schedule::Front {
                let near = solved_on(&grid(), &sets, &with(16, Some(1.0)), [2, 1]).0;
                assert!(near.iter().zip(&one.0).all(|(near, all)| *near == all.min(1.0)), "{}", method.name());
            }
        }
    }
}
