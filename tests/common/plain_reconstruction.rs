//! The reconstruction of Kósa (2015) as one would write it down: one thread, f64, whole arrays. Fast sweeping
//! from the corners of the points' cells, a flood for the start, a band of twice beta, semi-implicit steps with SOR.
//! Shared by tests and the bench.

use super::lab::PlainGrid;
use super::plain_scheme::{PlainVelocity, coefficients, gradient_norms};
use strandline::grid::Geometry;
use strandline::kernel::surface::{MarchingCubes, Patch, Welder, cells_of_brick};

use crate::common::mesh_buffer::MeshBuffer;

/// How the plain program is run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlainSettings {
    pub(crate) beta: f64,
    /// What is solved: all within this distance of the cloud, but for the outermost voxels.
    pub(crate) gamma: f64,
    pub(crate) delta: f64,
    pub(crate) epsilon: f64,
    pub(crate) tau: f64,
    /// Of the discrete L2 norm of a step's change.
    pub(crate) stop: f64,
    /// Root mean square of the last corrections of a step.
    pub(crate) tolerance: f64,
}

/// What it found, and what that took.
pub(crate) struct PlainSurface {
    pub(crate) u: Vec<f64>,
    pub(crate) band: usize,
    pub(crate) steps: u32,
    pub(crate) iterations: u32,
    pub(crate) seconds: [f64; 3],
}

impl PlainSurface {
    /// The surface u = 1/2.
    pub(crate) fn mesh(&self, geometry: &Geometry) -> MeshBuffer {
        let u: Vec<f32> = self.u.iter().map(|u| *u as f32).collect();
        let part = geometry.domain();
        let (mut patch, mut welder, mut mesh) = (Patch::default(), Welder::new(geometry), MeshBuffer::default());
        let cells = cells_of_brick(&part, geometry.shape, false);
        MarchingCubes::new(0.5).extract(&u, &part, &cells, &mut patch);
        welder.add(&patch, &mut mesh).expect("memory takes any mesh");
        mesh
    }
}

/// Runs it on a grid whose border is outside and farther than the band from the cloud.
pub(crate) fn reconstruct_plainly(geometry: &Geometry, cloud: &[[f64; 3]], settings: PlainSettings) -> PlainSurface {
    let started = std::time::Instant::now();
    let mut lap = 0.0;
    let mut seconds = || {
        let since = started.elapsed().as_secs_f64() - lap;
        lap += since;
        since
    };
    let grid = PlainGrid { shape: geometry.shape };
    let d = fast_sweeping(grid, geometry, cloud);
    let distance = seconds();
    let inside = flood(grid, &d, settings.beta);
    let within = |v: &[i64; 3]| (0..3).all(|a| v[a] > 0 && v[a] < grid.shape[a] - 1);
    let near = |v: &[i64; 3]| d[grid.at(*v)] <= settings.gamma;
    let band: Vec<usize> = grid.voxels().filter(within).filter(near).map(|v| grid.at(v)).collect();
    let mut found = PlainSurface {
        u: inside.iter().map(|&inside| f64::from(u8::from(inside))).collect(),
        band: band.len(),
        steps: 0,
        iterations: 0,
        seconds: [distance, seconds(), 0.0],
    };
    while time_step(geometry, &d, &band, settings, &mut found) >= settings.stop {}
    found.seconds[2] = seconds();
    found
}

/// Distances by Gauss-Seidel sweeps in the eight orders (Zhao, A fast sweeping method for Eikonal equations, 2005).
fn fast_sweeping(grid: PlainGrid, geometry: &Geometry, cloud: &[[f64; 3]]) -> Vec<f64> {
    let mut d = vec![f64::INFINITY; grid.len()];
    for point in cloud {
        let base = geometry.to_voxels(*point).map(|v| v.floor() as i64);
        for corner in 0..8 {
            let v = std::array::from_fn(|a| base[a] + (corner >> a & 1));
            let p = geometry.position(v);
            let from_point = (0..3).map(|a| (p[a] - point[a]).powi(2)).sum::<f64>().sqrt();
            d[grid.at(v)] = d[grid.at(v)].min(from_point);
        }
    }
    let h = geometry.spacing[0];
    let [nx, ny, nz] = grid.shape;
    for order in 0..8 {
        let along = |n: i64, axis: usize, k: i64| if order >> axis & 1 == 0 { k } else { n - 1 - k };
        for z in (0..nz).map(|k| along(nz, 2, k)) {
            for y in (0..ny).map(|k| along(ny, 1, k)) {
                for x in (0..nx).map(|k| along(nx, 0, k)) {
                    let at = grid.at([x, y, z]);
                    let least = |a: [i64; 3], b: [i64; 3]| {
                        let of = |v: [i64; 3]| if grid.contains(v) { d[grid.at(v)] } else { f64::INFINITY };
                        of(a).min(of(b))
                    };
                    let a = least([x - 1, y, z], [x + 1, y, z]);
                    let b = least([x, y - 1, z], [x, y + 1, z]);
                    let c = least([x, y, z - 1], [x, y, z + 1]);
                    d[at] = d[at].min(upwind([a, b, c], h));
                }
            }
        }
    }
    d
}

/// The solution of the upwind difference equation for the distances of the nearer neighbours along the three axes.
fn upwind(mut beside: [f64; 3], h: f64) -> f64 {
    beside.sort_by(f64::total_cmp);
    let [a, b, c] = beside;
    let one = a + h;
    if one <= b {
        return one;
    }
    let two = 0.5 * (a + b + (2.0 * h * h - (a - b).powi(2)).sqrt());
    if two <= c {
        return two;
    }
    let sum = a + b + c;
    (sum + (sum * sum - 3.0 * (a * a + b * b + c * c - h * h)).max(0.0).sqrt()) / 3.0
}

/// True where the flood from the border through voxels with `d >= beta` does not reach.
fn flood(grid: PlainGrid, d: &[f64], beta: f64) -> Vec<bool> {
    let mut inside = vec![true; grid.len()];
    let mut stack: Vec<[i64; 3]> = vec![[0; 3]];
    inside[0] = false;
    while let Some(v) = stack.pop() {
        for q in PlainGrid::around(v).into_iter().filter(|q| grid.contains(*q)) {
            if inside[grid.at(q)] && d[grid.at(q)] >= beta {
                inside[grid.at(q)] = false;
                stack.push(q);
            }
        }
    }
    inside
}

/// One step on the band; returns the discrete L2 norm of its change.
fn time_step(geometry: &Geometry, d: &[f64], band: &[usize], settings: PlainSettings, found: &mut PlainSurface) -> f64 {
    let [nx, ny, _] = geometry.shape.map(|n| n as usize);
    let strides = [1, nx, nx * ny];
    let around = |at: usize| -> [usize; 6] {
        std::array::from_fn(|q| if q % 2 == 0 { at - strides[q / 2] } else { at + strides[q / 2] })
    };
    let PlainSettings { delta, epsilon, tau, .. } = settings;
    let velocity = PlainVelocity { theta: 1.0, rho: 0.0, delta, epsilon, tau, normalised: true };
    let u = &mut found.u;
    let old: Vec<f64> = band.iter().map(|&at| u[at]).collect();
    let scheme: Vec<[f64; 6]> = band
        .iter()
        .map(|&at| {
            let value =
                |i: i64, j: i64, k: i64| u[(at as i64 + j + i * strides[1] as i64 + k * strides[2] as i64) as usize];
            let norms = gradient_norms(value, geometry.spacing);
            let towards = around(at).map(|q| d[q] - d[at]);
            coefficients(&norms, towards, [0.0; 6], geometry.spacing, &velocity)
        })
        .collect();
    loop {
        let mut squares = 0.0;
        for ((&at, old), c) in band.iter().zip(&old).zip(&scheme) {
            let q = around(at);
            let diagonal = 1.0 - c.iter().sum::<f64>();
            let sum: f64 = (0..6).map(|n| c[n] * u[q[n]]).sum();
            let correction = (old - sum) / diagonal - u[at];
            squares += correction * correction;
            u[at] += 1.2 * correction;
        }
        found.iterations += 1;
        if (squares / band.len() as f64).sqrt() < settings.tolerance {
            break;
        }
    }
    found.steps += 1;
    let change: f64 = band.iter().zip(&old).map(|(&at, old)| (u[at] - old).powi(2)).sum();
    (geometry.voxel_volume() * change).sqrt()
}
