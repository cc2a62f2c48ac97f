//! Marks that fit the image and may be meant otherwise: slice numbers and pixels for lengths, one outline number for many
//! slices.

use crate::grid::{Geometry, digits};
use crate::pipeline::marks::ObjectMarks;

/// Marks whose whole numbers say something: fewer may be whole by chance.
const TELLING: usize = 8;
/// An object so few voxels wide was hardly marked on this image by lengths.
const HARDLY_MARKED: f64 = 4.0;
/// An object so much smaller than a voxel was marked in another unit: a thousandth, or less, of its size.
const IN_ANOTHER_UNIT: f64 = 0.2;

/// What speaks against reading an object's marks as lengths, where the image has other spacings than 1.
#[must_use]
pub fn doubts(marks: &ObjectMarks, image: &Geometry) -> Vec<String> {
    let points = marks.contours.concat();
    let object = marks.object;
    if points.is_empty() {
        return Vec::new();
    }
    let fits =
        [0, 1, 2].map(|axis| points.iter().all(|p| p[axis] >= -0.5 && p[axis] <= image.shape[axis] as f64 + 0.5));
    let odd = [0, 1, 2].map(|axis| fits[axis] && is_odd(&points, axis, image));
    let whole = [0, 1, 2].map(|axis| is_whole(&points, axis));
    let spacing = triple(image.spacing);
    if fits == [true; 3] && whole == [true; 3] && odd.contains(&true) && !contours_are_slices(marks, image) {
        return vec![format!(
            "all marks of object {object} are whole numbers; if they are voxel indices, multiply them by the spacing \
             {spacing}, or give --points-in voxels"
        )];
    }
    if odd[2] && !contours_are_slices(marks, image) {
        let h = short(image.spacing[2]);
        return vec![format!(
            "z of all marks of object {object} is a whole number, as slice numbers are, and slices are {h} apart: if all \
             are voxel indices, give --points-in voxels; if z alone is, name its column slice (counted from 1) or \
             z [px] (from 0)"
        )];
    }
    if points.len() >= TELLING && odd[0] && odd[1] {
        return vec![format!(
            "x and y of all marks of object {object} are whole numbers, as pixels are: if they are, name the columns \
             x [px], y [px], or give --points-in voxels where z counts slices too"
        )];
    }
    let wide = |axis: usize| {
        let (low, high) = limits(&points, axis);
        (high - low) / image.spacing[axis]
    };
    if points.len() >= TELLING && (0..3).all(|axis| wide(axis) < IN_ANOTHER_UNIT) {
        let unit = image.unit.as_deref().map_or(String::new(), |unit| format!(", {unit}"));
        let [x, y, z] = [0, 1, 2].map(|axis| digits::number(wide(axis)));
        return vec![format!(
            "the marks of object {object} span {x} x {y} x {z} voxels: their lengths are in another unit than the image's{unit}; \
             name theirs in the header, as in x [mm]"
        )];
    }
    let narrow = fits[0] && fits[1] && wide(0) < HARDLY_MARKED && wide(1) < HARDLY_MARKED;
    if points.len() >= TELLING && narrow && image.spacing[..2] != [1.0; 2] {
        return vec![format!(
            "the marks of object {object} span {:.1} x {:.1} x {:.1} voxels; if they are voxel indices, give --points-in \
             voxels",
            wide(0),
            wide(1),
            wide(2)
        )];
    }
    Vec::new()
}

fn is_whole(points: &[[f64; 3]], axis: usize) -> bool {
    points.iter().all(|p| p[axis].fract() == 0.0)
}

/// Whole numbers along an axis on which voxels do not lie at whole numbers, or lie at every few of them alone.
fn is_odd(points: &[[f64; 3]], axis: usize, image: &Geometry) -> bool {
    let h = image.spacing[axis];
    let on_voxel = |p: &[f64; 3]| {
        let voxel = image.to_voxels(*p)[axis];
        (voxel - voxel.round()).abs() < 1e-6
    };
    let differ = points.iter().any(|p| p[axis] != points[0][axis]);
    differ && is_whole(points, axis) && (h.fract() != 0.0 || !points.iter().all(on_voxel))
}

/// True where the outlines bear the numbers of the slices that they lie on by their lengths.
fn contours_are_slices(marks: &ObjectMarks, image: &Geometry) -> bool {
    let on_slice = |(number, contour): (&i64, &Vec<[f64; 3]>)| {
        contour.iter().all(|&p| (image.to_voxels(p)[2] - *number as f64).abs() < 0.25)
    };
    marks.drawn && marks.numbers.iter().zip(&marks.contours).all(on_slice)
}

/// The outlines that have marks on several slices along z, and on how many: three marks or more on each.
#[must_use]
pub fn spans_slices(marks: &ObjectMarks, image: &Geometry) -> Vec<(i64, usize)> {
    let slices = |contour: &[[f64; 3]]| {
        let mut slices: Vec<f64> = contour.iter().map(|&p| image.to_voxels(p)[2]).collect();
        slices.sort_by(f64::total_cmp);
        let runs: Vec<&[f64]> = slices.chunk_by(|a, b| b - a < 0.01).collect();
        let planar = (0..2).any(|axis| {
            let (low, high) = limits(contour, axis);
            high - low < 0.25 * image.spacing[axis]
        });
        (!planar && runs.len() > 1 && runs.iter().all(|run| run.len() > 2)).then_some(runs.len())
    };
    let numbered = marks.numbers.iter().zip(&marks.contours).filter(|_| marks.drawn);
    numbered.filter_map(|(&number, contour)| Some((number, slices(contour)?))).collect()
}

/// An outline is open when its ends are farther apart than so many of its longest step from mark to mark.
const OPEN_STEPS: f64 = 4.0;
/// With fewer marks steps tell nothing: they are the sides of a polygon.
const FEWEST_STEPS: usize = 6;

/// The outlines whose ends lie far from each other, as one has it that was drawn half around.
#[must_use]
pub fn open_outlines(marks: &ObjectMarks) -> Vec<i64> {
    let step = |a: &[f64; 3], b: &[f64; 3]| (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum::<f64>().sqrt();
    let is_open = |contour: &[[f64; 3]]| {
        let longest = contour.windows(2).map(|pair| step(&pair[0], &pair[1])).fold(0.0, f64::max);
        let ends = contour.first().zip(contour.last());
        contour.len() > FEWEST_STEPS && ends.is_some_and(|(a, b)| step(a, b) > OPEN_STEPS * longest)
    };
    let numbered = marks.numbers.iter().zip(&marks.contours).filter(|_| marks.drawn);
    numbered.filter(|(_, contour)| is_open(contour)).map(|(&number, _)| number).collect()
}

fn limits(points: &[[f64; 3]], axis: usize) -> (f64, f64) {
    points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| (low.min(p[axis]), high.max(p[axis])))
}

/// A number with no more decimals than tell something.
fn short(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}

fn triple(values: [f64; 3]) -> String {
    let [x, y, z] = values.map(short);
    format!("({x}, {y}, {z})")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(spacing: [f64; 3]) -> Geometry {
        Geometry { shape: [100, 80, 40], spacing, origin: [0.0; 3], unit: None }
    }

    fn rings(slices: &[f64], number: impl Fn(f64) -> i64) -> ObjectMarks {
        let ring = |z: f64| {
            let at = |n: u32| f64::from(n) * std::f64::consts::TAU / 12.0;
            (0..12).map(|n| [20.1 + 9.0 * at(n).cos(), 20.2 + 9.0 * at(n).sin(), z]).collect()
        };
        let contours = slices.iter().map(|&z| ring(z)).collect();
        ObjectMarks {
            object: 3,
            contours,
            numbers: slices.iter().map(|&z| number(z)).collect(),
            drawn: true,
            seed: None,
        }
    }

    #[test]
    fn whole_numbers_are_doubted() {
        let points: Vec<[f64; 3]> = (0..20).map(|n| [f64::from(n), f64::from(n % 7), f64::from(n % 3)]).collect();
        let marks = ObjectMarks { object: 3, contours: vec![points], numbers: vec![0], drawn: false, seed: None };
        let notes = doubts(&marks, &image([0.25, 0.25, 1.0]));
        assert!(notes[0].contains("whole numbers") && notes[0].contains("--points-in voxels"), "{notes:?}");
        assert!(!doubts(&marks, &image([2.0; 3])).is_empty());
        assert!(doubts(&marks, &image([1.0; 3])).is_empty());
    }

    #[test]
    fn slice_numbers_are_told_from_heights() {
        let slices = [4.0, 7.0, 10.0];
        let notes = |spacing: f64, number: fn(f64) -> i64| doubts(&rings(&slices, number), &image([0.9, 0.9, spacing]));
        for spacing in [0.3, 2.0, 5.0] {
            assert!(notes(spacing, |z| z as i64)[0].contains("slice numbers"), "{spacing}");
        }
        assert!(notes(1.0, |z| z as i64).is_empty());
        assert!(notes(0.5, |z| (2.0 * z) as i64).is_empty(), "the outlines' numbers are those of the slices");
        assert!(doubts(&rings(&[4.2, 7.2, 10.2], |z| z as i64), &image([0.9, 0.9, 0.3])).is_empty());
    }

    #[test]
    fn one_number_on_all_slices_is_found() {
        let mut marks = rings(&[4.0, 7.0, 10.0], |z| z as i64);
        assert!(spans_slices(&marks, &image([1.0; 3])).is_empty());
        marks.contours = vec![marks.contours.concat()];
        marks.numbers = vec![9];
        assert_eq!(spans_slices(&marks, &image([1.0; 3])), [(9, 3)]);
    }
}
