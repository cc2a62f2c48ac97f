//! Reads the sources of a distance: clouds, meshes, and the borders of the labels of volumes.

use std::path::Path;

use super::console::Console;
use super::distance_args::{DistanceJobArgs, GridArgs};
use super::grid::check_spacing;
use super::input::open_stack;
use super::text::grouped;
use crate::error::{Error, Result};
use crate::exec::{Cancel, Progress};
use crate::grid::{DataSets, Geometry, TriangleMesh, refuse_too_many};
use crate::io::label_volume::{LabelVolume, is_label_volume};
use crate::io::ome_zarr::is_store;
use crate::io::sources::{Source, read_source};
use crate::pipeline::label_borders::label_borders;

/// What was read.
pub(super) struct Read {
    pub(super) sets: DataSets,
    /// The grid of the first label volume.
    pub(super) volume: Option<Geometry>,
}

/// Reads all sources; a cloud or mesh is one data set with the next label, a label volume as many as it has labels.
pub(super) fn read_sets(args: &DistanceJobArgs, console: &Console, cancel: &Cancel) -> Result<Read> {
    check_spacing("--image-spacing", args.job.grid.image_spacing)?;
    let mut read = Read { sets: DataSets::default(), volume: None };
    for path in &args.sources {
        let is_volume = is_label_volume(path);
        if is_volume && !args.choice.signed {
            let volume = open_volume(path, &args.job.grid, console)?;
            add_labels(&mut read.sets, path, &volume, console, cancel)?;
            read.volume.get_or_insert_with(|| volume.geometry().clone());
        } else if is_volume {
            return Err(without_inside("label volumes").at(path));
        } else {
            match read_source(path)? {
                Source::Cloud(_) if args.choice.signed => return Err(without_inside("points").at(path)),
                Source::Cloud(cloud) => read.sets.add_cloud(&cloud.positions),
                Source::Mesh(mesh) => {
                    if args.choice.signed {
                        tell_of_holes(path, &mesh, console);
                    }
                    read.sets.add_mesh(&mesh);
                }
            }
        }
        refuse_too_many("sources", read.sets.len() as u64).map_err(|error| error.at(path))?;
    }
    Ok(read)
}

fn without_inside(what: &str) -> Error {
    Error::input(format!("holds {what}, which have no inside here; --signed needs triangle meshes"))
}

fn open_volume(path: &Path, grid: &GridArgs, console: &Console) -> Result<LabelVolume> {
    let spacing = grid.image_spacing;
    if is_store(path) {
        if grid.pages.is_given() {
            return Err(Error::usage("is a store; --axes and --image-index are for TIFF files").at(path));
        }
        let mut volume = LabelVolume::of_store(path)?;
        if let Some(spacing) = spacing {
            volume.set_spacing(spacing);
        }
        return Ok(volume);
    }
    let stack = open_stack(path, grid.pages.select(0, 0), spacing)?;
    for note in &stack.notes {
        console.note(note);
    }
    Ok(LabelVolume::of_stack(path, stack.stack, stack.geometry))
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
    if 2 * points as u64 > volume.geometry().domain().volume() {
        console.note(&format!("{}: most voxels are borders; is it an image, and no label volume?", path.display()));
    }
    for (label, positions) in borders {
        let numbered = before.checked_add(label).filter(|label| *label < u32::MAX).ok_or_else(|| {
            Error::input(format!("has the label {label}, which is too large to be numbered on")).at(path)
        })?;
        sets.add_labelled(numbered, &positions);
    }
    Ok(())
}

/// Says where a mesh has no inside and outside that all of it agrees on.
fn tell_of_holes(path: &Path, mesh: &TriangleMesh, console: &Console) {
    let edges = mesh.boundary_edges();
    let name = path.display();
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
}
