//! Values known at scattered places, carried over to others: the mean of all, the nearest counting most.
//!
//! ```text
//! v(p) = sum w_n v_n / sum w_n     w_n = (1 - t_n / 32)^32     t_n = (|p - p_n|^2 - least |p - p_m|^2) / fade
//! ```
//!
//! The weights are within a hundredth of a Gaussian's `e^-t`, and end.

use std::ops::Range;

/// Values at places.
#[derive(Clone, Debug, Default)]
pub struct Carried {
    /// One list for each coordinate.
    places: [Vec<f64>; 3],
    values: [Vec<f64>; 2],
}

impl Carried {
    /// Two values at each place, a position.
    pub fn new(samples: impl Iterator<Item = ([f64; 3], [f64; 2])>) -> Self {
        let mut carried = Self::default();
        for (place, value) in samples {
            carried.places.iter_mut().zip(place).for_each(|(list, v)| list.push(v));
            carried.values.iter_mut().zip(value).for_each(|(list, v)| list.push(v));
        }
        carried
    }

    /// The values at a point, weights falling with `fade`, an area; those numbered `without` are left aside. None of none.
    #[must_use]
    pub fn at(&self, point: [f64; 3], fade: f64, without: Range<usize>) -> Option<[f64; 2]> {
        let parts = [0..without.start, without.end..self.values[0].len()];
        if parts.iter().all(Range::is_empty) {
            return None;
        }
        let of = |part: &Range<usize>| -> [&[f64]; 3] { std::array::from_fn(|a| &self.places[a][part.clone()]) };
        let nearest = parts.iter().map(|part| nearest(point, of(part))).fold(f64::INFINITY, f64::min);
        let mut sums = [[0.0; LANES]; 3];
        for part in &parts {
            let values = [0, 1].map(|m| &self.values[m][part.clone()]);
            weigh(point, of(part), values, [nearest, 1.0 / (fade * POWER)], &mut sums);
        }
        let [weights, first, second] = sums.map(|lanes| lanes.iter().sum::<f64>());
        Some([first / weights, second / weights])
    }
}

const POWER: f64 = 32.0;
/// Sums are taken in so many lanes and these added up in order, whatever the processor.
const LANES: usize = 8;

/// The square of the distance to the nearest place.
fn nearest(point: [f64; 3], places: [&[f64]; 3]) -> f64 {
    vectorised!({ point: [f64; 3], places: [&[f64]; 3] } => nearest_in_lanes -> f64)
}

#[inline(always)]
fn nearest_in_lanes(point: [f64; 3], places: [&[f64]; 3]) -> f64 {
    let mut lanes = [f64::INFINITY; LANES];
    let [(x, x_rest), (y, y_rest), (z, z_rest)] = places.map(<[f64]>::as_chunks);
    for ((x, y), z) in x.iter().zip(y).zip(z) {
        let squares = squares(point, [x, y, z]);
        lanes = std::array::from_fn(|n| if squares[n] < lanes[n] { squares[n] } else { lanes[n] });
    }
    let rest = [padded(x_rest, FAR), padded(y_rest, FAR), padded(z_rest, FAR)];
    let squares = squares(point, [&rest[0], &rest[1], &rest[2]]);
    lanes.into_iter().chain(squares).fold(f64::INFINITY, f64::min)
}

/// Adds weights and weighted values; `by` are the least square and what the others' excess over it is multiplied by.
fn weigh(point: [f64; 3], places: [&[f64]; 3], values: [&[f64]; 2], by: [f64; 2], sums: &mut [[f64; LANES]; 3]) {
    vectorised!({
        point: [f64; 3], places: [&[f64]; 3], values: [&[f64]; 2], by: [f64; 2], sums: &mut [[f64; LANES]; 3]
    } => weigh_in_lanes);
}

#[inline(always)]
fn weigh_in_lanes(
    point: [f64; 3],
    places: [&[f64]; 3],
    values: [&[f64]; 2],
    [least, scale]: [f64; 2],
    sums: &mut [[f64; LANES]; 3],
) {
    let mut lanes = *sums;
    let mut add = |terms: [[f64; LANES]; 3]| {
        for (lane, term) in lanes.iter_mut().zip(terms) {
            (0..LANES).for_each(|n| lane[n] += term[n]);
        }
    };
    let [(x, x_rest), (y, y_rest), (z, z_rest)] = places.map(<[f64]>::as_chunks);
    let [(first, first_rest), (second, second_rest)] = values.map(<[f64]>::as_chunks);
    for ((((x, y), z), first), second) in x.iter().zip(y).zip(z).zip(first).zip(second) {
        add(terms(squares(point, [x, y, z]), [first, second], least, scale));
    }
    // Places too far away to count fill up the last lanes.
    let [x, y, z] = [x_rest, y_rest, z_rest].map(|rest| padded(rest, FAR));
    let values = [first_rest, second_rest].map(|rest| padded(rest, 0.0));
    add(terms(squares(point, [&x, &y, &z]), [&values[0], &values[1]], least, scale));
    *sums = lanes;
}

/// Weights and weighted values.
#[inline(always)]
fn terms(squares: [f64; LANES], values: [&[f64; LANES]; 2], least: f64, scale: f64) -> [[f64; LANES]; 3] {
    let weights: [f64; LANES] = std::array::from_fn(|n| {
        let left = 1.0 - (squares[n] - least) * scale;
        let left = if left > 0.0 { left } else { 0.0 };
        let second = left * left;
        let fourth = second * second;
        let eighth = fourth * fourth;
        let sixteenth = eighth * eighth;
        sixteenth * sixteenth
    });
    [weights, std::array::from_fn(|n| weights[n] * values[0][n]), std::array::from_fn(|n| weights[n] * values[1][n])]
}

/// A coordinate that no place has.
const FAR: f64 = 1e100;

#[inline(always)]
fn padded(rest: &[f64], with: f64) -> [f64; LANES] {
    std::array::from_fn(|n| rest.get(n).copied().unwrap_or(with))
}

#[inline(always)]
fn squares(point: [f64; 3], places: [&[f64; LANES]; 3]) -> [f64; LANES] {
    let by: [[f64; LANES]; 3] = std::array::from_fn(|a| std::array::from_fn(|n| point[a] - places[a][n]));
    std::array::from_fn(|n| by[0][n] * by[0][n] + by[1][n] * by[1][n] + by[2][n] * by[2][n])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearer_places_count_more_as_a_gaussian_has_it() {
        let place = |n: usize| [(n * 7 % 11) as f64, (n * 5 % 13) as f64, (n % 3) as f64];
        let value = |n: usize| [n as f64, f64::from(n as u32 % 2) - 0.5];
        let carried = Carried::new((0..45).map(|n| (place(n), value(n))));
        let (point, fade) = ([4.2, 6.1, 0.5], 9.0);
        for without in [0..0, 3..17, 40..45] {
            let square = |n: usize| (0..3).map(|a| (place(n)[a] - point[a]).powi(2)).sum::<f64>();
            let numbers = || (0..45).filter(|n| !without.contains(n));
            let least = numbers().map(square).fold(f64::INFINITY, f64::min);
            let weight = |n: usize| (-(square(n) - least) / fade).exp();
            let whole: f64 = numbers().map(weight).sum();
            let found = carried.at(point, fade, without.clone()).unwrap();
            for m in 0..2 {
                let wanted = numbers().map(|n| weight(n) * value(n)[m]).sum::<f64>() / whole;
                assert!((found[m] - wanted).abs() < 0.02 * [45.0, 1.0][m], "{without:?} {m}: {} {wanted}", found[m]);
            }
        }
        assert!(carried.at(point, fade, 0..45).is_none());
    }
}
