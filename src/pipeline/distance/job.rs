//! The whole job of `distance`: solve on a grid of any size, and write what was asked for.

use std::sync::Arc;

use super::checks::check_shape;
use super::exact::exact;
use super::medium::Medium;
use super::ranks::{Reads, part_of_rank, solve_watched};
use super::readout::early::Early;
use super::readout::found::DistanceFound;
use super::readout::images::Wanted;
use super::readout::kept::Kept;
use super::readout::reading::Reading;
use super::readout::visit::ReadOut;
use super::seeding::contiguous::contiguous_margin;
use super::{Method, Options, Schedule, Solved, Sources, Writes};
use crate::error::Result;
use crate::exec::Engine;
use crate::grid::{BrickGrid, BrickSet, DataSets, Geometry, PointBins, TriangleBins};
use crate::io::ome_zarr::StoreWriter;
use crate::kernel::distance::features::source_trees::SourceTrees;
use crate::kernel::distance::seeding::initialise::Cube;
use crate::kernel::distance::seeding::outside::OutsideSources;
use crate::kernel::distance::state::neighbours::Neighbours;
use crate::kernel::distance::state::precision::Precision;
use crate::store::VolumeSource;
use crate::store::checkpoint::SavedField;

/// Which voxels points fix at the start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Init {
    /// The corners of the point's cell (Alg. 1).
    Cell,
    /// So large a cube around each point that the cubes of a data set touch (Sec. 4.0.1).
    Contiguous,
    /// A point on a grid point that one alone, others the corners of their cell.
    Grid,
}

/// What is computed and how.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(clippy::struct_excessive_bools, reason = "each is asked for by itself")]
pub struct DistanceSettings {
    /// Which method.
    pub method: Method,
    /// In which order.
    pub schedule: Schedule,
    /// Whose sources a voxel is offered.
    pub neighbours: Neighbours,
    /// From which start.
    pub init: Init,
    /// As far as that, physical; voxels farther away hold this distance.
    pub farthest: Option<f64>,
    /// Negative inside the meshes.
    pub signed: bool,
    /// Also the label of the nearest data set.
    pub labels: bool,
    /// Also the position of the nearest source.
    pub closest_point: bool,
    /// Edge of the bricks.
    pub brick: i64,
    /// Without an error: each voxel asks the sources that can be nearest, and no method is used.
    pub exact: bool,
    /// Through an image of speeds: not distances but the times that a front takes ([`travel_times`]).
    pub timed: bool,
}

/// Edge of the bricks that times through an image of speeds are solved in.
const TIMED_BRICK: i64 = 32;

impl DistanceSettings {
    /// Whether anything asked for is made of sources.
    #[must_use]
    pub fn keeps_sources(&self) -> bool {
        self.labels || self.closest_point
    }

    /// Edge of the bricks that a grid is cut into where nobody asks for another.
    #[must_use]
    pub fn brick_for(&self, shape: [i64; 3]) -> i64 {
        let edge = self.method.solver::<f32>().brick_for(shape);
        // In a large brick ways that bend take many sweeps.
        if self.timed { edge.min(TIMED_BRICK) } else { edge }
    }

    /// Whether labels are looked at closer, for which sources are sorted.
    pub(crate) fn looks_closer<P: Precision>(&self, sets: &DataSets) -> bool {
        if self.exact {
            return false;
        }
        let is_tracked = self.schedule == Schedule::Front && self.method.solver::<P>().tracks_sources();
        self.labels && sets.count() > 1 && is_tracked
    }
}

/// Computes the distance to `sets` on a grid, stored as `P`; `store` gets the fields, none when it is absent.
///
/// # Errors
/// When the memory is too little, the method cannot do what is asked for in that order, the output cannot be written,
/// scratch runs out, or the run is interrupted.
pub fn distance<P: Precision>(
    engine: &Engine,
    geometry: &Geometry,
    sets: &DataSets,
    settings: &DistanceSettings,
    store: Option<&StoreWriter>,
) -> Result<DistanceFound> {
    distance_kept::<P>(engine, geometry, sets, settings, store, None)
}

/// The same; `kept` gets the fields, beside the store.
///
/// # Errors
/// As [`distance`].
pub fn distance_kept<P: Precision>(
    engine: &Engine,
    geometry: &Geometry,
    sets: &DataSets,
    settings: &DistanceSettings,
    store: Option<&StoreWriter>,
    kept: Option<&Kept<P>>,
) -> Result<DistanceFound> {
    read_out_kept(engine, geometry, sets, (settings, None), store, kept)
}

/// Computes the times that fronts from `sets` take to each voxel through an image of speeds on the same grid, stored as `P`;
/// `store` and `kept` get the fields. The settings say that they are timed.
///
/// # Errors
/// As [`distance`], and when the image has another shape, or holds what is no speed.
pub fn travel_times<P: Precision>(
    engine: &Engine,
    geometry: &Geometry,
    sets: &DataSets,
    (settings, speeds): (&DistanceSettings, &dyn VolumeSource),
    store: Option<&StoreWriter>,
    kept: Option<&Kept<P>>,
) -> Result<DistanceFound> {
    check_shape(speeds.shape(), geometry)?;
    read_out_kept(engine, geometry, sets, (settings, Some(speeds)), store, kept)
}

fn read_out_kept<P: Precision>(
    engine: &Engine,
    geometry: &Geometry,
    sets: &DataSets,
    (settings, speeds): (&DistanceSettings, Option<&dyn VolumeSource>),
    store: Option<&StoreWriter>,
    kept: Option<&Kept<P>>,
) -> Result<DistanceFound> {
    let writes = match store {
        Some(_) if reads_early(settings, store) => Writes::FieldsMeanwhile,
        Some(_) => Writes::Fields,
        None => Writes::Nothing,
    };
    let needs = settings.needs::<P>(geometry, sets, [engine.threads(), engine.comm().ranks()], writes);
    let needs = speeds.map_or(needs, |speeds| needs.reading(speeds, engine.threads()));
    let held = engine.reserve(needs.footprint)?;
    let lent = held.lend(needs.later);
    let trees = settings.looks_closer::<P>(sets).then(|| SourceTrees::new(sets));
    let wanted = Wanted { labels: settings.labels, borders: false, closest_point: settings.closest_point };
    let read_out = ReadOut { geometry, sets, is_signed: settings.signed, is_timed: settings.timed, wanted, kept };
    let reading = Reading::new(read_out, engine, store)?;
    if settings.exact {
        drop(lent);
        let stage = engine.stage("sort sources", 0);
        let exact = exact::<P>(geometry, sets, settings);
        stage.finish();
        return reading.finish(&exact);
    }
    // Only who watches a store gains by seeing its bricks one by one.
    let early = reads_early(settings, store).then_some(&reading as &dyn Early<P>);
    let reads = Reads { early, boxes: &reading.reads() };
    solve_sets_through::<P, _>(engine, geometry, sets, trees.as_ref(), (settings, reads, speeds), |solved, _| {
        drop(lent);
        reading.finish(&solved)
    })
}

/// Whether bricks are read out while others are still solved.
fn reads_early(settings: &DistanceSettings, store: Option<&StoreWriter>) -> bool {
    store.is_some_and(|store| store.live().is_some())
        && !settings.exact
        && settings.schedule == Schedule::Front
        && !settings.timed
        && settings.init != Init::Contiguous
}

/// Computes the distance to `sets` on a grid, stored as `P`, and hands it on, with the bricks it was solved on. `trees`
/// are the same sources, sorted: with them labels are looked at closer, where these are tracked.
///
/// # Errors
/// When the method cannot do what is asked for in that order, scratch runs out or the run is interrupted, or by what it is
/// handed to.
pub fn solve_sets<P: Precision, R>(
    engine: &Engine,
    geometry: &Geometry,
    sets: &DataSets,
    trees: Option<&SourceTrees>,
    settings: &DistanceSettings,
    then: impl FnOnce(Solved<'_, P>, &Arc<BrickSet>) -> Result<R>,
) -> Result<R> {
    solve_sets_watched(engine, geometry, sets, trees, (settings, Reads::default()), then)
}

/// The same; a front is read out as far as it has passed.
///
/// # Errors
/// As [`solve_sets`], and when the output cannot be written.
pub fn solve_sets_watched<P: Precision, R>(
    engine: &Engine,
    geometry: &Geometry,
    sets: &DataSets,
    trees: Option<&SourceTrees>,
    (settings, reads): (&DistanceSettings, Reads<'_, P>),
    then: impl FnOnce(Solved<'_, P>, &Arc<BrickSet>) -> Result<R>,
) -> Result<R> {
    solve_sets_through(engine, geometry, sets, trees, (settings, reads, None), then)
}

/// The same, where it is timed through an image of speeds.
fn solve_sets_through<P: Precision, R>(
    engine: &Engine,
    geometry: &Geometry,
    sets: &DataSets,
    trees: Option<&SourceTrees>,
    (settings, reads, speeds): (&DistanceSettings, Reads<'_, P>, Option<&dyn VolumeSource>),
    then: impl FnOnce(Solved<'_, P>, &Arc<BrickSet>) -> Result<R>,
) -> Result<R> {
    settings.check_order()?;
    let grid = BrickGrid::new(geometry.shape, settings.brick);
    let set = Arc::new(BrickSet::dense(grid));
    let order = (settings.method, settings.schedule);
    let medium = speeds.map(|speeds| Medium::read(engine, &part_of_rank::<P>(engine.comm(), &set, order).1, speeds));
    let medium = medium.transpose()?;
    medium.as_ref().map_or(Ok(()), |medium| medium.check_range::<P>(geometry))?;
    let stage = engine.stage("sort sources", 0);
    let bins = PointBins::new(grid, geometry, &sets.positions);
    let triangles = (!sets.mesh.is_empty()).then(|| TriangleBins::new(grid, geometry, &sets.mesh));
    let cubes = cubes(geometry, sets, settings.init);
    // Nobody knows how fast a front is outside of an image.
    let outside = if medium.is_none() { OutsideSources::new(geometry, sets) } else { None };
    let sources = Sources {
        geometry,
        positions: &sets.positions,
        bins: &bins,
        cubes: &cubes,
        mesh: triangles.as_ref().map(|bins| (&sets.mesh, bins)),
        sets: Some(sets),
        trees,
        outside: outside.as_ref(),
        medium: medium.as_ref(),
    };
    stage.finish();
    let stage = engine.resumable_stage("distance", set.len() as u64);
    stage.voxels(geometry.domain().volume());
    let options = Options {
        farthest: settings.farthest.unwrap_or(f64::INFINITY),
        neighbours: settings.neighbours,
        sources: settings.keeps_sources(),
        labels: settings.labels,
    };
    let solved = solve_watched::<P>(&stage, &sources, &set, order, options, reads)?;
    stage.finish();
    let state = solved.state.clone();
    engine.after("distance", state.as_deref().map(|state| state as &dyn SavedField), || then(solved, &set))
}

/// The voxels that the points of each data set fix.
fn cubes(geometry: &Geometry, sets: &DataSets, init: Init) -> Vec<(u32, Cube)> {
    let clouds = sets.clouds().filter(|points| !points.is_empty());
    let cube = |points: &std::ops::Range<u32>| match init {
        Init::Cell => Cube::CELL,
        Init::Grid => Cube { snaps: true, ..Cube::CELL },
        Init::Contiguous => {
            let points = &sets.positions[points.start as usize..points.end as usize];
            Cube { margin: contiguous_margin(geometry, points), snaps: false }
        }
    };
    clouds.map(|points| (points.end, cube(&points))).collect()
}
