//! The whole job: ingest, solve each object, write the store.

use std::collections::BTreeMap;

use super::estimate::estimate;
use super::kept::{Kept, labels_of, objects_of};
use super::label_image::early::begin_early;
use super::label_image::write::write_labels;
use super::labels::Placed;
use super::marks_table::write_marks;
use super::meshes::ObjectMeshes;
use super::neighbours::Found;
use super::object_report::{ObjectReport, Refused};
use super::objects::{Objects, solve_all};
use super::picture::{Picture, World};
use super::ranks::parts::kept_parts;
use super::ranks::solved::Solved;
use super::settings::{Guides, SegmentSettings};
use super::tissue::{join_objects, write_faces};
use crate::error::{Error, Result};
use crate::exec::Engine;
use crate::grid::{Box3, Geometry};
use crate::io::ome_zarr::{Content, ImageSpec, StoreWriter};
use crate::kernel::surface::Contact;
use crate::pipeline::image::as_read::AsRead;
use crate::pipeline::image::ingest::{Image, Ingest, ingest};
use crate::pipeline::output::pyramid::{Reduce, held, write_levels};
use crate::store::{BoxSource, Element, ElementType, Sample, SampleWork, VolumeSource};

/// What a segmentation found.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The grid of the image.
    pub geometry: Geometry,
    /// Type of the image's voxels.
    pub element: ElementType,
    /// The smallest and largest value of these voxels.
    pub extremes: [f64; 2],
    /// The objects in order of their labels.
    pub objects: Vec<ObjectReport>,
    /// The objects that could not be solved.
    pub refused: Vec<Refused>,
    /// Voxels of each label.
    pub label_voxels: BTreeMap<u32, u64>,
    /// What was found of neighbours.
    pub neighbours: Found,
    /// The common faces of labels, where any meet.
    pub contacts: Vec<Contact>,
}

/// Of whole numbers up to that, 2^53, each is held exactly in f64, the type that 64-bit ones are read in.
pub const LARGEST_WHOLE: f64 = 9_007_199_254_740_992.0;

/// Segments the part `crop` of a stack; `store` gets the results, `meshes` the surfaces, as
/// far as these are there.
///
/// # Errors
/// When the memory is too little, the stack or the marks cannot be used, the output cannot be written, scratch runs out, or the run is
/// interrupted.
pub fn segment(
    engine: &Engine,
    stack: &dyn VolumeSource,
    crop: &Box3,
    guides: &Guides<'_>,
    settings: &SegmentSettings,
    (store, meshes): (Option<&StoreWriter>, Option<&dyn ObjectMeshes>),
) -> Result<Outcome> {
    let job = Job { engine, stack, crop, guides, settings, store, meshes, keeps: false };
    stack.element().with_samples(job).map(|(outcome, _)| outcome)
}

/// The same of a whole stack; its fields are kept beside what is written.
///
/// # Errors
/// As [`segment`].
pub fn segment_kept(
    engine: &Engine,
    stack: &dyn VolumeSource,
    guides: &Guides<'_>,
    settings: &SegmentSettings,
    store: Option<&StoreWriter>,
) -> Result<(Outcome, Option<Kept>)> {
    let crop = &guides.geometry.domain();
    stack.element().with_samples(Job { engine, stack, crop, guides, settings, store, meshes: None, keeps: true })
}

/// Writes the part `crop` of a stack, whose grid is `geometry`, as the image of a store without objects: where none of them can be solved.
///
/// # Errors
/// When the memory is too little, the stack cannot be read, the store cannot be written, scratch runs out, or the run is interrupted.
pub fn image_alone(
    engine: &Engine,
    stack: &dyn VolumeSource,
    crop: &Box3,
    geometry: &Geometry,
    settings: &SegmentSettings,
    store: &StoreWriter,
) -> Result<()> {
    stack.element().with_samples(Alone { engine, stack, crop, geometry, settings, store })
}

struct Alone<'a> {
    engine: &'a Engine,
    stack: &'a dyn VolumeSource,
    crop: &'a Box3,
    geometry: &'a Geometry,
    settings: &'a SegmentSettings,
    store: &'a StoreWriter,
}

impl SampleWork for Alone<'_> {
    type Output = Result<()>;

    fn on<T: Sample>(self) -> Self::Output {
        let Self { engine, stack, crop, geometry, settings, store } = self;
        let nobody = Guides { geometry, objects: &[], refused: &[] };
        let needs = estimate(stack, crop, &nobody, settings, engine.threads() as u64, true);
        let _held = engine.reserve(needs.footprint)?;
        let stage = engine.stage("read stack", stack.natural_boxes(crop).len() as u64);
        let image = ingest::<T>(&stage, engine, &ingest_of(stack, crop, settings))?;
        stage.finish();
        write_image(engine, geometry, (&image, &image.bricks), store)
    }
}

/// What there is to segment, and where it goes.
struct Job<'a> {
    engine: &'a Engine,
    stack: &'a dyn VolumeSource,
    crop: &'a Box3,
    guides: &'a Guides<'a>,
    settings: &'a SegmentSettings,
    store: Option<&'a StoreWriter>,
    meshes: Option<&'a dyn ObjectMeshes>,
    /// Fields stay in memory or scratch.
    keeps: bool,
}

impl SampleWork for Job<'_> {
    type Output = Result<(Outcome, Option<Kept>)>;

    fn on<T: Sample>(self) -> Self::Output {
        run::<T>(&self)
    }
}

fn run<T: Sample>(job: &Job<'_>) -> Result<(Outcome, Option<Kept>)> {
    let Job { engine, stack, crop, guides, settings, store, meshes, keeps } = *job;
    let needs = estimate(stack, crop, guides, settings, engine.threads() as u64, store.is_some());
    let _held = engine.reserve(needs.footprint)?;
    let stage = engine.stage("read stack", stack.natural_boxes(crop).len() as u64);
    let comm = engine.comm();
    // Of several ranks none sees all of the image, or of the objects, before the end.
    let shown_in = store.filter(|store| store.live().is_some() && comm.ranks() == 1);
    let as_read = shown_in.map(|store| begin_image::<T>(engine, guides.geometry, store)).transpose()?.flatten();
    let parts = kept_parts(engine, guides, settings, (T::TYPE, store))?;
    let read = Ingest { parts: parts.as_deref(), as_read: as_read.as_ref(), ..ingest_of(stack, crop, settings) };
    let image = ingest::<T>(&stage, engine, &read)?;
    stage.finish();
    if settings.uses_image() && image.extremes[0] == image.extremes[1] {
        let value = image.extremes[0];
        let rounded = if T::TYPE == ElementType::F64 && value.abs() >= LARGEST_WHOLE {
            " (whole numbers from 2^53 on are rounded to doubles, so others near it may be among them)"
        } else {
            ""
        };
        let error = Error::input(format!(
            "the image holds only the value {value}{rounded}; check --channel, --time and --crop, or give --image none to \
             use the marks alone"
        ));
        return Err(match stack.path() {
            Some(path) => error.at(path),
            None => error,
        });
    }
    if let Some((store, as_read)) = shown_in.zip(as_read.as_ref()) {
        let stage = engine.stage("write image", 0);
        stage.voxels(guides.geometry.domain().volume());
        store.describe("", &image_spec(guides.geometry, &image))?;
        as_read.finish(&stage, engine, &image.bricks)?;
        stage.finish();
    }
    let is_written = as_read.is_some();
    drop(as_read);
    let origin = guides.geometry.position(crop.lo.map(|v| -v));
    let whole = Geometry { shape: stack.shape(), origin, ..guides.geometry.clone() };
    let world = World { whole: &whole, origin: guides.geometry.origin };
    let voxels = image.whole(stack, crop);
    let picture = Picture { voxels: &voxels, range: image.range, geometry: guides.geometry, world, shown_in };
    let early = shown_in.map(|store| begin_early(engine, guides, settings, store)).transpose()?;
    let early = early.as_deref();
    let Objects { solved, refused } = solve_all(engine, &picture, guides, settings, (store, meshes), early)?;
    let marked = guides.objects.iter().map(|marks| marks.object);
    let highest = marked.chain(refused.iter().map(|refused| refused.label)).max().unwrap_or(0);
    let joined = join_objects(&engine.by_itself(), guides.geometry, (&image, &voxels), placed(&solved), settings)?;
    let labels: Vec<u32> = solved.iter().map(|object| object.report.label).collect();
    let label_voxels = write_labels(engine, guides.geometry, (&joined, highest), &labels, (store, early))?;
    // The first rank draws and tells for all.
    let is_first = comm.rank() == 0;
    let contacts = match solved.len() {
        2.. if is_first => write_faces(&engine.by_itself(), guides.geometry, &joined, settings, store)?,
        _ => Vec::new(),
    };
    let neighbours = joined.found.clone();
    let labels = keeps.then(|| labels_of(engine, guides.geometry, &joined)).transpose()?;
    drop(joined);
    if let Some(store) = store {
        if !is_written {
            write_image(engine, guides.geometry, (&image, &voxels), store)?;
        }
        if is_first {
            write_marks(store, guides.objects)?;
        }
    }
    let (objects, reports) = objects_of(solved);
    let kept = labels.map(|labels| Kept { objects, labels });
    let (geometry, extremes) = (guides.geometry.clone(), image.extremes);
    let objects = reports;
    let outcome =
        Outcome { geometry, element: T::TYPE, extremes, objects, refused, label_voxels, neighbours, contacts };
    Ok((outcome, kept))
}

/// The objects on the image's grid.
fn placed(solved: &[Solved]) -> Vec<Placed<'_>> {
    solved
        .iter()
        .map(|s| Placed { label: s.report.label, window: s.window, u: &s.u, volume: s.report.measures.volume })
        .collect()
}

/// The whole of a part of a stack, as the settings want it.
fn ingest_of<'a, T: Element>(
    volume: &'a dyn VolumeSource,
    crop: &'a Box3,
    settings: &SegmentSettings,
) -> Ingest<'a, T> {
    let (edge, percentiles) = (settings.brick, settings.percentiles);
    Ingest { volume, crop, edge, percentiles, parts: None, as_read: None }
}

fn image_spec<'a, T: Sample>(geometry: &'a Geometry, image: &Image<T>) -> ImageSpec<'a> {
    let window = Some([image.range.low, image.range.high]);
    let (element, content, extremes) = (T::TYPE, Content::Grey, Some(image.extremes));
    ImageSpec { name: "image", geometry, element, content, window, extremes }
}

/// Begins the image of a live store; nothing where there is no room for it beside what reads it.
fn begin_image<T: Sample>(engine: &Engine, geometry: &Geometry, store: &StoreWriter) -> Result<Option<AsRead<T>>> {
    let Ok(held) = engine.hold(held(geometry, &[T::TYPE], engine.threads() as u64)) else { return Ok(None) };
    let (element, content) = (T::TYPE, Content::Grey);
    let spec = ImageSpec { name: "image", geometry, element, content, window: None, extremes: None };
    AsRead::new(engine, store.image("", &spec)?, geometry, held).map(Some)
}

fn write_image<T: Sample>(
    engine: &Engine,
    geometry: &Geometry,
    (image, voxels): (&Image<T>, &dyn BoxSource<T>),
    store: &StoreWriter,
) -> Result<()> {
    let stage = engine.resumable_stage("write image", 0);
    stage.voxels(geometry.domain().volume());
    let written = store.image("", &image_spec(geometry, image))?;
    write_levels::<T>(&stage, engine, written, voxels, Reduce::Mean)?;
    stage.finish();
    Ok(())
}
