//! A closed surface from points on a torus, without normals.
#![allow(clippy::disallowed_methods, reason = "no bits are compared here")]

use std::f64::consts::{PI, TAU};

use strandline::Reconstruction;

fn main() -> strandline::Result<()> {
    let (large, small) = (1.0, 0.4);
    let place = |n: u32| {
        // Two angles that cover the torus evenly enough.
        let (a, b) = (TAU * (f64::from(n) * 0.618_034).fract(), TAU * f64::from(n) / 2000.0);
        let away = large + small * a.cos();
        [away * b.cos(), away * b.sin(), small * a.sin()]
    };
    let cloud: Vec<[f64; 3]> = (0..2000).map(place).collect();

    let found = Reconstruction::of(&cloud).memory(1 << 29).solve()?;
    let measures = found.measures();
    println!("{} triangles, closed: {}", found.mesh.len(), measures.is_closed());
    println!("volume {:.3}, that of the torus {:.3}", measures.volume, 2.0 * PI * PI * large * small * small);
    if let Some(off) = found.hausdorff() {
        println!("the points are {:.4} off in the mean, {:.4} at most", off.mean, off.max);
    }
    Ok(())
}
