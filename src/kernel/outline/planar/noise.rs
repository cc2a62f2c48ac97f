//! How far marks scatter around the outlines that were meant: restricted maximum likelihood over all outlines of a run
//! (Patterson & Thompson 1971; Rasmussen & Williams 2006, sec. 2.7), for the process of `curve.rs`.
//!
//! Of the two kinds of places along an outline (`curve.rs`) the one counts under which the marks of a run scatter less.
//!
//! For one outline with covariance `K = A^2 C + sigma^2 1` and the ellipse's columns B, for both coordinates y,
//!
//! ```text
//! -2 log L = 2 (log det K + log det (B' K^-1 B)) + sum over y of y' P y      P = K^-1 - K^-1 B (B' K^-1 B)^-1 B' K^-1
//! ```

use nalgebra::{Cholesky, DMatrix};

use super::marked::{MOST_MARKS, Marked, Scatter};

/// Steps of the search: amplitudes of the radius, and deviations in units of the smallest spacing.
const AMPLITUDES: [f64; 7] = [0.01, 0.03, 0.07, 0.15, 0.3, 0.6, 1.2];
const DEVIATIONS: [f64; 9] = [0.02, 0.1, 0.2, 0.35, 0.5, 0.75, 1.1, 1.6, 2.4];
/// So many outlines tell enough.
const ENOUGH: usize = 40;

/// Those of the outlines that tell how their marks scatter, enough of them: fewer than six marks say nothing about their
/// noise.
#[must_use]
pub fn telling(outlines: &[Vec<[f64; 2]>]) -> Vec<&[[f64; 2]]> {
    let telling = || outlines.iter().filter(|o| (6..=MOST_MARKS).contains(&o.len()));
    let every = telling().count().div_ceil(ENOUGH).max(1);
    telling().step_by(every).map(Vec::as_slice).collect()
}

/// What each scatter costs, minus twice the log-likelihood, with places as they are and made round.
pub type Costs = [Vec<f64>; 2];

/// What an outline's marks cost under each scatter; `spacing` is the smallest one.
#[must_use]
pub fn costs(outline: &[[f64; 2]], spacing: f64) -> Costs {
    [false, true].map(|is_rounded| {
        let prepared = Prepared::new(outline, is_rounded);
        scatters(spacing).map(|scatter| prepared.cost(scatter)).collect()
    })
}

/// The scatter under which the marks of all outlines are most likely, from what it costs each.
#[must_use]
pub fn likeliest(costs: &[Costs], spacing: f64) -> Scatter {
    let of = |kind: usize| {
        let sums = scatters(spacing).enumerate().map(|(n, scatter)| {
            let sum = costs.iter().map(|outline| outline[kind][n]).sum::<f64>();
            (sum, scatter)
        });
        sums.min_by(|a, b| a.0.total_cmp(&b.0)).map(|best| best.1)
    };
    match (of(0), of(1)) {
        // Places under which the marks scatter less are nearer to how the outlines run.
        (Some(plain), Some(rounded)) if !costs.is_empty() => {
            if plain.sigma < rounded.sigma {
                plain
            } else {
                rounded
            }
        }
        _ => Scatter { sigma: 0.5 * spacing, amplitude: 0.15 },
    }
}

fn scatters(spacing: f64) -> impl Iterator<Item = Scatter> {
    AMPLITUDES
        .iter()
        .flat_map(move |&amplitude| DEVIATIONS.map(|deviation| Scatter { sigma: deviation * spacing, amplitude }))
}

/// The marks of an outline with the places along it, of both kinds, that they are likelier with.
pub(crate) fn likelier(outline: &[[f64; 2]], scatter: Scatter) -> Prepared {
    let [plain, rounded] = [false, true].map(|is_rounded| Prepared::new(outline, is_rounded));
    if rounded.cost(scatter) <= plain.cost(scatter) { rounded } else { plain }
}

/// An outline's marks with what they are solved from.
pub(crate) struct Prepared {
    pub(crate) marked: Marked,
    /// Without noise, for an amplitude of 1.
    pub(crate) covariance: DMatrix<f64>,
    pub(crate) ellipse: DMatrix<f64>,
}

impl Prepared {
    fn new(outline: &[[f64; 2]], is_rounded: bool) -> Self {
        let marked = Marked::new(outline, is_rounded);
        let (covariance, ellipse) = (marked.covariance(), marked.ellipse());
        Self { marked, covariance, ellipse }
    }

    /// Minus twice the restricted log-likelihood.
    fn cost(&self, scatter: Scatter) -> f64 {
        let mut k = &self.covariance * (scatter.amplitude * scatter.amplitude);
        (0..k.nrows()).for_each(|n| k[(n, n)] += scatter.sigma * scatter.sigma);
        let Some(k) = Cholesky::new(k) else { return f64::INFINITY };
        let solved = k.solve(&self.ellipse);
        let Some(inner) = Cholesky::new(self.ellipse.transpose() * &solved) else { return f64::INFINITY };
        let values = &self.marked.values;
        let residual = values - &self.ellipse * inner.solve(&(solved.transpose() * values));
        let squares = residual.dot(&k.solve(&residual));
        let determinants = 2.0 * (log_determinant(k.l_dirty()) + log_determinant(inner.l_dirty()));
        2.0 * determinants + squares
    }
}

/// Half the log determinant of the matrix that a triangle is the root of.
fn log_determinant(root: &DMatrix<f64>) -> f64 {
    (0..root.nrows()).map(|n| libm::log(root[(n, n)])).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Circles and three-lobed curves with a known scatter.
    fn outlines(sigma: f64, marks: usize) -> Vec<Vec<[f64; 2]>> {
        let mut state = 12345u64;
        let mut normal = || {
            let mut uniform = || {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (state >> 11) as f64 / (1u64 << 53) as f64
            };
            let (a, b) = (uniform().max(1e-12), uniform());
            (-2.0 * a.ln()).sqrt() * (std::f64::consts::TAU * b).cos()
        };
        let mut outline = |radius: f64, lobes: f64| -> Vec<[f64; 2]> {
            let turn = |n: usize| n as f64 / marks as f64 * std::f64::consts::TAU;
            let at = |n: usize| (turn(n), radius * (1.0 + lobes * (3.0 * turn(n)).cos()));
            (0..marks)
                .map(|n| (at(n), [normal(), normal()]))
                .map(|((t, r), noise)| [r * t.cos() + sigma * noise[0], r * t.sin() + sigma * noise[1]])
                .collect()
        };
        (0..12).map(|n| outline(8.0 + f64::from(n), if n % 2 == 0 { 0.0 } else { 0.1 })).collect()
    }

    fn estimate(outlines: &[Vec<[f64; 2]>]) -> Scatter {
        likeliest(&telling(outlines).into_iter().map(|outline| costs(outline, 1.0)).collect::<Vec<_>>(), 1.0)
    }

    #[test]
    fn the_scatter_of_marks_is_found() {
        for (sigma, marks) in [(0.5, 12), (1.5, 12), (0.5, 24), (1.0, 40)] {
            let found = estimate(&outlines(sigma, marks)).sigma;
            assert!((0.6 * sigma..1.55 * sigma).contains(&found), "{sigma} {marks}: {found}");
        }
        assert!(estimate(&outlines(0.0, 16)).sigma < 0.25, "exact marks");
    }
}
