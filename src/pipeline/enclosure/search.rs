//! What a cloud encloses: the distance around it, which side of it voxels are on, and how far the band must reach. The
//! distance is computed within a reach that grows until something enclosed is found or nothing can be.

use std::sync::Arc;

use super::facing::level_set;
pub use super::found::{Deepest, Enclosure, Found, Hole};
use super::near::Near;
use super::needs::box_bytes;
use super::pockets::pockets;
use super::region::{RegionOfInterest, voxel_bounds};
use super::resumed::Progress;
use super::sheets::{Company, hold_sheets};
use super::tagging::{Basin, tag};
use super::watershed::{Sides, watershed};
use crate::error::Result;
use crate::exec::{Engine, Hold, Stage, equal_part, tell_faces};
use crate::grid::Geometry;
use crate::kernel::level_set::initial::persistence::PERSISTENCE;
use crate::kernel::points::surfel::Surfel;
use crate::pipeline::distance::{Method, Sources, cloud_distance};
use crate::pipeline::level_set::band::Reaches;
use crate::store::BrickArray;
use crate::store::checkpoint::SavedField;

/// The start surface lies a little beyond the largest saddle, and at least so many smallest spacings from the cloud.
const ABOVE_SADDLE: f64 = 1.05;
const SMALLEST_BETA_VOXELS: f64 = 0.75;
/// The band reaches at least so many mean spacings to either side of the cloud.
const BAND_VOXELS: f64 = 4.0;
/// The search begins at so many largest spacings from the cloud.
const FIRST_REACH_VOXELS: f64 = 6.0;

/// The search goes on while more of the points than this share have one side all around them: a body may be open wider
/// than the reach.
const MOST_LOST: f64 = 0.1;

/// An open body is closed by balls of these parts of the reach.
const POCKET_RADII: [f64; 3] = [0.25, 0.5, 0.75];

/// Where the start surface lies when no beta is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Start {
    /// Between the points, each hole closed where it is narrowest.
    Watershed,
    /// At one distance from all points, a little beyond the largest hole.
    Tube,
}

/// A cloud, and how what it encloses is looked for.
#[derive(Clone, Copy, Debug)]
pub struct Search<'a> {
    /// The grid; what is found lies on a box of it that may reach past it.
    pub grid: &'a Geometry,
    /// World positions.
    pub cloud: &'a [[f64; 3]],
    /// Distance method.
    pub method: Method,
    /// Distance of the start surface from the cloud; automatic when none.
    pub beta: Option<f64>,
    /// Where it lies otherwise.
    pub start: Start,
    /// The distance from the cloud within which the search begins.
    pub first_reach: f64,
    /// The search ends as open where too little is found within this; as long as it is less, it grows.
    pub most_reach: f64,
    /// What is added to the names of stages.
    pub suffix: &'a str,
}

impl Search<'_> {
    /// Whether a basin is inside of a start surface at beta. One that was asked for is held against the depth too: then
    /// basins of any persistence come, and noise is as deep as its saddle.
    fn holds(&self, basin: &Basin, beta: f64) -> bool {
        let deep = self.beta.is_none() || f64::from(basin.depth) > beta;
        f64::from(basin.saddle) < beta && deep
    }

    /// No space can be deeper than this. On the way out of one along any axis the distance falls to the space's saddle, at
    /// the latest that far beyond the box around the cloud: half the box and two saddles bound the depth, and a start
    /// surface that was asked for lies beyond its saddle.
    fn deepest_possible(&self) -> f64 {
        let extents = self.extents();
        match self.beta {
            Some(beta) => {
                0.5 * extents.into_iter().fold(f64::INFINITY, f64::min) + 2.0 * beta + self.grid.max_spacing()
            }
            None => extents.into_iter().fold(0.0, f64::max),
        }
    }

    /// The cloud's extents along x, y, z.
    fn extents(&self) -> [f64; 3] {
        let bounds = voxel_bounds(self.cloud, self.grid);
        std::array::from_fn(|a| bounds.shape()[a] as f64 * self.grid.spacing[a])
    }
}

/// The reach that a search begins with on a grid, for a beta that was asked for.
#[must_use]
pub fn first_reach_for(grid: &Geometry, beta: Option<f64>) -> f64 {
    let wanted = beta.map_or(0.0, |beta| 2.0 * beta);
    (FIRST_REACH_VOXELS * grid.max_spacing()).max(wanted + 2.0 * grid.max_spacing())
}

/// Looks for what the cloud encloses.
///
/// # Errors
/// When a box that has grown does not fit the memory, scratch runs out or the run is interrupted.
pub fn enclose(engine: &Engine, search: &Search<'_>) -> Result<Found> {
    match (search.beta, search.start) {
        (None, Start::Watershed) => enclose_by_sides(engine, search),
        _ => enclose_by_flood(engine, search),
    }
}

/// The watershed of the distance, within a reach that grows until most points have both sides beside them.
fn enclose_by_sides(engine: &Engine, search: &Search<'_>) -> Result<Found> {
    let grid = search.grid;
    let half_width = BAND_VOXELS * libm::cbrt(grid.voxel_volume());
    let mut progress = Progress::begin(engine, search.suffix)?;
    let mut farthest = progress.farthest_or(search.first_reach.max(half_width + 3.0 * grid.max_spacing()));
    let enough = |sides: &Sides| sides.lost.len() as f64 <= MOST_LOST * search.cloud.len() as f64;
    loop {
        let around = Around::new(engine, search, farthest, &mut progress)?;
        let mut sides = around.sides_found(engine, search, &mut progress)?;
        if farthest >= search.most_reach && (sides.basins.is_empty() || !enough(&sides)) {
            return Ok(Found::Open);
        }
        // No ball fits the box around the cloud that is larger.
        let all = 2.0 * farthest > search.extents().into_iter().fold(f64::INFINITY, f64::min) + grid.max_spacing();
        // Where balls were tried before, they were to be.
        let tried = progress.balls();
        if sides.basins.is_empty() && all && tried == 0 {
            return Ok(Found::Nothing(around.deepest(engine, search, &mut progress)?));
        }
        if tried > 0 || (!sides.basins.is_empty() && all && !enough(&sides)) {
            for (balls, part) in (1..).zip(POCKET_RADII).skip(tried) {
                let ball = (part * farthest, &sides.inside);
                let fields: [&dyn SavedField; 2] = [&around.distance, &sides.inside];
                let closed = progress.step(&fields, || around.sides(engine, search, Some(ball)))?;
                if closed.lost.len() < sides.lost.len() {
                    sides = closed;
                }
                progress.told(around.near(), &sides, balls)?;
            }
        }
        if !sides.basins.is_empty() && (all || enough(&sides)) {
            let reaches = Reaches { inner: half_width as f32, outer: half_width as f32 };
            let Sides { inside, basins, lost } = sides;
            let geometry = &around.region.geometry;
            let sheet = hold_sheets(engine.comm(), geometry, search.cloud, &lost, Company::AT_THE_START, &inside)?;
            tell_faces(engine.comm(), &inside)?;
            return Ok(Found::Enclosed(Box::new(around.enclosed(0.0, reaches, inside, basins, sheet))));
        }
        farthest *= 2.0;
    }
}

/// The surface of points with normals, for what encloses nothing: told near them. Nothing of it is to be solved.
///
/// # Errors
/// When the box does not fit the memory, scratch runs out or the run is interrupted.
pub(crate) fn face(engine: &Engine, search: &Search<'_>, surfels: &[Surfel]) -> Result<Box<Enclosure>> {
    let mut progress = Progress::begin(engine, search.suffix)?;
    let farthest = progress.farthest_or(search.first_reach);
    let around = Around::new(engine, search, farthest, &mut progress)?;
    let stage = around.tagging(engine, search);
    let geometry = &around.region.geometry;
    let u = level_set(&stage, engine, geometry, surfels, around.near())?;
    stage.finish();
    let inside = BrickArray::blank(engine.scratch(), around.distance.set(), 0u8)?;
    let reaches = Reaches { inner: 0.0, outer: 0.0 };
    let enclosure = around.enclosed(0.0, reaches, inside, Vec::new(), Vec::new());
    Ok(Box::new(Enclosure { known: Some(u), ..enclosure }))
}

/// The flood from outside, to a start surface at one distance from all of the cloud.
fn enclose_by_flood(engine: &Engine, search: &Search<'_>) -> Result<Found> {
    let grid = search.grid;
    let mean = libm::cbrt(grid.voxel_volume());
    let mut progress = Progress::begin(engine, search.suffix)?;
    let mut farthest = progress.farthest_or(search.first_reach);
    loop {
        let around = Around::new(engine, search, farthest, &mut progress)?;
        let stage = around.tagging(engine, search);
        // Whoever names a beta knows how deep the inside is.
        let ratio = if search.beta.is_some() { 1.0 } else { PERSISTENCE };
        let wanted = |basin: &Basin| search.beta.is_none_or(|beta| search.holds(basin, beta));
        let flood = || tag(&stage, engine, &around.sources(search), around.near(), ratio, wanted);
        let mut tagging = progress.step(&[&around.distance], flood)?;
        let beta = search.beta.or_else(|| automatic_beta(&tagging.basins, grid));
        let Some(beta) = beta.filter(|&beta| tagging.basins.iter().any(|basin| search.holds(basin, beta))) else {
            stage.finish();
            // The deepest comes first; noise is as deep as its saddle.
            let deepest = Deepest::of(&tagging.basins, &around.region.geometry);
            let persists = deepest.filter(|d| d.depth >= f64::from(PERSISTENCE) * 0.5 * d.hole.width);
            if let (Some(_), Some(deepest)) = (search.beta, persists) {
                return Ok(Found::Leaks(deepest));
            }
            if farthest > search.deepest_possible() {
                return Ok(Found::Nothing(deepest));
            }
            farthest *= 2.0;
            continue;
        };
        let half_width = (2.0 * beta).max(BAND_VOXELS * mean);
        let outer = (beta + 0.5 * half_width).max(half_width);
        if half_width.max(outer) + 2.0 * grid.max_spacing() > farthest {
            stage.finish();
            farthest = half_width.max(outer) + 3.0 * grid.max_spacing();
            continue;
        }
        let deepest = Deepest::of(&tagging.basins, &around.region.geometry);
        tagging.basins.retain(|basin| search.holds(basin, beta));
        let inside =
            progress.step(&[&around.distance], || tagging.inside(&stage, engine, around.near(), beta as f32))?;
        stage.finish();
        let reaches = Reaches { inner: half_width as f32, outer: outer as f32 };
        let enclosure = around.enclosed(beta, reaches, inside, tagging.basins, Vec::new());
        return Ok(Found::Enclosed(Box::new(Enclosure { deepest, ..enclosure })));
    }
}

fn automatic_beta(basins: &[Basin], grid: &Geometry) -> Option<f64> {
    let saddle = basins.iter().map(|b| f64::from(b.saddle)).reduce(f64::max)?;
    Some((ABOVE_SADDLE * saddle).max(SMALLEST_BETA_VOXELS * grid.min_spacing()))
}

/// The distance within some reach of the cloud.
struct Around {
    region: RegionOfInterest,
    /// On this rank's part of the region's cells.
    distance: BrickArray<f32>,
    held: Hold,
}

impl Around {
    fn new<'a>(engine: &'a Engine, search: &Search<'_>, farthest: f64, progress: &mut Progress<'a>) -> Result<Self> {
        progress.reach(farthest)?;
        // The box grows with the reach: what it takes is held again, the tables of its grid before they are made.
        let (points, cells) =
            (search.cloud.len() as u64, RegionOfInterest::grid_cells(search.grid, search.cloud, farthest));
        let tables = engine.hold(box_bytes(points, cells, 0))?;
        let region = RegionOfInterest::new(search.grid, search.cloud, farthest);
        drop(tables);
        let held = engine.hold(region.held(search.cloud))?;
        let set = &region.cells;
        let sources = Sources::cloud(&region.geometry, search.cloud, &region.bins);
        let stage = progress.stage(engine, &format!("distance{}", search.suffix), 11 * set.len() as u64);
        stage.voxels((set.len() * set.grid().brick_len()) as u64);
        let own = Arc::new(equal_part(engine.comm(), set));
        let distance = if let Some(mut distance) = progress.distance(engine, &own)? {
            distance.set_all_absent(farthest as f32);
            distance
        } else {
            let distance = cloud_distance(&stage, engine, &sources, set, search.method, farthest as f32)?;
            progress.solved(&distance)?;
            distance
        };
        stage.finish();
        Ok(Self { region, distance, held })
    }

    /// The sides of the cloud as an earlier run told them, else as they are without balls.
    fn sides_found(&self, engine: &Engine, search: &Search<'_>, progress: &mut Progress<'_>) -> Result<Sides> {
        if let Some(sides) = progress.sides(engine, self.near())? {
            return Ok(sides);
        }
        let sides = progress.step(&[&self.distance], || self.sides(engine, search, None))?;
        progress.told(self.near(), &sides, 0)?;
        Ok(sides)
    }

    fn near(&self) -> Near<'_> {
        Near { distance: &self.distance, cells: &self.region.cells }
    }

    fn sources<'a>(&'a self, search: &Search<'a>) -> Sources<'a> {
        Sources::cloud(&self.region.geometry, search.cloud, &self.region.bins)
    }

    /// The sides of the cloud; with a radius, what is open is closed by a ball of it, what is inside stays so.
    fn sides(&self, engine: &Engine, search: &Search<'_>, ball: Option<(f64, &BrickArray<u8>)>) -> Result<Sides> {
        let stage = self.tagging(engine, search);
        let pockets = ball
            .map(|(radius, inside)| pockets(&stage, engine, &self.region.geometry, self.near(), inside, radius))
            .transpose()?;
        let sides = watershed(&stage, engine, &self.sources(search), self.near(), pockets.as_ref())?;
        stage.finish();
        Ok(sides)
    }

    /// The deepest space of a cloud that encloses nothing: what a given beta could start from.
    fn deepest(&self, engine: &Engine, search: &Search<'_>, progress: &mut Progress<'_>) -> Result<Option<Deepest>> {
        let stage = self.tagging(engine, search);
        let flood = || tag(&stage, engine, &self.sources(search), self.near(), 1.0, |_| false);
        let tagging = progress.step(&[&self.distance], flood)?;
        stage.finish();
        Ok(Deepest::of(&tagging.basins, &self.region.geometry))
    }

    fn tagging<'a>(&self, engine: &'a Engine, search: &Search<'_>) -> Stage<'a> {
        let set = &self.region.cells;
        let stage = engine.stage(&format!("tagging{}", search.suffix), 0);
        stage.voxels((set.len() * set.grid().brick_len()) as u64);
        stage
    }

    fn enclosed(
        self,
        beta: f64,
        reaches: Reaches,
        inside: BrickArray<u8>,
        basins: Vec<Basin>,
        sheet: Vec<u32>,
    ) -> Enclosure {
        let Self { region: RegionOfInterest { geometry, window, cells, .. }, distance, held } = self;
        let deepest = Deepest::of(&basins, &geometry);
        Enclosure {
            geometry,
            window,
            beta,
            reaches,
            cells,
            distance,
            inside,
            basins,
            deepest,
            sheet,
            known: None,
            held,
        }
    }
}

#[cfg(test)]
mod tests;
