//! The marks of one outline, where they lie along it, and how curves through them vary (see `curve.rs`).

use nalgebra::DMatrix;

/// The highest number of waves around a curve.
pub(crate) const MOST_WAVES: usize = 40;

/// Outlines of more marks were drawn freehand: their marks are the curve.
pub(crate) const MOST_MARKS: usize = 128;

/// How marks scatter around an outline, and how much outlines deviate from ellipses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scatter {
    /// Standard deviation of a mark along each coordinate, a length.
    pub sigma: f64,
    /// Amplitude A of the deviation from an ellipse, of the radius.
    pub amplitude: f64,
}

/// The marks of an outline with their places along it.
pub(crate) struct Marked {
    /// Shares of the way around.
    pub(crate) places: Vec<f64>,
    /// The two coordinates, columns of n rows.
    pub(crate) values: DMatrix<f64>,
    /// Radius of the circle with the same area.
    pub(crate) radius: f64,
}

impl Marked {
    /// Places along the outline as it is, or as it is when made round.
    pub(crate) fn new(marks: &[[f64; 2]], is_rounded: bool) -> Self {
        let round = if is_rounded { rounded(marks) } else { marks.to_vec() };
        let lengths: Vec<f64> = (0..marks.len()).map(|n| distance(round[n], round[(n + 1) % marks.len()])).collect();
        let whole: f64 = lengths.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        let mut place = 0.0;
        let places = lengths.iter().map(|length| {
            let here = place / whole;
            place += length;
            here
        });
        let places = places.collect();
        let values = DMatrix::from_fn(marks.len(), 2, |n, a| marks[n][a]);
        Self { places, values, radius: (area(marks).abs() / std::f64::consts::PI).sqrt() }
    }

    /// Covariances without noise for an amplitude of 1 of the radius.
    pub(crate) fn covariance(&self) -> DMatrix<f64> {
        let n = self.places.len();
        let mut covariance = DMatrix::zeros(n, n);
        for j in 0..n {
            for i in j..n {
                let value = self.radius * self.radius * wave_sum(self.places[i] - self.places[j]);
                (covariance[(i, j)], covariance[(j, i)]) = (value, value);
            }
        }
        covariance
    }

    /// What an ellipse is made of, at each mark.
    pub(crate) fn ellipse(&self) -> DMatrix<f64> {
        DMatrix::from_fn(self.places.len(), 3, |n, m| basis(self.places[n])[m])
    }
}

pub(crate) fn basis(t: f64) -> [f64; 3] {
    let (sin, cos) = libm::sincos(std::f64::consts::TAU * t);
    [1.0, cos, sin]
}

/// `sum over k from 2 of 2 cos(2 pi k t) / (k^2 - 1)^2`.
pub(crate) fn wave_sum(t: f64) -> f64 {
    let cos = libm::cos(std::f64::consts::TAU * t);
    // Chebyshev's recurrence gives the cosines of multiples.
    let (mut before, mut now, mut sum) = (1.0, cos, 0.0);
    for k in 2..=MOST_WAVES {
        (before, now) = (now, 2.0 * cos * now - before);
        let weight = (k * k - 1) as f64;
        sum += 2.0 * now / (weight * weight);
    }
    sum
}

/// The longest outline that is made round, in widths.
pub(crate) const LONGEST: f64 = 10.0;

/// The polygon, stretched so that its area's second moments are the same in all directions.
pub(crate) fn rounded(polygon: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let [xx, xy, yy] = second_moments(polygon);
    let (mean, half) = (0.5 * (xx + yy), 0.5 * (xx - yy));
    let apart = libm::hypot(half, xy);
    let least = mean / (LONGEST * LONGEST);
    if !(mean > 0.0 && apart > 0.0 && mean.is_finite()) {
        return polygon.to_vec();
    }
    let stretch = (mean + apart).sqrt() / (mean - apart).max(least).sqrt();
    // The direction of the shorter axis: half the angle of (-half, -xy).
    let (cos, sin) = (-half / apart, -xy / apart);
    let axis = [(0.5 * (1.0 + cos)).max(0.0).sqrt(), (0.5 * (1.0 - cos)).max(0.0).sqrt().copysign(sin)];
    let stretched = |p: &[f64; 2]| {
        let by = (stretch - 1.0) * (p[0] * axis[0] + p[1] * axis[1]);
        [p[0] + by * axis[0], p[1] + by * axis[1]]
    };
    polygon.iter().map(stretched).collect()
}

/// The second moments of a polygon's area about its centroid, xx, xy, yy, for each unit of area (Green's theorem).
pub(crate) fn second_moments(polygon: &[[f64; 2]]) -> [f64; 3] {
    // About a corner first: far from the origin digits would be lost.
    let corner = polygon[0];
    let at = |n: usize| std::array::from_fn(|a| polygon[n % polygon.len()][a] - corner[a]);
    let (mut area, mut first, mut second) = (0.0, [0.0; 2], [0.0; 3]);
    for n in 0..polygon.len() {
        let (a, b): ([f64; 2], [f64; 2]) = (at(n), at(n + 1));
        let cross = a[0] * b[1] - b[0] * a[1];
        area += cross / 2.0;
        (0..2).for_each(|k| first[k] += cross * (a[k] + b[k]) / 6.0);
        let product = |k: usize, l: usize| a[k] * a[l] + b[k] * b[l] + (a[k] + b[k]) * (a[l] + b[l]);
        [[0, 0], [0, 1], [1, 1]]
            .iter()
            .zip(&mut second)
            .for_each(|(&[k, l], sum)| *sum += cross * product(k, l) / 24.0);
    }
    let mean = first.map(|v| v / area);
    [second[0] / area - mean[0] * mean[0], second[1] / area - mean[0] * mean[1], second[2] / area - mean[1] * mean[1]]
}

/// Twice-signed area halved: positive for a polygon that runs from the first axis to the second.
#[must_use]
pub(crate) fn area(polygon: &[[f64; 2]]) -> f64 {
    let twice = |n: usize| {
        let (a, b) = (polygon[n], polygon[(n + 1) % polygon.len()]);
        a[0] * b[1] - a[1] * b[0]
    };
    0.5 * (0..polygon.len()).map(twice).sum::<f64>()
}

pub(crate) fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    libm::hypot(a[0] - b[0], a[1] - b[1])
}
