//! One object that was marked twice, by two people in two files: what two objects have in common of what both fill.

use std::cell::OnceCell;

use crate::grid::Geometry;
use crate::kernel::outline::planar::curve::Curve;
use crate::kernel::outline::planar::section::Section;
use crate::kernel::outline::spatial::fitted::{Fitted, LEAST_BESIDE};
use crate::pipeline::marks::ObjectMarks;
use crate::pipeline::segment::outlined::outlines::{Drawn, drawn_by_plane};

/// Objects whose boxes share less than this are not compared by their shapes: outlines of other slices of one object have
/// boxes that share a half or more.
const COMPARED: f64 = 0.25;
/// Two objects that share so much of what both fill are likely one.
const SAME: f64 = 0.5;
/// A shape goes through so many samples of its outlines, about: they tell the share to a few hundredths.
const SAMPLES: usize = 120;
/// Points along each axis at which two shapes are compared.
const ALONG: usize = 20;

/// Where an object lies.
#[derive(Clone, Debug)]
pub struct Extent<'a> {
    marks: &'a ObjectMarks,
    /// The lowest and highest coordinates of its marks.
    bounds: [[f64; 2]; 3],
    /// The shape that its outlines stand for, and how far it may go on beyond the first and last of them, once somebody
    /// asked; none where its marks are no outlines.
    shape: OnceCell<Option<(Fitted, f64)>>,
}

impl<'a> Extent<'a> {
    /// Of an object's marks; none where it has none.
    #[must_use]
    pub fn of(marks: &'a ObjectMarks) -> Option<Self> {
        let points = marks.contours.concat();
        let limits = |axis: usize| {
            points
                .iter()
                .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], p| [low.min(p[axis]), high.max(p[axis])])
        };
        (!points.is_empty()).then(|| Self { marks, bounds: [0, 1, 2].map(limits), shape: OnceCell::new() })
    }

    fn shape(&self, image: &Geometry) -> Option<&(Fitted, f64)> {
        self.shape.get_or_init(|| shape_of(self.marks, image)).as_ref()
    }

    /// Whether it lies within another by a voxel on all sides, as a nucleus in its cell.
    fn is_within(&self, outer: &Self, image: &Geometry) -> bool {
        (0..3).all(|axis| {
            let ([low, high], [from, to]) = (self.bounds[axis], outer.bounds[axis]);
            low >= from + image.spacing[axis] && high <= to - image.spacing[axis]
        })
    }

    /// The share by boxes alone; none where they do not meet.
    fn boxes_share(&self, other: &Self, image: &Geometry) -> Option<f64> {
        let volume = |bounds: [[f64; 2]; 3]| -> f64 {
            (0..3).map(|axis| (bounds[axis][1] - bounds[axis][0]).max(0.0) + 0.5 * image.spacing[axis]).product()
        };
        let common = std::array::from_fn(|axis| {
            let (a, b) = (self.bounds[axis], other.bounds[axis]);
            [a[0].max(b[0]), a[1].min(b[1])]
        });
        let meet = common.iter().all(|[low, high]| low <= high);
        meet.then(|| volume(common) / (volume(self.bounds) + volume(other.bounds) - volume(common)))
    }
}

/// The share that two objects have in common of what both fill, where it is so large that they may be one object; none
/// where one lies within the other.
#[must_use]
pub fn shared(a: &Extent<'_>, b: &Extent<'_>, image: &Geometry) -> Option<f64> {
    if a.is_within(b, image) || b.is_within(a, image) {
        return None;
    }
    let boxes = a.boxes_share(b, image).filter(|&share| share > COMPARED)?;
    let share = match (a.shape(image), b.shape(image)) {
        (Some(first), Some(second)) => {
            let beyond = first.1.max(second.1);
            let around = std::array::from_fn(|axis| {
                let (a, b) = (a.bounds[axis], b.bounds[axis]);
                [a[0].min(b[0]) - beyond, a[1].max(b[1]) + beyond]
            });
            shapes_share(&first.0, &second.0, around)
        }
        _ => boxes,
    };
    Some(share).filter(|&share| share > SAME)
}

/// The shape that an object's outlines stand for, as they were marked, and how far it goes on beyond them.
fn shape_of(marks: &ObjectMarks, image: &Geometry) -> Option<(Fitted, f64)> {
    let spacing = image.min_spacing();
    let section = |outlines: &Vec<Drawn<'_>>| {
        let polygon = |outline: &Drawn<'_>| Curve { points: outline.in_plane.clone(), deviation: 0.0 };
        let plane = outlines.first()?.plane;
        Some(Section::new(plane, outlines.iter().map(polygon).collect(), Vec::new(), 0.1 * spacing))
    };
    let sections: Vec<Section> = drawn_by_plane(marks, image)?.iter().filter_map(section).collect();
    let fitted = Fitted::new(&sections.iter().collect::<Vec<_>>(), SAMPLES, LEAST_BESIDE * spacing)?;
    let beyond = fitted.ends().map_or(0.0, |ends| ends.height());
    Some((fitted, beyond))
}

/// What two shapes have in common of what both fill, at points of a box.
fn shapes_share(a: &Fitted, b: &Fitted, bounds: [[f64; 2]; 3]) -> f64 {
    let at = |axis: usize, n: usize| {
        let [low, high] = bounds[axis];
        low + (high - low) * (n as f64 + 0.5) / ALONG as f64
    };
    let (mut common, mut filled) = (0_u32, 0_u32);
    for n in 0..ALONG.pow(3) {
        let point = [at(0, n % ALONG), at(1, n / ALONG % ALONG), at(2, n / (ALONG * ALONG))];
        let [a, b] = [a, b].map(|shape| shape.distance(point).0 <= 0.0);
        common += u32::from(a && b);
        filled += u32::from(a || b);
    }
    f64::from(common) / f64::from(filled.max(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image() -> Geometry {
        Geometry { shape: [60, 60, 40], spacing: [1.0; 3], origin: [0.0; 3], unit: None }
    }

    /// Outlines of a ball of radius 12 on some slices, or of a ball in it.
    fn ball(centre: [f64; 3], radius: f64, slices: &[f64]) -> ObjectMarks {
        let ring = |&z: &f64| {
            let r = (radius * radius - (z - centre[2]).powi(2)).sqrt();
            let at = |n: u32| f64::from(n) * std::f64::consts::TAU / 24.0;
            (0..24).map(|n| [centre[0] + r * at(n).cos(), centre[1] + r * at(n).sin(), z]).collect()
        };
        ObjectMarks {
            object: 1,
            contours: slices.iter().map(ring).collect(),
            numbers: slices.iter().map(|&z| z as i64).collect(),
            drawn: true,
            seed: None,
        }
    }

    fn share(a: &ObjectMarks, b: &ObjectMarks) -> Option<f64> {
        shared(&Extent::of(a).unwrap(), &Extent::of(b).unwrap(), &image())
    }

    /// Two balls of radius r whose centres are d apart share `pi (4 r + d) (2 r - d)^2 / 12`.
    #[test]
    fn balls_share_what_balls_do() {
        let slices = [6.0, 12.0, 18.0, 24.0];
        let first = ball([23.5, 23.5, 15.0], 12.0, &slices);
        for d in [0.0_f64, 2.0, 4.0] {
            let second = ball([23.5 + d, 23.5, 15.0], 12.0, &slices);
            let (r, volume) = (12.0_f64, 4.0 / 3.0 * std::f64::consts::PI * 12.0_f64.powi(3));
            let common = std::f64::consts::PI * (4.0 * r + d) * (2.0 * r - d).powi(2) / 12.0;
            let expected = common / (2.0 * volume - common);
            let found = share(&first, &second).unwrap();
            assert!((found - expected).abs() < 0.06, "{d} apart: {found} for {expected}");
        }
    }

    #[test]
    fn other_slices_of_one_ball_are_the_ball() {
        let (a, b) = ([4.0, 10.0, 16.0, 22.0], [7.0, 13.0, 19.0, 25.0]);
        let centre = [23.5, 23.5, 15.0];
        assert!(share(&ball(centre, 12.0, &a), &ball(centre, 12.0, &b)).is_some_and(|share| share > 0.85));
    }

    #[test]
    fn neighbours_and_a_nucleus_are_none() {
        let slices = [8.0, 12.0, 18.0, 22.0];
        let cell = ball([23.5, 23.5, 15.0], 12.0, &slices);
        assert_eq!(share(&cell, &ball([23.5, 23.5, 15.0], 8.0, &[10.0, 15.0, 20.0])), None);
        // Their boxes share 30 %, they themselves less than a tenth.
        assert_eq!(share(&cell, &ball([35.5, 33.5, 15.0], 12.0, &slices)), None);
    }
}
