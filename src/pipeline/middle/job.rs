//! The whole job of `middle`: solve with source tracking, make labels exact where that was asked for, draw the surfaces
//! between them, measure and write.

use super::draw::{Boxes, draw};
use super::exact::with_exact_labels;
use super::settings::{LabelMode, MiddleSettings};
use super::surface::SurfaceKind;
use super::surface::{Drawing, Labelled};
use super::touching::Touching;
use super::walls::{WallsOf, write_tables};
use crate::error::{Error, Result};
use crate::exec::Engine;
use crate::grid::{Box3, BrickGrid, BrickId, DataSets, Geometry};
use crate::io::ome_zarr::StoreWriter;
use crate::kernel::distance::features::exact_sources::ExactSources;
use crate::kernel::distance::features::labelled_shapes::LabelledShapes;
use crate::kernel::distance::features::source_trees::SourceTrees;
use crate::kernel::distance::repair::bends::MARGIN;
use crate::kernel::distance::state::precision::Precision;
use crate::kernel::surface::{LabelMeasures, Measures, Pair, Walls, label_measures};
use crate::pipeline::distance::seeding::label_borders::Labels;
use crate::pipeline::distance::{
    DistanceFound, DistanceSettings, Kept, ReadOut, Reading, Reads, Wanted, solve_sets_watched,
};
use crate::store::MeshSink;

/// What a job found.
#[derive(Clone, Debug, PartialEq)]
pub struct MiddleFound {
    /// Of the distance.
    pub distance: DistanceFound,
    /// The measures of all surfaces as one mesh; its volume is that around the second label, where it is closed.
    pub measures: Measures,
    /// What lies between each two labels that meet.
    pub pairs: Vec<Pair>,
    /// What each label measures.
    pub labels: Vec<LabelMeasures>,
}

/// What surfaces lie between.
#[derive(Clone, Copy)]
#[allow(missing_debug_implementations, reason = "volumes have none")]
pub struct MiddleSources<'a> {
    /// The data sets.
    pub sets: &'a DataSets,
    /// The label volume that all of them are from, where that is so: those of its voxels that touch have smooth walls between them, if it lies
    /// on the grid of the run.
    pub volume: Option<&'a dyn Labels>,
    /// Whether the surfaces are walls alone, of that volume: between its labels and around each of them.
    pub background: bool,
}

impl<'a> MiddleSources<'a> {
    /// Of data sets that lie apart.
    #[must_use]
    pub fn apart(sets: &'a DataSets) -> Self {
        Self { sets, volume: None, background: false }
    }
}

/// Computes the middle surfaces of `sets` on a grid, distances stored as `P`; `mesh` gets the surfaces, `store` the fields
/// and a table of the measures, none when it is absent.
///
/// # Errors
/// When there are fewer than two sets, the memory is too little, the mesh is not taken, the output cannot be written, scratch
/// runs out, or the run is interrupted.
pub fn middle<P: Precision>(
    engine: &Engine,
    geometry: &Geometry,
    sets: &DataSets,
    settings: &MiddleSettings,
    store: Option<&StoreWriter>,
    mesh: &mut dyn MeshSink,
) -> Result<MiddleFound> {
    middle_kept::<P>(engine, geometry, &MiddleSources::apart(sets), settings, (store, None), mesh)
}

/// The same; the fields go into the store and stay in what is kept, as far as these are there.
///
/// # Errors
/// As [`middle`].
pub fn middle_kept<P: Precision>(
    engine: &Engine,
    geometry: &Geometry,
    sources: &MiddleSources<'_>,
    settings: &MiddleSettings,
    (store, kept): (Option<&StoreWriter>, Option<&Kept<P>>),
    mesh: &mut dyn MeshSink,
) -> Result<MiddleFound> {
    let MiddleSources { sets, volume, background } = *sources;
    check_sets(sets, (settings.surface, background))?;
    let comm = engine.comm();
    let needs = settings.needs::<P>(geometry, sets, engine.threads(), comm.ranks(), store.is_some());
    let held = engine.reserve(needs.footprint)?;
    let lent = held.lend(needs.later);
    let Drawing { stated, .. } = Drawing::new(geometry, sets, engine.threads());
    let distance = DistanceSettings { labels: true, ..settings.distance };
    let trees = SourceTrees::new(sets);
    let wanted = Wanted { labels: true, borders: store.is_some(), closest_point: distance.closest_point };
    let read_out = ReadOut { geometry, sets, is_signed: distance.signed, is_timed: false, wanted, kept };
    let reading = Reading::new(read_out, engine, store)?;
    let boxes = Boxes::new(geometry, comm);
    let volume = volume.filter(|volume| volume.geometry() == geometry && settings.surface == SurfaceKind::Exact);
    let grid = BrickGrid::new(geometry.shape, distance.brick);
    let bricks = if comm.ranks() == 1 { (0..grid.len()).collect() } else { bricks_read(&grid, &reading, &boxes) };
    // Whole bricks are made exact, of voxels each of which is looked at again.
    let around = |id: &BrickId| grid.brick_box(*id).grow(MARGIN).intersect(&geometry.domain());
    let reads: Vec<Box3> = if comm.ranks() == 1 { Vec::new() } else { bricks.iter().map(around).collect() };
    let reads = Reads { early: None, boxes: &reads };
    solve_sets_watched::<P, _>(engine, geometry, sets, Some(&trees), (&distance, reads), |mut solved, set| {
        drop(lent);
        let shapes = LabelledShapes::new(sets);
        if settings.labels == LabelMode::Exact {
            let stage = engine.stage("exact labels", 0);
            stage.voxels(geometry.domain().volume());
            let farthest = distance.farthest.unwrap_or(f64::INFINITY);
            let exact = ExactSources { geometry, shapes: &shapes, trees: &trees, farthest };
            solved = with_exact_labels(&stage, &exact, (set.grid(), bricks), solved)?;
            stage.finish();
        }
        let touching = volume.map(|volume| read_touching(engine, (volume, background), &boxes)).transpose()?;
        let stage = engine.stage("surface", 0);
        stage.voxels(geometry.domain().volume());
        let first_labels = std::array::from_fn(|n| sets.labels().get(n).copied().unwrap_or(0));
        let labelled = Labelled {
            geometry,
            shapes: &shapes,
            trees: &trees,
            sources: &*solved.sources,
            first_labels,
            kind: settings.surface,
            touching: touching.as_ref(),
        };
        let (measures, pairs) = match touching.as_ref().filter(|_| background) {
            Some(touching) => draw(&stage, &WallsOf::new(geometry, touching), &boxes, stated, mesh)?,
            None => draw(&stage, &labelled, &boxes, stated, mesh)?,
        };
        stage.finish();
        if measures.triangles == 0 && comm.rank() == 0 {
            return Err(Error::vanished(
                "no surface lies between the data sets in this grid: one of them is the nearest everywhere, or --max-distance is \
                 less than half of what lies between them; give a grid that reaches others, or a larger distance",
            ));
        }
        let found = reading.finish(&solved)?;
        let labels = label_measures(&pairs);
        if let Some(store) = store.filter(|_| comm.rank() == 0) {
            write_tables(store, &pairs, &labels, &found.label_voxels)?;
        }
        Ok(MiddleFound { distance: found, measures, pairs, labels })
    })
}

/// The labels of a volume around this rank's boxes.
fn read_touching(engine: &Engine, (volume, is_bounded): (&dyn Labels, bool), boxes: &Boxes) -> Result<Touching> {
    let geometry = volume.geometry();
    let (grid, reach) = (Touching::grid(geometry), Walls::reach(geometry.spacing).map(|n| n + 2));
    let mut bricks: Vec<BrickId> = boxes.reads(reach).flat_map(|part| grid.bricks_in(&part)).collect();
    bricks.sort_unstable();
    bricks.dedup();
    let stage = engine.stage("read", 0);
    stage.voxels(geometry.domain().volume());
    let needed = |id: BrickId| bricks.binary_search(&id).is_ok();
    let touching = Touching::read_from(&stage, engine, volume, (&needed, is_bounded))?;
    stage.finish();
    Ok(touching)
}

/// The bricks whose voxels are written or drawn by this rank, or lie beside those, in order.
fn bricks_read<P: Precision>(grid: &BrickGrid, reading: &Reading<'_, P>, boxes: &Boxes) -> Vec<BrickId> {
    let parts = reading.reads().into_iter().chain(boxes.reads([2; 3]));
    let mut bricks: Vec<BrickId> = parts.flat_map(|part| grid.bricks_in(&part)).collect();
    bricks.sort_unstable();
    bricks.dedup();
    bricks
}

/// Refuses data sets between which no such surface lies.
///
/// # Errors
/// With what to give.
pub(crate) fn check_sets(sets: &DataSets, (surface, background): (SurfaceKind, bool)) -> Result<()> {
    match (sets.count(), surface) {
        (1, SurfaceKind::Exact) if background => Ok(()),
        (0 | 1, _) => Err(Error::usage(
            "a middle surface lies between data sets, but the files hold one; give two files or more, or a label volume \
             with two labels or more, or --background for the surface around the one label of a volume",
        )),
        (2, _) | (_, SurfaceKind::Exact) => Ok(()),
        (count, SurfaceKind::Labels) => Err(Error::usage(format!(
            "--surface labels draws the border of two data sets, but {count} were given; leave it out for the borders of \
             all of them"
        ))),
    }
}
