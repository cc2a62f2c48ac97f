//! A smooth function in space through scattered values: triharmonic radial basis functions with a linear polynomial
//! (Duchon 1977; Carr et al. 2001; in 3-D the kernel is r^3).
//!
//! `f(x) = sum w_i |x - x_i|^3 + c0 + c . x`, with `sum w_i = 0`, `sum w_i x_i = 0`. Of all functions through the values
//! it has the smallest third derivatives. In: points and values, physical. Out: values and gradients.

use nalgebra::{DMatrix, DVector};

/// The function.
#[derive(Clone, Debug)]
pub struct RadialBasis {
    centre: [f64; 3],
    scale: f64,
    /// Nodes, one list for each coordinate, and their weights.
    nodes: [Vec<f64>; 3],
    weights: Vec<f64>,
    linear: [f64; 4],
}

impl RadialBasis {
    /// The function with these values at these points, or with `smoothing` (a volume) near to them: that much may be lost
    /// of a value for each unit of its weight. None where they do not tell it, as when all lie in one plane.
    #[must_use]
    pub fn through(points: &[[f64; 3]], values: &[f64], smoothing: f64) -> Option<Self> {
        let n = points.len();
        if n < 5 {
            return None;
        }
        let mean = |a: usize| points.iter().map(|p| p[a]).sum::<f64>() / n as f64;
        let centre: [f64; 3] = std::array::from_fn(mean);
        let farthest = points.iter().flat_map(|p| (0..3).map(|a| (p[a] - centre[a]).abs())).fold(0.0, f64::max);
        let scale = 1.0 / farthest.max(f64::MIN_POSITIVE);
        let nodes: [Vec<f64>; 3] = std::array::from_fn(|a| points.iter().map(|p| (p[a] - centre[a]) * scale).collect());
        let mut system = DMatrix::zeros(n + 4, n + 4);
        for j in 0..n {
            for i in 0..j {
                let r = (0..3).map(|a| (nodes[a][i] - nodes[a][j]).powi(2)).sum::<f64>();
                let value = r * r.sqrt();
                system[(i, j)] = value;
                system[(j, i)] = value;
            }
            let linear = [1.0, nodes[0][j], nodes[1][j], nodes[2][j]];
            for (m, value) in linear.into_iter().enumerate() {
                system[(j, n + m)] = value;
                system[(n + m, j)] = value;
            }
        }
        let nugget = smoothing * scale.powi(3);
        (0..n).for_each(|i| system[(i, i)] += nugget);
        let right = DVector::from_fn(n + 4, |i, _| values.get(i).copied().unwrap_or(0.0));
        let solved = system.lu().solve(&right)?;
        // A system without a single solution gives numbers that are no solution.
        if !solved.iter().all(|w| w.is_finite()) {
            return None;
        }
        let weights: Vec<f64> = solved.iter().take(n).copied().collect();
        let linear = std::array::from_fn(|m| solved[n + m]);
        let found = Self { centre, scale, nodes, weights, linear };
        let largest = values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let off = |n: usize| (found.value(points[n]).0 + nugget * found.weights[n] - values[n]).abs();
        ((0..n).all(|n| off(n) <= 1e-3 * largest)).then_some(found)
    }

    /// Value and gradient at a point.
    #[must_use]
    pub fn value(&self, point: [f64; 3]) -> (f64, [f64; 3]) {
        let p: [f64; 3] = std::array::from_fn(|a| (point[a] - self.centre[a]) * self.scale);
        let sums = sums(p, [&self.nodes[0], &self.nodes[1], &self.nodes[2]], &self.weights);
        let value = sums[0] + self.linear[0] + (0..3).map(|a| self.linear[a + 1] * p[a]).sum::<f64>();
        (value, std::array::from_fn(|a| (3.0 * sums[a + 1] + self.linear[a + 1]) * self.scale))
    }
}

/// `sum w r^3` and `sum w r (p - x)`. Lanes are added up in a fixed order.
fn sums(p: [f64; 3], [x, y, z]: [&[f64]; 3], weights: &[f64]) -> [f64; 4] {
    vectorised!({ p: [f64; 3], x: &[f64], y: &[f64], z: &[f64], weights: &[f64] } => sums_in_lanes -> [f64; 4])
}

const LANES: usize = 8;

#[inline(always)]
fn sums_in_lanes(p: [f64; 3], x: &[f64], y: &[f64], z: &[f64], weights: &[f64]) -> [f64; 4] {
    let mut lanes = [[0.0; LANES]; 4];
    let [(x, x_rest), (y, y_rest), (z, z_rest), (w, w_rest)] = [x, y, z, weights].map(<[f64]>::as_chunks);
    for (((x, y), z), w) in x.iter().zip(y).zip(z).zip(w) {
        // Whole arrays in, whole arrays out: that is what becomes vector instructions.
        let terms = terms(p, [x, y, z], w);
        for (lane, term) in lanes.iter_mut().zip(terms) {
            (0..LANES).for_each(|n| lane[n] += term[n]);
        }
    }
    let [mut x, mut y, mut z, mut w] = [[0.0; LANES]; 4];
    for (list, rest) in [(&mut x, x_rest), (&mut y, y_rest), (&mut z, z_rest), (&mut w, w_rest)] {
        list.iter_mut().zip(rest).for_each(|(value, rest)| *value = *rest);
    }
    // What is left over has a weight, the rest of the lanes none.
    let terms = terms(p, [&x, &y, &z], &w);
    std::array::from_fn(|m| (0..LANES).map(|n| lanes[m][n] + terms[m][n]).sum())
}

#[inline(always)]
fn terms(p: [f64; 3], nodes: [&[f64; LANES]; 3], weights: &[f64; LANES]) -> [[f64; LANES]; 4] {
    let by: [[f64; LANES]; 3] = std::array::from_fn(|a| std::array::from_fn(|n| p[a] - nodes[a][n]));
    let square: [f64; LANES] = std::array::from_fn(|n| by[0][n] * by[0][n] + by[1][n] * by[1][n] + by[2][n] * by[2][n]);
    let slope: [f64; LANES] = std::array::from_fn(|n| weights[n] * square[n].sqrt());
    [
        std::array::from_fn(|n| slope[n] * square[n]),
        std::array::from_fn(|n| slope[n] * by[0][n]),
        std::array::from_fn(|n| slope[n] * by[1][n]),
        std::array::from_fn(|n| slope[n] * by[2][n]),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_linear_function_comes_back_and_values_are_kept() {
        let points: Vec<[f64; 3]> = (0..40)
            .map(|n| {
                let t = f64::from(n);
                [(t * 0.7).sin() * 9.0, (t * 1.3).cos() * 7.0, t * 0.4]
            })
            .collect();
        let of = |p: [f64; 3]| 2.0 + 0.5 * p[0] - p[1] + 3.0 * p[2];
        let linear = RadialBasis::through(&points, &points.iter().map(|&p| of(p)).collect::<Vec<_>>(), 0.0).unwrap();
        let (value, gradient) = linear.value([20.0, -11.0, 5.0]);
        assert!((value - of([20.0, -11.0, 5.0])).abs() < 1e-6, "{value}");
        assert!((gradient[2] - 3.0).abs() < 1e-6, "{gradient:?}");
        let bumpy: Vec<f64> = points.iter().map(|p| p[0].sin() + p[2]).collect();
        let function = RadialBasis::through(&points, &bumpy, 0.0).unwrap();
        for (&p, &v) in points.iter().zip(&bumpy) {
            assert!((function.value(p).0 - v).abs() < 1e-8);
        }
        let (at, h) = ([1.0, 2.0, 3.0], 1e-5);
        let numeric = (function.value([1.0 + h, 2.0, 3.0]).0 - function.value([1.0 - h, 2.0, 3.0]).0) / (2.0 * h);
        assert!((function.value(at).1[0] - numeric).abs() < 1e-5);
    }

    #[test]
    fn points_of_one_plane_tell_no_function() {
        let flat: Vec<[f64; 3]> = (0..20).map(|n| [f64::from(n % 5), f64::from(n / 5), 1.0]).collect();
        assert!(RadialBasis::through(&flat, &[1.0; 20], 0.0).is_none());
    }
}
