//! The shape that an object's outlines stand for: a function in space, negative inside, near to a signed distance.
//!
//! Three parts: radial basis functions through samples of the sections (`radial_basis.rs`), divided by the norm of their
//! gradient and read from a lattice; where there are more marks than samples, what is left to each section's own signed
//! distance, shared out linearly between neighbouring sections (Raya & Udupa 1990); and an end beyond the last sections,
//! at most half their distance away.

use super::lattice::Lattice;
use super::radial_basis::RadialBasis;
use super::samples::Samples;
use super::section::{Section, widest_gap};
use crate::grid::{Box3, Geometry};
use crate::kernel::vector::dot;

/// Points beside outlines lie at least so many smallest spacings away.
pub const LEAST_BESIDE: f64 = 0.75;
/// Values may be missed by as much as a function of 50 cubed smallest spacings would gain by it: outlines of neighbouring
/// slices smooth each other a little, which is less than marks scatter.
const SMOOTHING: f64 = 50.0;
/// For small objects as much of their own size.
const SMOOTHING_OF_SIZE: f64 = 0.05;
/// Samples at most: what solving for them takes grows with the third power.
const MOST_SAMPLES: usize = 900;
/// Points along an outline, at least and at most, where there is room.
const ALONG: [usize; 2] = [6, 20];
/// Gradient norms that a function is divided by.
const NORMS: [f64; 2] = [0.4, 2.5];

/// The function before it is laid out on a grid.
#[derive(Clone, Debug)]
pub struct Fitted {
    function: RadialBasis,
    ends: Option<Ends>,
}

/// Where an object of parallel sections ends along their normal.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Ends {
    normal: [f64; 3],
    low: f64,
    high: f64,
}

impl Fitted {
    /// Fits sections in order of their offsets, of one direction or several; points beside outlines lie `least` away at
    /// the least. None where the sections tell no shape.
    #[must_use]
    pub fn new(sections: &[&Section], least: f64) -> Option<Self> {
        let samples = sampled(sections, least);
        let radius = sections.iter().map(|section| section.radius()).sum::<f64>() / sections.len().max(1) as f64;
        let smoothing = (SMOOTHING * (least / LEAST_BESIDE).powi(3)).min(SMOOTHING_OF_SIZE * radius.powi(3));
        let Some(ends) = parallel_ends(sections) else {
            return Some(Self {
                function: RadialBasis::through(&samples.points, &samples.values, smoothing)?,
                ends: None,
            });
        };
        let function = closed(sections, samples, ends, smoothing)?;
        Some(Self { function, ends: Some(ends) })
    }

    /// The signed distance at a point, about, and its gradient's direction.
    #[must_use]
    pub fn distance(&self, point: [f64; 3]) -> (f64, [f64; 3]) {
        let (value, gradient) = self.function.value(point);
        let norm = dot(gradient, gradient).sqrt();
        let distance = value / norm.clamp(NORMS[0], NORMS[1]);
        let beyond = self.ends.map_or(f64::NEG_INFINITY, |ends| ends.beyond(point));
        let direction = gradient.map(|g| g / norm.max(f64::MIN_POSITIVE));
        (distance.max(beyond), direction)
    }

    /// How far the object may reach beyond its marks, along the normal of its sections.
    #[must_use]
    pub fn reach_beyond(&self, sections: &[&Section]) -> f64 {
        let (Some(ends), Some(first), Some(last)) = (self.ends, sections.first(), sections.last()) else { return 0.0 };
        (first.plane.offset - ends.low).max(ends.high - last.plane.offset)
    }
}

impl Ends {
    /// How far a point lies beyond the nearer end; negative between both.
    fn beyond(&self, point: [f64; 3]) -> f64 {
        let along = dot(self.normal, point);
        (self.low - along).max(along - self.high)
    }
}

fn sampled(sections: &[&Section], least: f64) -> Samples {
    let curves = |sections: &[&Section]| sections.iter().map(|s| s.curves.len()).sum::<usize>();
    // Of many sections every n-th and the last.
    let every = (3 * ALONG[0] * curves(sections)).div_ceil(MOST_SAMPLES).max(1);
    let last = sections.len().saturating_sub(1);
    let kept = sections.iter().enumerate().filter(|(n, _)| n % every == 0 || *n == last).map(|(_, s)| *s);
    let kept: Vec<&Section> = kept.collect();
    let count = (MOST_SAMPLES / (3 * curves(&kept)).max(1)).clamp(ALONG[0], ALONG[1]);
    let mut samples = Samples::default();
    for section in &kept {
        samples.add_section(section, count, least);
    }
    samples
}

/// Where sections of one direction end, at the latest: their widest distance beyond the first and last, where the next
/// one would have been marked; of a single one its radius.
fn parallel_ends(sections: &[&Section]) -> Option<Ends> {
    let (first, last) = (sections.first()?, sections.last()?);
    if !sections.iter().all(|section| section.plane.is_parallel_to(&first.plane)) {
        return None;
    }
    let gap = widest_gap(sections);
    let height = if gap > 0.0 { gap } else { first.radius() };
    Some(Ends { normal: first.plane.normal, low: first.plane.offset - height, high: last.plane.offset + height })
}

/// The function through the samples that is positive beyond both ends.
fn closed(sections: &[&Section], mut samples: Samples, ends: Ends, smoothing: f64) -> Option<RadialBasis> {
    let (first, last) = (sections.first()?, sections.last()?);
    let (below, above) = (ends.low - first.plane.offset, ends.high - last.plane.offset);
    // A single plane tells nothing of what is beside it.
    let open =
        (sections.len() > 1).then(|| RadialBasis::through(&samples.points, &samples.values, smoothing)).flatten();
    let before = samples.points.len();
    let is_open = |place: [f64; 3]| open.as_ref().is_none_or(|function| function.value(place).0 < 0.0);
    samples.add_end(first, below, is_open);
    samples.add_end(last, above, is_open);
    if samples.points.len() == before {
        return open;
    }
    RadialBasis::through(&samples.points, &samples.values, smoothing)
}

/// A shape on a grid.
#[derive(Clone, Debug)]
pub struct Shape<'a> {
    geometry: Geometry,
    lattice: Lattice,
    ends: Option<Ends>,
    /// Sections by direction, where the function does not pass through all marks.
    families: Vec<Vec<&'a Section>>,
}

/// What is left to a section's own distance counts up to so many smallest spacings.
const MOST_LEFT: f64 = 6.0;
/// A function that passes outlines within this part of the smallest spacing needs no correction.
const CLOSE: f64 = 0.2;

impl<'a> Shape<'a> {
    /// The fitted function, laid out on a lattice of a grid.
    #[must_use]
    pub fn new(fitted: &Fitted, geometry: Geometry, lattice: Lattice, sections: &[&'a Section]) -> Self {
        let mut shape = Self { geometry, lattice, ends: fitted.ends, families: Vec::new() };
        let spacing = shape.geometry.min_spacing();
        let off = |section: &Section| {
            let on = section.curves.iter().flat_map(|curve| curve.points.iter().step_by(3));
            on.map(|&p| shape.on_lattice(section.plane.lift(p, 0.0)).abs()).fold(0.0, f64::max)
        };
        if sections.iter().any(|section| off(section) > CLOSE * spacing) {
            shape.families = families(sections);
        }
        shape
    }

    fn on_lattice(&self, point: [f64; 3]) -> f64 {
        f64::from(self.lattice.at(self.geometry.to_voxels(point)))
    }

    /// True where no voxel of a box lies within `reach` of the surface, as far as its middle tells.
    #[must_use]
    pub fn is_beyond(&self, part: &Box3, reach: f64) -> bool {
        const STEEPEST: f64 = 1.5;
        let middle = std::array::from_fn(|a| 0.5 * (part.lo[a] + part.hi[a] - 1) as f64);
        let half = 0.5 * self.geometry.length(part.shape());
        let left = if self.families.is_empty() { 0.0 } else { MOST_LEFT * self.geometry.min_spacing() };
        f64::from(self.lattice.at(middle)).abs() > reach + left + STEEPEST * half
    }

    /// Fills a box of voxels, dense, with the signed distance.
    pub fn read(&self, part: &Box3, out: &mut [f32]) {
        self.lattice.read(part, out);
        if self.families.is_empty() && self.ends.is_none() {
            return;
        }
        let width = part.shape()[0] as usize;
        let limit = (2.0 * MOST_LEFT * self.geometry.min_spacing()) as f32;
        for ((y, z), row) in part.rows().zip(out.chunks_exact_mut(width)) {
            for (x, value) in (part.lo[0]..).zip(row) {
                let point = self.geometry.position([x, y, z]);
                if value.abs() < limit {
                    *value += self.left(point) as f32;
                }
                if let Some(ends) = self.ends {
                    *value = value.max(ends.beyond(point) as f32);
                }
            }
        }
    }

    /// What the sections add to the function at a point.
    fn left(&self, point: [f64; 3]) -> f64 {
        let least = (0.5 * self.geometry.min_spacing()).powi(2);
        let parts = self.families.iter().map(|family| {
            let (left, away) = self.left_of(family, point);
            (left, 1.0 / (away * away + least))
        });
        let (sum, weights) = parts.fold((0.0, 0.0), |(sum, all), (left, weight)| (sum + weight * left, all + weight));
        if weights > 0.0 { sum / weights } else { 0.0 }
    }

    /// The same of the sections of one direction, and how far the nearest of them is.
    fn left_of(&self, family: &[&Section], point: [f64; 3]) -> (f64, f64) {
        let along = dot(family[0].plane.normal, point);
        let above = family.partition_point(|section| section.plane.offset <= along);
        let at = |n: usize| (self.left_on(family[n], point), (family[n].plane.offset - along).abs());
        if above == 0 || above == family.len() {
            let (left, away) = at(above.saturating_sub(1));
            let fade = self.fade(family);
            return (left * (-(away / fade).powi(2)).exp(), away);
        }
        let ((low, below), (high, over)) = (at(above - 1), at(above));
        ((low * over + high * below) / (below + over), below.min(over))
    }

    /// The length over which what is left of an end section fades.
    fn fade(&self, family: &[&Section]) -> f64 {
        (0.5 * widest_gap(family)).max(self.geometry.min_spacing())
    }

    /// What is left of a section at the point of its plane below a point.
    fn left_on(&self, section: &Section, point: [f64; 3]) -> f64 {
        let there = section.plane.project(point);
        let most = MOST_LEFT * self.geometry.min_spacing();
        (section.distance(there) - self.on_lattice(section.plane.lift(there, 0.0))).clamp(-most, most)
    }
}

/// Sections by direction, each in order of their offsets.
fn families<'a>(sections: &[&'a Section]) -> Vec<Vec<&'a Section>> {
    let mut families: Vec<Vec<&Section>> = Vec::new();
    for &section in sections {
        match families.iter_mut().find(|family| family[0].plane.is_parallel_to(&section.plane)) {
            Some(family) => family.push(section),
            None => families.push(vec![section]),
        }
    }
    for family in &mut families {
        family.sort_by(|a, b| a.plane.offset.total_cmp(&b.plane.offset));
    }
    families
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::outline::curve::Curve;
    use crate::kernel::outline::plane::Plane;

    /// A section of a ball of radius 10 around the origin, at a height.
    fn section(height: f64, radius: f64) -> Section {
        let circle = |n: u32| {
            let t = f64::from(n) / 48.0 * std::f64::consts::TAU;
            [radius * t.cos(), radius * t.sin(), height]
        };
        let marks: Vec<[f64; 3]> = (0..48).map(circle).collect();
        let plane = Plane::of(&marks, [0.5; 3]).unwrap();
        let points = marks.iter().map(|&p| plane.project(p)).collect();
        Section::new(plane, vec![Curve { points, deviation: 0.1 }], marks)
    }

    #[test]
    fn a_few_sections_of_a_ball_make_the_ball() {
        let heights = [-7.0, 0.0, 7.0];
        let sections: Vec<Section> = heights.iter().map(|&h: &f64| section(h, (100.0 - h * h).sqrt())).collect();
        let fitted = Fitted::new(&sections.iter().collect::<Vec<_>>(), 0.75).unwrap();
        for n in 0..200 {
            let (t, z) = (f64::from(n) * 2.4, f64::from(n) / 100.0 - 0.995);
            let across = (1.0f64 - z * z).sqrt();
            let on_ball = [10.0 * across * t.cos(), 10.0 * across * t.sin(), 10.0 * z];
            let off = fitted.distance(on_ball).0;
            assert!(off.abs() < if z.abs() < 0.7 { 0.5 } else { 2.0 }, "{on_ball:?}: {off}");
        }
        assert!(fitted.distance([0.0; 3]).0 < -5.0 && fitted.distance([0.0, 0.0, 14.1]).0 > 0.0);
    }

    #[test]
    fn a_single_section_however_small_is_a_body() {
        for radius in [1.5, 2.5, 12.0, 300.0] {
            let alone = section(4.0, radius);
            let fitted = Fitted::new(&[&alone], 0.75).unwrap();
            assert!(
                fitted.distance([0.0, 0.0, 4.0]).0 < -0.3 * radius,
                "{radius}: {:?}",
                fitted.distance([0.0, 0.0, 4.0])
            );
            assert!(fitted.distance([0.0, 0.0, 4.0 + 1.05 * radius]).0 > 0.0);
            assert!(fitted.distance([0.98 * radius, 0.0, 4.0]).0.abs() < 0.2 * radius);
        }
    }
}
