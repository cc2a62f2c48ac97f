//! Grey values along the normals of an outline: what the image shows where a border was marked.
use serde::{Deserialize, Serialize};

use crate::grid::Box3;

/// Samples on either side of the border.
pub const REACH: usize = 12;
/// Samples of a profile.
pub const LEN: usize = 2 * REACH + 1;
/// Distance between samples, in smallest spacings.
pub const STEP: f64 = 0.5;

/// Grey values from the inside to the outside; the border is in the middle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Profile(pub [f32; LEN]);

/// Places of a profile that count as inside and as outside: 3 to 6 spacings from the border.
const FLANK: std::ops::RangeInclusive<usize> = 6..=REACH;

impl Profile {
    /// The value on the border.
    #[must_use]
    pub fn here(&self) -> f64 {
        f64::from(self.0[REACH])
    }

    /// The mean on the inside.
    #[must_use]
    pub fn inside(&self) -> f64 {
        mean(FLANK.map(|n| self.0[REACH - n]))
    }

    /// The mean on the outside.
    #[must_use]
    pub fn outside(&self) -> f64 {
        mean(FLANK.map(|n| self.0[REACH + n]))
    }

    /// The value at a place in smallest spacings outside of the border.
    #[must_use]
    pub fn at(&self, place: f64) -> f64 {
        let n = (place / STEP + REACH as f64).clamp(0.0, (LEN - 1) as f64);
        let low = (n.floor() as usize).min(LEN - 2);
        let (a, b) = (f64::from(self.0[low]), f64::from(self.0[low + 1]));
        a + (n - low as f64) * (b - a)
    }

    /// How much the value falls from the inside to the outside there, per smallest spacing.
    #[must_use]
    pub fn fall(&self, place: f64) -> f64 {
        const BY: f64 = 1.0;
        (self.at(place - BY) - self.at(place + BY)) / (2.0 * BY)
    }

    /// Where the profile is highest (`sign` 1) or lowest (-1), in smallest spacings from the border.
    #[must_use]
    pub fn crest(&self, sign: f32) -> f64 {
        let value = |n: usize| sign * self.0[n];
        let nearest = |n: &usize| std::cmp::Reverse(n.abs_diff(REACH));
        let top = (0..LEN).max_by(|a, b| value(*a).total_cmp(&value(*b)).then(nearest(a).cmp(&nearest(b))));
        let top = top.unwrap_or(REACH);
        let place = top as f64 - REACH as f64;
        if top == 0 || top == LEN - 1 {
            return place * STEP;
        }
        let (before, here, after) = (value(top - 1), value(top), value(top + 1));
        let bend = f64::from(before - 2.0 * here + after);
        let shift = if bend < 0.0 { 0.5 * f64::from(before - after) / bend } else { 0.0 };
        (place + shift.clamp(-0.5, 0.5)) * STEP
    }
}

fn mean(values: impl Iterator<Item = f32>) -> f64 {
    let (sum, count) = values.fold((0.0, 0), |(sum, count), v| (sum + f64::from(v), count + 1));
    sum / f64::from(count)
}

/// The value of a dense box of voxels at a place in voxels between its centres, by linear interpolation; outside of the
/// box that of its border.
#[must_use]
pub fn interpolate(values: &[f32], part: &Box3, place: [f64; 3]) -> f32 {
    let last = part.shape().map(|n| (n - 1) as f64);
    let local: [f64; 3] = std::array::from_fn(|a| (place[a] - part.lo[a] as f64).clamp(0.0, last[a]));
    let low = local.map(f64::floor);
    let share: [f64; 3] = std::array::from_fn(|a| local[a] - low[a]);
    let at = |by: [i64; 3]| {
        let voxel = std::array::from_fn(|a| part.lo[a] + (low[a] as i64 + by[a]).min(part.shape()[a] - 1));
        f64::from(values[part.offset_of(voxel)])
    };
    let along = |y: i64, z: i64| at([0, y, z]) + share[0] * (at([1, y, z]) - at([0, y, z]));
    let across = |z: i64| along(0, z) + share[1] * (along(1, z) - along(0, z));
    (across(0) + share[2] * (across(1) - across(0))) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_and_a_wall_are_read() {
        let at = |n: usize| (n as f64 - REACH as f64) * STEP;
        let step = Profile(std::array::from_fn(|n| {
            if at(n) < 0.0 {
                1.0
            } else if at(n) > 0.0 {
                0.0
            } else {
                0.5
            }
        }));
        assert_eq!((step.inside(), step.outside(), step.here()), (1.0, 0.0, 0.5));
        assert_eq!(step.fall(0.0), 0.5);
        let wall = Profile(std::array::from_fn(|n| (-(at(n) - 1.3).powi(2)).exp() as f32));
        assert!((wall.crest(1.0) - 1.3).abs() < 0.05, "{}", wall.crest(1.0));
        let gap = Profile(wall.0.map(|v| -v));
        assert!((gap.crest(-1.0) - 1.3).abs() < 0.05);
    }

    #[test]
    fn linear_values_are_interpolated_exactly() {
        let part = Box3::new([1, 2, 3], [4, 5, 6]);
        let of = |p: [f64; 3]| 2.0 * p[0] - p[1] + 0.5 * p[2];
        let voxels = part.rows().flat_map(|(y, z)| (1..4).map(move |x| [x, y, z].map(|v| v as f64)));
        let values: Vec<f32> = voxels.map(|p| of(p) as f32).collect();
        for place in [[1.0, 2.0, 3.0], [2.25, 3.5, 4.75], [3.0, 4.0, 5.0]] {
            assert!((f64::from(interpolate(&values, &part, place)) - of(place)).abs() < 1e-6);
        }
        assert_eq!(interpolate(&values, &part, [-9.0, 3.0, 4.0]), interpolate(&values, &part, [1.0, 3.0, 4.0]));
    }
}
