//! A whole reconstruction from a cloud like that of a scan, as the papers' program does it and as ours does.
//!
//! The plain program runs once, on one thread, and stops at u; ours draws and measures the surface too. Both surfaces
//! are compared: mean and largest distance of the plain one's vertices from ours.
//! `cargo bench --bench reconstruction [-- SCALE]`: 1 is 277 x 457 x 377 voxels and 43,000 points.
#![allow(missing_docs, dead_code, clippy::disallowed_methods)]

#[path = "../tests/common/mod.rs"]
mod common;

use std::time::Instant;

use common::clouds::scan;
use common::lab::Lab;
use common::plain_reconstruction::{PlainSettings, reconstruct_plainly};
use strandline::grid::{Geometry, TriangleMesh};
use strandline::kernel::surface::PatchIndex;
use strandline::pipeline::distance::Method;
use strandline::pipeline::level_set::motion::Motion;
use strandline::pipeline::reconstruct::{ReconstructSettings, reconstruct};
use strandline::store::NoMesh;

const REPEATS: usize = 3;
/// In the unit of the cloud, whose body is about two across, like the papers'.
const SPACING: f64 = 2.0 / 330.0;

/// Our surface, of a run that is not timed.
fn our_mesh(grid: &Geometry, cloud: &[[f64; 3]], settings: &ReconstructSettings) -> TriangleMesh {
    let lab = Lab::new(2);
    let mut mesh = TriangleMesh::default();
    reconstruct(&lab.engine, grid, cloud, settings, &mut mesh).expect("a surface");
    mesh
}

fn main() {
    let scale: f64 = std::env::args().skip(1).find_map(|a| a.parse().ok()).unwrap_or(1.0);
    let shape = [277, 457, 377].map(|n: i64| (n as f64 * scale).round() as i64);
    let h = SPACING / scale;
    let half = shape.map(|n| (n as f64 / 2.0 - 26.0) * h / 1.17);
    let cloud = scan(half, (43_000.0 * scale * scale) as usize, 0.1 * h);
    let origin = shape.map(|n| -0.5 * (n - 1) as f64 * h);
    let grid = Geometry { shape, spacing: [h; 3], origin, unit: None };
    println!("{} points, {shape:?} voxels", cloud.len());
    let motion = Motion { delta: Some(0.1 * h), ..ReconstructSettings::default().motion };
    // By the same distance as the plain program.
    let settings = ReconstructSettings { motion, method: Method::FSM, ..ReconstructSettings::default() };
    let mut hole = 0.0;
    for threads in [1, 2] {
        let mut best = f64::INFINITY;
        for _ in 0..REPEATS {
            let lab = Lab::new(threads);
            let started = Instant::now();
            let found = reconstruct(&lab.engine, &grid, &cloud, &settings, &mut NoMesh).expect("a surface");
            let seconds = started.elapsed().as_secs_f64();
            hole = found.hole.expect("a hole between points").width;
            if seconds < best {
                best = seconds;
                println!(
                    "ours, {threads} threads: {seconds:.2} s, {} band voxels, {:?}",
                    found.band_voxels, found.evolution
                );
                for stage in lab.engine.reports() {
                    println!("    {:10} {:6.2} s", stage.name, stage.seconds);
                }
            }
        }
    }
    // A little beyond the widest gap between points.
    let beta = 1.1 * 0.5 * hole;
    let plain = PlainSettings {
        beta,
        gamma: 2.0 * beta,
        delta: 0.1 * h,
        epsilon: 0.01,
        tau: 0.25 * h,
        stop: 1e-4,
        tolerance: 1e-3,
    };
    let found = reconstruct_plainly(&grid, &cloud, plain);
    let [distance, start, level_set] = found.seconds;
    println!(
        "plain: {:.2} s (distance {distance:.2}, start {start:.2}, level set {level_set:.2}): {} band voxels, {} \
         steps, {} iterations, {:.0} ns a voxel and step",
        distance + start + level_set,
        found.band,
        found.steps,
        found.iterations,
        level_set * 1e9 / (found.band as f64 * f64::from(found.steps)),
    );
    let ours = our_mesh(&grid, &cloud, &settings);
    let theirs = found.mesh(&grid);
    let vertices: Vec<[f32; 3]> = ours.vertices.iter().map(|v| v.map(|x| x as f32)).collect();
    let index = PatchIndex::new(&vertices, &ours.triangles, h);
    let off = index.hausdorff_from(theirs.vertices.iter().map(|v| v.map(f64::from))).expect("surfaces");
    println!(
        "distance of the plain surface's vertices from ours: {:.4} h in the mean, {:.3} h at most",
        off.mean / h,
        off.max / h
    );
}
