//! Reads the sources of a distance: clouds, meshes, and the borders of the labels of volumes.

use std::path::Path;

use super::image::{chosen_notes, open_stack};
use super::marks::{Reading, placed};
use super::noted::read_in_unit;
use crate::cli::args::common::PointsIn;
use crate::cli::args::distance::DistanceJobArgs;
use crate::cli::args::grid::GridArgs;
use crate::cli::terminal::console::Console;
use crate::cli::terminal::text::{bytes, grouped};
use crate::error::{Error, Result};
use crate::exec::{Budget, Cancel, Progress};
use crate::grid::{DataSets, Geometry, PointCloud, TriangleMesh, refuse_too_many};
use crate::io::geometry::read::point_file::PointFile;
use crate::io::geometry::read::points::LengthUnit;
use crate::io::geometry::read::source::Source;
use crate::io::geometry::read::sources::read_parts;
use crate::io::stack::label_volume::{LabelVolume, is_label_volume, labels_of};
use crate::kernel::geometry::solid::Solid;
use crate::pipeline::distance::seeding::label_borders::label_borders;
use crate::pipeline::distance::without_inside;
use crate::pipeline::laying::check_spacing;

/// Labels that have fewer voxels in the mean are grey values.
const FEWEST_VOXELS: u64 = 16;

/// What was read.
pub(crate) struct Read {
    pub(crate) sets: DataSets,
    /// The grid of the first label volume.
    pub(crate) volume: Option<Geometry>,
}

/// Reads all sources; a cloud or mesh is one data set with the next label, a label volume as many as it has labels. `grid`
/// is the one that was asked for, where no source is needed to tell it.
pub(crate) fn read_sets(
    args: &DistanceJobArgs,
    grid: Option<&Geometry>,
    memory: u64,
    console: &Console,
    cancel: &Cancel,
) -> Result<Read> {
    check_spacing("--image-spacing", args.job.grid.image_spacing)?;
    if args.job.grid.points_in == Some(PointsIn::Voxels) && grid.is_none() {
        return Err(Error::usage(
            "--points-in voxels counts voxels of a grid; give --like IMAGE, or --origin, --shape and --spacing",
        ));
    }
    let mut read = Read { sets: DataSets::default(), volume: None };
    // The unit of the first file that tells one.
    let mut unit = None;
    for path in &args.sources {
        let is_volume = is_label_volume(path);
        if is_volume && !args.choice.signed {
            let volume = open_volume(path, &args.job.grid, console)?;
            refuse_other_unit(volume.geometry(), &mut unit).map_err(|error| error.at(path))?;
            Budget { total: memory }.admit(volume.reading_bytes()).map_err(|error| {
                let needed = bytes(volume.reading_bytes());
                Error::usage(format!("needs {needed} to be read, for its chunks or planes; {error}")).at(path)
            })?;
            add_labels(&mut read.sets, path, &volume, console, cancel)?;
            read.volume.get_or_insert_with(|| volume.geometry().clone());
        } else if is_volume {
            return Err(without_inside("label volumes").at(path));
        } else {
            match read_placed(path, &args.job.grid, grid, &mut unit, &|text| console.note(text))? {
                Source::Cloud(_) if args.choice.signed => return Err(without_inside("points").at(path)),
                Source::Cloud(cloud) => read.sets.add_cloud(&cloud.positions),
                Source::Mesh(mesh) if args.choice.signed => {
                    read.sets.add_mesh(&turned_outside_out(path, mesh, console));
                }
                Source::Mesh(mesh) => read.sets.add_mesh(&mesh),
            }
        }
        refuse_too_many("sources", read.sets.len() as u64).map_err(|error| error.at(path))?;
    }
    Ok(read)
}

/// Reads points or a mesh. Points that count voxels are placed where the grid has them: of a file whose form says so where the
/// grid is that of an image, of any where that was asked for.
fn read_placed(
    path: &Path,
    args: &GridArgs,
    grid: Option<&Geometry>,
    unit: &mut Option<LengthUnit>,
    note: &dyn Fn(&str),
) -> Result<Source> {
    let image = grid.filter(|_| args.like.is_some() || args.points_in.is_some());
    let Some(image) = image else { return read_in_unit(path, unit, note) };
    let (source, form, notes) = read_parts(path)?;
    for text in &notes {
        note(text);
    }
    let noted = |text: &str| note(&format!("{}: {text}", path.display()));
    match (source, form) {
        (Source::Cloud(cloud), form) => {
            let file = form.unwrap_or_else(|| PointFile::physical("points", PointCloud::default()));
            for text in &file.notes {
                noted(text);
            }
            let reading = Reading { image, points_in: args.points_in, time: Some(args.volume.time) };
            let cloud = placed(PointFile { cloud, ..file }, &reading, noted).map_err(|error| error.at(path))?;
            Ok(Source::Cloud(cloud))
        }
        (mesh, _) => {
            if args.points_in == Some(PointsIn::Voxels) {
                noted("is a mesh, whose vertices are lengths; --points-in says what the numbers of points are");
            }
            Ok(mesh)
        }
    }
}

/// Refuses a volume whose lengths are in another unit than those of the files before it.
fn refuse_other_unit(volume: &Geometry, unit: &mut Option<LengthUnit>) -> Result<()> {
    let Some(own) = volume.unit.as_deref().and_then(LengthUnit::named) else { return Ok(()) };
    let before = *unit.get_or_insert(own);
    if own == before {
        return Ok(());
    }
    Err(Error::input(format!(
        "its lengths are in {}, those of the files before it in {}; name it first, so that points are told in its unit",
        own.name, before.name
    )))
}

/// Opens a label volume, and tells what there is to be told of it.
pub(crate) fn open_volume(path: &Path, args: &GridArgs, console: &Console) -> Result<LabelVolume> {
    let (path, note) = labels_of(path)?;
    let select = args.volume.select();
    let stack = open_stack(&path, select, args.image_spacing)?;
    let chosen = chosen_notes(&path, stack.stack.info(), select);
    for note in note.iter().chain(&stack.notes).chain(&chosen) {
        console.note(note);
    }
    Ok(LabelVolume::new(&path, stack.stack, stack.geometry))
}

/// Each label of a volume is a data set of that label; after other files they are numbered on.
fn add_labels(
    sets: &mut DataSets,
    path: &Path,
    volume: &LabelVolume,
    console: &Console,
    cancel: &Cancel,
) -> Result<()> {
    let before = sets.last_label();
    let borders = label_borders(volume, cancel).map_err(|error| error.at(path))?;
    let points: usize = borders.values().map(Vec::len).sum();
    let on = if before > 0 { format!("; label n of it is label {before} + n here") } else { String::new() };
    console.note(&format!(
        "{}: {} labels with {} voxels on their borders{on}",
        path.display(),
        grouped(borders.len() as u64),
        grouped(points as u64)
    ));
    let voxels = volume.geometry().domain().volume();
    if 2 * points as u64 > voxels || FEWEST_VOXELS * borders.len() as u64 > voxels {
        console.note(&format!(
            "{}: {} labels on {} voxels, {} % of which are borders; is it an image, and no label volume?",
            path.display(),
            grouped(borders.len() as u64),
            grouped(voxels),
            100 * points as u64 / voxels.max(1)
        ));
    }
    for (label, positions) in borders {
        let numbered = before.checked_add(label).filter(|label| *label < u32::MAX).ok_or_else(|| {
            Error::input(format!("has the label {label}, which is too large to be numbered on")).at(path)
        })?;
        sets.add_labelled(numbered, &positions);
    }
    Ok(())
}

/// The mesh as it is meant, for signs. Says what had to be done for that, and where it has no inside and outside that all
/// of it agrees on.
fn turned_outside_out(path: &Path, mesh: TriangleMesh, console: &Console) -> TriangleMesh {
    let solid = Solid::new(mesh);
    let (edges, name) = (solid.edges, path.display());
    for sentence in solid.found.sentences() {
        console.note(&format!("{name}: {sentence}"));
    }
    if !edges.is_closed() {
        console.note(&format!(
            "{name} is open: {} boundary edges; inside is where it winds around more than half",
            grouped(edges.open)
        ));
    }
    if !edges.is_oriented() {
        console.note(&format!(
            "{name} has {} edges whose triangles disagree on what is outside; signs there may be wrong",
            grouped(edges.flipped)
        ));
    }
    solid.mesh
}
