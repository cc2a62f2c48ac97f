//! The walls between the labels of a volume that fills its grid, or around each label against what has none: a job without any
//! distance, as labels touch everywhere.
//!
//! ```text
//! volume -> bricks -> boxes with more than one label -> walls -> mesh, measures of each pair and each label
//! ```

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

use super::draw::{Boxes, Draws, draw};
use super::survey::Survey;
use super::table::{labels_csv, pairs_csv};
use super::touching::{Bricks, Touching, WORK_BYTES, touching_bytes};
use crate::error::{Error, Result};
use crate::exec::{Engine, Footprint, Plan, gather_records};
use crate::grid::{Box3, BrickId, Geometry};
use crate::io::ome_zarr::{Content, ImageSpec, LabelColor, LabelSpec, StoreWriter};
use crate::kernel::image::labels;
use crate::kernel::image::picture::palette::label_color;
use crate::kernel::surface::{
    LabelMeasures, Measures, Pair, Partition, TaggedPatch, Walls, cells_of_brick, label_measures,
};
use crate::pipeline::distance::Needs;
use crate::pipeline::distance::seeding::label_borders::Labels;
use crate::pipeline::output::drawn::STATED;
use crate::pipeline::output::pyramid::{Reduce, held, write_levels};
use crate::pipeline::output::viewer_mesh;
use crate::store::{BoxSource, Element, ElementType, MeshSink};

/// Bytes of what is remembered for each voxel of the layer that is drawn.
const LAYER_BYTES: u64 = 64;
/// Bytes of a triangle that waits in a temporary file.
const WAITING_BYTES: u64 = 20;
/// How much more is held than of the surface between sources: the sides of triangles, while it is told how these are bent.
const MORE: f64 = 1.5;
/// Seconds of one thread for a voxel: read, drawn, written twice.
const READ_SECONDS: f64 = 6e-9;
const WALL_SECONDS: f64 = 150e-9;
const WRITE_SECONDS: f64 = 20e-9;

/// What is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WallsSettings {
    /// Whether labels have a surface against what has none too, and against what lies around the volume.
    pub background: bool,
}

/// What was found.
#[derive(Clone, Debug, PartialEq)]
pub struct WallsFound {
    /// Voxels of each label.
    pub label_voxels: BTreeMap<u32, u64>,
    /// The measures of all walls as one mesh; its volume has no meaning where there are more than two labels.
    pub measures: Measures,
    /// What lies between each two labels; label 0 is what has none.
    pub pairs: Vec<Pair>,
    /// What each label measures.
    pub labels: Vec<LabelMeasures>,
}

impl WallsSettings {
    /// What drawing the walls of a volume takes on so many threads of one of several ranks.
    #[must_use]
    pub fn needs(volume: &dyn Labels, survey: &Survey, threads: usize, writes: bool) -> Needs {
        let geometry = volume.geometry();
        let plane = libm::cbrt(geometry.domain().volume() as f64).powi(2) as u64;
        let natural = volume.natural_boxes().next().map_or(0, |part| part.volume());
        let reading = Footprint::of_thread(volume.reading_bytes() + 8 * natural);
        let drawing = Footprint::of_all(stated(survey, threads) + LAYER_BYTES * plane);
        let element = volume.element();
        let writing = if writes { held(geometry, &[element], threads as u64) } else { 0 };
        let footprint = reading.or(drawing, threads as u64).or(Footprint::of_all(writing), threads as u64);
        let seconds = Self::plan(geometry, threads, writes).iter().map(|(_, seconds)| seconds).sum();
        Needs {
            footprint,
            held: footprint.bytes(threads as u64),
            later: 0,
            scratch: touching_bytes(volume),
            waiting: WAITING_BYTES * survey.crowded.triangles(),
            seconds,
        }
    }

    /// The stages of the job, and what each will probably take.
    #[must_use]
    pub fn plan(geometry: &Geometry, threads: usize, writes: bool) -> Plan {
        let all = geometry.domain().volume() as f64 / threads as f64;
        let mut plan: Plan = vec![("read".into(), all * READ_SECONDS), ("surface".into(), all * WALL_SECONDS)];
        if writes {
            plan.push(("write image".into(), all * WRITE_SECONDS));
            plan.push(("write nearest".into(), all * WRITE_SECONDS));
            plan.push(("write border".into(), all * WRITE_SECONDS));
            plan.push((viewer_mesh::STAGE.to_owned(), all * WRITE_SECONDS));
        }
        plan
    }

    /// Bytes of the image and the labels in a store, if nothing of them could be compressed.
    #[must_use]
    pub fn written(volume: &dyn Labels) -> u64 {
        let element = volume.element().size() as u64;
        volume.geometry().domain().volume().saturating_mul(3 * element).saturating_mul(8) / 7
    }
}

/// Draws the walls of a volume: `mesh` gets them, `store` the volume and tables of what they measure.
///
/// # Errors
/// When there are no walls, the memory is too little, the volume cannot be read, the mesh is not taken, the output cannot be written,
/// scratch runs out, or the run is interrupted.
pub fn walls(
    engine: &Engine,
    (volume, survey): (&dyn Labels, &Survey),
    settings: WallsSettings,
    store: Option<&StoreWriter>,
    mesh: &mut dyn MeshSink,
) -> Result<WallsFound> {
    let (geometry, comm) = (volume.geometry(), engine.comm());
    let _held = engine.reserve(WallsSettings::needs(volume, survey, engine.threads(), store.is_some()).footprint)?;
    let boxes = Boxes::new(geometry, comm);
    // Each rank writes its share of the volume, wherever that lies.
    let bricks = if comm.ranks() == 1 || store.is_some() { None } else { Some(bricks_read(geometry, &boxes)) };
    let needed = |id: BrickId| bricks.as_ref().is_none_or(|bricks| bricks.binary_search(&id).is_ok());
    let stage = engine.stage("read", 0);
    stage.voxels(geometry.domain().volume());
    let touching = Touching::read_from(&stage, engine, volume, (&needed, settings.background))?;
    stage.finish();
    let stage = engine.stage("surface", 0);
    stage.voxels(geometry.domain().volume());
    let drawn = WallsOf::new(geometry, &touching);
    let (measures, pairs) = draw(&stage, &drawn, &boxes, stated(survey, engine.threads()), mesh)?;
    let own = drawn.counts.into_inner().unwrap_or_else(PoisonError::into_inner);
    let mut label_voxels = BTreeMap::new();
    for (label, count) in gather_records(comm, &own)?.into_iter().flatten() {
        *label_voxels.entry(label).or_insert(0) += count;
    }
    stage.finish();
    check_found(settings, &label_voxels)?;
    let found = WallsFound { label_voxels, measures, labels: label_measures(&pairs), pairs };
    if let Some(store) = store {
        match &touching.bricks {
            Bricks::U8(bricks) => write_volume(engine, geometry, bricks, &found, store)?,
            Bricks::U16(bricks) => write_volume(engine, geometry, bricks, &found, store)?,
            Bricks::U32(bricks) => write_volume(engine, geometry, bricks, &found, store)?,
        }
        if comm.rank() == 0 {
            write_tables(store, &found.pairs, &found.labels, &found.label_voxels)?;
        }
    }
    Ok(found)
}

/// Bytes that drawing is stated with.
fn stated(survey: &Survey, threads: usize) -> u64 {
    STATED.max((MORE * survey.crowded.drawing(threads) as f64) as u64) + WORK_BYTES * threads as u64
}

/// Whether every voxel of a volume has a label: walls then are all there is between these.
///
/// # Errors
/// When a box cannot be read, a voxel holds no label, or the run is interrupted.
pub fn is_full(volume: &dyn Labels, check: impl Fn() -> Result<()>) -> Result<bool> {
    let mut labels = Vec::new();
    for part in volume.natural_boxes() {
        check()?;
        volume.read_box(&part, &mut labels)?;
        if labels.contains(&0) {
            return Ok(false);
        }
    }
    Ok(true)
}

/// Writes the tables of pairs and of labels beside the surface.
pub(super) fn write_tables(
    store: &StoreWriter,
    pairs: &[Pair],
    labels: &[LabelMeasures],
    label_voxels: &BTreeMap<u32, u64>,
) -> Result<()> {
    for (name, text) in [("pairs", pairs_csv(pairs)), ("labels", labels_csv(labels, label_voxels))] {
        let path = store.file(&format!("meshes/{name}.csv"))?;
        std::fs::write(&path, text).map_err(|e| Error::from_io("cannot write the table", &e).at(&path))?;
    }
    Ok(())
}

/// The bricks that a rank's boxes read.
fn bricks_read(geometry: &Geometry, boxes: &Boxes) -> Vec<BrickId> {
    let grid = Touching::grid(geometry);
    let reach = Walls::reach(geometry.spacing).map(|n| n + 1);
    let mut bricks: Vec<BrickId> = boxes.reads(reach).flat_map(|part| grid.bricks_in(&part)).collect();
    bricks.sort_unstable();
    bricks.dedup();
    bricks
}

fn check_found(settings: WallsSettings, label_voxels: &BTreeMap<u32, u64>) -> Result<()> {
    if label_voxels.is_empty() {
        return Err(Error::input("holds no label: all of its voxels are 0"));
    }
    if label_voxels.len() == 1 && !settings.background {
        return Err(Error::input(
            "holds no border of a label: all of its voxels are the same; --background draws the surface around one label",
        ));
    }
    Ok(())
}

/// The labels of a volume whose walls are drawn, and how many voxels of each were seen.
pub(super) struct WallsOf<'a> {
    geometry: &'a Geometry,
    touching: &'a Touching,
    counts: Mutex<BTreeMap<u32, u64>>,
}

/// Work buffers of a thread.
pub(super) struct Work {
    partition: Partition<Walls>,
    labels: Vec<u32>,
    own: Vec<u32>,
}

impl Draws for WallsOf<'_> {
    type Work = Work;

    fn geometry(&self) -> &Geometry {
        self.geometry
    }

    fn work(&self) -> Box<dyn Fn() -> Work + Send + Sync> {
        let sides = self.touching.sides(self.geometry.spacing);
        Box::new(move || Work { partition: Partition::new(sides()), labels: Vec::new(), own: Vec::new() })
    }

    fn work_bytes(work: &Work) -> u64 {
        let labels = work.labels.capacity() + work.own.capacity();
        work.partition.bytes() + (labels * size_of::<u32>()) as u64
    }

    fn patch(&self, work: &mut Work, part: &Box3) -> Result<TaggedPatch> {
        let cells = cells_of_brick(part, self.geometry.shape, self.touching.is_bounded);
        let corners = Box3::new(cells.lo, cells.hi.map(|v| v + 1));
        let Work { partition, labels: read, own } = work;
        self.touching.read(&corners.grow(1), read)?;
        corners.grow(1).cut(read, part, own);
        self.count(own);
        let mut patch = TaggedPatch::default();
        patch.patch.cells = cells;
        // Most boxes hold one label: no more of these is looked at.
        if cells.is_empty() || self.touching.is_one(&corners.grow(1), read) {
            return Ok(patch);
        }
        let reach = self.touching.reach();
        let around = Box3::new(
            std::array::from_fn(|a| corners.lo[a] - reach[a]),
            std::array::from_fn(|a| corners.hi[a] + reach[a]),
        );
        self.touching.read(&around, read)?;
        partition.extract(read, &around, &cells, &mut patch.patch);
        patch.distances = vec![0.0; patch.patch.positions.len()];
        patch.shrink();
        Ok(patch)
    }

    /// None: they touch.
    fn gaps(&self, patch: &TaggedPatch) -> Vec<f64> {
        patch.distances.clone()
    }
}

impl<'a> WallsOf<'a> {
    /// Of a volume's labels.
    pub(super) fn new(geometry: &'a Geometry, touching: &'a Touching) -> Self {
        Self { geometry, touching, counts: Mutex::new(BTreeMap::new()) }
    }

    fn count(&self, own: &[u32]) {
        let found = labels::count(own);
        let mut counts = self.counts.lock().unwrap_or_else(PoisonError::into_inner);
        for (label, voxels) in found {
            *counts.entry(label).or_insert(0) += voxels;
        }
    }
}

/// Of each label the voxels that have a neighbour of another one.
struct Borders<'a, T: Element>(&'a dyn BoxSource<T>);

impl<T: Element> BoxSource<T> for Borders<'_, T> {
    fn shape(&self) -> [i64; 3] {
        self.0.shape()
    }

    fn read_box(&self, part: &Box3, out: &mut [T]) -> Result<()> {
        let around = part.grow(1).intersect(&Box3::from_shape(self.0.shape()));
        let mut values = vec![T::default(); around.len()];
        self.0.read_box(&around, &mut values)?;
        labels::border(&values, &around, part, out);
        Ok(())
    }
}

/// Writes the volume as the image of the store, and as labels over it: each voxel is nearest to its own.
fn write_volume<T: Element>(
    engine: &Engine,
    geometry: &Geometry,
    bricks: &dyn BoxSource<T>,
    found: &WallsFound,
    store: &StoreWriter,
) -> Result<()> {
    let element: ElementType = T::TYPE;
    let highest = found.label_voxels.keys().next_back().copied().unwrap_or(1);
    let extremes = Some([0.0, f64::from(highest)]);
    let spec = ImageSpec { name: "image", geometry, element, content: Content::Grey, window: extremes, extremes };
    let stage = engine.stage("write image", 0);
    stage.voxels(geometry.domain().volume());
    write_levels::<T>(&stage, engine, store.image("", &spec)?, bricks, Reduce::Mean)?;
    stage.finish();
    let color = |&label: &u32| {
        let [red, green, blue] = label_color(label);
        LabelColor { label, rgba: [red, green, blue, 255] }
    };
    let colors: Vec<LabelColor> = found.label_voxels.keys().map(color).collect();
    let stage = engine.stage("write nearest", 0);
    stage.voxels(geometry.domain().volume());
    let image = store.labels(&LabelSpec { name: "nearest", geometry, element, colors: &colors })?;
    write_levels::<T>(&stage, engine, image, bricks, Reduce::Mode)?;
    stage.finish();
    let stage = engine.stage("write border", 0);
    stage.voxels(geometry.domain().volume());
    let image = store.labels(&LabelSpec { name: "border", geometry, element, colors: &colors })?;
    write_levels::<T>(&stage, engine, image, &Borders(bricks), Reduce::Mode)?;
    stage.finish();
    Ok(())
}
