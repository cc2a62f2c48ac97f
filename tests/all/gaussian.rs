//! The Gaussian presmoothing against plain sums in f64, against scipy, and against what a Gaussian leaves of white noise;
//! its bits on any set of cells, bricks and threads.

use std::sync::Arc;

use strandline::grid::BrickSet;
use strandline::kernel::level_set::cell::CELL;
use strandline::pipeline::image::smoothing::smoothed;
use strandline::pipeline::image::terms::{EdgeSettings, Smoothing, edges, presmooth};
use strandline::store::{BoxSource, BrickArray};

use crate::common::lab::{Lab, PlainGrid, dense, whole};
use crate::common::random::Random;

/// An image on bricks of its own, smoothed on some cells.
fn run(lab: &Lab, image: &BrickArray<f32>, set: &Arc<BrickSet>, spacing: [f64; 3], sigma: [f64; 3]) -> Vec<f32> {
    let stage = lab.engine.stage("smoothing", 0);
    whole(&smoothed(&stage, &lab.engine, image, set, spacing, sigma).expect("smoothing needs only scratch"))
}

/// An image smoothed everywhere.
fn everywhere(shape: [i64; 3], spacing: [f64; 3], sigma: [f64; 3], image: &[f32]) -> Vec<f32> {
    let lab = Lab::new(2);
    let source = lab.field(&dense(shape, 32), image);
    run(&lab, &source, &dense(shape, CELL as i64), spacing, sigma)
}

fn noise(shape: [i64; 3]) -> Vec<f32> {
    let mut random = Random(11);
    (0..PlainGrid { shape }.len()).map(|_| random.unit() as f32).collect()
}

/// The voxel that two mirrors beside the border voxels show.
fn mirrored(mut at: i64, len: i64) -> i64 {
    while at < 0 || at >= len {
        at = if at < 0 { -1 - at } else { 2 * len - 1 - at };
    }
    at
}

/// The Gaussian's values at the voxels out to four widths, over their sum; axis by axis.
fn plain_gaussian(grid: PlainGrid, spacing: [f64; 3], sigma: [f64; 3], image: &[f32]) -> Vec<f64> {
    let mut values: Vec<f64> = image.iter().map(|v| f64::from(*v)).collect();
    for a in 0..3 {
        let reach = (4.0 * sigma[a] / spacing[a]).ceil() as i64;
        let weight = |k: i64| (-0.5 * (k as f64 * spacing[a] / sigma[a]).powi(2)).exp();
        let total: f64 = (-reach..=reach).map(weight).sum();
        let sum = |v: [i64; 3]| -> f64 {
            let beside = |k: i64| {
                let mut at = v;
                at[a] = mirrored(v[a] + k, grid.shape[a]);
                at
            };
            (-reach..=reach).map(|k| weight(k) * values[grid.at(beside(k))]).sum()
        };
        values = grid.voxels().map(|v| sum(v) / total).collect();
    }
    values
}

#[test]
fn images_are_smoothed_as_by_plain_sums() {
    for (shape, spacing, sigma) in [
        ([37, 21, 30], [1.0; 3], [2.0; 3]),
        ([70, 33, 19], [0.2, 0.25, 0.9], [0.9; 3]),
        ([20, 81, 40], [1.0, 0.5, 2.0], [1.5, 4.0, 3.0]),
        ([5, 3, 1], [1.0; 3], [1.0, 2.0, 3.0]),
        ([1, 50, 2], [1.0; 3], [6.5; 3]),
    ] {
        let (grid, image) = (PlainGrid { shape }, noise(shape));
        let expected = plain_gaussian(grid, spacing, sigma, &image);
        let found = everywhere(shape, spacing, sigma, &image);
        for ((v, found), exact) in grid.voxels().zip(found).zip(expected) {
            assert!((f64::from(found) - exact).abs() < 2e-6, "{shape:?}, sigma {sigma:?}, {v:?}: {found} for {exact}");
        }
    }
}

/// `scipy.ndimage.gaussian_filter(row, [sigma, 0, 0], mode="reflect")` of scipy 1.17.1.
#[test]
fn borders_are_those_of_scipy() {
    let row = [0.0, 1.0, 0.25, 0.0, 0.0, 0.5, 1.0];
    for (sigma, expected) in [
        (
            1.0,
            [0.310_568_320, 0.463_968_565, 0.344_190_905, 0.146_045_245, 0.197_405_271, 0.498_892_035, 0.788_929_659],
        ),
        (
            2.0,
            [0.352_139_275, 0.339_974_026, 0.324_373_125, 0.330_963_245, 0.384_771_148, 0.473_769_901, 0.544_009_280],
        ),
        (
            4.5,
            [0.375_699_366, 0.379_051_191, 0.385_128_755, 0.392_764_177, 0.400_481_339, 0.406_708_607, 0.410_166_566],
        ),
    ] {
        let found = everywhere([7, 1, 1], [0.5; 3], [0.5 * sigma, 0.0, 0.0], &row);
        for (found, exact) in found.iter().zip(expected) {
            assert!((f64::from(*found) - exact).abs() < 1e-6, "sigma {sigma}: {found} for {exact}");
        }
    }
}

/// White noise of deviation 1 is left with `1 / ((4 pi)^(3/4) sqrt(s_x s_y s_z))`, s in voxels: along each axis the
/// square of a Gaussian has the integral `1 / (2 sqrt(pi) s)`.
#[test]
fn noise_is_that_of_a_gaussian() {
    let shape = [72; 3];
    let (grid, image) = (PlainGrid { shape }, noise(shape));
    let deviation = |values: &mut dyn Iterator<Item = f64>| {
        let values: Vec<f64> = values.collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt()
    };
    let before = deviation(&mut image.iter().map(|v| f64::from(*v)));
    for (spacing, sigma) in [([1.0; 3], 2.0), ([0.3; 3], 0.3), ([0.5, 0.5, 1.0], 1.0)] {
        let found = everywhere(shape, spacing, [sigma; 3], &image);
        // The mirror image of noise is no new noise.
        let inner = |v: &[i64; 3]| v.iter().all(|v| (8..64).contains(v));
        let left = deviation(&mut grid.voxels().filter(inner).map(|v| f64::from(found[grid.at(v)]))) / before;
        let widths: f64 = spacing.iter().map(|h| sigma / h).product();
        let exact = (4.0 * std::f64::consts::PI).powf(-0.75) / widths.sqrt();
        assert!((left / exact - 1.0).abs() < 0.1, "{spacing:?}, sigma {sigma}: {left} for {exact}");
    }
}

#[test]
fn a_point_keeps_its_sum_and_is_spread_by_sigma() {
    let (shape, centre) = ([48; 3], [20, 23, 25]);
    let grid = PlainGrid { shape };
    let mut image = vec![0.0; grid.len()];
    image[grid.at(centre)] = 1.0;
    for sigma in [0.0, 0.3, 0.5, 0.8, 1.7, 3.0] {
        // Widths in voxels differ along the axes.
        let (spacing, widths) = ([1.0, 0.5, 2.0], [sigma, 2.0 * sigma, 0.5 * sigma]);
        let found = everywhere(shape, spacing, [sigma; 3], &image);
        let moment = |of: &dyn Fn([i64; 3]) -> f64| -> f64 {
            grid.voxels().zip(&found).map(|(v, found)| f64::from(*found) * of(v)).sum()
        };
        let sum = moment(&|_| 1.0);
        assert!((sum - 1.0).abs() < 2e-6, "sigma {sigma}: sum {sum}");
        for a in 0..3 {
            let variance = moment(&|v| ((v[a] - centre[a]) as f64).powi(2));
            // A thousandth was cut off beyond four widths.
            assert!((variance - widths[a] * widths[a]).abs() < 2e-3 * widths[a] * widths[a] + 1e-6, "{a}: {variance}");
        }
    }
}

#[test]
fn constants_and_images_without_a_width_stay_to_the_bit() {
    let shape = [50, 33, 20];
    let image = noise(shape);
    assert_eq!(everywhere(shape, [1.0; 3], [0.0; 3], &image), image);
    for value in [0.3_f32, 1.0, 1e-7, 77.7] {
        let image = vec![value; image.len()];
        assert_eq!(everywhere(shape, [1.0, 0.7, 2.0], [2.3; 3], &image), image);
    }
}

/// Whatever cells are wanted, whatever bricks the image lies in, with any number of threads and little memory.
#[test]
fn a_voxel_has_the_same_bits_on_any_cells() {
    let (shape, spacing, sigma) = ([150, 70, 50], [1.0, 0.8, 2.0], [2.3; 3]);
    let (grid, image) = (PlainGrid { shape }, noise(shape));
    let all = dense(shape, CELL as i64);
    let exact = everywhere(shape, spacing, sigma, &image);
    let mut random = Random(5);
    for (brick, threads, window, share) in [(16, 1, 1 << 30, 2), (32, 2, 1 << 16, 5), (64, 3, 1 << 30, 30)] {
        let lab = Lab::with_window(threads, window);
        let part = Arc::new(BrickSet::from_fn(*all.grid(), |_| random.below(share) == 0));
        let found = run(&lab, &lab.field(&dense(shape, brick), &image), &part, spacing, sigma);
        let is_wanted = |v: [i64; 3]| part.grid().brick_of(v).and_then(|id| part.slot(id)).is_some();
        let mut seen = 0;
        for v in grid.voxels().filter(|&v| is_wanted(v)) {
            assert_eq!(found[grid.at(v)].to_bits(), exact[grid.at(v)].to_bits(), "{v:?} of one in {share}");
            seen += 1;
        }
        assert!(seen > 0, "no cell of one in {share}");
    }
}

/// The edge detector of a band has the bits of that of the whole image.
#[test]
fn a_part_of_the_cells_has_the_edges_of_the_whole() {
    let (lab, shape) = (Lab::new(2), [120, 40, 40]);
    let all = dense(shape, CELL as i64);
    let part = Arc::new(BrickSet::from_fn(*all.grid(), |id| all.grid().coords(id)[0] == 2));
    let source = lab.field(&all, &noise(shape));
    let settings = EdgeSettings { smoothing: Smoothing::Gaussian, sigma: 2.0, k: 50.0 };
    let stage = lab.engine.stage("edges", 0);
    let [g, near] = [&all, &part].map(|set| {
        let smoothed = presmooth(&stage, &lab.engine, &source, set, [1.0; 3], &settings).expect("room in scratch");
        whole(&edges(&stage, &lab.engine, &smoothed, set, [1.0; 3], settings.k).expect("room in scratch"))
    });
    let grid = PlainGrid { shape };
    for v in grid.voxels().filter(|v| (32..48).contains(&v[0])) {
        assert_eq!(near[grid.at(v)].to_bits(), g[grid.at(v)].to_bits(), "{v:?}");
    }
}

#[test]
fn widths_beyond_reason_are_refused() {
    let (lab, shape) = (Lab::new(1), [16; 3]);
    let set = dense(shape, CELL as i64);
    let source = lab.field(&set, &noise(shape));
    assert_eq!(BoxSource::shape(&source), shape);
    let stage = lab.engine.stage("smoothing", 0);
    let refused = smoothed(&stage, &lab.engine, &source, &set, [0.1; 3], [5.0; 3]).err().expect("50 voxels");
    assert!(refused.exit_code() == 2 && refused.to_string().contains("50 voxels"), "{refused}");
}
