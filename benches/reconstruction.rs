//! A whole reconstruction from a cloud like that of a scan, as the papers' program does it and as ours does.
//!
//! The plain program runs once, on one thread, and stops at u; ours draws and measures the surface too. Both surfaces are
//! compared: mean and largest distance of the plain one's vertices from ours.
//! `cargo bench --bench reconstruction [-- SCALE]`: 1 is 277 x 457 x 377 voxels and 43,000 points.
#![allow(missing_docs, dead_code)]

#[path = "../tests/common/mod.rs"]
mod common;

use std::f64::consts::PI;
use std::time::Instant;

use common::lab::Lab;
use common::plain_reconstruction::{PlainSettings, reconstruct_plainly};
use common::random::Random;
use strandline::grid::{Geometry, TriangleMesh};
use strandline::io::ome_zarr::StoreWriter;
use strandline::io::sources::{Source, read_source};
use strandline::kernel::surface::PatchIndex;
use strandline::pipeline::distance::Method;
use strandline::pipeline::motion::Motion;
use strandline::pipeline::reconstruct::{ReconstructSettings, reconstruct};

const REPEATS: usize = 3;
/// In the unit of the cloud, whose body is about two across, like the papers'.
const SPACING: f64 = 2.0 / 330.0;

/// A body with bumps and dents, sampled as a scanner does: unevenly, with noise, some points missing.
fn scan(shape: [i64; 3], points: usize, h: f64) -> Vec<[f64; 3]> {
    let mut random = Random(7);
    let golden = PI * (3.0 - 5.0_f64.sqrt());
    let all = points * 10 / 9;
    let half = shape.map(|n| (n as f64 / 2.0 - 26.0) * h / 1.17);
    let mut cloud = Vec::new();
    for n in 0..all {
        let (height, turn) = (1.0 - (2 * n + 1) as f64 / all as f64, golden * n as f64);
        let ring = (1.0 - height * height).sqrt();
        let p = [ring * turn.cos(), ring * turn.sin(), height];
        let bumps = 1.0 + 0.08 * (5.0 * p[0]).sin() * (4.0 * p[1] + 1.0).cos() + 0.06 * (9.0 * p[2] + 3.0 * p[0]).sin();
        let noise = 1.0 + 0.1 * h * (random.unit() - 0.5);
        if random.below(10) > 0 && cloud.len() < points {
            cloud.push(std::array::from_fn(|a| p[a] * half[a] * bumps * noise));
        }
    }
    cloud
}

/// Our surface, of a run that is not timed.
fn our_mesh(grid: &Geometry, cloud: &[[f64; 3]], settings: &ReconstructSettings) -> TriangleMesh {
    let lab = Lab::new(2);
    let folder = tempfile::tempdir().expect("a folder");
    let store = StoreWriter::create(&folder.path().join("out.zarr"), false).expect("a store");
    reconstruct(&lab.engine, grid, cloud, settings, Some(&store)).expect("a surface");
    store.finish().expect("a store");
    match read_source(&folder.path().join("out.zarr/meshes/surface.ply")).expect("a mesh") {
        Source::Mesh(mesh) => mesh,
        Source::Cloud(_) => panic!("a surface has triangles"),
    }
}

fn main() {
    let scale: f64 = std::env::args().skip(1).find_map(|a| a.parse().ok()).unwrap_or(1.0);
    let shape = [277, 457, 377].map(|n: i64| (n as f64 * scale).round() as i64);
    let h = SPACING / scale;
    let cloud = scan(shape, (43_000.0 * scale * scale) as usize, h);
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
            let found = reconstruct(&lab.engine, &grid, &cloud, &settings, None).expect("a surface");
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
        "plain: {:.2} s (distance {distance:.2}, start {start:.2}, level set {level_set:.2}): {} band voxels, {} steps, {} iterations, {:.0} ns a voxel and step",
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
