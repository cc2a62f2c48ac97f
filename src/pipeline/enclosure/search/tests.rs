//! Searches that are ended anywhere, and those of several ranks.

use std::f64::consts::PI;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use super::{Found, Search, Start, enclose, first_reach_for};
use crate::error::Result;
use crate::exec::save_points::ending::check_ended_anywhere;
use crate::exec::{Budget, Cancel, Comm, Engine, SelfComm, Silent, as_threads};
use crate::grid::Geometry;
use crate::kernel::level_set::cell::CELL;
use crate::pipeline::distance::Method;
use crate::store::{BoxSource, Scratch};

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
            let (most_reach, suffix) = (f64::INFINITY, "");
            let search = Search { grid: &grid, cloud: &cloud, method, beta, start, first_reach, most_reach, suffix };
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

/// Points on a sphere around the middle of a grid of 104^3, in a spiral, the first so many of 12000.
fn large_sphere(first: usize, radius: f64) -> Vec<[f64; 3]> {
    let point = |n: usize| {
        let z = (2.0 * n as f64 + 1.0) / 12000.0 - 1.0;
        let (around, ring) = (PI * (1.0 + 5.0_f64.sqrt()) * n as f64, (1.0 - z * z).sqrt());
        [ring * libm::cos(around), ring * libm::sin(around), z].map(|v| 52.0 + radius * v)
    };
    (0..first).map(point).collect()
}

/// A search and the band that comes of it, voxel by voxel.
#[derive(PartialEq)]
struct Searched {
    u: Vec<f32>,
    distance: Vec<f32>,
    solved: Vec<u8>,
    told: String,
    /// Whether no brick is stored in the middle.
    is_hollow: bool,
}

/// What one rank of several finds.
fn band_on(comm: Arc<dyn Comm>, search: &Search<'_>) -> Result<Searched> {
    let scratch = Scratch::new(&std::env::temp_dir(), 1 << 30);
    let engine = Engine::new(1, scratch, Budget { total: 2 << 30 }, Cancel::default(), Arc::new(Silent))?.as_rank(comm);
    let Found::Enclosed(found) = enclose(&engine, search)? else { panic!("nothing found") };
    let told = (found.beta, found.window, found.hole(), found.basins.clone(), found.sheet().to_vec());
    let (part, cells) = (found.geometry.domain(), &found.cells);
    let middle = cells.grid().brick_of([52 - found.window.lo[0]; 3]).map(|id| cells.slot(id));
    let is_hollow = middle == Some(None);
    let (band, _held) = found.into_band(&engine, "")?;
    let (mut u, mut distance, mut solved) = (vec![0.0; part.len()], vec![0.0; part.len()], vec![0; part.len()]);
    band.u.read_box(&part, &mut u)?;
    band.distance.read_box(&part, &mut distance)?;
    band.solved.read_box(&part, &mut solved)?;
    Ok(Searched { u, distance, solved, told: format!("{told:?} {}", band.voxels), is_hollow })
}

/// Every rank finds what one alone does: with a hollow that no brick is stored of and that the flood enters through a hole, with sheets
/// whose sides are told from bricks of others, and balls.
#[test]
fn a_search_on_ranks_finds_what_one_does() {
    let grid = Geometry::new([104; 3], [1.0; 3], [0.0; 3]);
    let sheet = (0..900).map(|n| [38.0 + 0.9 * f64::from(n % 30), 38.0 + 0.9 * f64::from(n / 30), 101.2]);
    let with_sheet = large_sphere(12_000, 44.0).into_iter().chain(sheet).collect();
    let in_another = large_sphere(12_000, 44.0).into_iter().chain(large_sphere(12_000, 22.0)).collect();
    let runs: [(Vec<[f64; 3]>, Start, Option<f64>); 5] = [
        (large_sphere(12_000, 44.0), Start::Watershed, None),
        (with_sheet, Start::Watershed, None),
        (in_another, Start::Watershed, None),
        (large_sphere(11_900, 44.0), Start::Tube, None),
        (large_sphere(11_980, 44.0), Start::Tube, Some(5.0)),
    ];
    assert_eq!(CELL, 16, "the hollow is larger than the reach and a cell");
    for (n, (cloud, start, beta)) in runs.into_iter().enumerate() {
        let first_reach = first_reach_for(&grid, beta);
        let (method, most_reach, suffix) = (Method::VDT, f64::INFINITY, "");
        let search = Search { grid: &grid, cloud: &cloud, method, beta, start, first_reach, most_reach, suffix };
        let one = band_on(Arc::new(SelfComm), &search).unwrap();
        for ranks in if n == 0 { vec![2, 3, 5] } else { vec![3] } {
            for (rank, found) in as_threads(ranks, |comm| band_on(comm, &search)).unwrap().into_iter().enumerate() {
                assert_eq!(found.told, one.told, "search {n}, rank {rank} of {ranks}");
                assert!(found == one, "search {n}: the fields of rank {rank} of {ranks}");
            }
        }
        assert!(n != 0 || one.is_hollow);
    }
}
