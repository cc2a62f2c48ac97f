//! One object: from its marks to the segmentation function on a box of its own.

use super::begun::Solution;
use super::begun::{Begun, Forces};
use super::outlined::outlines::not_flat;
use super::outlined::shape_start::begin;
use super::outlined::survey::{Outlined, Trust};
use super::picture::{Picture, World};
use super::reach::first_reach;
use super::seed::grow;
use super::settings::{ImageModel, SegmentSettings, Start};
use crate::error::{Error, Result};
use crate::exec::Engine;
use crate::pipeline::enclosure::search;
use crate::pipeline::enclosure::search::{Deepest, Found, Search, enclose};
use crate::pipeline::marks::{ObjectMarks, cloud_of};
use crate::store::Element;

/// Solves one object.
///
/// # Errors
/// When its marks enclose nothing, scratch runs out or the run is interrupted.
pub(super) fn solve<T: Element>(
    engine: &Engine,
    picture: &Picture<'_, T>,
    marks: &ObjectMarks,
    outlined: Option<(&Outlined, Trust)>,
    settings: &SegmentSettings,
) -> Result<Solution> {
    if outlined.is_none() && matches!(settings.image, ImageModel::Level | ImageModel::Wall) {
        return Err(needs_outlines(marks, settings));
    }
    if let Some(seed) = marks.seed {
        return grow(engine, picture, marks, &seed, settings);
    }
    if let Some(outlined) = outlined {
        let (begun, forces) = begin(engine, picture, marks, outlined, settings)?;
        return begun.solve(engine, picture, marks, settings, &forces);
    }
    let cloud = cloud_of(marks, picture.geometry, settings.caps);
    let loose = settings.start == Start::Auto && !marks.drawn;
    let suffix = format!(" {}", marks.object);
    let search = Search {
        grid: picture.geometry,
        cloud: &cloud,
        method: settings.method,
        beta: settings.beta,
        start: if loose { search::Start::Watershed } else { search::Start::Tube },
        first_reach: first_reach(marks, picture.geometry, settings),
        most_reach: f64::INFINITY,
        suffix: &suffix,
    };
    let enclosure = match enclose(engine, &search)? {
        Found::Enclosed(enclosure) => enclosure,
        Found::Leaks(deepest) => return Err(leak(marks, settings, &deepest, picture.world)),
        Found::Nothing(deepest) => return Err(encloses_nothing(marks, picture, deepest.as_ref())),
        Found::Open => return Err(encloses_nothing(marks, picture, None)),
    };
    let (geometry, window, hole) = (enclosure.geometry.clone(), enclosure.window, enclosure.hole());
    let (beta, larger_beta) = (enclosure.beta, enclosure.larger_beta());
    let (band, held) = enclosure.into_band(engine, &suffix)?;
    // Marks that a cloud is made of are dense, and edges make results worse where marks are good.
    let edges = !loose || settings.image == ImageModel::Edge;
    let forces = Forces { edges: edges && settings.uses_image(), ..Forces::of_settings(settings) };
    let cloud_points = cloud.len() as u64;
    let begun = Begun { geometry, window, band, distance: None, cloud_points, beta, hole, rests: false, held };
    Ok(Solution { larger_beta, ..begun.solve(engine, picture, marks, settings, &forces)? })
}

fn needs_outlines(marks: &ObjectMarks, settings: &SegmentSettings) -> Error {
    let model = if settings.image == ImageModel::Wall { "wall" } else { "level" };
    Error::input(format!(
        "object {} has no outlines along which --image {model} could read grey values; name its contours in a contour \
         column, each in a plane, and leave out --start flood and --beta, or give --image edge",
        marks.object
    ))
}

fn leak(marks: &ObjectMarks, settings: &SegmentSettings, deepest: &Deepest, world: World<'_>) -> Error {
    let (object, beta) = (marks.object, settings.beta.unwrap_or_default());
    let larger = deepest.beta().map_or(String::new(), |beta| format!(", or give --beta {beta}"));
    Error::input(format!(
        "with --beta {beta} the start of object {object} leaks through {}; leave --beta out{larger}",
        world.describe(&deepest.hole)
    ))
}

fn encloses_nothing<T: Element>(marks: &ObjectMarks, picture: &Picture<'_, T>, deepest: Option<&Deepest>) -> Error {
    let (object, image) = (marks.object, picture.geometry);
    // A hole, and what closes it, are worth telling where the flood found any space at all.
    let told = deepest.and_then(|deepest| Some((deepest, deepest.beta()?)));
    let hole = told.map_or(String::new(), |(deepest, beta)| {
        format!(", or give --beta {beta}: the deepest space has {}", picture.world.describe(&deepest.hole))
    });
    if !marks.drawn {
        return Error::input(format!(
            "the points of object {object} enclose nothing at this spacing; where they are outlines, give each a number in \
             a column named contour (object,contour,x,y,z): without it they are one loose cloud, which needs points all \
             around{hole}"
        ));
    }
    if let Some(number) = not_flat(marks, image) {
        return Error::input(format!(
            "contour {number} of object {object} lies in no plane, so it is no outline, and as points its marks enclose \
             nothing; give the outline of each slice a contour number of its own"
        ));
    }
    Error::input(format!(
        "the marks of object {object} enclose nothing at this spacing; mark its border all around, on every few \
         slices, in the order of the contour{hole}"
    ))
}
