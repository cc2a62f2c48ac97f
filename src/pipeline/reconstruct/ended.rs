//! Reconstructions that are ended anywhere, on several ranks.

use std::f64::consts::PI;

use super::{ReconstructSettings, grid_for, reconstruct};
use crate::error::Result;
use crate::exec::Engine;
use crate::exec::save_points::ending::check_ended_on_ranks;
use crate::grid::{Box3, TriangleMesh};
use crate::store::BoxSource;

/// Points on two balls beside each other, in spirals.
fn cloud() -> Vec<[f64; 3]> {
    let point = |n: usize| {
        let z = (2.0 * (n % 300) as f64 + 1.0) / 300.0 - 1.0;
        let (around, ring) = (PI * (1.0 + 5.0_f64.sqrt()) * n as f64, (1.0 - z * z).sqrt());
        [ring * libm::cos(around) + if n < 300 { 0.0 } else { 2.6 }, ring * libm::sin(around), z]
    };
    (0..600).map(point).collect()
}

/// The level set on the whole grid, as bits, and what is told; all ranks have these.
fn found(engine: &Engine) -> Result<(Vec<u32>, String)> {
    let cloud = cloud();
    let Some(grid) = grid_for(&cloud, None) else { panic!("600 points tell a grid") };
    let found = reconstruct(engine, &grid, &cloud, &ReconstructSettings::default(), &mut TriangleMesh::default())?;
    let part = Box3::from_shape(found.geometry.shape);
    let mut values = vec![0.0; part.len()];
    found.level_set().read_box(&part, &mut values)?;
    let told = format!("{:?} {:?} {:?}", found.evolution, found.spaces, found.sheet_points);
    Ok((values.into_iter().map(f32::to_bits).collect(), told))
}

#[test]
fn a_reconstruction_that_ranks_were_ended_in_goes_on_with_the_same_bits_on_other_numbers_of_them() {
    let resumed = check_ended_on_ranks("reconstruct", 5, &found);
    assert!(resumed >= 4, "{resumed} of 8 had something to go on from");
}
