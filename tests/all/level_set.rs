//! Motions whose course is known: a sphere that shrinks by its curvature, moves at a speed, or comes to rest, and the same bits from
//! any number of threads. Whole reconstructions are in `reconstruct`.

use std::f64::consts::PI;

use strandline::grid::Geometry;
use strandline::kernel::level_set::cell::CELL;
use strandline::kernel::level_set::scheme::velocity::Velocity;
use strandline::kernel::surface::{MarchingCubes, Measures, Patch, SurfaceMeasure, Welder, cells_of_brick};
use strandline::pipeline::level_set::evolve::evolve;
use strandline::pipeline::level_set::time_loop::{Stop, TimeLoop};

use crate::common::lab::{Lab, PlainGrid, dense, whole};
use crate::common::mesh_buffer::MeshBuffer;
use crate::common::plain_scheme::{gradient_norms, mean_norm};

/// The surface u = 0.5 of a field over the whole grid.
fn surface(geometry: &Geometry, u: &[f32]) -> (MeshBuffer, Measures) {
    let part = geometry.domain();
    let cells = cells_of_brick(&part, geometry.shape, false);
    let (mut patch, mut welder, mut mesh) = (Patch::default(), Welder::new(geometry), MeshBuffer::default());
    let mut measure = SurfaceMeasure::new(geometry.position(geometry.shape.map(|n| n / 2)));
    MarchingCubes::new(0.5).extract(u, &part, &cells, &mut patch);
    welder.add(&patch, &mut mesh).expect("memory takes any mesh");
    welder.triangles_of(&patch).for_each(|(corners, positions)| measure.add(corners, positions));
    (mesh, measure.measures())
}

fn settings(h: f64, theta: f32, delta: f32) -> TimeLoop {
    let tau = (h / 4.0) as f32;
    TimeLoop {
        velocity: Velocity { theta, rho: 0.0, delta, epsilon: 0.01, tau, normalised: true, speed: false },
        stop: Stop::L2(1e-4),
        max_steps: 1000,
        omega: 1.2,
        solver_tolerance: 1e-6,
    }
}

/// A cone about the origin, cut off at 0 and 1, whose level 0.5 is the sphere of this radius.
fn cone(geometry: &Geometry, radius: f64) -> Vec<f32> {
    let grid = PlainGrid { shape: geometry.shape };
    let distance = |v| geometry.position(v).iter().map(|x| x * x).sum::<f64>().sqrt();
    grid.voxels().map(|v| (0.5 + (radius - distance(v)) / 1.2).clamp(0.0, 1.0) as f32).collect()
}

fn centred(shape: [i64; 3], spacing: [f64; 3]) -> Geometry {
    let origin = std::array::from_fn(|a| -0.5 * (shape[a] - 1) as f64 * spacing[a]);
    Geometry { shape, spacing, origin, unit: None }
}

/// Motion by mean curvature: `dr/dt = -2 delta / r`, so `r^2 = r0^2 - 4 delta t`.
#[test]
fn a_sphere_shrinks_by_its_curvature() {
    let lab = Lab::new(2);
    for (shape, spacing) in [([46; 3], [0.05; 3]), ([46, 40, 26], [0.05, 0.06, 0.09])] {
        let geometry = centred(shape, spacing);
        let u = cone(&geometry, 0.8);
        let (d, solved) = (vec![0.0; u.len()], vec![1; u.len()]);
        let mut band = lab.band(shape, &u, &d, &solved);
        let mut run = TimeLoop { stop: Stop::L2(0.0), max_steps: 10, ..settings(0.02, 0.0, 0.1) };
        run.velocity.epsilon = 1e-3;
        let stage = lab.engine.stage("sphere", 0);
        for leg in 1..=4 {
            evolve(&stage, &lab.engine, &mut band, None, spacing, &run, None).unwrap();
            let time = f64::from(leg * run.max_steps) * f64::from(run.velocity.tau);
            let exact = (0.64 - 4.0 * 0.1 * time).sqrt();
            let radius = (0.75 / PI * surface(&geometry, &whole(&band.u)).1.volume).cbrt();
            assert!((radius / exact - 1.0).abs() < 0.005, "{spacing:?}, t = {time}: {radius} for {exact}");
        }
    }
}

/// A ball grows and shrinks at the speed that it is given, `dr/dt = F`, the more exactly the finer the grid, and rests
/// where F is none.
#[test]
fn a_sphere_moves_at_its_speed() {
    let lab = Lab::new(2);
    let radius_after = |finer: i64, steps: u32, speed: &dyn Fn(f64) -> f64| {
        let shape = [42, 36, 28].map(|n| n * finer);
        let geometry = centred(shape, [0.06, 0.07, 0.09].map(|h| h / finer as f64));
        let (u, grid) = (cone(&geometry, 0.6), PlainGrid { shape });
        let length = |v| geometry.position(v).iter().map(|x| x * x).sum::<f64>().sqrt();
        let speeds: Vec<f32> = grid.voxels().map(|v| speed(length(v)) as f32).collect();
        let mut band = lab.band(geometry.shape, &u, &vec![0.0; u.len()], &vec![1; u.len()]);
        let field = lab.field(&dense(geometry.shape, CELL as i64), &speeds);
        let mut run = TimeLoop { stop: Stop::L2(0.0), max_steps: steps, ..settings(0.02, 0.0, 0.0) };
        run.velocity = Velocity { rho: 1.0, speed: true, epsilon: 1e-3, ..run.velocity };
        let stage = lab.engine.stage("sphere", 0);
        evolve(&stage, &lab.engine, &mut band, Some(&field), geometry.spacing, &run, None).unwrap();
        (0.75 / PI * surface(&geometry, &whole(&band.u)).1.volume).cbrt()
    };
    let time = 40.0 * 0.005;
    for speed in [1.0, -1.0] {
        let off = [1, 2].map(|finer| (radius_after(finer, 40, &|_| speed) - 0.6 - speed * time).abs());
        assert!(off[0] < 0.15 * time && off[1] < 0.7 * off[0], "{speed}: {off:?}");
    }
    let rested = radius_after(2, 100, &|r| 8.0 * (0.75 - r));
    assert!((rested - 0.75).abs() < 0.01, "{rested}");
}

/// The surface moves towards the points at unit speed: the front of `theta = 1` alone comes to rest on them.
#[test]
fn the_front_rests_where_the_distance_is_zero() {
    let lab = Lab::new(2);
    let geometry = centred([44; 3], [0.05; 3]);
    let u = cone(&geometry, 0.8);
    let grid = PlainGrid { shape: geometry.shape };
    let length = |v| geometry.position(v).iter().map(|x| x * x).sum::<f64>().sqrt();
    for target in [0.6, 0.9] {
        let d: Vec<f32> = grid.voxels().map(|v| (length(v) - target).abs() as f32).collect();
        let mut band = lab.band(geometry.shape, &u, &d, &vec![1; u.len()]);
        let stage = lab.engine.stage("sphere", 0);
        let run = TimeLoop { max_steps: 60, ..settings(0.05, 1.0, 0.0) };
        evolve(&stage, &lab.engine, &mut band, None, geometry.spacing, &run, None).unwrap();
        let radius = (0.75 / PI * surface(&geometry, &whole(&band.u)).1.volume).cbrt();
        assert!((radius - target).abs() < 0.005, "{radius} for {target}");
    }
}

/// One and two threads take the same steps to the same bits, on a domain that cuts cells short on every axis; what the
/// loop says of its last step is what the fields say.
#[test]
fn threads_change_no_bit_of_the_level_set() {
    let geometry = centred([37, 44, 29], [0.05, 0.04, 0.07]);
    let grid = PlainGrid { shape: geometry.shape };
    let u = cone(&geometry, 0.6);
    let d: Vec<f32> = grid.voxels().map(|v| (geometry.position(v)[0].abs() - 0.55).abs() as f32).collect();
    let g: Vec<f32> = grid.voxels().map(|v| 1.0 / (1.0 + geometry.position(v)[1].powi(2)) as f32).collect();
    let solved: Vec<u8> = d.iter().map(|d| u8::from(*d < 0.5)).collect();
    let runs = [(1, 12), (2, 12), (2, 11)].map(|(threads, max_steps)| {
        let lab = Lab::new(threads);
        let mut band = lab.band(geometry.shape, &u, &d, &solved);
        let edges = lab.field(band.solved.set(), &g);
        let mut run = TimeLoop { stop: Stop::Surface(0.0), max_steps, ..settings(0.05, 0.7, 0.05) };
        run.velocity.rho = 0.4;
        let stage = lab.engine.stage("threads", 0);
        let done = evolve(&stage, &lab.engine, &mut band, Some(&edges), geometry.spacing, &run, None).unwrap();
        (whole(&band.u), done, run)
    });
    let [(new, done, run), (second, other, _), (before, ..)] = &runs;
    assert_eq!(done, other);
    assert!(new.iter().zip(second).all(|(a, b)| a.to_bits() == b.to_bits()));
    assert!(new.iter().zip(&u).zip(&solved).all(|((new, old), s)| *s == 1 || new == old), "held voxels stay");
    let motion: f64 = new.iter().zip(before).map(|(n, b)| f64::from((n - b).abs())).sum();
    let area: f64 = grid
        .voxels()
        .filter(|v| solved[grid.at(*v)] == 1)
        .map(|v| {
            let value = |i, j, k| f64::from(before[grid.at([v[0] + j, v[1] + i, v[2] + k])]);
            mean_norm(&gradient_norms(value, geometry.spacing)).hypot(0.01)
        })
        .sum();
    let speed = motion / (area * f64::from(run.velocity.tau));
    assert!((done.residual / speed - 1.0).abs() < 1e-4, "{} for {speed}", done.residual);
}
