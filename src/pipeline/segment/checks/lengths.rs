//! Do the marks fit the image? Wrong units and wrong axes are the mistakes that happen, and each can be told.

use crate::error::{Error, Result};
use crate::grid::Geometry;
use crate::pipeline::image::smoothing::check_width;
use crate::pipeline::image::terms::Smoothing;
use crate::pipeline::marks::{ObjectMarks, Seed};
use crate::pipeline::segment::neighbours::FillGaps;
use crate::pipeline::segment::settings::SegmentSettings;

/// Fewer points than this enclose nothing.
const FEWEST_POINTS: usize = 4;
/// When this part of an object's marks would fit under another reading, that reading is offered.
const FITTING: f64 = 0.9;

/// Grids that marks are looked at on.
#[derive(Clone, Copy, Debug)]
pub struct Grids<'a> {
    /// That of the image.
    pub whole: &'a Geometry,
    /// That of the part of it that is segmented.
    pub part: &'a Geometry,
    /// The axes along which the spacing is a guess.
    pub guessed: [bool; 3],
}

/// Checks one object's marks against the grid of the image; returns what the user should know all the same.
///
/// # Errors
/// With too few marks, when more than half of them lie outside of the image, or when they look like voxel indices.
pub fn check_marks(marks: &ObjectMarks, grids: &Grids<'_>) -> Result<Vec<String>> {
    let mut notes = check_on(marks, grids.whole, grids.guessed)?;
    let (object, points) = (marks.object, marks.contours.concat());
    if let Some(point) = points.iter().find(|&&p| is_far(grids.whole, p)) {
        return Err(Error::input(format!(
            "the mark ({}, {}, {}) of object {object} lies farther from the image than this is long ({}); correct it, or \
             leave it out",
            brief(point[0]),
            brief(point[1]),
            brief(point[2]),
            spans(&extent(grids.whole), grids.whole)
        )));
    }
    if grids.part.shape != grids.whole.shape {
        let outside = points.iter().filter(|&&p| !holds(grids.part, p)).count();
        if 2 * outside > points.len() {
            return Err(Error::input(format!("--crop leaves out most marks of object {object}; widen it")));
        }
        if outside > 0 {
            notes.push(format!("--crop leaves out {outside} of the {} marks of object {object}", points.len()));
        }
    }
    Ok(notes)
}

fn check_on(marks: &ObjectMarks, image: &Geometry, guessed: [bool; 3]) -> Result<Vec<String>> {
    let points = marks.contours.concat();
    let object = marks.object;
    if points.len() < FEWEST_POINTS {
        let count = if points.len() == 1 { "one point".into() } else { format!("{} points", points.len()) };
        return Err(Error::input(format!(
            "object {object} has {count}; mark its border all around, with {FEWEST_POINTS} points at the very least"
        )));
    }
    let outside = points.iter().filter(|&&p| !holds(image, p)).count();
    let hint = wrong_guess(&points, image, guessed).or_else(|| other_reading(&points, outside, image));
    if 2 * outside > points.len() || (outside > 0 && hint.is_some() && whole_numbers(&points)) {
        let advice = hint.unwrap_or(
            "give physical coordinates (voxel index times spacing) or --points-in voxels, or correct the spacing with \
             --image-spacing"
                .into(),
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
        let hint = hint.filter(|_| outside as f64 > (1.0 - FITTING) * points.len() as f64);
        let hint = hint.map_or(String::new(), |hint| format!(": {hint}"));
        notes.push(format!("{outside} {verb} outside of the image (object {object}, {} in all){hint}", points.len()));
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

/// Spacings may differ by this factor: more is a slip, and lengths along one axis would be that many voxels along another.
const LONGEST_VOXEL: f64 = 1000.0;
/// Gaps are filled up to so many smallest spacings.
const WIDEST_GAP: f64 = 64.0;

/// Checks lengths of the settings against the image's.
///
/// # Errors
/// When voxels are needles, or a length is out of all proportion to the image.
pub fn check_lengths(settings: &SegmentSettings, image: &Geometry) -> Result<()> {
    let (h, most) = (image.min_spacing(), image.length(image.shape));
    if image.max_spacing() > LONGEST_VOXEL * h {
        return Err(Error::input(format!(
            "the image's spacing is {}: voxels so much longer than wide cannot be right; give --image-spacing HX,HY,HZ",
            triple(image.spacing)
        )));
    }
    if let Some(beta) = settings.beta.filter(|&beta| beta > most) {
        return Err(Error::usage(format!("--beta is {beta}, and the image no longer than {most:.3}; give less")));
    }
    match settings.fill_gaps {
        Some(FillGaps::Width(width)) if width > WIDEST_GAP * h => Err(Error::usage(format!(
            "--fill-gaps is {width}; gaps are filled up to {} wide, {WIDEST_GAP} of the smallest spacing",
            WIDEST_GAP * h
        ))),
        _ => Ok(()),
    }
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

/// True farther away than the image is long.
fn is_far(image: &Geometry, point: [f64; 3]) -> bool {
    let [low, high] = extent(image);
    let longest = (0..3).map(|a| high[a] - low[a]).fold(0.0, f64::max);
    (0..3).any(|a| !(low[a] - longest..=high[a] + longest).contains(&point[a]))
}

/// A number in few characters, however large.
fn brief(value: f64) -> String {
    if value.abs() < 1e7 { short(value).to_string() } else { format!("{value:e}") }
}

fn whole_numbers(points: &[[f64; 3]]) -> bool {
    points.iter().flatten().all(|v| v.fract() == 0.0)
}

/// That the marks lie outside along axes alone whose spacing was guessed.
fn wrong_guess(points: &[[f64; 3]], image: &Geometry, guessed: [bool; 3]) -> Option<String> {
    let leaves = |a: usize| {
        let last = image.shape[a] as f64 - 0.5;
        points.iter().any(|&p| !(-0.5 - 1e-6..=last + 1e-6).contains(&image.to_voxels(p)[a]))
    };
    let axes: Vec<usize> = (0..3).filter(|&a| leaves(a)).collect();
    let names: Vec<&str> = axes.iter().map(|&a| ["x", "y", "z"][a]).collect();
    (!axes.is_empty() && axes.iter().all(|&a| guessed[a])).then(|| {
        let along = names.join(" and ");
        format!("the spacing along {along} is a guess, as the file does not tell it: give --image-spacing HX,HY,HZ")
    })
}

/// What the marks would mean if they were read in another unit or order, where they would fit then, and better than now
/// that so many lie outside.
fn other_reading(points: &[[f64; 3]], outside: usize, image: &Geometry) -> Option<String> {
    let fits = |reading: &dyn Fn([f64; 3]) -> [f64; 3]| {
        let read: Vec<[f64; 3]> = points.iter().map(|&p| reading(p)).collect();
        let [low, high] = bounds(&read);
        // A reading that leaves next to nothing of the marks' extent would fit anywhere.
        let drawn = (0..3).filter(|&a| high[a] - low[a] > 2.0 * image.spacing[a]).count() >= 2;
        let inside = read.iter().filter(|&&p| holds(image, p)).count();
        drawn && inside as f64 >= FITTING * points.len() as f64 && 2 * (points.len() - inside) <= outside
    };
    let h = image.spacing;
    if fits(&|p| std::array::from_fn(|a| p[a] * h[a])) && h != [1.0; 3] {
        return Some(format!(
            "they look like voxel indices: multiply them by the spacing {}, or give --points-in voxels",
            triple(h)
        ));
    }
    if fits(&|p| image.to_voxels(p)) && h != [1.0; 3] {
        return Some("they would fit when divided by the spacing: if lengths were read as voxel indices, give --points-in physical".into());
    }
    if fits(&|p| [p[0], p[1], p[2] * h[2]]) && h[2] != 1.0 {
        return Some(
            "their z looks like a slice number: multiply it by the spacing along z, or name its column z [px]".into(),
        );
    }
    if fits(&|p| [p[0] * h[0], p[1] * h[1], p[2]]) && h[..2] != [1.0; 2] {
        return Some(
            "their x and y look like pixels: multiply them by the spacing, name them x [px], y [px], or give --points-in \
             voxels where z counts slices too"
                .into(),
        );
    }
    if fits(&|p| p.map(|v| v / 1000.0)) {
        return Some("they would fit when divided by 1000: are they in nanometers?".into());
    }
    if fits(&|p| p.map(|v| v * 1000.0)) {
        return Some("they would fit when multiplied by 1000: are they in another unit than the image?".into());
    }
    if fits(&|p| [p[1], p[0], p[2]]) {
        return Some("they would fit as y,x,z: are the columns in the order x,y,z?".into());
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
        check_on(&marks(points), &image(spacing), [false; 3]).unwrap_err().to_string()
    }

    #[test]
    fn marks_in_the_image_pass_in_silence() {
        let notes =
            check_on(&marks(ring([25.0, 20.0, 20.0], [10.0, 10.0])), &image([0.5, 0.5, 1.0]), [false; 3]).unwrap();
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
    fn a_guessed_spacing_is_doubted_before_the_marks_are() {
        let above = ring([25.0, 20.0, 60.0], [10.0, 10.0]);
        let told = |guessed| check_on(&marks(above.clone()), &image([0.5, 0.5, 1.0]), guessed).unwrap_err().to_string();
        assert!(
            told([false, false, true]).ends_with(
                "the spacing along z is a guess, as the file does not tell it: give --image-spacing HX,HY,HZ"
            )
        );
        assert!(!told([true, true, false]).contains("guess"));
    }

    #[test]
    fn a_mark_far_away_is_named() {
        let mut points = ring([25.0, 20.0, 20.0], [10.0, 10.0]);
        points.push([25.0, 20.0, 1e9]);
        let whole = image([0.5, 0.5, 1.0]);
        let grids = Grids { whole: &whole, part: &whole, guessed: [false; 3] };
        let text = check_marks(&marks(points), &grids).unwrap_err().to_string();
        assert!(text.contains("the mark (25, 20, 1e9) of object 3 lies farther"), "{text}");
    }

    #[test]
    fn whole_numbers_that_reach_out_are_voxel_indices_even_when_few_do() {
        let mut points: Vec<[f64; 3]> = (0..20).map(|n| [f64::from(n % 24), f64::from(n % 7), 3.0]).collect();
        points.push([90.0, 10.0, 3.0]);
        assert!(said(points, [0.25, 0.25, 1.0]).contains("voxel indices"));
    }

    #[test]
    fn a_few_outside_are_noted_and_too_few_refused() {
        let mut points = ring([25.3, 20.0, 20.0], [10.0, 10.0]);
        points.push([80.5, 10.0, 10.0]);
        let notes = check_on(&marks(points), &image([0.5, 0.5, 1.0]), [false; 3]).unwrap();
        assert_eq!(notes, ["1 mark lies outside of the image (object 3, 25 in all)"]);
        assert!(said(vec![[1.0; 3]], [1.0; 3]).starts_with("object 3 has one point;"));
        assert!(said(vec![[1.0; 3]; 3], [1.0; 3]).starts_with("object 3 has 3 points;"));
    }
}
