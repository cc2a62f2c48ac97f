//! Two balls in an image with noise, each marked by three outlines; the label volume and a mesh of each.
#![allow(clippy::disallowed_methods, reason = "no bits are compared here")]

use std::f64::consts::TAU;

use strandline::{Geometry, Segmentation, Volume};

/// Where the balls lie, and how large they are.
const BALLS: [([f64; 3], f64); 2] = [([12.0, 16.0, 16.0], 8.0), ([34.0, 16.0, 16.0], 9.0)];

fn main() -> strandline::Result<()> {
    let shape = [48, 32, 32];
    let inside = |p: [f64; 3], (centre, radius): ([f64; 3], f64)| {
        (0..3).map(|a| (p[a] - centre[a]).powi(2)).sum::<f64>() <= radius * radius
    };
    let mut voxels = Vec::new();
    for n in 0..48_u32 * 32 * 32 {
        let place = [n % 48, n / 48 % 32, n / (48 * 32)].map(f64::from);
        let noise = n.wrapping_mul(2_654_435_761) >> 27;
        let grey = if BALLS.iter().any(|&ball| inside(place, ball)) { 400 } else { 100 };
        voxels.push((grey + noise) as u16);
    }
    let image = Volume::new(shape, voxels)?;

    let mut job = Segmentation::of(&image, Geometry::new(shape, [1.0; 3], [0.0; 3]));
    for (label, (centre, radius)) in (1..).zip(BALLS) {
        for z in [-5.0, 0.0, 5.0] {
            let across = f64::sqrt(radius * radius - z * z);
            let at = |n: u32| f64::from(n) * TAU / 24.0;
            let on = |a: f64| [centre[0] + across * a.cos(), centre[1] + across * a.sin(), centre[2] + z];
            job = job.outline(label, (0..24).map(at).map(on).collect::<Vec<_>>());
        }
    }
    let found = job.solve()?;
    for object in &found.outcome().objects {
        let (label, mesh) = (object.label, found.mesh(object.label)?);
        let voxels = found.outcome().label_voxels[&label];
        println!("object {label}: volume {:.0}, {voxels} voxels, {} triangles", object.measures.volume, mesh.len());
    }
    println!("label in the middle of the second: {}", found.labels().at([34, 16, 16])?);
    Ok(())
}
