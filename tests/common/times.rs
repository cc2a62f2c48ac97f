//! Travel times in the plainest way: Dijkstra's algorithm over a dense volume, each voxel's time from its settled neighbours alone,
//! as the least that any set of axes gives. In f64; nothing of it is the program's.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use strandline::grid::Geometry;

use super::lab::PlainGrid;
use super::textbook::{position, squared};

/// The voxels that points fix and the times there: the corners of their cells, at their own speed.
pub(crate) fn fixed_times(geometry: &Geometry, speeds: &[f32], points: &[[f64; 3]]) -> Vec<(usize, f64)> {
    let plain = PlainGrid { shape: geometry.shape };
    let mut fixed = Vec::new();
    for &point in points {
        let first: [i64; 3] =
            std::array::from_fn(|a| ((point[a] - geometry.origin[a]) / geometry.spacing[a]).floor() as i64);
        for corner in 0..8 {
            let v: [i64; 3] = std::array::from_fn(|a| first[a] + (corner >> a & 1));
            let place = plain.at(v);
            if plain.contains(v) && speeds[place] > 0.0 {
                fixed.push((place, squared(position(geometry, v), point).sqrt() / f64::from(speeds[place])));
            }
        }
    }
    fixed
}

/// The time of every voxel, infinite where no front comes.
pub(crate) fn plain_times(geometry: &Geometry, speeds: &[f32], fixed: &[(usize, f64)]) -> Vec<f64> {
    let plain = PlainGrid { shape: geometry.shape };
    let voxels: Vec<[i64; 3]> = plain.voxels().collect();
    let mut times = vec![f64::INFINITY; plain.len()];
    let (mut settled, mut is_fixed) = (vec![false; plain.len()], vec![false; plain.len()]);
    let mut heap = BinaryHeap::new();
    for &(place, time) in fixed {
        times[place] = times[place].min(time);
        is_fixed[place] = true;
        heap.push(Reverse((times[place].to_bits(), place)));
    }
    while let Some(Reverse((bits, place))) = heap.pop() {
        if std::mem::replace(&mut settled[place], true) || f64::from_bits(bits) > times[place] {
            continue;
        }
        for beside in PlainGrid::around(voxels[place]).into_iter().filter(|v| plain.contains(*v)) {
            let at = plain.at(beside);
            if settled[at] || is_fixed[at] || speeds[at] == 0.0 {
                continue;
            }
            let around = PlainGrid::around(beside);
            let known = |v: [i64; 3]| {
                if plain.contains(v) && settled[plain.at(v)] { times[plain.at(v)] } else { f64::INFINITY }
            };
            let near = [0, 1, 2].map(|a| known(around[2 * a]).min(known(around[2 * a + 1])));
            let time = least_time(near, geometry.spacing, f64::from(speeds[at]));
            if time < times[at] {
                times[at] = time;
                heap.push(Reverse((time.to_bits(), at)));
            }
        }
    }
    times
}

/// The smallest solution that any set of axes has which is later than its neighbours.
fn least_time(near: [f64; 3], spacing: [f64; 3], speed: f64) -> f64 {
    let mut least = f64::INFINITY;
    for set in 1..8_u32 {
        let axes: Vec<usize> = (0..3).filter(|a| set >> a & 1 == 1 && near[*a].is_finite()).collect();
        if axes.len() != set.count_ones() as usize {
            continue;
        }
        // sum ((t - a) / h)^2 = 1 / F^2, about the mean of the neighbours.
        let weight: f64 = axes.iter().map(|&a| spacing[a].powi(-2)).sum();
        let mean = axes.iter().map(|&a| near[a] * spacing[a].powi(-2)).sum::<f64>() / weight;
        let spread: f64 = axes.iter().map(|&a| ((near[a] - mean) / spacing[a]).powi(2)).sum();
        let rest = speed.powi(-2) - spread;
        let time = mean + (rest.max(0.0) / weight).sqrt();
        if rest >= 0.0 && axes.iter().all(|&a| time >= near[a]) {
            least = least.min(time);
        }
    }
    least
}
