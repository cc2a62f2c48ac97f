//! The noise of a cloud: how far its points scatter around the surface that they were measured on, and the cloud without it
//! (docs/algorithms.md, "Noise of the points").
//!
//! Curvature, edges and thin parts leave residuals too, but not everywhere, and noise does: so it is told from the places
//! where least is left.

use std::f64::consts::PI;

use glam::DVec3;
use rstar::RTree;

use super::estimate::spacing_memory;
use crate::error::Result;
use crate::exec::{Engine, Stage, Workers};
use crate::kernel::points::smoothing::{scatter, smoothed};

/// Of so many points spread over the cloud's order the noise is told.
const SAMPLE: usize = 2000;
/// From so many neighbours of each: few, so that they lie on one smooth piece.
const NEIGHBOURS: usize = 14;
/// At this part of the places less is left. Of noise alone it is this part of the deviation: the root of the chi-squared
/// distribution's quantile, with eight degrees of freedom, over these.
const LEAST_LEFT: f64 = 0.1;
const OF_DEVIATION: f64 = 0.6606;
/// Where half of the places have a smaller kurtosis than this it is no noise but the sides of a thin part. Of normal noise half of them
/// have less than 2.5, of even noise less than 2.3, of two sheets less than 1.7 to 2.2.
const LEAST_KURTOSIS: f64 = 2.25;
/// Fewer points do not tell what is noise and what is shape.
const FEWEST: usize = 500;
/// Noise below this part of the points' distances is left as it is: the surface's own curvature is as much.
const LEAST_NOISE: f64 = 0.08;
/// A fit is made of so many points that its height is known to this part of the points' distances: four deviations squared over the
/// number, about.
const WANTED: f64 = 0.065;
const FEWEST_FITTED: usize = 24;
const MOST_FITTED: usize = 120;
/// Points that one thread takes at a time.
const AT_ONCE: usize = 512;

/// What is known of a cloud's noise.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Noise {
    /// The standard deviation of the points from their surface, a length; none where the points do not tell it.
    pub deviation: Option<f64>,
    /// How many points were moved onto the surface around them.
    pub moved: u64,
}

/// The points in a tree, and how far they are apart along the surface.
struct Known<'a> {
    points: &'a [[f64; 3]],
    tree: RTree<[f64; 3]>,
}

/// Tells the noise of a cloud, or takes it as it was given; moves the points onto the surface where it is more than their
/// distances hide.
///
/// # Errors
/// When the memory is too little, or the run is interrupted.
pub(super) fn without_noise(
    engine: &Engine,
    points: &[[f64; 3]],
    given: Option<f64>,
) -> Result<(Option<Vec<[f64; 3]>>, Noise)> {
    if given == Some(0.0) || (given.is_none() && points.len() < FEWEST) {
        return Ok((None, Noise { deviation: given, moved: 0 }));
    }
    let _held = engine.hold(spacing_memory(points.len()))?;
    let stage = engine.stage("noise", points.len() as u64);
    let known = Known { points, tree: RTree::bulk_load(points.to_vec()) };
    let Sampled { least, apart } = known.sampled(&stage)?;
    let deviation = given.or(least);
    let strong = deviation.filter(|&sigma| given.is_some() || sigma > LEAST_NOISE * apart);
    let found = strong.map(|sigma| known.smoothed(&stage, sigma, apart)).transpose()?;
    stage.finish();
    let (cloud, moved) = found.unzip();
    Ok((cloud, Noise { deviation, moved: moved.unwrap_or(0) }))
}

/// What a sample of the points tells.
struct Sampled {
    /// The deviation where least is left.
    least: Option<f64>,
    /// The edge of the square that a point has of the surface.
    apart: f64,
}

impl Known<'_> {
    /// The nearest points to one, that one first.
    fn near(&self, point: &[f64; 3], number: usize, found: &mut Vec<DVec3>) {
        found.clear();
        found.extend(self.tree.nearest_neighbor_iter(*point).take(number).map(|&p| DVec3::from(p)));
    }

    fn sampled(&self, stage: &Stage<'_>) -> Result<Sampled> {
        let sample: Vec<&[f64; 3]> = self.points.iter().step_by(self.points.len().div_ceil(SAMPLE)).collect();
        let parts: Vec<&[&[f64; 3]]> = sample.chunks(AT_ONCE).collect();
        let found = stage.run(&parts, &Workers::new(Vec::new), |near, part| {
            let told = |point: &&[f64; 3]| {
                self.near(point, NEIGHBOURS, near);
                let radius = near.last().map_or(0.0, |last| last.distance(near[0]));
                (scatter(near), radius)
            };
            Ok(part.iter().map(told).collect::<Vec<_>>())
        })?;
        let (scatters, radii): (Vec<_>, Vec<_>) = found.into_iter().flatten().unzip();
        let scatters = || scatters.iter().flatten();
        let is_noise = quantile(scatters().map(|scatter| scatter.kurtosis).collect(), 0.5) >= Some(LEAST_KURTOSIS);
        let least = quantile(scatters().map(|scatter| scatter.deviation).collect(), LEAST_LEFT);
        let least = least.filter(|_| is_noise).map(|left| left / OF_DEVIATION);
        let radius = quantile(radii, 0.5).unwrap_or(0.0);
        Ok(Sampled { least, apart: radius * (PI / NEIGHBOURS as f64).sqrt() })
    }

    /// The points on the surface around them, and how many that has moved.
    fn smoothed(&self, stage: &Stage<'_>, sigma: f64, apart: f64) -> Result<(Vec<[f64; 3]>, u64)> {
        let number = (4.0 * (sigma / (WANTED * apart)).powi(2)).min(MOST_FITTED as f64) as usize;
        let number = number.max(FEWEST_FITTED);
        let parts: Vec<&[[f64; 3]]> = self.points.chunks(AT_ONCE).collect();
        let found = stage.run(&parts, &Workers::new(Vec::new), |near, part| {
            let place = |point: &[f64; 3]| {
                self.near(point, number, near);
                smoothed(near, sigma)
            };
            Ok(part.iter().map(place).collect::<Vec<_>>())
        })?;
        let found = || found.iter().flatten();
        let cloud =
            self.points.iter().zip(found()).map(|(point, place)| place.map_or(*point, |place| place.to_array()));
        Ok((cloud.collect(), found().flatten().count() as u64))
    }
}

/// The value that a part of all lie below; none of none.
fn quantile(mut values: Vec<f64>, part: f64) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get((part * values.len() as f64) as usize).copied()
}
