//! The papers' program on the whole grid and in its band, and ours (Kósa 2015, Tables 1 and 2), as lines of a
//! Markdown table: grid, points in the band, seconds of the three, mean squared difference of u between the first two.
//! `cargo bench --bench full_and_band [-- LARGEST]`: grids of 40^3, 80^3 .. up to that; 80 without.
#![allow(missing_docs, dead_code, clippy::disallowed_methods)]

#[path = "../tests/common/mod.rs"]
mod common;

use std::f64::consts::PI;
use std::time::Instant;

use common::clouds::scan;
use common::lab::Lab;
use common::plain_reconstruction::{PlainSettings, reconstruct_plainly};
use strandline::grid::Geometry;
use strandline::pipeline::distance::Method;
use strandline::pipeline::level_set::motion::Motion;
use strandline::pipeline::reconstruct::{ReconstructSettings, reconstruct};
use strandline::store::NoMesh;

fn main() {
    let largest: i64 = std::env::args().skip(1).find_map(|a| a.parse().ok()).unwrap_or(80);
    for n in [40, 80, 160].into_iter().filter(|n| *n <= largest) {
        // A body two across, the band's width away from the border.
        let radius = n as f64 / 2.0 - 11.0;
        let h = 1.0 / radius;
        let cloud = scan([0.88; 3], (PI * radius * radius) as usize, 0.0);
        let grid = Geometry { shape: [n; 3], spacing: [h; 3], origin: [-0.5 * (n - 1) as f64 * h; 3], unit: None };
        let motion = Motion { delta: Some(0.1 * h), ..ReconstructSettings::default().motion };
        let settings = ReconstructSettings { motion, method: Method::FSM, ..ReconstructSettings::default() };
        let started = Instant::now();
        let ours = reconstruct(&Lab::new(2).engine, &grid, &cloud, &settings, &mut NoMesh).expect("a surface");
        let seconds = started.elapsed().as_secs_f64();
        let beta = 1.1 * 0.5 * ours.hole.expect("a hole between points").width;
        let full = PlainSettings {
            beta,
            gamma: f64::INFINITY,
            delta: 0.1 * h,
            epsilon: 0.01,
            tau: 0.25 * h,
            stop: 1e-4,
            tolerance: 1e-4,
        };
        let found =
            [full, PlainSettings { gamma: 2.0 * beta, ..full }].map(|by| reconstruct_plainly(&grid, &cloud, by));
        let difference: f64 = found[0].u.iter().zip(&found[1].u).map(|(a, b)| (a - b).powi(2)).sum();
        let [whole, band] = found.each_ref().map(|found| found.seconds.iter().sum::<f64>());
        let squared = difference / found[0].u.len() as f64;
        println!("| {n}^3 | {} | {whole:.3} | {band:.3} | {squared:.2e} | {seconds:.3} |", found[1].band);
    }
}
