//! The whole job: ingest, solve each object, write the store.

use std::collections::BTreeMap;

use super::cross_validate::cross_validate;
use super::labels::Placed;
use super::neighbours::{Found, Joined};
use super::object::{ObjectReport, Picture, Solution, solve};
use super::outlines::scatter_of;
use super::settings::{Guides, ImageModel, SegmentSettings, Start};
use super::survey::{Outlined, Trust, trust};
use super::tissue::{join_objects, write_faces};
use crate::error::{Error, ErrorKind, Result};
use crate::exec::{Engine, Stage, Workers};
use crate::grid::{Box3, BrickGrid, Geometry};
use crate::io::ome_zarr::{ImageSpec, LabelColor, LabelSpec, StoreWriter};
use crate::kernel::image::labels;
use crate::kernel::image::palette::label_color;
use crate::kernel::surface::Contact;
use crate::kernel::surface::Hausdorff;
use crate::pipeline::ingest::{Image, ingest};
use crate::pipeline::marks::{ObjectMarks, split_and_seed};
use crate::pipeline::pyramid::{Reduce, write_levels};
use crate::pipeline::surface::{self, Drawn};
use crate::store::{BoxSource, Element, ElementType, PlaneSource, Sample};

/// An object that could not be solved.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refused {
    /// Its number.
    pub label: u32,
    /// Why, in one sentence.
    pub reason: String,
}

/// What a segmentation found.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The grid of the image.
    pub geometry: Geometry,
    /// Type of the image's voxels.
    pub element: ElementType,
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

/// Segments the part `crop` of a stack; `store` gets the results, none of them when it is absent.
///
/// # Errors
/// When the stack or the marks cannot be used, the output cannot be written, scratch runs out, or the run is
/// interrupted.
pub fn segment(
    engine: &Engine,
    stack: &dyn PlaneSource,
    crop: &Box3,
    guides: &Guides<'_>,
    settings: &SegmentSettings,
    store: Option<&StoreWriter>,
) -> Result<Outcome> {
    match stack.element() {
        ElementType::U8 => run::<u8>(engine, stack, crop, guides, settings, store),
        ElementType::U16 => run::<u16>(engine, stack, crop, guides, settings, store),
        ElementType::U32 => run::<u32>(engine, stack, crop, guides, settings, store),
        ElementType::F64 => run::<f64>(engine, stack, crop, guides, settings, store),
        ElementType::F32 | ElementType::F16 => run::<f32>(engine, stack, crop, guides, settings, store),
    }
}

fn run<T: Sample>(
    engine: &Engine,
    stack: &dyn PlaneSource,
    crop: &Box3,
    guides: &Guides<'_>,
    settings: &SegmentSettings,
    store: Option<&StoreWriter>,
) -> Result<Outcome> {
    let objects = split_and_seed(guides.cloud, guides.seeds);
    let stage = engine.stage("read stack", crop.shape()[2].unsigned_abs());
    let image = ingest::<T>(&stage, engine, stack, crop, settings.brick, settings.percentiles)?;
    stage.finish();
    if settings.uses_image() && image.extremes[0] == image.extremes[1] {
        return Err(Error::input(format!(
            "the image holds only the value {}; check --channel, --time and --crop, or give --image none to use the marks \
             alone",
            image.extremes[0]
        )));
    }
    let picture = Picture { voxels: &image.bricks, range: image.range, geometry: guides.geometry };
    let (outlined, trusts) = survey(engine, &picture, &objects, settings)?;
    let (mut solved, mut refused) = (Vec::new(), Vec::new());
    for (n, marks) in objects.iter().enumerate() {
        let outlined = outlined[n].as_ref();
        let found = solve(engine, &picture, marks, outlined.zip(trusts[n]), settings)
            .and_then(|solution| Ok((draw(engine, &solution, marks, store, objects.len() > 1)?, solution)));
        match found {
            Ok((mut report, solution)) => {
                if settings.cross_validate {
                    report.cross_validation =
                        outlined.map(|o| cross_validate(engine, o, guides.geometry)).transpose()?.flatten();
                }
                solved.push((solution, report));
            }
            // One object that cannot be solved does not stop the others.
            Err(error) if error.kind() == ErrorKind::Input && objects.len() > 1 => {
                refused.push(Refused { label: marks.object, reason: error.to_string() });
            }
            Err(error) => return Err(error),
        }
    }
    if solved.is_empty() {
        let reasons: Vec<String> = refused.into_iter().map(|refused| refused.reason).collect();
        return Err(Error::input(reasons.join("; ")));
    }
    let joined = join_objects(engine, guides.geometry, &image, placed(&solved), settings)?;
    let label_voxels = write_labels(engine, guides.geometry, &joined, &solved, store)?;
    let contacts = match solved.len() {
        0 | 1 => Vec::new(),
        _ => write_faces(engine, guides.geometry, &joined, settings, store)?,
    };
    let neighbours = joined.found.clone();
    drop(joined);
    if let Some(store) = store {
        write_image(engine, guides.geometry, &image, store)?;
    }
    let objects = solved.into_iter().map(|(_, report)| report).collect();
    let geometry = guides.geometry.clone();
    Ok(Outcome { geometry, element: T::TYPE, objects, refused, label_voxels, neighbours, contacts })
}

/// Each object's outlines and how far they are trusted; none where its marks are none.
type Surveyed = (Vec<Option<Outlined>>, Vec<Option<Trust>>);

/// Looks at all objects that are marked by outlines, unless the papers' start was asked for.
fn survey<T: Element>(
    engine: &Engine,
    picture: &Picture<'_, T>,
    objects: &[ObjectMarks],
    settings: &SegmentSettings,
) -> Result<Surveyed> {
    let scatter = scatter_of(objects, picture.geometry);
    let looks = settings.uses_image() && settings.image != ImageModel::Edge;
    let outlined = |marks: &ObjectMarks| match settings.start {
        Start::Auto if marks.seed.is_none() => Outlined::new(engine, picture, marks, scatter, looks),
        _ => Ok(None),
    };
    let outlined: Vec<Option<Outlined>> = objects.iter().map(outlined).collect::<Result<_>>()?;
    let trusts = trust(&outlined, picture.geometry, scatter, settings.image);
    Ok((outlined, trusts))
}

/// Extracts, measures and writes an object's surface, and writes its segmentation function.
fn draw(
    engine: &Engine,
    solution: &Solution,
    marks: &ObjectMarks,
    store: Option<&StoreWriter>,
    several: bool,
) -> Result<ObjectReport> {
    let (u, geometry, label) = (&solution.u, &solution.geometry, marks.object);
    let stage = engine.stage(&format!("surface {label}"), 0);
    let name = if several { format!("meshes/object-{label}.ply") } else { "meshes/surface.ply".into() };
    let mesh = store.map(|store| store.file(&name)).transpose()?;
    let Drawn { measures, hausdorff, lost_points } =
        surface::draw(&stage, u, geometry, &marks.contours.concat(), mesh.as_deref())?;
    stage.voxels(solution.band_voxels);
    stage.finish();
    check_surface(marks, geometry, hausdorff)?;
    if let Some(store) = store {
        let farthest = f64::from(solution.distance.absent(0));
        for (name, field, high) in [("levelset", u, 1.0), ("distance", &solution.distance, farthest)] {
            let group = if several { format!("{name}/object-{label}") } else { name.into() };
            let spec = ImageSpec { name, geometry, element: ElementType::F32, window: Some([0.0, high]) };
            let stage = engine.stage(&format!("write {name} {label}"), 0);
            write_levels::<f32>(&stage, engine, store.image(&group, &spec)?.levels(), field, Reduce::Mean)?;
            stage.finish();
        }
    }
    Ok(ObjectReport {
        label,
        cloud_points: solution.cloud_points,
        beta: solution.beta,
        hole: solution.hole,
        band_voxels: solution.band_voxels,
        evolution: solution.evolution,
        measures,
        hausdorff,
        marks_off: lost_points,
        image_model: solution.image_model,
        theta: solution.theta,
        rho: solution.rho,
        cross_validation: None,
    })
}

/// The objects on the image's grid.
fn placed(solved: &[(Solution, ObjectReport)]) -> Vec<Placed<'_>> {
    solved
        .iter()
        .map(|(s, report)| Placed { label: report.label, window: s.window, u: &s.u, volume: report.measures.volume })
        .collect()
}

/// Marks lie so many largest spacings from their surface in the mean, at most.
const MOST_OFF: f64 = 4.0;

/// Refuses a surface that is not that of the marks.
fn check_surface(marks: &ObjectMarks, geometry: &Geometry, hausdorff: Option<Hausdorff>) -> Result<()> {
    let object = marks.object;
    let wrong = |what: String| {
        Error::input(format!(
            "object {object}: {what}; leave out --beta, --theta and --rho where they were given, or mark more outlines"
        ))
    };
    match hausdorff {
        None if marks.seed.is_none() => Err(wrong("its surface vanished".into())),
        Some(found) if found.mean > MOST_OFF * geometry.max_spacing() => {
            let off = found.mean;
            Err(wrong(format!("its marks lie {off:.3} from the surface that was found, in the mean")))
        }
        _ => Ok(()),
    }
}

fn write_labels(
    engine: &Engine,
    geometry: &Geometry,
    volume: &Joined<'_>,
    solved: &[(Solution, ObjectReport)],
    store: Option<&StoreWriter>,
) -> Result<BTreeMap<u32, u64>> {
    let stage = engine.stage("write labels", 0);
    stage.voxels(geometry.domain().volume());
    let highest = solved.iter().map(|(_, r)| r.label).max().unwrap_or(0);
    let counts = match highest {
        0..=0xff => write_labels_as::<u8>(&stage, engine, geometry, volume, solved, store),
        0x100..=0xffff => write_labels_as::<u16>(&stage, engine, geometry, volume, solved, store),
        _ => write_labels_as::<u32>(&stage, engine, geometry, volume, solved, store),
    }?;
    stage.finish();
    Ok(counts)
}

fn write_labels_as<T: Element>(
    stage: &Stage<'_>,
    engine: &Engine,
    geometry: &Geometry,
    volume: &Joined<'_>,
    solved: &[(Solution, ObjectReport)],
    store: Option<&StoreWriter>,
) -> Result<BTreeMap<u32, u64>> {
    if let Some(store) = store {
        let colors: Vec<LabelColor> = solved
            .iter()
            .map(|(_, r)| {
                let [red, green, blue] = label_color(r.label);
                LabelColor { label: r.label, rgba: [red, green, blue, 255] }
            })
            .collect();
        let spec = LabelSpec { name: "segmentation", geometry, element: T::TYPE, colors: &colors };
        let image = store.labels(&spec)?;
        write_levels::<T>(stage, engine, image.levels(), volume, Reduce::Mode)?;
    }
    count_labels(stage, geometry, volume)
}

/// Voxels of each label.
fn count_labels(stage: &Stage<'_>, geometry: &Geometry, volume: &Joined<'_>) -> Result<BTreeMap<u32, u64>> {
    let grid = BrickGrid::new(geometry.shape, 64);
    let parts: Vec<Box3> = (0..grid.len()).map(|id| grid.brick_box(id)).collect();
    let counts = stage.run(&parts, &Workers::new(Vec::new), |labels, part| {
        if BoxSource::<u32>::constant_in(volume, part) == Some(0) {
            return Ok(BTreeMap::new());
        }
        labels.resize(part.len(), 0);
        volume.read_box(part, labels)?;
        Ok(labels::count(labels))
    })?;
    Ok(counts.into_iter().flatten().fold(BTreeMap::new(), |mut all, (label, n)| {
        *all.entry(label).or_default() += n;
        all
    }))
}

fn write_image<T: Sample>(engine: &Engine, geometry: &Geometry, image: &Image<T>, store: &StoreWriter) -> Result<()> {
    let stage = engine.stage("write image", 0);
    stage.voxels(geometry.domain().volume());
    let window = Some([image.range.low, image.range.high]);
    let levels = store.image("", &ImageSpec { name: "image", geometry, element: T::TYPE, window })?;
    write_levels::<T>(&stage, engine, levels.levels(), &image.bricks, Reduce::Mean)?;
    stage.finish();
    Ok(())
}
