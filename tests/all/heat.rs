//! The presmoothing against the exact response of cosine modes to one implicit step of the heat equation, and against
//! Gauss-Seidel in f64 over the whole grid; the edge detector of the smoothed image against the printed formulas.

use std::f64::consts::PI;
use std::sync::Arc;

use strandline::grid::BrickSet;
use strandline::kernel::level_set::cell::CELL;
use strandline::pipeline::image::terms::{EdgeSettings, Smoothing, edges, presmooth};
use strandline::store::BrickArray;

use crate::common::lab::{Lab, PlainGrid, dense, whole};
use crate::common::plain_scheme::{gradient_norms, mean_norm};
use crate::common::random::Random;

const GRIDS: [([i64; 3], [f64; 3]); 3] =
    [([32, 32, 48], [1.0; 3]), ([37, 21, 30], [0.4, 0.4, 0.4]), ([40, 33, 19], [0.2, 0.25, 0.9])];

fn smoothed(lab: &Lab, shape: [i64; 3], spacing: [f64; 3], sigma: f64, image: &[f32]) -> Vec<f32> {
    let set = dense(shape, CELL as i64);
    let source = lab.field(&set, image);
    let settings = EdgeSettings { smoothing: Smoothing::Heat, sigma, k: 0.0 };
    whole(
        &presmooth(&lab.engine.stage("heat", 0), &lab.engine, &source, &set, spacing, &settings)
            .expect("room in scratch"),
    )
}

/// A product of cosines is an eigenvector of the discrete Laplacian with mirrored borders: it is only damped.
#[test]
fn cosine_modes_are_damped_exactly() {
    let lab = Lab::new(2);
    for (shape, spacing) in GRIDS {
        for (sigma, waves) in [(0.5, [1, 0, 0]), (0.5, [3, 5, 2]), (1.0, [0, 2, 1]), (1.0, [9, 7, 4])] {
            let sigma = sigma * spacing[0];
            let angle = |a: usize| PI * f64::from(waves[a]) / shape[a] as f64;
            let mode = |v: [i64; 3]| (0..3).map(|a| (angle(a) * (v[a] as f64 + 0.5)).cos()).product::<f64>();
            let eigenvalue: f64 = (0..3).map(|a| (2.0 - 2.0 * angle(a).cos()) / (spacing[a] * spacing[a])).sum();
            let damping = 1.0 / (1.0 + 0.5 * sigma * sigma * eigenvalue);
            let voxels = || PlainGrid { shape }.voxels();
            let image: Vec<f32> = voxels().map(|v| (0.5 + 0.5 * mode(v)) as f32).collect();
            let found = smoothed(&lab, shape, spacing, sigma, &image);
            for (v, found) in voxels().zip(&found) {
                let exact = 0.5 + 0.5 * damping * mode(v);
                assert!((f64::from(*found) - exact).abs() < 3e-4, "{waves:?} at {v:?}: {found} for {exact}");
            }
        }
    }
}

/// `(1 - tau Laplace) I = I_0` by Gauss-Seidel, until nothing moves.
fn plain_heat(grid: PlainGrid, spacing: [f64; 3], sigma: f64, image: &[f32]) -> Vec<f64> {
    let mut u: Vec<f64> = image.iter().map(|v| f64::from(*v)).collect();
    let weight = |q: usize| 0.5 * sigma * sigma / (spacing[q / 2] * spacing[q / 2]);
    for _ in 0..10_000 {
        let mut largest = 0.0_f64;
        for v in grid.voxels() {
            let (mut sum, mut diagonal) = (f64::from(image[grid.at(v)]), 1.0);
            for (q, beside) in PlainGrid::around(v).into_iter().enumerate().filter(|(_, q)| grid.contains(*q)) {
                sum += weight(q) * u[grid.at(beside)];
                diagonal += weight(q);
            }
            largest = largest.max((sum / diagonal - u[grid.at(v)]).abs());
            u[grid.at(v)] = sum / diagonal;
        }
        if largest < 1e-12 {
            break;
        }
    }
    u
}

/// A bright blob near a corner, in noise, and a dark slab: an image with everything in it.
fn picture(grid: PlainGrid) -> Vec<f32> {
    let mut random = Random(4);
    let value = |v: [i64; 3]| {
        let squared: f64 = (0..3).map(|a| (v[a] as f64 - 8.0 - a as f64).powi(2)).sum();
        let slab = if v[0] > grid.shape[0] - 6 { 0.0 } else { 0.2 };
        0.6 * (-squared / 30.0).exp() + slab + 0.2 * random.unit()
    };
    grid.voxels().map(value).map(|v| v as f32).collect()
}

#[test]
fn images_are_smoothed_as_by_gauss_seidel() {
    let lab = Lab::new(2);
    for (shape, spacing) in GRIDS {
        let grid = PlainGrid { shape };
        let image = picture(grid);
        for sigma in [0.6, 1.5, 3.0].map(|s| s * spacing[0]) {
            let expected = plain_heat(grid, spacing, sigma, &image);
            let found = smoothed(&lab, shape, spacing, sigma, &image);
            let worst = found.iter().zip(&expected).map(|(f, e)| (f64::from(*f) - e).abs()).fold(0.0, f64::max);
            // The solver stops at corrections of 2e-5; slow modes of wide smoothing are then off by more.
            assert!(worst < 1.5e-3, "{shape:?}, sigma {sigma}: off by {worst}");
            let mean = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>() / grid.len() as f64;
            let (before, after) =
                (mean(&mut image.iter().map(|v| f64::from(*v))), mean(&mut found.iter().map(|v| f64::from(*v))));
            assert!((before - after).abs() < 1e-4, "{shape:?}, sigma {sigma}: mean {before} became {after}");
        }
    }
}

#[test]
fn without_a_width_nothing_is_smoothed() {
    let grid = PlainGrid { shape: [18, 17, 5] };
    let image = picture(grid);
    assert_eq!(smoothed(&Lab::new(1), grid.shape, [1.0; 3], 0.0, &image), image);
}

/// The edge detector of an image on a set of cells, smoothed first.
fn detected(
    lab: &Lab,
    image: &BrickArray<f32>,
    set: &Arc<BrickSet>,
    spacing: [f64; 3],
    settings: &EdgeSettings,
) -> BrickArray<f32> {
    let stage = lab.engine.stage("edges", 0);
    let smoothed = presmooth(&stage, &lab.engine, image, set, spacing, settings).expect("smoothing needs only scratch");
    edges(&stage, &lab.engine, &smoothed, set, spacing, settings.k).expect("edges need only scratch")
}

#[test]
fn edges_are_those_of_the_smoothed_image() {
    let (grid, spacing, sigma, k) = (PlainGrid { shape: [37, 21, 30] }, [0.2, 0.25, 0.9], 0.3, 50.0);
    let image = picture(grid);
    let plain = plain_heat(grid, spacing, sigma, &image);
    let runs = [1, 2].map(|threads| {
        let lab = Lab::new(threads);
        let set = dense(grid.shape, CELL as i64);
        let settings = EdgeSettings { smoothing: Smoothing::Heat, sigma, k: k as f32 };
        let image = lab.field(&set, &image);
        whole(&detected(&lab, &image, &set, spacing, &settings))
    });
    assert!(runs[0].iter().zip(&runs[1]).all(|(a, b)| a.to_bits() == b.to_bits()), "threads changed a bit");
    for v in grid.voxels() {
        let value = |i, j, y| plain[grid.at([v[0] + j, v[1] + i, v[2] + y])];
        // Gradients per smallest spacing.
        let s = 0.2 * mean_norm(&gradient_norms(value, spacing));
        let (g, found) = (1.0 / (1.0 + k * s * s), f64::from(runs[0][grid.at(v)]));
        assert!((found - g).abs() < 2e-3, "{v:?}: {found} for {g}");
    }
}

/// Cells near the band are all that is smoothed; five widths around it are enough.
#[test]
fn a_part_of_the_cells_has_the_edges_of_the_whole() {
    let lab = Lab::new(2);
    let grid = PlainGrid { shape: [120, 40, 40] };
    let image = picture(grid);
    let all = dense(grid.shape, CELL as i64);
    let part = Arc::new(BrickSet::from_fn(*all.grid(), |id| all.grid().coords(id)[0] == 2));
    let source = lab.field(&all, &image);
    let settings = EdgeSettings { smoothing: Smoothing::Heat, sigma: 2.0, k: 50.0 };
    let [g, near] = [&all, &part].map(|set| whole(&detected(&lab, &source, set, [1.0; 3], &settings)));
    for v in grid.voxels().filter(|v| (32..48).contains(&v[0])) {
        let (found, exact) = (near[grid.at(v)], g[grid.at(v)]);
        assert!((found - exact).abs() < 2e-3, "{v:?}: {found} for {exact}");
    }
}
