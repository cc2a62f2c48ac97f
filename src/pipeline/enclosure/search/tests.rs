//! Searches that are ended anywhere.

use std::f64::consts::PI;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use super::{Found, Search, Start, enclose, first_reach_for};
use crate::error::Result;
use crate::exec::Engine;
use crate::exec::save_points::ending::check_ended_anywhere;
use crate::grid::Geometry;
use crate::pipeline::distance::Method;

/// Points on a sphere of radius 9 around the middle, in a spiral, the first so many of 500.
fn sphere(first: usize) -> Vec<[f64; 3]> {
    let point = |n: usize| {
        let z = (2.0 * n as f64 + 1.0) / 500.0 - 1.0;
        let (around, ring) = (PI * (1.0 + 5.0_f64.sqrt()) * n as f64, (1.0 - z * z).sqrt());
        [ring * libm::cos(around), ring * libm::sin(around), z].map(|v| 16.0 + 9.0 * v)
    };
    (0..first).map(point).collect()
}

/// All that a search finds, voxel by voxel.
fn found(engine: &Engine, search: &Search<'_>) -> Result<(Vec<f32>, Vec<u8>, String)> {
    let Found::Enclosed(found) = enclose(engine, search)? else { panic!("nothing found") };
    let (fields, told) = (found.fields()?, (found.beta, found.window, found.hole(), found.spaces(), found.sheet()));
    Ok((fields.0, fields.1, format!("{told:?}")))
}

#[test]
fn a_search_that_is_ended_anywhere_goes_on_with_the_same_bits() {
    let grid = Geometry::new([32; 3], [1.0; 3], [0.0; 3]);
    // Beside the sphere a sheet, whose points have one side all around: balls are tried.
    let sheet = (0..256).map(|n| [7.0 + 1.1 * f64::from(n % 16), 7.0 + 1.1 * f64::from(n / 16), 30.3]);
    let with_sheet = sphere(500).into_iter().chain(sheet).collect();
    let runs: [(Vec<[f64; 3]>, Start, Option<f64>); 4] = [
        (sphere(500), Start::Watershed, None),
        (with_sheet, Start::Watershed, None),
        (sphere(500), Start::Tube, None),
        (sphere(492), Start::Tube, Some(3.0)),
    ];
    for (n, (cloud, start, beta)) in runs.into_iter().enumerate() {
        let most = AtomicUsize::new(0);
        let run = |engine: &Engine| {
            let first_reach = first_reach_for(&grid, beta);
            let method = Method::FSM;
            let (only_near, suffix) = (false, "");
            let search = Search { grid: &grid, cloud: &cloud, method, beta, start, first_reach, only_near, suffix };
            let found = found(engine, &search);
            most.fetch_max(engine.reports().len(), Relaxed);
            found
        };
        check_ended_anywhere(&format!("search {n}"), 6, 1.0, &run);
        // A stage for the distance within each reach, and one for the sides there, with each ball too.
        let least = if n == 1 { 7 } else { 2 };
        assert!(most.into_inner() >= least, "search {n}");
    }
}
