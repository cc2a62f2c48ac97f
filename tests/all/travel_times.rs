//! Travel times through an image of speeds (docs/algorithms.md, "Travel times"): against a plain Dijkstra in f64, an analytic answer,
//! and the distances that they are at speed 1; the same bits whatever the method, the order, the bricks.

#![allow(clippy::unwrap_used)]

use strandline::{DistanceField, Geometry, Method, Schedule, SolvedDistance, TriangleMesh, Volume};

use crate::common::lab::PlainGrid;
use crate::common::random::Random;
use crate::common::times::{fixed_times, plain_times};

/// Until an iteration changes nothing.
const TO_REST: Schedule = Schedule::Sweep { iterations: u32::MAX };

const POINTS: [[f64; 3]; 3] = [[3.31, -1.2, 2.05], [11.02, 5.9, 7.3], [10.4, 0.3, 1.9]];

fn grid() -> Geometry {
    Geometry::new([37, 23, 19], [0.25, 0.4, 0.375], [3.0, -2.0, 1.0])
}

/// Speeds that differ up to a hundredfold, walls with gaps among them.
fn speeds(grid: &Geometry, seed: u64, walls: usize) -> Vec<f32> {
    let mut random = Random(seed);
    let plain = PlainGrid { shape: grid.shape };
    let wall = |v: [i64; 3]| v[0] % 9 == 5 && v[1] > 3 && walls > 0;
    plain
        .voxels()
        .map(|v| if wall(v) || random.below(100) < walls { 0.0 } else { 0.1 * 100_f32.powf(random.unit() as f32) })
        .collect()
}

fn job<'a>(points: &'a [[f64; 3]], grid: &Geometry, speeds: &'a [f32]) -> DistanceField<'a> {
    let split = points.len().div_ceil(2);
    DistanceField::new()
        .points(&points[..split])
        .points(&points[split..])
        .speed(Volume::new(grid.shape, speeds).unwrap(), grid.clone())
        .labels()
}

fn all(solved: &SolvedDistance<f32>) -> (Vec<f32>, Vec<u32>) {
    let part = solved.geometry().domain();
    (solved.distance().read_box(&part).unwrap(), solved.labels().unwrap().read_box(&part).unwrap())
}

/// All methods, orders and bricks that there are.
fn ways<'a>(job: impl Fn() -> DistanceField<'a>) -> Vec<(String, Vec<f32>, Vec<u32>)> {
    let mut ways = Vec::new();
    for method in [Method::FMM, Method::FSM] {
        for schedule in [Schedule::Front, TO_REST] {
            for (brick, threads) in [(16, 1), (16, 3), (32, 2), (64, 1)] {
                let job = job().method(method).schedule(schedule).brick(brick).threads(threads);
                let (times, labels) = all(&job.solve().unwrap());
                ways.push((format!("{} {schedule:?} {brick} {threads}", method.name()), times, labels));
            }
        }
    }
    ways
}

#[test]
fn times_are_those_of_a_plain_dijkstra_and_the_same_bits_in_any_order() {
    let grid = grid();
    for (seed, walls) in [(1, 0), (2, 3), (3, 20)] {
        let speeds = speeds(&grid, seed, walls);
        let fixed = fixed_times(&grid, &speeds, &POINTS);
        let plain = plain_times(&grid, &speeds, &fixed);
        assert_eq!(plain.iter().any(|t| t.is_infinite()), walls > 0);
        let ways = ways(|| job(&POINTS, &grid, &speeds));
        let (_, first, labels) = &ways[0];
        for (place, (time, expected)) in first.iter().zip(&plain).enumerate() {
            let time = f64::from(*time);
            let is_same = time == *expected || (time - expected).abs() <= 3e-6 * expected;
            assert!(is_same, "seed {seed}, voxel {place}: {time}, plainly {expected}");
        }
        for (way, times, of) in &ways {
            let bits = |times: &[f32]| times.iter().map(|t| t.to_bits()).collect::<Vec<_>>();
            assert!(bits(times) == bits(first) && of == labels, "seed {seed}: {way}");
        }
    }
}

/// The label of a voxel is that of sources whose front is the first, or as good as the first.
#[test]
fn labels_follow_the_fronts() {
    let grid = grid();
    let plain = PlainGrid { shape: grid.shape };
    for (seed, walls) in [(4, 0), (5, 4)] {
        // Smooth speeds: across a jump the way back is as coarse as a voxel.
        let speeds: Vec<f32> = speeds(&grid, seed, walls)
            .into_iter()
            .zip(plain.voxels())
            .map(
                |(speed, [x, y, z])| {
                    if speed == 0.0 { 0.0 } else { 1.5 + ((x + 2 * y) as f32 * 0.2).sin() * (z as f32 * 0.3).cos() }
                },
            )
            .collect();
        let of = |points: &[[f64; 3]]| plain_times(&grid, &speeds, &fixed_times(&grid, &speeds, points));
        let (one, two) = (of(&POINTS[..2]), of(&POINTS[2..]));
        let (_, labels) = all(&job(&POINTS, &grid, &speeds).solve().unwrap());
        // A step of the way back is off by half a voxel at the most.
        let close = 0.5 * 0.4 / 0.5;
        let mut wrong = 0;
        for ((label, one), two) in labels.iter().zip(&one).zip(&two) {
            let reached = one.min(*two).is_finite();
            assert_eq!(*label == 0, !reached);
            if reached && (one - two).abs() > close {
                wrong += usize::from(*label != if one < two { 1 } else { 2 });
            }
        }
        assert!(wrong <= labels.len() / 500, "{wrong} of {} labels are not of the first front", labels.len());
    }
}

/// Two rooms whose wall is so thin that voxels on both sides of it touch at edges and corners: no label comes through.
#[test]
fn nothing_comes_through_a_wall() {
    let grid = Geometry::new([24, 24, 24], [1.0; 3], [0.0; 3]);
    let plain = PlainGrid { shape: grid.shape };
    let speeds: Vec<f32> =
        plain.voxels().map(|[x, y, z]| if x + y + z == 34 { 0.0 } else { 1.0 + (x % 3) as f32 }).collect();
    let points = [[1.5, 2.5, 1.5], [22.5, 22.5, 21.5]];
    for (way, times, labels) in ways(|| job(&points, &grid, &speeds)) {
        for ((v, label), time) in plain.voxels().zip(labels).zip(times) {
            let expected = match v.iter().sum::<i64>() {
                34 => 0,
                ..34 => 1,
                _ => 2,
            };
            assert!(label == expected && time.is_finite() == (expected > 0), "{way}: {label} at {v:?}");
        }
    }
}

/// At speed 1 times are distances, at speed 4 a quarter of them, to the bit.
#[test]
fn at_one_speed_times_are_distances() {
    let grid = grid();
    let plain =
        DistanceField::new().points(&POINTS).grid(grid.clone()).method(Method::FSM).schedule(TO_REST).solve().unwrap();
    let part = grid.domain();
    let distances: Vec<f32> = plain.distance().read_box(&part).unwrap();
    for (speed, scale) in [(1.0_f32, 1.0), (4.0, 0.25)] {
        let speeds = vec![speed; part.len()];
        for (way, times, _) in ways(|| job(&POINTS, &grid, &speeds)) {
            assert!(times.iter().zip(&distances).all(|(t, d)| *t == scale * d), "{way} at speed {speed}");
        }
    }
}

/// The first arrival from a point below the plane z = `border`, at speeds `below` and `above` it: straight on, along the border where
/// that is faster (the head wave), or bent by Snell's law, found by bisection of where it crosses.
fn first_arrival(source: [f64; 3], at: [f64; 3], border: f64, [below, above]: [f64; 2]) -> f64 {
    let along = (at[0] - source[0]).hypot(at[1] - source[1]);
    let (depth, height) = (border - source[2], at[2] - border);
    if height <= 0.0 {
        let direct = along.hypot(at[2] - source[2]) / below;
        let sine = below / above;
        if sine >= 1.0 {
            return direct;
        }
        let cosine = (1.0 - sine * sine).sqrt();
        let is_reached = along >= (depth - height) * sine / cosine;
        let head = along / above + (depth - height) * cosine / below;
        return if is_reached { direct.min(head) } else { direct };
    }
    let (mut low, mut high) = (0.0, along);
    for _ in 0..100 {
        let middle = f64::midpoint(low, high);
        let slope = middle / middle.hypot(depth) / below - (along - middle) / (along - middle).hypot(height) / above;
        if slope < 0.0 { low = middle } else { high = middle }
    }
    low.hypot(depth) / below + (along - low).hypot(height) / above
}

/// A point makes a cone of times, which costs an order its logarithm; a sphere around it makes none.
#[test]
fn two_layers_are_met_with_the_first_order() {
    let (source, radius) = ([0.4, 0.45, 0.3], 0.15);
    let sphere = crate::common::meshes::sphere(source, radius, 48, std::f64::consts::PI);
    for layers in [[1.0, 3.0], [2.0, 1.0]] {
        let mean_errors = [16, 32, 64].map(|n: i64| {
            let h = 1.0 / n as f64;
            // Midway between two planes of voxels.
            let border = ((0.55 * n as f64).floor() + 0.5) * h;
            let grid = Geometry::new([n + 1; 3], [h; 3], [0.0; 3]);
            let plain = PlainGrid { shape: grid.shape };
            let speeds: Vec<f32> =
                plain.voxels().map(|v| layers[usize::from(v[2] as f64 * h > border)] as f32).collect();
            let of = |job: DistanceField<'_>| {
                let job = job.speed(Volume::new(grid.shape, speeds.as_slice()).unwrap(), grid.clone());
                job.solve().unwrap().distance().read().unwrap()
            };
            let error = |times: Vec<f32>, later: f64| {
                let far = |v: &[i64; 3]| {
                    let p = grid.position(*v);
                    (0..3).map(|a| (p[a] - source[a]).powi(2)).sum::<f64>().sqrt() > radius + h
                };
                let errors = plain.voxels().zip(times).filter(|(v, _)| far(v));
                let errors = errors.map(|(v, t)| {
                    (f64::from(t) + later - first_arrival(source, grid.position(v), border, layers)).abs()
                });
                let (sum, count) = errors.fold((0.0, 0), |(sum, count), error| (sum + error, count + 1));
                sum / f64::from(count)
            };
            let mesh: &TriangleMesh = &sphere;
            let point = error(of(DistanceField::new().points(&[source][..])), 0.0);
            let sphere = error(of(DistanceField::new().mesh(mesh.clone())), radius / layers[0]);
            [point, sphere]
        });
        let [a, b, c] = mean_errors;
        // Of a first order a half; of h log h at these steps 0.6, and more where a head wave is made of what comes from the cone.
        for (coarse, fine) in [(a, b), (b, c)] {
            assert!(fine[0] < 0.72 * coarse[0], "{layers:?}: {mean_errors:?}");
            assert!(fine[1] < 0.6 * coarse[1], "{layers:?}: {mean_errors:?}");
        }
        assert!(c[0] < 1.0 / 64.0 && c[1] < 0.45 / 64.0, "{layers:?}: {mean_errors:?}");
    }
}
