//! A smooth closed curve through noisy marks: universal kriging along the curve (Rasmussen & Williams 2006, eq. 2.41;
//! Wahba 1990), each coordinate for itself.
//!
//! With the share t of the way around, measured as it is or where the outline's second moments are those of a circle (an
//! ellipse is then run through as its angle does, however long it is), as the marks are likelier, `q(t) = b0 + b1 cos 2 pi t + b2 sin 2 pi t + f(t)`: an ellipse, which costs
//! nothing, and a Gaussian process f with covariance
//!
//! ```text
//! A^2 r^2 sum over k from 2 of 2 cos(2 pi k (t - t')) / (k^2 - 1)^2
//! ```
//!
//! r is the outline's radius, so A is a number for shapes of all sizes. Marks carry white noise of variance sigma^2.
//! In: marks in the plane, in order. Out: points on the curve, and how sure they are.

use nalgebra::DMatrix;

use super::marked::{MOST_MARKS, MOST_WAVES, Scatter, distance};
use super::noise::{Prepared, likelier};

/// A curve as the waves around it: `c_0 + sum over k of c_k cos 2 pi k t + s_k sin 2 pi k t`.
struct Waves(Vec<[[f64; 2]; 2]>);

impl Waves {
    /// What the weights of marks at these places and of the ellipse, the last three rows, make: sums of cosines of
    /// differences, taken apart.
    fn of(places: &[f64], weights: &DMatrix<f64>, scale: f64) -> Self {
        let n = places.len();
        let row = |m: usize| std::array::from_fn(|a| weights[(n + m, a)]);
        let mut waves = vec![[row(0), [0.0; 2]], [row(1), row(2)]];
        for k in 2..=MOST_WAVES {
            let square = (k * k - 1) as f64;
            let mut wave = [[0.0; 2]; 2];
            for (i, place) in places.iter().enumerate() {
                let (sin, cos) = libm::sincos(std::f64::consts::TAU * k as f64 * place);
                for a in 0..2 {
                    wave[0][a] += scale * 2.0 / (square * square) * weights[(i, a)] * cos;
                    wave[1][a] += scale * 2.0 / (square * square) * weights[(i, a)] * sin;
                }
            }
            waves.push(wave);
        }
        Self(waves)
    }

    fn at(&self, t: f64) -> [f64; 2] {
        let (sin, cos) = libm::sincos(std::f64::consts::TAU * t);
        let mut turn = [1.0, 0.0];
        self.0.iter().fold([0.0; 2], |sum, [c, s]| {
            let here = std::array::from_fn(|a| sum[a] + c[a] * turn[0] + s[a] * turn[1]);
            turn = [turn[0] * cos - turn[1] * sin, turn[0] * sin + turn[1] * cos];
            here
        })
    }
}

/// A closed curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// Points along it, closed from the last to the first.
    pub points: Vec<[f64; 2]>,
    /// Standard deviation of its points, a length.
    pub deviation: f64,
}

impl Curve {
    /// The curve through marks, with points no more than about `step` apart.
    #[must_use]
    pub fn through(marks: &[[f64; 2]], scatter: Scatter, step: f64) -> Self {
        let polygon = || Self { points: marks.to_vec(), deviation: scatter.sigma };
        if !(4..=MOST_MARKS).contains(&marks.len()) {
            return polygon();
        }
        let Prepared { marked, covariance, ellipse } = likelier(marks, scatter);
        if marked.radius <= scatter.sigma {
            return polygon();
        }
        let (n, variance) = (marks.len(), scatter.sigma * scatter.sigma);
        let shape = covariance * (scatter.amplitude * scatter.amplitude);
        let mut system = DMatrix::zeros(n + 3, n + 3);
        system.view_mut((0, 0), (n, n)).copy_from(&shape);
        (0..n).for_each(|i| system[(i, i)] += variance.max(1e-9 * marked.radius * marked.radius));
        system.view_mut((0, n), (n, 3)).copy_from(&ellipse);
        system.view_mut((n, 0), (3, n)).copy_from(&ellipse.transpose());
        let Some(inverse) = system.try_inverse() else { return polygon() };
        let mut right = DMatrix::zeros(n + 3, 2);
        right.view_mut((0, 0), (n, 2)).copy_from(&marked.values);
        let weights = &inverse * right;
        // The trace of the smoother tells how many parameters the curve has.
        let free = n as f64 - variance * inverse.view((0, 0), (n, n)).trace();
        let length: f64 = (0..n).map(|i| distance(marks[i], marks[(i + 1) % n])).sum();
        let count = ((length / step).ceil() as usize).clamp(2 * n, 4096);
        let scale = marked.radius * marked.radius * scatter.amplitude * scatter.amplitude;
        let waves = Waves::of(&marked.places, &weights, scale);
        let points = (0..count).map(|m| waves.at(m as f64 / count as f64)).collect();
        Self { points, deviation: scatter.sigma * (free.max(1.0) / n as f64).sqrt().min(1.0) }
    }
}

impl Curve {
    /// Whether both curves run within `apart` of each other all along.
    #[must_use]
    pub fn repeats(&self, other: &Self, apart: f64) -> bool {
        let near = |p: &[f64; 2], of: &Self| of.points.iter().any(|q| distance(*p, *q) <= apart);
        let follows = |a: &Self, b: &Self| a.points.iter().step_by(3).all(|p| near(p, b));
        follows(self, other) && follows(other, self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_ellipse_is_no_deviation() {
        // Marks at even steps of the angle and of the length: noise that is expected smooths either not at all.
        let ellipse = |t: f64| {
            let (x, y) = (40.0 * t.cos(), 10.0 * t.sin());
            [100.0 + 0.8 * x - 0.6 * y, 5000.0 + 0.6 * x + 0.8 * y]
        };
        let fine: Vec<f64> = (0..4000).map(|n| std::f64::consts::TAU * f64::from(n) / 4000.0).collect();
        let mut lengths = vec![0.0];
        fine.windows(2).for_each(|t| lengths.push(lengths[lengths.len() - 1] + distance(ellipse(t[0]), ellipse(t[1]))));
        let even = |n: usize| fine[lengths.partition_point(|&l| l < lengths[3999] * n as f64 / 14.0)];
        for marks in [(0..14).map(|n| fine[n * 285]).collect::<Vec<_>>(), (0..14).map(even).collect()] {
            let marks: Vec<[f64; 2]> = marks.into_iter().map(ellipse).collect();
            let curve = Curve::through(&marks, Scatter { sigma: 1.0, amplitude: 0.01 }, 0.5);
            let off = |p: &[f64; 2]| fine.iter().map(|&t| distance(ellipse(t), *p)).fold(f64::INFINITY, f64::min);
            let worst = curve.points.iter().map(off).fold(0.0, f64::max);
            assert!(worst < 0.6, "{worst}");
        }
    }
}
