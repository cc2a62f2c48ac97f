//! The shape that an object's outlines stand for: a function in space, negative inside, near to a signed distance.
//!
//! Radial basis functions through samples of the sections (`radial_basis.rs`), of a few neighbouring sections at a time
//! where there are many (`windows.rs`), divided by the norm of their gradient; and an end beyond the last sections
//! (`ends.rs`).

use glam::DVec3;

use super::ends::Ends;
use super::radial_basis::RadialBasis;
use super::samples::Samples;
use super::windows::{Window, windows};
use crate::kernel::outline::planar::section::Section;

/// Points beside outlines lie at least so many smallest spacings away.
pub const LEAST_BESIDE: f64 = 0.75;
/// Values may be missed by as much as a function of 50 cubed smallest spacings would gain by it: outlines of neighbouring
/// slices smooth each other a little, which is less than marks scatter.
const SMOOTHING: f64 = 50.0;
/// For small objects as much of their own size.
const SMOOTHING_OF_SIZE: f64 = 0.05;
/// Samples of a function at most: what solving for them takes grows with the third power.
pub const MOST_SAMPLES: usize = 340;
/// Points along an outline, at least and at most, where there is room.
const ALONG: [usize; 2] = [6, 16];
/// Sections nearer to each other than this part of their radius need not all be fitted: what is left to those between is
/// their own.
const APART: f64 = 0.25;
/// Gradient norms that a function is divided by.
const NORMS: [f64; 2] = [0.4, 2.5];

/// The function.
#[derive(Clone, Debug)]
pub struct Fitted {
    parts: Vec<(Window, RadialBasis)>,
    ends: Option<Ends>,
}

/// Sections that are to be fitted, window by window, in any order.
#[derive(Clone, Debug)]
pub struct Fit<'a> {
    sections: Vec<&'a Section>,
    ends: Option<Ends>,
    windows: Vec<Window>,
    most: usize,
    least: f64,
    smoothing: f64,
}

impl<'a> Fit<'a> {
    /// Of sections in order of their offsets, of one direction or several; points beside outlines lie `least` away at
    /// the least, and a function goes through `most` samples about.
    #[must_use]
    pub fn new(sections: &[&'a Section], most: usize, least: f64) -> Self {
        let radius = sections.iter().map(|section| section.radius()).sum::<f64>() / sections.len().max(1) as f64;
        let smoothing = (SMOOTHING * (least / LEAST_BESIDE).powi(3)).min(SMOOTHING_OF_SIZE * radius.powi(3));
        let ends = Ends::of(sections);
        let sections = if ends.is_some() { thinned(sections, APART * radius) } else { sections.to_vec() };
        let windows = split(&sections, ends, most);
        Self { sections, ends, windows, most, least, smoothing }
    }

    /// The windows.
    #[must_use]
    pub fn windows(&self) -> &[Window] {
        &self.windows
    }

    /// The function of a window; none where its sections tell no shape.
    #[must_use]
    pub fn solve(&self, window: &Window) -> Option<RadialBasis> {
        let [low, high] = self.ends.map_or([None; 2], |ends| ends.round());
        let at = [window.sections.start == 0, window.sections.end == self.sections.len()];
        let ends = [low.filter(|_| at[0]), high.filter(|_| at[1])];
        self.through(&self.sections[window.sections.clone()], ends)
    }

    /// The function through the samples of sections that is positive so far beyond the first and last of them, where they
    /// have round ends.
    fn through(&self, sections: &[&Section], [low, high]: [Option<f64>; 2]) -> Option<RadialBasis> {
        let mut samples = sampled(sections, self.most, self.least);
        let through = |samples: &Samples| RadialBasis::through(&samples.points, &samples.values, self.smoothing);
        if low.or(high).is_some() {
            // Fewer samples tell whether the shape would go on; a single plane tells nothing of what is beside it.
            let open = (sections.len() > 1).then(|| through(&sampled(sections, self.most / 3, self.least))).flatten();
            let is_open = |place: [f64; 3]| open.as_ref().is_none_or(|function| function.value(place).0 < 0.0);
            if let (Some(height), Some(first)) = (low, sections.first()) {
                samples.add_end(first, -height, is_open);
            }
            if let (Some(height), Some(last)) = (high, sections.last()) {
                samples.add_end(last, height, is_open);
            }
        }
        through(&samples)
    }

    /// Takes the functions of all windows, in order; none where any is none.
    #[must_use]
    pub fn join(self, functions: Vec<Option<RadialBasis>>) -> Option<Fitted> {
        let parts = self.windows.into_iter().zip(functions).map(|(window, function)| Some((window, function?)));
        Some(Fitted { parts: parts.collect::<Option<_>>()?, ends: self.ends })
    }
}

impl Fitted {
    /// Fits sections at once.
    #[must_use]
    pub fn new(sections: &[&Section], most: usize, least: f64) -> Option<Self> {
        let fit = Fit::new(sections, most, least);
        let functions = fit.windows().iter().map(|window| fit.solve(window)).collect();
        fit.join(functions)
    }

    /// Where the object ends; none where its sections have several directions.
    #[must_use]
    pub fn ends(&self) -> Option<Ends> {
        self.ends
    }

    /// The signed distance at a point, about, and its gradient's direction.
    #[must_use]
    pub fn distance(&self, point: [f64; 3]) -> (f64, [f64; 3]) {
        let (value, gradient) = self.value(point);
        let norm = gradient.length();
        let distance = value / norm.clamp(NORMS[0], NORMS[1]);
        let beyond = self.ends.map_or(f64::NEG_INFINITY, |ends| ends.beyond(point));
        (distance.max(beyond), (gradient / norm.max(f64::MIN_POSITIVE)).into())
    }

    fn value(&self, point: [f64; 3]) -> (f64, DVec3) {
        let offset = self.ends.map_or(0.0, |ends| ends.offset(point));
        let weighted = self.parts.iter().map(|(window, function)| (window.weight(offset), function));
        let mut sum = (0.0, DVec3::ZERO);
        for (weight, function) in weighted.filter(|(weight, _)| *weight > 0.0) {
            let (value, gradient) = function.value(point);
            sum = (sum.0 + weight * value, sum.1 + weight * DVec3::from(gradient));
        }
        sum
    }
}

/// The first and last of sections, and those between that are no nearer to each other than `apart`.
fn thinned<'a>(sections: &[&'a Section], apart: f64) -> Vec<&'a Section> {
    let mut kept: Vec<&Section> = Vec::new();
    for (n, section) in sections.iter().enumerate() {
        let away = kept.last().map_or(f64::INFINITY, |before| section.plane.offset - before.plane.offset);
        if away >= apart || n + 1 == sections.len() {
            kept.push(section);
        }
    }
    kept
}

fn curves(sections: &[&Section]) -> usize {
    sections.iter().map(|section| section.curves.len()).sum()
}

/// Windows of as many sections as a function has room for; one where sections have several directions.
fn split(sections: &[&Section], ends: Option<Ends>, most: usize) -> Vec<Window> {
    let offsets: Vec<f64> = sections.iter().map(|section| section.plane.offset).collect();
    let each = 3 * ALONG[1] * curves(sections).div_ceil(sections.len().max(1));
    windows(&offsets, if ends.is_some() { most / each } else { usize::MAX })
}

/// About `most` samples of sections.
fn sampled(sections: &[&Section], most: usize, least: f64) -> Samples {
    // Of many sections every n-th and the last.
    let every = (3 * ALONG[0] * curves(sections)).div_ceil(most).max(1);
    let last = sections.len().saturating_sub(1);
    let kept = sections.iter().enumerate().filter(|(n, _)| n % every == 0 || *n == last).map(|(_, s)| *s);
    let kept: Vec<&Section> = kept.collect();
    let count = (most / (3 * curves(&kept)).max(1)).clamp(ALONG[0], ALONG[1]);
    let mut samples = Samples::default();
    for section in &kept {
        samples.add_section(section, count, least);
    }
    samples
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::outline::planar::curve::Curve;
    use crate::kernel::outline::planar::plane::Plane;

    /// A section of a ball of radius 10 around the origin, at a height.
    fn section(height: f64, radius: f64) -> Section {
        let circle = |n: u32| {
            let t = f64::from(n) / 48.0 * std::f64::consts::TAU;
            [radius * t.cos(), radius * t.sin(), height]
        };
        let marks: Vec<[f64; 3]> = (0..48).map(circle).collect();
        let plane = Plane::of(&marks, [0.5; 3]).unwrap();
        let points = marks.iter().map(|&p| plane.project(p)).collect();
        Section::new(plane, vec![Curve { points, deviation: 0.1 }], marks, 1e-3)
    }

    #[test]
    fn a_few_sections_of_a_ball_make_the_ball() {
        let heights = [-7.0, 0.0, 7.0];
        let sections: Vec<Section> = heights.iter().map(|&h: &f64| section(h, (100.0 - h * h).sqrt())).collect();
        let fitted = Fitted::new(&sections.iter().collect::<Vec<_>>(), MOST_SAMPLES, 0.75).unwrap();
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
            let fitted = Fitted::new(&[&alone], MOST_SAMPLES, 0.75).unwrap();
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
