//! What a point's neighbours say of its noise, and where the surface is that it was meant to lie on: moving least squares
//! (Levin, "The approximation power of moving least-squares", 1998; Alexa et al., "Computing and rendering point set
//! surfaces", 2003) with weights that leave out what lies beyond the noise, such as the other side of a thin part (docs/algorithms.md,
//! "Noise of the points").

use glam::DVec3;

use super::height_field::{COEFFICIENTS, HeightField, plane_normal};

/// Fits that follow each other; each begins with what the one before has found.
const FITS: usize = 3;
/// The weight of a neighbour falls to 1/e^2 at the distance of the farthest one.
const FALL: f64 = 2.0;
/// Neighbours so many deviations off the fitted surface hardly count; before there is one, so many off the point along its normal: both
/// sides of a thin part would count alike.
const FAR_DEVIATIONS: f64 = 2.0;
const FIRST_DEVIATIONS: f64 = 3.0;
/// A point is moved so many deviations at most; what is farther off is no noise.
const MOST_DEVIATIONS: f64 = 6.0;

/// What a fit to the points around a place leaves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scatter {
    /// Root mean square, of what the fit has left free.
    pub deviation: f64,
    /// The mean fourth power over the square of the mean square: the less, the more all points are as far off, as those of the two sides of
    /// a thin part are.
    pub kurtosis: f64,
}

/// How `neighbours` of a place scatter around a surface that is fitted to them. None where they tell no surface.
#[must_use]
pub fn scatter(neighbours: &[DVec3]) -> Option<Scatter> {
    let (place, radius) = (*neighbours.first()?, radius_of(neighbours)?);
    let free = neighbours.len().checked_sub(COEFFICIENTS).filter(|&free| free > 0)?;
    let weights = vec![1.0; neighbours.len()];
    let normal = plane_normal(neighbours, &weights);
    let first = HeightField::fitted(neighbours, &weights, (place, normal), radius)?;
    let second = HeightField::fitted(neighbours, &weights, (place, first.normal), radius)?;
    let sum: f64 = second.residuals.iter().map(|r| r * r).sum();
    let fourth: f64 = second.residuals.iter().map(|r| r.powi(4)).sum();
    let kurtosis = if sum > 0.0 { fourth * neighbours.len() as f64 / (sum * sum) } else { f64::INFINITY };
    Some(Scatter { deviation: (sum / free as f64).sqrt(), kurtosis })
}

/// Where the surface is that the first of `neighbours`, the nearest first, lies beside, for points that scatter by `sigma` around
/// it. None where they tell no surface, or the point is too far from it to be its noise.
#[must_use]
pub fn smoothed(neighbours: &[DVec3], sigma: f64) -> Option<DVec3> {
    let (from, radius) = (*neighbours.first()?, radius_of(neighbours)?);
    let near = |squared: f64| libm::exp(-FALL * squared / (radius * radius));
    let mut weights: Vec<f64> = neighbours.iter().map(|p| near(p.distance_squared(from))).collect();
    let mut normal = plane_normal(neighbours, &weights);
    for (weight, point) in weights.iter_mut().zip(neighbours) {
        let off = (*point - from).dot(normal) / (FIRST_DEVIATIONS * sigma);
        *weight *= libm::exp(-0.5 * off * off);
    }
    let mut at = from;
    for _ in 0..FITS {
        let fitted = HeightField::fitted(neighbours, &weights, (at, normal), radius)?;
        at += normal * fitted.height.clamp(-radius, radius);
        normal = fitted.normal;
        for ((weight, point), residual) in weights.iter_mut().zip(neighbours).zip(&fitted.residuals) {
            let away = *point - at;
            let along = away.length_squared() - away.dot(normal).powi(2);
            let off = residual / (FAR_DEVIATIONS * sigma);
            *weight = near(along) * libm::exp(-0.5 * off * off);
        }
    }
    let is_noise = at.distance(from) <= MOST_DEVIATIONS * sigma;
    is_noise.then_some(at)
}

/// The distance of the farthest, the last, from the first; none where all are at one place.
fn radius_of(neighbours: &[DVec3]) -> Option<f64> {
    let radius = neighbours.last()?.distance(*neighbours.first()?);
    (radius > 0.0).then_some(radius)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers that are distributed as noise is, about: sums of twelve even ones.
    fn noise(seed: &mut u64) -> f64 {
        let mut sum = -6.0;
        for _ in 0..12 {
            *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            sum += (*seed >> 11) as f64 / (1u64 << 53) as f64;
        }
        sum
    }

    /// A patch of a sphere of that radius around (0, 0, 0), its points scattered; the one in the middle is the first.
    fn patch(radius: f64, sigma: f64, seed: &mut u64) -> Vec<DVec3> {
        let place = |n: i32| {
            let (a, b) = (f64::from(n % 11 - 5), f64::from(n / 11 - 5));
            DVec3::new(a, b, (radius * radius - a * a - b * b).sqrt())
        };
        let mut points: Vec<DVec3> = (0..121).map(|n| place(n) + DVec3::Z * (sigma * noise(seed))).collect();
        let middle = place(60);
        points.sort_by(|p, q| {
            let along = |p: &DVec3| (*p - middle).truncate().length();
            along(p).total_cmp(&along(q))
        });
        points
    }

    #[test]
    fn the_deviation_is_that_of_the_noise() {
        let mut seed = 3;
        for sigma in [0.0, 0.1, 0.4] {
            let found: f64 =
                (0..40).filter_map(|_| scatter(&patch(30.0, sigma, &mut seed)[..25])).map(|s| s.deviation).sum::<f64>()
                    / 40.0;
            assert!((found - sigma).abs() < 0.05 * sigma + 0.01, "{sigma}: {found}");
        }
    }

    /// Two sheets, nearer to each other than their points are, are told from noise of the same size.
    #[test]
    fn two_sheets_are_no_noise() {
        let mut seed = 4;
        let mut median = |of: fn(f64) -> f64| {
            let one = |_| {
                let mut points = patch(1e4, 0.0, &mut seed);
                points.truncate(14);
                let heights: Vec<f64> = points.iter().map(|_| 0.2 * of(noise(&mut seed))).collect();
                points.iter_mut().zip(heights).for_each(|(point, height)| point.z += height);
                scatter(&points).unwrap().kurtosis
            };
            let mut found: Vec<f64> = (0..600).map(one).collect();
            found.sort_by(f64::total_cmp);
            found[300]
        };
        let (sheets, normal) = (median(f64::signum), median(|height| height));
        assert!(sheets < 2.2 && normal > 2.4, "{sheets} {normal}");
    }

    #[test]
    fn points_come_to_the_surface() {
        let mut seed = 8;
        let off = |sigma: f64, seed: &mut u64| {
            let off = |_| {
                let points = patch(30.0, sigma, seed);
                (smoothed(&points, sigma).unwrap().length() - 30.0).abs()
            };
            (0..60).map(off).sum::<f64>() / 60.0
        };
        assert!(off(0.5, &mut seed) < 0.15);
        assert!(off(0.1, &mut seed) < 0.04);
    }

    /// The other side of a part as thin as six deviations pulls nothing away from this one.
    #[test]
    fn two_sheets_stay_apart() {
        let mut seed = 5;
        let mut off = Vec::new();
        for _ in 0..60 {
            let here = patch(1e4, 0.3, &mut seed);
            let there = patch(1e4, 0.3, &mut seed).into_iter().map(|p| p - DVec3::Z * 1.8);
            let first = here[0];
            let mut both: Vec<DVec3> = here.into_iter().chain(there).collect();
            both.sort_by(|p, q| p.distance_squared(first).total_cmp(&q.distance_squared(first)));
            off.extend(smoothed(&both, 0.3).map(|at| at.z - 1e4));
        }
        let mean = off.iter().sum::<f64>() / off.len() as f64;
        assert!(off.len() > 50 && mean.abs() < 0.2, "{} {mean}", off.len());
    }
}
