//! Searches that are ended anywhere.

use std::f64::consts::PI;

use super::super::search::{Found, Search, Start, enclose, first_reach_for};
use crate::error::Result;
use crate::exec::Engine;
use crate::exec::ending::check_ended_anywhere;
use crate::grid::Geometry;
use crate::pipeline::distance::Method;

/// Points on a sphere of some radius around the middle, in a spiral, as far as a share of it from its lower end.
fn sphere(count: usize, middle: f64, radius: f64, share: f64) -> Vec<[f64; 3]> {
    let point = |n: usize| {
        let z = (2.0 * n as f64 + 1.0) / count as f64 - 1.0;
        let (around, ring) = (PI * (1.0 + 5.0_f64.sqrt()) * n as f64, (1.0 - z * z).sqrt());
        [ring * around.cos(), ring * around.sin(), z].map(|v| middle + radius * v)
    };
    (0..(share * count as f64) as usize).map(point).collect()
}

/// All that a search finds, voxel by voxel.
fn found(engine: &Engine, search: &Search<'_>) -> Result<(Vec<f32>, Vec<u8>, String)> {
    let Found::Enclosed(found) = enclose(engine, search)? else { panic!("nothing found") };
    let (fields, told) = (found.fields()?, (found.beta, found.window, found.hole(), found.spaces(), found.sheet()));
    Ok((fields.0, fields.1, format!("{told:?}")))
}

#[test]
fn a_search_that_is_ended_anywhere_goes_on_with_the_same_bits() {
    let grid = Geometry::new([80; 3], [1.0; 3], [0.0; 3]);
    // Whole; with a hole as wide as the first reaches; a bowl, which balls close; and by the flood.
    let whole = (sphere(2000, 40.0, 24.0, 1.0), Start::Watershed, None);
    let bowl = (sphere(3000, 40.0, 24.0, 0.6), Start::Watershed, None);
    let flooded = (sphere(2000, 40.0, 24.0, 1.0), Start::Tube, None);
    let asked = (sphere(2000, 40.0, 24.0, 0.99), Start::Tube, Some(7.0));
    for (n, (cloud, start, beta)) in [whole, bowl, flooded, asked].into_iter().enumerate() {
        let run = |engine: &Engine| {
            let first_reach = first_reach_for(&grid, beta);
            let method = Method::FSM;
            found(engine, &Search { grid: &grid, cloud: &cloud, method, beta, start, first_reach, suffix: "" })
        };
        check_ended_anywhere(&format!("search {n}"), 24, 1.0, &run);
    }
}
