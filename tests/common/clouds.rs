//! Point clouds by formula.

use std::f64::consts::PI;

use strandline::grid::Geometry;

use super::random::Random;

/// The papers' Sponge with r = 1 about the origin, both ends of both angles in, duplicates kept: 231 points at a step
/// of pi / 10 (Kósa & Mikula 2023, eq. 11, with y = r cos p cos t).
pub(crate) fn sponge() -> Vec<[f64; 3]> {
    let step = PI / 10.0;
    let point = |p: f64, t: f64| {
        let s = p.sin().powi(2);
        [(0.207 + 2.003 * s - 1.123 * s * s) * p.cos() * t.sin(), p.cos() * t.cos(), p.sin()]
    };
    (0..=20).flat_map(|p| (0..=10).map(move |t| point(f64::from(p) * step, f64::from(t) * step))).collect()
}

/// About `count` evenly spread points of a sphere (Fibonacci lattice), those of `keep` only.
pub(crate) fn sphere(centre: [f64; 3], radius: f64, count: usize, keep: impl Fn([f64; 3]) -> bool) -> Vec<[f64; 3]> {
    let golden = PI * (3.0 - 5.0_f64.sqrt());
    let directions = (0..count).map(|n| {
        let (height, turn) = (1.0 - (2 * n + 1) as f64 / count as f64, golden * n as f64);
        let ring = (1.0 - height * height).sqrt();
        [ring * turn.cos(), ring * turn.sin(), height]
    });
    directions.filter(|d| keep(*d)).map(|d| std::array::from_fn(|a| centre[a] + radius * d[a])).collect()
}

/// The papers' grid around a cloud: a sixth of the largest extent on every side.
pub(crate) fn grid_around(cloud: &[[f64; 3]], h: f64) -> Geometry {
    let low: [f64; 3] = std::array::from_fn(|a| cloud.iter().map(|p| p[a]).fold(f64::INFINITY, f64::min));
    let high: [f64; 3] = std::array::from_fn(|a| cloud.iter().map(|p| p[a]).fold(f64::NEG_INFINITY, f64::max));
    let padding = (0..3).map(|a| high[a] - low[a]).fold(0.0, f64::max) / 6.0;
    Geometry {
        shape: std::array::from_fn(|a| ((high[a] - low[a] + 2.0 * padding) / h).floor() as i64 + 2),
        spacing: [h; 3],
        origin: low.map(|v| v - padding),
        unit: None,
    }
}

/// A sphere with the Sponge's parametrisation: 231 points, duplicates kept.
pub(crate) fn sphere_by_angles(centre: [f64; 3], r: f64) -> Vec<[f64; 3]> {
    let step = PI / 10.0;
    let point = |p: f64, t: f64| {
        [centre[0] + r * p.cos() * t.sin(), centre[1] + r * p.cos() * t.cos(), centre[2] + r * p.sin()]
    };
    (0..=20).flat_map(|p| (0..=10).map(move |t| point(f64::from(p) * step, f64::from(t) * step))).collect()
}

/// The papers' pair (docs/algorithms.md, "Readings and figures"): the Sponge, and a sphere of radius 1/2 two to its
/// negative x side.
pub(crate) fn sponge_and_sphere() -> [Vec<[f64; 3]>; 2] {
    [sponge(), sphere_by_angles([-2.0, 0.0, 0.0], 0.5)]
}

/// Random points: anywhere in the domain or up to two voxels outside, some on grid points, some given twice.
pub(crate) fn random_cloud(geometry: &Geometry, count: usize, seed: u64) -> Vec<[f64; 3]> {
    let mut random = Random(seed);
    let mut cloud: Vec<[f64; 3]> = Vec::new();
    for n in 0..count {
        let snap = random.below(3) == 0;
        let margin = if random.below(4) == 0 { 2.0 } else { 0.0 };
        let p = std::array::from_fn(|a| {
            let place = random.unit() * (geometry.shape[a] as f64 - 1.0 + 2.0 * margin) - margin;
            geometry.origin[a] + geometry.spacing[a] * if snap { place.round() } else { place }
        });
        let twice = n > 0 && random.below(8) == 0;
        cloud.push(if twice { cloud[random.below(n)] } else { p });
    }
    cloud
}

/// A body with bumps and dents about the origin, of these half extents but for the bumps, sampled as a scanner does:
/// not quite evenly, a tenth of the points missing, with noise as large as that.
pub(crate) fn scan(half: [f64; 3], points: usize, noise: f64) -> Vec<[f64; 3]> {
    let mut random = Random(7);
    let golden = PI * (3.0 - 5.0_f64.sqrt());
    let all = points * 10 / 9;
    let mut cloud = Vec::new();
    for n in 0..all {
        let (height, turn) = (1.0 - (2 * n + 1) as f64 / all as f64, golden * n as f64);
        let ring = (1.0 - height * height).sqrt();
        let p = [ring * turn.cos(), ring * turn.sin(), height];
        let bumps = 1.0 + 0.08 * (5.0 * p[0]).sin() * (4.0 * p[1] + 1.0).cos() + 0.06 * (9.0 * p[2] + 3.0 * p[0]).sin();
        let off = noise * (random.unit() - 0.5);
        if random.below(10) > 0 && cloud.len() < points {
            cloud.push(std::array::from_fn(|a| p[a] * (half[a] * bumps + off)));
        }
    }
    cloud
}
