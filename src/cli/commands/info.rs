//! `strandline info`: what a stack, a cloud of points, a mesh or a store is, as lines or as JSON.

use std::path::Path;

use serde_json::{Value, json};

use super::info_store::store;
use crate::cli::args::common::InfoArgs;
use crate::cli::print;
use crate::cli::report::lines::{Lines, line, table};
use crate::cli::terminal::text::{grouped, number, place};
use crate::error::{Error, Result};
use crate::grid::{PointCloud, TriangleMesh};
use crate::io::geometry::read::point_file::{PointFile, Scale};
use crate::io::geometry::read::source::Source;
use crate::io::geometry::read::sources::{describe, is_standard_input};
use crate::io::ome_zarr::is_store;
use crate::io::stack::formats;
use crate::io::stack::volume::Select;
use crate::kernel::geometry::solid::Solid;
use crate::pipeline::marks::split;

/// Runs the command.
pub(crate) fn run(args: &InfoArgs) -> Result<()> {
    let path = &args.file;
    if !path.exists() && !is_standard_input(path) {
        return Err(Error::input("there is no such file or folder").at(path));
    }
    if args.pages.is_given() && formats::format_of(path).is_none() {
        return Err(Error::usage("is no TIFF stack and no Zarr image; --axes and --image-index are for these").at(path));
    }
    let (document, lines) = if is_store(path) {
        if args.pages.axes.is_some() {
            return Err(Error::usage("names its axes itself; --axes is for TIFF files").at(path));
        }
        store(path, args.pages.image_index)?
    } else if let Some(format) = formats::format_of(path) {
        stack(path, format, args.pages.select())?
    } else {
        let (source, points_of, notes) = describe(path)?;
        match source {
            // What is told where points are taken as they are is no news here.
            Source::Cloud(cloud) => {
                points(&cloud, points_of.as_ref(), points_of.as_ref().map_or(&notes, |of| &of.notes))
            }
            Source::Mesh(mesh) => triangles(mesh, notes),
        }
    };
    let text = if args.json { format!("{document:#}\n") } else { table(&lines) };
    print(&text)
}

fn stack(path: &Path, format: &formats::Format, select: Select) -> Result<(Value, Lines)> {
    let stack = (format.open)(path, select)?;
    let info = stack.info();
    let [x, y, z] = info.shape;
    let unit = info.unit.clone().unwrap_or_default();
    let spacing = info.spacing.map(|h| h.map_or("?".into(), number)).join(", ");
    let mut lines = vec![
        line("kind", format.name),
        line("size x, y, z", format!("{x}, {y}, {z}")),
        line("spacing x, y, z", format!("{spacing} {unit}").trim_end()),
        line("channels", info.channels.to_string()),
        line("times", info.times.to_string()),
        line("axes as stored", &*info.axes),
        line("type", &*info.file_type),
        line("compression", &*info.compression),
    ];
    let images = stack.images();
    if images.len() > 1 {
        lines.push(line("images", images.len().to_string()));
        lines.push(line("image", select.image.unwrap_or(0).to_string()));
    }
    lines.extend(info.notes.iter().map(|note| line("note", &**note)));
    let document = json!({
        "kind": "stack", "shape_xyz": info.shape, "spacing_xyz": info.spacing, "unit": info.unit,
        "channels": info.channels, "times": info.times, "axes": info.axes, "type": info.file_type,
        "compression": info.compression, "notes": info.notes, "image_index": select.image.unwrap_or(0),
        "images": images.iter().map(|image| json!({ "name": image.name, "shape_xyz": image.shape })).collect::<Vec<_>>(),
    });
    Ok((document, lines))
}

/// What places in a box are told to: a thousandth of its largest extent.
fn step_within(low: [f64; 3], high: [f64; 3]) -> f64 {
    (0..3).map(|a| high[a] - low[a]).fold(0.0, f64::max) / 1e3
}

fn points(cloud: &PointCloud, file: Option<&PointFile>, notes: &[String]) -> (Value, Lines) {
    let (low, high) = cloud.bounds().unwrap_or_default();
    let step = step_within(low, high);
    let mut lines = vec![line("kind", "points")];
    let scales = file.map_or([Scale::Physical; 3], |file| file.scales);
    let counts = |axis: usize| match (scales[axis], file.and_then(|file| file.units[axis])) {
        (Scale::Physical, Some(unit)) => unit.name,
        (Scale::Physical, None) => "length",
        (Scale::Voxels, _) => "voxels, the first one 0",
        (Scale::Slices, _) => "slices, in the file the first one 1, here 0",
    };
    let counts = [0, 1, 2].map(counts);
    if let Some(file) = file {
        lines.push(line("form", &*file.form));
        match counts {
            [x, y, z] if x == y && y == z => lines.push(line("x, y, z in", x)),
            [x, y, z] => lines.extend([line("x in", x), line("y in", y), line("z in", z)]),
        }
    }
    lines.extend([
        line("points", grouped(cloud.len() as u64)),
        line("lowest x, y, z", place(low, step)),
        line("highest x, y, z", place(high, step)),
    ]);
    let times = file.and_then(|file| Some((file.times.iter().min()?, file.times.iter().max()?)));
    if let Some((first, last)) = times {
        let text = if first == last { first.to_string() } else { format!("{first} to {last}") };
        lines.push(line("times", text));
    }
    let mut objects = Vec::new();
    for marks in split(cloud) {
        let points: usize = marks.contours.iter().map(Vec::len).sum();
        let contours = if marks.drawn { marks.contours.len() } else { 0 };
        let on = if marks.drawn { format!(" on {contours} contours") } else { ", no contours".into() };
        lines.push(line(&format!("object {}", marks.object), format!("{} points{on}", grouped(points as u64))));
        objects.push(json!({ "object": marks.object, "points": points, "contours": contours }));
    }
    lines.extend(notes.iter().map(|note| line("note", &**note)));
    let document = json!({
        "kind": "points", "form": file.map(|file| &*file.form), "counts_xyz": counts, "points": cloud.len(),
        "lowest_xyz": low, "highest_xyz": high, "times": times, "objects": objects, "notes": notes,
    });
    (document, lines)
}

fn triangles(mesh: TriangleMesh, mut notes: Vec<String>) -> (Value, Lines) {
    let (low, high) = mesh.bounds().unwrap_or_default();
    let step = step_within(low, high);
    let (vertices, count) = (mesh.vertices.len(), mesh.len());
    let solid = Solid::new(mesh);
    let edges = solid.edges;
    notes.extend(solid.found.sentences());
    let mut closed = vec![edges.is_closed().to_string()];
    if !edges.is_closed() {
        closed.push(format!("{} boundary edges", grouped(edges.open)));
    }
    if !edges.is_oriented() {
        closed.push(format!("{} edges whose triangles disagree on what is outside", grouped(edges.flipped)));
    }
    let mut lines = vec![
        line("kind", "triangle mesh"),
        line("vertices", grouped(vertices as u64)),
        line("triangles", grouped(count as u64)),
        line("closed", closed.join(", ")),
        line("lowest x, y, z", place(low, step)),
        line("highest x, y, z", place(high, step)),
    ];
    lines.extend(notes.iter().map(|note| line("note", &**note)));
    let document = json!({
        "kind": "mesh", "vertices": vertices, "triangles": count, "closed": edges.is_closed(),
        "boundary_edges": edges.open, "flipped_edges": solid.found.flipped_edges, "lowest_xyz": low,
        "highest_xyz": high, "notes": notes,
    });
    (document, lines)
}
