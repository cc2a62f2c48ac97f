//! Marks become outlines: contours that lie in a plane and run around something, as smooth curves, by the planes that
//! they were drawn in.

use std::cmp::Ordering;

use crate::error::Result;
use crate::exec::{Stage, Workers};
use crate::grid::Geometry;
use crate::kernel::outline::planar::crossing::crosses_itself;
use crate::kernel::outline::planar::curve::Curve;
use crate::kernel::outline::planar::marked::Scatter;
use crate::kernel::outline::planar::noise;
use crate::kernel::outline::planar::plane::Plane;
use crate::kernel::outline::planar::section::Section;
use crate::pipeline::marks::ObjectMarks;

/// Marks of a plane lie within this part of the spacing along its normal.
const FLATNESS: f64 = 0.5;
/// Points of a curve are at most so many smallest spacings apart.
const CURVE_STEP: f64 = 0.5;
/// Distances to curves are exact to this part of the smallest spacing.
const CURVE_WITHIN: f64 = 0.01;
/// Planes nearer to each other than this part of the smallest spacing are one.
const SAME_PLANE: f64 = 0.25;

/// An outline that runs so near to another of its plane all along, in smallest spacings, is that one drawn again: what
/// lies between both could not be seen on the grid.
const REPEATED: f64 = 1.5;

/// An outline as it was marked.
pub(crate) struct Drawn<'a> {
    pub(crate) plane: Plane,
    marks: &'a [[f64; 3]],
    pub(crate) in_plane: Vec<[f64; 2]>,
}

/// The plane that a contour was drawn in; none where it is not flat.
fn plane_of(contour: &[[f64; 3]], image: &Geometry) -> Option<Plane> {
    Plane::of(contour, image.spacing.map(|h| FLATNESS * h))
}

/// The outlines of an object; none where any contour of three marks or more is none.
fn drawn<'a>(marks: &'a ObjectMarks, image: &Geometry) -> Option<Vec<Drawn<'a>>> {
    if !marks.drawn {
        return None;
    }
    let outline = |marks: &'a Vec<[f64; 3]>| {
        let plane = plane_of(marks, image)?;
        let in_plane = marks.iter().map(|&p| plane.project(p)).collect();
        Some(Drawn { plane, marks, in_plane })
    };
    // An outline that was saved twice is one outline, no hole in itself.
    let repeats = |n: usize| marks.contours[..n].contains(&marks.contours[n]);
    let told = (0..marks.contours.len()).filter(|&n| marks.contours[n].len() > 2 && !repeats(n));
    let found: Vec<Drawn> = told.map(|n| outline(&marks.contours[n])).collect::<Option<_>>()?;
    (!found.is_empty()).then_some(found)
}

/// The number of the first contour that is not flat.
pub(crate) fn not_flat(marks: &ObjectMarks, image: &Geometry) -> Option<i64> {
    let numbered = marks.numbers.iter().zip(&marks.contours);
    numbered.filter(|(_, contour)| contour.len() > 2).find(|(_, c)| plane_of(c, image).is_none()).map(|(n, _)| *n)
}

/// How the marks of all objects scatter around their outlines.
///
/// # Errors
/// When the run is interrupted.
pub(crate) fn scatter_of(stage: &Stage<'_>, objects: &[ObjectMarks], image: &Geometry) -> Result<Scatter> {
    let outlines = objects.iter().filter_map(|marks| drawn(marks, image)).flatten().map(|outline| outline.in_plane);
    let (outlines, spacing) = (outlines.collect::<Vec<_>>(), image.min_spacing());
    let costs =
        stage.run(&noise::telling(&outlines), &Workers::none(), |(), outline| Ok(noise::costs(outline, spacing)))?;
    Ok(noise::likeliest(&costs, spacing))
}

/// An object's outlines by the planes that they were drawn in, by direction and along it; none where its contours are no
/// outlines.
pub(crate) fn drawn_by_plane<'a>(marks: &'a ObjectMarks, image: &Geometry) -> Option<Vec<Vec<Drawn<'a>>>> {
    let mut outlines = drawn(marks, image)?;
    // Planes of one direction differ in their last digits: they share the first one's.
    let mut directions: Vec<Plane> = Vec::new();
    for outline in &outlines {
        if !directions.iter().any(|plane| plane.is_parallel_to(&outline.plane)) {
            directions.push(outline.plane);
        }
    }
    directions.sort_by(|a, b| {
        let order = |axis: &usize| b.normal[*axis].total_cmp(&a.normal[*axis]);
        [0, 1, 2].iter().map(order).find(|order| order.is_ne()).unwrap_or(Ordering::Equal)
    });
    let direction = |outline: &Drawn| directions.iter().position(|plane| plane.is_parallel_to(&outline.plane));
    outlines.sort_by(|a, b| direction(a).cmp(&direction(b)).then(a.plane.offset.total_cmp(&b.plane.offset)));
    let same = SAME_PLANE * image.min_spacing();
    let mut groups: Vec<Vec<Drawn>> = Vec::new();
    for outline in outlines {
        let shares = |before: &Drawn| {
            let by = before.plane.offset - outline.plane.offset;
            before.plane.is_parallel_to(&outline.plane) && by.abs() <= same
        };
        match groups.last_mut().filter(|group| group.last().is_some_and(shares)) {
            Some(group) => group.push(outline),
            None => groups.push(vec![outline]),
        }
    }
    Some(groups)
}

/// The section that the outlines of a plane bound; `spacing` is the smallest one.
pub(crate) fn section(outlines: &[Drawn<'_>], scatter: Scatter, spacing: f64) -> Section {
    let step = CURVE_STEP * spacing;
    let mut curves: Vec<Curve> = Vec::new();
    for outline in outlines {
        let curve = Curve::through(&outline.in_plane, scatter, step);
        if !curves.iter().any(|before| before.repeats(&curve, REPEATED * spacing)) {
            curves.push(curve);
        }
    }
    let marks = outlines.iter().flat_map(|outline| outline.marks).copied().collect();
    Section::new(outlines[0].plane, curves, marks, CURVE_WITHIN * spacing)
}

/// The numbers of an object's contours that cross themselves.
#[must_use]
pub fn crossed(marks: &ObjectMarks, image: &Geometry) -> Vec<i64> {
    let crosses = |contour: &[[f64; 3]]| {
        let plane = plane_of(contour, image)?;
        Some(crosses_itself(&contour.iter().map(|&p| plane.project(p)).collect::<Vec<_>>()))
    };
    let numbered = marks.numbers.iter().zip(&marks.contours);
    numbered.filter(|(_, contour)| crosses(contour) == Some(true)).map(|(number, _)| *number).collect()
}

/// The points of all curves, world positions: the cloud that the outlines stand for.
#[must_use]
pub(crate) fn cloud(sections: &[Section]) -> Vec<[f64; 3]> {
    let points = |section: &Section| -> Vec<[f64; 3]> {
        section.curves.iter().flat_map(|curve| &curve.points).map(|&p| section.plane.lift(p, 0.0)).collect()
    };
    sections.iter().flat_map(points).collect()
}
