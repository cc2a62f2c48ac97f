//! Time steps of the level set on a spherical shell, as the papers' program does them and as ours does.
//!
//! Plain: f64, one thread, for each voxel of the band the 24 norms as printed, six coefficients and a diagonal kept in
//! lists, SOR along the band's list. Both stop a step at the same root mean square of corrections; both have the
//! image's term. Prints nanoseconds for each band voxel and step, and errors against the plain program solved to 1e-9.
//! `cargo bench --bench level_set_step [-- RADIUS]`
#![allow(missing_docs, dead_code, clippy::disallowed_methods)]

#[path = "../tests/common/lab.rs"]
mod lab;
#[path = "../tests/common/plain_scheme.rs"]
mod plain_scheme;

use std::time::Instant;

use lab::{Lab, PlainGrid, dense, whole};
use plain_scheme::{PlainVelocity, coefficients, gradient_norms};
use strandline::kernel::level_set::cell::CELL;
use strandline::kernel::level_set::scheme::velocity::Velocity;
use strandline::pipeline::level_set::band::{Reaches, SidesNear, make_band};
use strandline::pipeline::level_set::evolve::evolve;
use strandline::pipeline::level_set::time_loop::{Stop, TimeLoop};

const STEPS: u32 = 20;
/// Each program runs this often, taking turns; its fastest run counts.
const REPEATS: usize = 2;
const OMEGA: f64 = 1.2;
const VELOCITY: PlainVelocity =
    PlainVelocity { theta: 0.7, rho: 0.3, delta: 0.1, epsilon: 0.01, tau: 0.5, normalised: true };
/// Half the width of the band, in voxels.
const HALF: f64 = 12.0;

/// The fields on a grid of spacing 1: distance to a sphere, detector of a wavy membrane beside it, start, band.
struct Scene {
    grid: PlainGrid,
    radius: f64,
    d: Vec<f32>,
    g: Vec<f32>,
    level: Vec<f32>,
}

impl Scene {
    fn new(radius: f64) -> Self {
        let n = (2.0 * (radius + HALF) + 4.0).ceil() as i64;
        let grid = PlainGrid { shape: [n; 3] };
        let from_centre = |v: [i64; 3]| v.map(|x| x as f64 - 0.5 * (n - 1) as f64);
        let r = |v| from_centre(v).iter().map(|x| x * x).sum::<f64>().sqrt();
        let d: Vec<f32> = grid.voxels().map(|v| (r(v) - radius).abs() as f32).collect();
        let membrane = |v: [i64; 3]| {
            let wave = (0.3 * v[0] as f64).sin() + (0.23 * v[1] as f64).cos();
            1.0 - 0.7 * (-((r(v) - radius - wave) / 2.5).powi(2)).exp()
        };
        let g = grid.voxels().map(|v| membrane(v) as f32).collect();
        // Outside the flood reaches as far as the distance, inside nowhere.
        let level = grid.voxels().map(|v| if r(v) > radius { (r(v) - radius) as f32 } else { 0.0 }).collect();
        Self { grid, radius, d, g, level }
    }

    fn in_band(&self, at: usize) -> bool {
        f64::from(self.d[at]) <= HALF
    }

    fn start(&self) -> Vec<f64> {
        self.level.iter().map(|level| f64::from(u8::from(*level < 3.0))).collect()
    }
}

struct Cost {
    seconds: f64,
    assembly: f64,
    iterations: u64,
    fill: f64,
    u: Vec<f64>,
}

/// The papers' program: returns u and what it cost.
fn plain(scene: &Scene, tolerance: f64) -> Cost {
    let grid = scene.grid;
    let [nx, ny, _] = grid.shape.map(|n| n as usize);
    let strides = [1, nx, nx * ny];
    // The band keeps away from the border, so that plain strides reach every neighbour.
    let band: Vec<usize> = (0..grid.len()).filter(|at| scene.in_band(*at)).collect();
    let d: Vec<f64> = scene.d.iter().map(|v| f64::from(*v)).collect();
    let g: Vec<f64> = scene.g.iter().map(|v| f64::from(*v)).collect();
    let mut u = scene.start();
    let mut a = vec![[0.0; 6]; band.len()];
    let mut right = vec![0.0; band.len()];
    let (mut assembly, mut iterations) = (0.0, 0);
    let around = |at: usize| -> [usize; 6] {
        std::array::from_fn(|q| if q % 2 == 0 { at - strides[q / 2] } else { at + strides[q / 2] })
    };
    let started = Instant::now();
    for _ in 0..STEPS {
        let assembling = Instant::now();
        for (n, &at) in band.iter().enumerate() {
            let value =
                |i: i64, j: i64, k: i64| u[(at as i64 + j + i * strides[1] as i64 + k * strides[2] as i64) as usize];
            let norms = gradient_norms(value, [1.0; 3]);
            let difference = |f: &[f64]| around(at).map(|q| f[q] - f[at]);
            a[n] = coefficients(&norms, difference(&d), difference(&g), [1.0; 3], &VELOCITY);
            right[n] = u[at];
        }
        assembly += assembling.elapsed().as_secs_f64();
        loop {
            let mut squares = 0.0;
            for (n, &at) in band.iter().enumerate() {
                let (q, c) = (around(at), &a[n]);
                let diagonal = 1.0 - (c[0] + c[1] + c[2] + c[3] + c[4] + c[5]);
                let sum =
                    c[0] * u[q[0]] + c[1] * u[q[1]] + c[2] * u[q[2]] + c[3] * u[q[3]] + c[4] * u[q[4]] + c[5] * u[q[5]];
                let correction = (right[n] - sum) / diagonal - u[at];
                squares += correction * correction;
                u[at] += OMEGA * correction;
            }
            iterations += 1;
            if (squares / band.len() as f64).sqrt() < tolerance {
                break;
            }
        }
    }
    Cost { seconds: started.elapsed().as_secs_f64(), assembly, iterations, fill: 1.0, u }
}

/// Our pipeline on the same band.
fn ours(scene: &Scene, threads: usize, tolerance: f64) -> Cost {
    let lab = Lab::new(threads);
    let set = dense(scene.grid.shape, CELL as i64);
    let inside: Vec<u8> = scene.level.iter().map(|level| u8::from(*level < 3.0)).collect();
    let (distance, inside, g) = (lab.field(&set, &scene.d), lab.field(&set, &inside), lab.field(&set, &scene.g));
    let stage = lab.engine.stage("band", 0);
    let sides = SidesNear { distance: &distance, inside: &inside, cells: &set };
    let reaches = Reaches { inner: HALF as f32, outer: HALF as f32 };
    let mut band = make_band(&stage, &lab.engine, sides, reaches).expect("room for a band");
    let edges = lab.field(&band.solved.set().clone(), &whole(&g));
    let velocity = Velocity {
        theta: VELOCITY.theta as f32,
        rho: VELOCITY.rho as f32,
        delta: VELOCITY.delta as f32,
        epsilon: VELOCITY.epsilon as f32,
        tau: VELOCITY.tau as f32,
        normalised: VELOCITY.normalised,
        speed: false,
    };
    let settings =
        TimeLoop { velocity, stop: Stop::L2(0.0), max_steps: STEPS, omega: OMEGA as f32, solver_tolerance: tolerance };
    let cells = (0..band.solved.set().len() as u32).filter(|slot| band.solved.read(*slot, |s| s.contains(&1))).count();
    let fill = band.voxels as f64 / (cells * CELL * CELL * CELL) as f64;
    let started = Instant::now();
    let done =
        evolve(&stage, &lab.engine, &mut band, Some(&edges), [1.0; 3], &settings, None).expect("steps are taken");
    let seconds = started.elapsed().as_secs_f64();
    let u = whole(&band.u).into_iter().map(f64::from).collect();
    Cost { seconds, assembly: 0.0, iterations: done.sor_iterations, fill, u }
}

fn main() {
    let given = std::env::args().skip(1).find_map(|a| a.parse().ok());
    let scene = Scene::new(given.unwrap_or(70.0));
    let voxels = (0..scene.grid.len()).filter(|at| scene.in_band(*at)).count();
    println!("shell of radius {}: {voxels} band voxels of {}, {STEPS} steps", scene.radius, scene.grid.len());
    let per_step = |seconds: f64| seconds * 1e9 / (voxels as f64 * f64::from(STEPS));
    let solved = plain(&scene, 1e-9).u;
    for tolerance in [1e-3, 1e-4, 1e-5] {
        let mut best: [Option<Cost>; 3] = [None, None, None];
        for _ in 0..REPEATS {
            let costs = [plain(&scene, tolerance), ours(&scene, 1, tolerance), ours(&scene, 2, tolerance)];
            for (best, cost) in best.iter_mut().zip(costs) {
                if best.as_ref().is_none_or(|b| cost.seconds < b.seconds) {
                    *best = Some(cost);
                }
            }
        }
        let [reference, one, two] = best.map(|cost| cost.expect("every program has run"));
        println!("corrections below {tolerance:e}");
        println!("  plain: of this assembly {:.1} ns", per_step(reference.assembly));
        for (name, cost) in [("plain f64", &reference), ("1 thread ", &one), ("2 threads", &two)] {
            let errors = || cost.u.iter().zip(&solved).map(|(a, b)| (a - b).abs());
            println!(
                "  {name}    {:7.1} ns, {:.1} iterations a step, ratio {:.2}, cells {:.0} % full, error of u {:.1e} \
                 (largest {:.1e})",
                per_step(cost.seconds),
                cost.iterations as f64 / f64::from(STEPS),
                reference.seconds / cost.seconds,
                100.0 * cost.fill,
                (errors().map(|e| e * e).sum::<f64>() / voxels as f64).sqrt(),
                errors().fold(0.0, f64::max),
            );
        }
    }
}
