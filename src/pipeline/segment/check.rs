//! Do the marks fit the image? Wrong units and wrong axes are the mistakes that happen, and each can be told.

use super::settings::SegmentSettings;
use crate::error::{Error, Result};
use crate::grid::Geometry;
use crate::pipeline::image_terms::Smoothing;
use crate::pipeline::marks::{ObjectMarks, Seed};
use crate::pipeline::smoothing::check_width;

/// Fewer points than this enclose nothing.
const FEWEST_POINTS: usize = 4;
/// When this part of an object's marks would fit under another reading, that reading is offered.
const FITTING: f64 = 0.9;

/// Checks one object's marks against the grid of the image; returns what the user should know all the same.
///
/// # Errors
/// With too few marks, when more than half of them lie outside of the image, or when they look like voxel indices.
pub fn check_marks(marks: &ObjectMarks, image: &Geometry) -> Result<Vec<String>> {
    let points = marks.contours.concat();
    let object = marks.object;
    if points.len() < FEWEST_POINTS {
        let count = if points.len() == 1 { "one point".into() } else { format!("{} points", points.len()) };
        return Err(Error::input(format!(
            "object {object} has {count}; mark its border all around, with {FEWEST_POINTS} points at the very least"
        )));
    }
    let outside = points.iter().filter(|&&p| !holds(image, p)).count();
    let hint = other_reading(&points, image);
    if 2 * outside > points.len() || (outside > 0 && hint.is_some() && whole_numbers(&points)) {
        let advice = hint.unwrap_or(
            "give physical coordinates (voxel index times spacing), or correct the spacing with --image-spacing".into(),
        );
        return Err(Error::input(format!(
            "{outside} of the {} marks of object {object} lie outside of the image: they span {}, the image {}; \
             {advice}",
            points.len(),
            spans(&bounds(&points), image),
            spans(&extent(image), image)
        )));
    }
    let mut notes = Vec::new();
    if outside > 0 {
        let verb = if outside == 1 { "mark lies" } else { "marks lie" };
        notes.push(format!("{outside} {verb} outside of the image (object {object}, {} in all)", points.len()));
    }
    if outside == 0 && whole_numbers(&points) && image.spacing.iter().any(|h| h.fract() != 0.0) {
        notes.push(format!(
            "all marks of object {object} are whole numbers; if they are voxel indices, multiply them by the spacing \
             {}",
            triple(image.spacing)
        ));
    }
    Ok(notes)
}

/// Checks that a seed is a ball that holds a voxel of the image.
///
/// # Errors
/// When it is not, with the box that the image fills.
pub fn check_seed(seed: &Seed, image: &Geometry) -> Result<()> {
    let Seed { centre, radius } = *seed;
    let is_ball = centre.iter().chain([&radius]).all(|v| v.is_finite()) && radius > 0.0;
    if !is_ball {
        return Err(Error::usage("--seed needs three finite coordinates and a radius above 0: X,Y,Z,R"));
    }
    let last = image.shape.map(|n| (n - 1) as f64);
    let voxel = image.to_voxels(centre);
    let nearest = image.position(std::array::from_fn(|a| voxel[a].round().clamp(0.0, last[a]) as i64));
    let away = (0..3).map(|a| (nearest[a] - centre[a]).powi(2)).sum::<f64>().sqrt();
    if away <= radius {
        return Ok(());
    }
    Err(Error::usage(format!(
        "--seed {},{},{},{radius} holds no voxel of the image, which spans {}; give physical coordinates within it",
        centre[0],
        centre[1],
        centre[2],
        spans(&extent(image), image)
    )))
}

/// Checks that the image can be smoothed as wanted.
///
/// # Errors
/// When a Gaussian would be too wide.
pub fn check_smoothing(settings: &SegmentSettings, image: &Geometry) -> Result<()> {
    if settings.smoothing == Smoothing::Heat || !settings.uses_image() {
        return Ok(());
    }
    check_width(image.spacing, [settings.sigma_on(image); 3])
}

/// The physical box that the image's voxels fill, `[lowest, highest]`.
fn extent(image: &Geometry) -> [[f64; 3]; 2] {
    let half = image.spacing.map(|h| 0.5 * h);
    let last = image.position(image.shape.map(|n| n - 1));
    [std::array::from_fn(|a| image.origin[a] - half[a]), std::array::from_fn(|a| last[a] + half[a])]
}

fn bounds(points: &[[f64; 3]]) -> [[f64; 3]; 2] {
    let limits = |start: f64, of: fn(f64, f64) -> f64| {
        points.iter().fold([start; 3], |limit, p| std::array::from_fn(|a| of(limit[a], p[a])))
    };
    [limits(f64::INFINITY, f64::min), limits(f64::NEG_INFINITY, f64::max)]
}

/// True within the image's voxels, rounding aside.
fn holds(image: &Geometry, point: [f64; 3]) -> bool {
    let voxel = image.to_voxels(point);
    (0..3).all(|a| voxel[a] >= -0.5 - 1e-6 && voxel[a] <= image.shape[a] as f64 - 0.5 + 1e-6)
}

fn whole_numbers(points: &[[f64; 3]]) -> bool {
    points.iter().flatten().all(|v| v.fract() == 0.0)
}

/// What the marks would mean if they were read in another unit or order, where they would fit then.
fn other_reading(points: &[[f64; 3]], image: &Geometry) -> Option<String> {
    let fits = |reading: &dyn Fn([f64; 3]) -> [f64; 3]| {
        let read: Vec<[f64; 3]> = points.iter().map(|&p| reading(p)).collect();
        let [low, high] = bounds(&read);
        // A reading that leaves next to nothing of the marks' extent would fit anywhere.
        let drawn = (0..3).filter(|&a| high[a] - low[a] > 2.0 * image.spacing[a]).count() >= 2;
        drawn && read.iter().filter(|&&p| holds(image, p)).count() as f64 >= FITTING * points.len() as f64
    };
    let h = image.spacing;
    if fits(&|p| std::array::from_fn(|a| p[a] * h[a])) && h != [1.0; 3] {
        return Some(format!("they look like voxel indices: multiply them by the spacing {}", triple(h)));
    }
    if fits(&|p| p.map(|v| v / 1000.0)) {
        return Some("they would fit when divided by 1000: are they in nanometers?".into());
    }
    if fits(&|p| p.map(|v| v * 1000.0)) {
        return Some("they would fit when multiplied by 1000: are they in another unit than the image?".into());
    }
    fits(&|p| [p[2], p[1], p[0]]).then(|| "they would fit as z,y,x: are the columns in the order x,y,z?".into())
}

/// A number with no more decimals than tell something.
fn short(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}

fn triple(values: [f64; 3]) -> String {
    let [x, y, z] = values.map(short);
    format!("({x}, {y}, {z})")
}

fn spans([low, high]: &[[f64; 3]; 2], image: &Geometry) -> String {
    let axis = |a: usize| format!("{} {} to {}", ["x", "y", "z"][a], short(low[a]), short(high[a]));
    let unit = image.unit.as_deref().map_or(String::new(), |unit| format!(" {unit}"));
    format!("{}, {}, {}{unit}", axis(0), axis(1), axis(2))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(spacing: [f64; 3]) -> Geometry {
        Geometry { shape: [100, 80, 40], spacing, origin: [0.0; 3], unit: Some("micrometer".into()) }
    }

    fn marks(points: Vec<[f64; 3]>) -> ObjectMarks {
        ObjectMarks { object: 3, contours: vec![points], numbers: vec![0], drawn: true, seed: None }
    }

    fn ring(centre: [f64; 3], radius: [f64; 2]) -> Vec<[f64; 3]> {
        let at = |n: u32| f64::from(n) * std::f64::consts::TAU / 24.0;
        (0..24).map(|n| [centre[0] + radius[0] * at(n).cos(), centre[1] + radius[1] * at(n).sin(), centre[2]]).collect()
    }

    fn said(points: Vec<[f64; 3]>, spacing: [f64; 3]) -> String {
        check_marks(&marks(points), &image(spacing)).unwrap_err().to_string()
    }

    #[test]
    fn marks_in_the_image_pass_in_silence() {
        let notes = check_marks(&marks(ring([25.0, 20.0, 20.0], [10.0, 10.0])), &image([0.5, 0.5, 1.0])).unwrap();
        assert!(notes.is_empty(), "{notes:?}");
    }

    #[test]
    fn wrong_units_are_named() {
        let spacing = [0.25, 0.25, 1.0];
        let inside = ring([12.0, 10.0, 20.0], [6.0, 6.0]);
        let voxels: Vec<_> = inside.iter().map(|p| [p[0] * 4.0, p[1] * 4.0, p[2]]).collect();
        let text = said(voxels, spacing);
        assert!(text.contains("voxel indices: multiply them by the spacing (0.25, 0.25, 1)"), "{text}");
        assert!(text.contains("object 3") && text.contains("x -0.125 to 24.875") && text.contains("micrometer"));
        assert!(said(inside.iter().map(|p| p.map(|v| v * 1e3)).collect(), spacing).contains("divided by 1000"));
        assert!(said(inside.iter().map(|p| p.map(|v| v * 1e-3 - 1.0)).collect(), spacing).contains("--image-spacing"));
        let turned = vec![[39.0, 3.0, 55.0], [36.0, 8.0, 52.0], [33.0, 12.0, 58.0], [30.0, 6.0, 60.0]];
        assert!(said(turned, [1.0; 3]).contains("z,y,x"));
    }

    #[test]
    fn whole_numbers_that_reach_out_are_voxel_indices_even_when_few_do() {
        let mut points: Vec<[f64; 3]> = (0..20).map(|n| [f64::from(n % 24), f64::from(n % 7), 3.0]).collect();
        points.push([90.0, 10.0, 3.0]);
        assert!(said(points.clone(), [0.25, 0.25, 1.0]).contains("voxel indices"));
        points.pop();
        let notes = check_marks(&marks(points.clone()), &image([0.25, 0.25, 1.0])).unwrap();
        assert!(notes[0].contains("whole numbers"), "{notes:?}");
        assert!(check_marks(&marks(points), &image([1.0; 3])).unwrap().is_empty());
    }

    #[test]
    fn a_few_outside_are_noted_and_too_few_refused() {
        let mut points = ring([25.3, 20.0, 20.0], [10.0, 10.0]);
        points.push([80.5, 10.0, 10.0]);
        let notes = check_marks(&marks(points), &image([0.5, 0.5, 1.0])).unwrap();
        assert_eq!(notes, ["1 mark lies outside of the image (object 3, 25 in all)"]);
        assert!(said(vec![[1.0; 3]], [1.0; 3]).starts_with("object 3 has one point;"));
        assert!(said(vec![[1.0; 3]; 3], [1.0; 3]).starts_with("object 3 has 3 points;"));
    }
}
