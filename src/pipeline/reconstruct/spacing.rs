//! The spacing of a cloud: how far its points are apart as the surface sees it.
//!
//! That is the mean distance to the nearest other point, where this says how well the surface is covered. It does not
//! where scans were merged (each point has a near copy) or where a part was scanned far more densely than the rest:
//! these points are many and cover little. How a cloud covers its surface is told by the number N of cubes of an edge
//! h that hold points (box counting; Mandelbrot 1982): as long as the cubes are wider than the spacing, N h^2 is the
//! surface's area, whatever lies in each cube; below that it falls.

use std::collections::HashMap;

use rstar::RTree;

/// A cloud of fewer places is too small to be counted in cubes.
const FEWEST_COUNTED: usize = 50;
/// Cubes this few, or holding more than so many points each, are too coarse to be the surface.
const FEWEST_CUBES: f64 = 24.0;
const MOST_PER_CUBE: f64 = 50.0;
/// The cloud covers its surface down to where so large a part of the area is left: at about half the spacing.
const COVERED: f64 = 0.25;
/// Nearest neighbours at this part of that length in the mean are those of random points; closer ones are copies.
const LEAST_MEAN: f64 = 0.62;
/// Points nearer to another than this part of it are copies, or in a dense part; of random clouds a tenth are.
const NEAR: f64 = 0.25;
const MOST_NEAR: f64 = 0.15;
/// A point so many times as far from the others as usual stands alone, and says nothing of the spacing.
const ALONE: f64 = 6.0;
/// Bits of a place along one axis: an outlier a million times as far away as the cloud is wide leaves enough of them.
const BITS: u32 = 42;

/// The distance between neighbouring points of a cloud that matters for its surface; none for fewer than two places.
/// Copies, near copies, single outliers and small dense parts leave it as it is.
#[must_use]
pub fn typical_spacing(points: &[[f64; 3]]) -> Option<f64> {
    let mut places = points.to_vec();
    places.sort_by(|p, q| p[2].total_cmp(&q[2]).then(p[1].total_cmp(&q[1])).then(p[0].total_cmp(&q[0])));
    places.dedup();
    let distances = nearest_distances(&places);
    let mean = mean_of_usual(&distances)?;
    let Some(covered) = covered_down_to(&places) else { return Some(mean) };
    let near = distances.iter().filter(|&&d| d < NEAR * covered).count() as f64;
    if mean >= LEAST_MEAN * covered && near <= MOST_NEAR * distances.len() as f64 {
        return Some(mean);
    }
    mean_of_usual(&nearest_distances(&thinned(&places, covered))).or(Some(mean))
}

/// The distance from each of several different places to the nearest other one.
fn nearest_distances(places: &[[f64; 3]]) -> Vec<f64> {
    let tree = RTree::bulk_load(places.to_vec());
    let nearest = |p: &[f64; 3]| Some(tree.nearest_neighbor_iter_with_distance_2(*p).nth(1)?.1.sqrt());
    places.iter().filter_map(nearest).collect()
}

/// The mean of those distances that are not far above the others.
fn mean_of_usual(distances: &[f64]) -> Option<f64> {
    let mut sorted = distances.to_vec();
    sorted.sort_by(f64::total_cmp);
    let most = ALONE * sorted.get(sorted.len() / 2)?;
    let usual = || distances.iter().filter(|&&d| d <= most);
    Some(usual().sum::<f64>() / usual().count() as f64)
}

/// The edge of cubes at which the cloud covers no more than a quarter of the area that wider ones see.
fn covered_down_to(places: &[[f64; 3]]) -> Option<f64> {
    if places.len() < FEWEST_COUNTED {
        return None;
    }
    let counted = cubes(places);
    let area = |&(edge, number): &(f64, u64)| edge * edge * number as f64;
    let least = FEWEST_CUBES.max(places.len() as f64 / MOST_PER_CUBE);
    let fine = counted.partition_point(|&(_, number)| (number as f64) < least);
    let whole = (fine..counted.len()).max_by(|&a, &b| area(&counted[a]).total_cmp(&area(&counted[b])))?;
    let wanted = COVERED * area(&counted[whole]);
    let below = (whole..counted.len()).find(|&level| area(&counted[level]) < wanted)?;
    let (wide, narrow) = (area(&counted[below - 1]), area(&counted[below]));
    // Each edge is half of the one before it.
    let part = libm::log(wide / wanted) / libm::log(wide / narrow);
    Some(counted[below - 1].0 * libm::exp2(-part))
}

/// The edges of cubes, each half of the one before, and how many hold places.
fn cubes(places: &[[f64; 3]]) -> Vec<(f64, u64)> {
    let bound = |a: usize, pick: fn(f64, f64) -> f64| places.iter().map(|p| p[a]).reduce(pick).unwrap_or(0.0);
    let low = [0, 1, 2].map(|a| bound(a, f64::min));
    let extent = (0..3).map(|a| bound(a, f64::max) - low[a]).fold(f64::MIN_POSITIVE, f64::max);
    // Odd parts: a lattice, or a plane along an axis, shall not lie on the sides of cubes.
    let first: [f64; 3] = std::array::from_fn(|a| low[a] - [0.381_966, 0.276_393, 0.453_401][a] * extent);
    let scale = (1u64 << BITS) as f64 / (2.0 * extent);
    let mut keys: Vec<u128> =
        places.iter().map(|p| key([0, 1, 2].map(|a| ((p[a] - first[a]) * scale) as u64))).collect();
    keys.sort_unstable();
    // Neighbours in this order are told apart by all cubes up to those of the highest bit in which they differ.
    let mut apart = [0u64; BITS as usize];
    for pair in keys.windows(2).filter(|pair| pair[0] != pair[1]) {
        apart[((pair[0] ^ pair[1]).ilog2() / 3) as usize] += 1;
    }
    let (mut number, mut edge) = (1, 2.0 * extent);
    let mut counted = vec![(edge, number)];
    for apart in apart.into_iter().rev() {
        number += apart;
        edge *= 0.5;
        counted.push((edge, number));
    }
    counted
}

/// The bits of three numbers in turn, so that the places of a cube follow one another (Morton 1966).
fn key(place: [u64; 3]) -> u128 {
    (0..BITS).rev().fold(0, |key, bit| place.iter().fold(key, |key, v| key << 1 | u128::from(v >> bit & 1)))
}

/// The places that are at least `apart` from those kept before them, in their order.
fn thinned(places: &[[f64; 3]], apart: f64) -> Vec<[f64; 3]> {
    let cell = |p: &[f64; 3]| p.map(|v| (v / apart).floor() as i64);
    let mut cells: HashMap<[i64; 3], Vec<[f64; 3]>> = HashMap::new();
    let near = |p: &[f64; 3], q: &[f64; 3]| (0..3).map(|a| (p[a] - q[a]).powi(2)).sum::<f64>() < apart * apart;
    let around = |[x, y, z]: [i64; 3]| {
        (-1..2).flat_map(move |k| (-1..2).flat_map(move |j| (-1..2).map(move |i| [x + i, y + j, z + k])))
    };
    let mut kept = Vec::new();
    for p in places {
        let here = cell(p);
        if !around(here).any(|at| cells.get(&at).is_some_and(|those| those.iter().any(|q| near(p, q)))) {
            kept.push(*p);
            cells.entry(here).or_default().push(*p);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// Points evenly on the unit sphere (golden angle); neighbours are about 3.4 / sqrt(n) apart.
    fn sphere(n: u32) -> Vec<[f64; 3]> {
        let place = |k: u32| {
            let z = 1.0 - (2.0 * f64::from(k) + 1.0) / f64::from(n);
            let (r, turn) = ((1.0 - z * z).sqrt(), PI * (1.0 + 5f64.sqrt()) * f64::from(k));
            [r * libm::cos(turn), r * libm::sin(turn), z]
        };
        (0..n).map(place).collect()
    }

    fn shifted(points: &[[f64; 3]], by: f64) -> Vec<[f64; 3]> {
        // To either side of the surface and along it by turns.
        let turn = |n: usize| [[by, 0.0, 0.0], [0.0, -by, 0.0], [0.0, 0.0, by], [-by, by, 0.0]][n % 4];
        points.iter().enumerate().map(|(n, p)| std::array::from_fn(|a| p[a] + turn(n)[a])).collect()
    }

    /// Against the plain definition, of every pair.
    #[test]
    fn an_even_cloud_has_its_mean_distance() {
        for n in [40, 300, 1000] {
            let cloud = sphere(n);
            let distance = |p: &[f64; 3], q: &[f64; 3]| (0..3).map(|a| (p[a] - q[a]).powi(2)).sum::<f64>().sqrt();
            let others = |p: &[f64; 3]| cloud.iter().map(|q| distance(p, q)).filter(|&d| d > 0.0).fold(9.0, f64::min);
            let mean = cloud.iter().map(others).sum::<f64>() / f64::from(n);
            assert!((typical_spacing(&cloud).unwrap() - mean).abs() < 1e-12, "{n}");
        }
        let lattice: Vec<[f64; 3]> = (0..60).map(|n| [0.5 * f64::from(n % 3), 0.5 * f64::from(n / 3), 0.0]).collect();
        let twice = [&lattice[..], &lattice[7..9]].concat();
        assert!((typical_spacing(&twice).unwrap() - 0.5).abs() < 1e-12, "points at the same place count once");
        assert_eq!(typical_spacing(&lattice[..1]), None);
        assert_eq!(typical_spacing(&[[1.0; 3]; 9]), None);
        assert_eq!(typical_spacing(&[]), None);
    }

    #[test]
    fn copies_outliers_and_dense_parts_leave_it() {
        let once = sphere(500);
        let spacing = typical_spacing(&once).unwrap();
        let same = |cloud: &[[f64; 3]], what: &str| {
            let found = typical_spacing(cloud).unwrap();
            assert!((found / spacing - 1.0).abs() < 0.12, "{what}: {found}, not {spacing}");
        };
        for by in [1e-9, 1e-6, 1e-4, 1e-2, 2e-2] {
            same(&[once.clone(), shifted(&once, by)].concat(), &format!("copies {by} apart"));
            let six: Vec<_> = (0..6).flat_map(|n| shifted(&once, by * f64::from(n) / 5.0)).collect();
            same(&six, &format!("six copies within {by}"));
        }
        same(&[once.clone(), shifted(&once[..150], 1e-3)].concat(), "a part of it twice");
        for far in [3.0, 100.0, 1e6] {
            same(&[once.clone(), vec![[far, 0.1, -far]]].concat(), &format!("an outlier at {far}"));
            let both = [once.clone(), shifted(&once, 1e-4), vec![[far, 0.1, -far]]].concat();
            same(&both, &format!("copies, and an outlier at {far}"));
        }
        let patch = sphere(100_000).into_iter().filter(|p| p[2] > 0.97);
        same(&once.iter().copied().chain(patch).collect::<Vec<_>>(), "a dense patch");
        let far_away: Vec<_> = once.iter().map(|p| [p[0] + 5e5, p[1] + 4e6, p[2]]).collect();
        same(&[far_away.clone(), shifted(&far_away, 1e-4)].concat(), "survey coordinates");
    }
}
