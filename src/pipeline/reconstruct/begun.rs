//! What a reconstruction begins with: the search for what the cloud encloses, as it is, with caps, farther from it; and what is said
//! where there is nothing.

use super::bridges::bridges;
use super::caps::{Cap, Closing, Holes};
use super::flat::{IN_ONE_PLANE, flat};
use super::normals::sided::Sided;
use super::settings::ReconstructSettings;
use crate::error::{Error, Result};
use crate::exec::Engine;
use crate::grid::{Geometry, digits};
use crate::pipeline::enclosure::region::voxel_bounds;
use crate::pipeline::enclosure::search::{
    Deepest, Enclosure, Found, Hole, Search, Start, enclose, face, first_reach_for,
};

/// Where more of the points than this part have one side all around them, holes are looked for that let it in.
const MOST_SHEET: f64 = 0.01;

/// Caps are put over the holes of a cloud of which so many of the points in doubt have an inside.
const LEAST_BODY: f64 = 0.5;

/// As far from the points as the box is wide an inside is looked for in boxes of so many voxels at most.
const FARTHER_VOXELS: u64 = 4 << 20;

/// In larger ones that of a body is looked for so many times as far as at first.
const BODY_REACH: f64 = 4.0;

/// Caps are wide that have one new point for so many of the cloud's, or more.
const WIDE_CAPS: usize = 20;

/// A cloud that is no thicker than this part of a spacing, root mean square, is flat.
const FLAT_VOXELS: f64 = 0.1;

/// What a search starts from, and what was found.
pub(super) struct Begun {
    pub(super) enclosure: Box<Enclosure>,
    /// The points that close the cloud, behind its own.
    pub(super) closed: Option<Vec<[f64; 3]>>,
    pub(super) caps: Vec<Cap>,
}

impl Begun {
    fn of(enclosure: Box<Enclosure>) -> Self {
        Self { enclosure, closed: None, caps: Vec::new() }
    }
}

/// What the cloud encloses: as it is where that is told near it, else with caps over its holes, else as far from it as is needed.
///
/// # Errors
/// When it encloses nothing, the memory is too little, scratch runs out, or the run is interrupted.
pub(super) fn enclosed(
    engine: &Engine,
    grid: &Geometry,
    cloud: &[[f64; 3]],
    settings: &ReconstructSettings,
    sided: Option<&Sided>,
) -> Result<Begun> {
    let first_reach = first_reach_for(grid, settings.beta);
    let search = Search {
        grid,
        cloud,
        method: settings.method,
        beta: settings.beta,
        start: Start::Watershed,
        first_reach,
        most_reach: first_reach,
        suffix: "",
    };
    let found = enclose(engine, &search)?;
    let most = MOST_SHEET * cloud.len() as f64;
    let is_in_doubt = match &found {
        Found::Open => true,
        Found::Enclosed(enclosure) => enclosure.sheet().len() as f64 > most,
        _ => false,
    };
    if !is_in_doubt || settings.beta.is_some() {
        return as_it_is(settings, &search, found);
    }
    if let Some(sided) = sided {
        let search = Search { suffix: " of sides", ..search };
        return Ok(Begun::of(face(engine, &search, &sided.surfels)?));
    }
    let lost: Vec<u32> = match &found {
        Found::Enclosed(enclosure) => enclosure.sheet().to_vec(),
        _ => (0..cloud.len() as u32).collect(),
    };
    let (is_body, closing) = match closed(engine, &search, &lost)? {
        Capped::Closed(begun) => return Ok(begun),
        Capped::Body(closing) => (true, closing),
        Capped::NoBody => (false, Closing::default()),
    };
    // Far from the points a search takes all of the box.
    let most_reach = match voxel_bounds(cloud, grid).volume() {
        ..=FARTHER_VOXELS => f64::INFINITY,
        _ if is_body => BODY_REACH * first_reach,
        _ => first_reach,
    };
    if !matches!(found, Found::Open) || most_reach == first_reach {
        return as_it_is(settings, &search, found);
    }
    let farther = Search { most_reach, suffix: " farther", ..search };
    let found = match with_wide_caps(engine, &farther, closing)? {
        Some(begun) => return Ok(begun),
        None => enclose(engine, &farther)?,
    };
    as_it_is(settings, &search, found)
}

/// The cloud with caps as a search farther from it finds it, where these are wide: where the points are so uneven that a search near them is
/// lost, holes wider than they are apart stay open far from them too.
fn with_wide_caps(engine: &Engine, farther: &Search<'_>, closing: Closing) -> Result<Option<Begun>> {
    let (cloud, Closing { points, caps }) = (farther.cloud, closing);
    if points.len() <= cloud.len() / WIDE_CAPS {
        return Ok(None);
    }
    let closed = [cloud, &points].concat();
    let search = Search { cloud: &closed, suffix: " farther with caps", ..*farther };
    Ok(match enclose(engine, &search)? {
        Found::Enclosed(enclosure) if enclosure.sheet().len() as f64 <= MOST_SHEET * cloud.len() as f64 => {
            Some(Begun { enclosure, closed: Some(closed), caps })
        }
        _ => None,
    })
}

/// What a search gave, as it is.
fn as_it_is(settings: &ReconstructSettings, search: &Search<'_>, found: Found) -> Result<Begun> {
    let Search { grid, cloud, .. } = *search;
    let flat = || flat_cloud(settings, grid, cloud);
    Err(match found {
        Found::Enclosed(enclosure) => return Ok(Begun::of(enclosure)),
        Found::Leaks(deepest) => flat().unwrap_or_else(|| leaks(settings, grid, &deepest)),
        Found::Nothing(deepest) => flat().unwrap_or_else(|| encloses_nothing(settings, grid, deepest.as_ref())),
        Found::Open => flat().unwrap_or_else(|| encloses_nothing(settings, grid, None)),
    })
}

/// What caps make of a cloud.
enum Capped {
    /// They close it.
    Closed(Begun),
    /// It is a body, but near the points these do not close it.
    Body(Closing),
    /// Most of the points in doubt have no inside.
    NoBody,
}

/// The cloud with caps over its holes, if it is a body that is open there: as a search near both finds it, where that leaves half as many
/// points without two sides.
fn closed(engine: &Engine, search: &Search<'_>, lost: &[u32]) -> Result<Capped> {
    let cloud = search.cloud;
    let alone = &*engine.by_itself();
    let sided = Sided::new(alone, cloud)?;
    let holes = Holes::new(alone, cloud, &sided)?;
    if holes.share_of_body(lost.iter().map(|&n| n as usize)) < LEAST_BODY {
        return Ok(Capped::NoBody);
    }
    let bridges = bridges(alone, cloud, &sided)?;
    let mut open = Closing::default();
    let attempts: &[&[[f64; 3]]] = if bridges.is_empty() { &[&[]] } else { &[&bridges, &[]] };
    for bridges in attempts {
        let Closing { points, caps } = Closing::of(alone, (&holes, bridges))?;
        if points.is_empty() {
            continue;
        }
        let closed = [cloud, &points].concat();
        let with_caps = Search { cloud: &closed, suffix: " with caps", ..*search };
        if let Found::Enclosed(enclosure) = enclose(engine, &with_caps)?
            && 2 * enclosure.sheet().len() < lost.len()
        {
            return Ok(Capped::Closed(Begun { enclosure, closed: Some(closed), caps }));
        }
        open = Closing { points, caps };
    }
    Ok(Capped::Body(open))
}

/// What is said of a cloud that no setting gives an inside.
fn flat_cloud(settings: &ReconstructSettings, grid: &Geometry, cloud: &[[f64; 3]]) -> Option<Error> {
    let place = flat(cloud, FLAT_VOXELS * grid.min_spacing())?;
    Some(Error::input(format!(
        "the points enclose nothing: all of them lie {place}, which has no inside; give points of all sides of the body{}",
        if place == IN_ONE_PLANE { or_open(settings) } else { "" }
    )))
}

/// What else there is to do.
fn or_open(settings: &ReconstructSettings) -> &'static str {
    if settings.open { "" } else { ", or --open for a surface that ends where the points do" }
}

fn leaks(settings: &ReconstructSettings, grid: &Geometry, deepest: &Deepest) -> Error {
    let beta = settings.beta.unwrap_or_default();
    let larger = deepest.beta().map_or(String::new(), |beta| format!(", or give --beta {beta}"));
    Error::input(format!(
        "with --beta {beta} the start leaks through {}; leave --beta out{larger}",
        hole_of(&deepest.hole, grid)
    ))
}

fn hole_of(hole: &Hole, grid: &Geometry) -> String {
    let place = digits::place(hole.place, grid.min_spacing());
    format!("a hole {} wide at {place}", digits::number(hole.width))
}

fn encloses_nothing(settings: &ReconstructSettings, grid: &Geometry, deepest: Option<&Deepest>) -> Error {
    let spacing = digits::number(grid.min_spacing());
    let with = settings.beta.map_or(String::new(), |beta| format!(" with --beta {beta}"));
    let Some((deepest, beta)) = deepest.and_then(|deepest| Some((deepest, deepest.beta()?))) else {
        return Error::input(format!(
            "the points enclose nothing at the spacing {spacing}{with}: outside reaches everywhere; give points of all \
             sides of the body, or a finer --spacing if they lie denser than that{}",
            or_open(settings)
        ));
    };
    let depth = digits::number(deepest.depth);
    let hole = hole_of(&deepest.hole, grid);
    Error::input(format!(
        "the points enclose nothing at the spacing {spacing}{with}: the deepest space is {depth} deep, which has {hole}, and \
         a space has to be deeper than its hole is wide; give --beta {beta} if the body is that thin, else points of all \
         sides of it, or a finer --spacing if they lie denser than that{}",
        or_open(settings)
    ))
}
