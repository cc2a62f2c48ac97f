//! How wide gaps between neighbours are: the width that `--fill-gaps auto` fills up to.
//!
//! From every voxel at the surface of an object the nearest other object is looked for; most of what faces a neighbour
//! across a wall finds it one wall away, however the cells are placed. Three times the median of these widths takes
//! in the walls where objects fell short, and the hollows where three or four walls meet: a ball between three cells at
//! 120 degrees is 1.15 walls wide, between four 1.22, and more by what the solution rounds off their edges. Where most
//! touch already, two voxels: more would join what the tissue's outer surface keeps apart.

use super::fields::{Roots, near_two};
use super::survey::Survey;
use crate::error::Result;
use crate::exec::{Stage, Workers, one_wave};
use crate::grid::Geometry;
use crate::kernel::image::morphology::gaps::{BINS, Gaps};

/// Gaps wider than so many smallest spacings, or so many largest ones, are not looked for, nor filled.
const REACH: [f64; 2] = [12.0, 6.0];
/// The part of all widths that are not larger than the one that is taken, and how many times that is filled.
const QUANTILE: f64 = 0.5;
const TIMES: f64 = 3.0;
/// So many largest spacings at least.
const LEAST: f64 = 2.0;

/// As far as other objects are looked for.
fn reach(geometry: &Geometry) -> f64 {
    (REACH[0] * geometry.min_spacing()).max(REACH[1] * geometry.max_spacing())
}

/// The largest width that can be found.
pub(super) fn widest(geometry: &Geometry) -> f64 {
    reach(geometry)
}

/// The width to fill up to; 0 where no two objects face each other.
pub(super) fn width(
    stage: &Stage<'_>,
    geometry: &Geometry,
    survey: &Survey,
    roots: &Roots<'_>,
    labels: &[u32],
) -> Result<f64> {
    let least = geometry.min_spacing();
    let (reach, spacing) = (reach(geometry), geometry.spacing);
    let make = move || (Gaps::new(spacing, reach, 0.0), Vec::new());
    let halo = Gaps::new(spacing, reach, 0.0).across();
    let set = near_two(survey, roots, labels, halo);
    let found = stage.run(&one_wave(&set), &Workers::new(make), |(gaps, labels), &slot| {
        let part = survey.grid.brick_box(set.id(slot));
        let around = roots.around(&part, halo, labels)?;
        Ok(gaps.widths(labels, &around, &part))
    })?;
    let mut bins: Vec<u64> = Vec::new();
    for counts in found {
        bins.resize(bins.len().max(counts.len()), 0);
        bins.iter_mut().zip(counts).for_each(|(sum, n)| *sum += n);
    }
    if bins.is_empty() {
        return Ok(0.0);
    }
    let width = TIMES * quantile(&bins, QUANTILE) as f64 / BINS * least;
    Ok(width.max(LEAST * geometry.max_spacing()).min(widest(geometry)))
}

/// The lowest bin up to which lie so many parts of all that was counted.
fn quantile(bins: &[u64], part: f64) -> usize {
    let wanted = part * bins.iter().sum::<u64>() as f64;
    let mut sum = 0;
    let reached = |n: &u64| {
        sum += n;
        sum as f64 >= wanted
    };
    bins.iter().position(reached).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_of_counts() {
        assert_eq!(quantile(&[0, 4, 0, 3, 1], 0.5), 1);
        assert_eq!(quantile(&[0, 4, 0, 3, 1], 0.75), 3);
        assert_eq!((quantile(&[], 0.75), quantile(&[0, 0, 2], 0.75)), (0, 2));
    }
}
