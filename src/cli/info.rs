//! `strandline info`: what a stack, a cloud of points, a mesh or a store is, as lines or as JSON.

use std::path::Path;

use serde_json::{Map, Value, json};

use super::args::InfoArgs;
use super::print;
use super::text::{grouped, number, triple};
use crate::error::{Error, Result};
use crate::grid::{PointCloud, TriangleMesh};
use crate::io::ome_zarr::{ImageReader, is_store};
use crate::io::sources::{Source, read_source};
use crate::io::stacks::{self, Select};
use crate::pipeline::marks::split;

/// Runs the command.
pub(super) fn run(args: &InfoArgs) -> Result<()> {
    let path = &args.file;
    if !path.exists() {
        return Err(Error::input("there is no such file or folder").at(path));
    }
    if args.pages.is_given() && (is_store(path) || stacks::format_of(path).is_none()) {
        return Err(Error::usage("is no TIFF stack; --axes and --image-index are for these").at(path));
    }
    let (document, lines) = if is_store(path) {
        store(path)?
    } else if let Some(format) = stacks::format_of(path) {
        stack(path, format, args.pages.select(0, 0))?
    } else {
        match read_source(path)? {
            Source::Cloud(cloud) => points(&cloud),
            Source::Mesh(mesh) => triangles(&mesh),
        }
    };
    let text = if args.json { format!("{document:#}\n") } else { table(&lines) };
    print(&text);
    Ok(())
}

type Lines = Vec<(String, String)>;

fn table(lines: &Lines) -> String {
    let width = lines.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0);
    lines.iter().fold(String::new(), |text, (name, value)| text + &format!("{name:<width$}  {value}\n"))
}

fn line(name: &str, value: impl Into<String>) -> (String, String) {
    (name.into(), value.into())
}

fn stack(path: &Path, format: &stacks::Format, select: Select) -> Result<(Value, Lines)> {
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

fn points(cloud: &PointCloud) -> (Value, Lines) {
    let (low, high) = cloud.bounds().unwrap_or_default();
    let mut lines = vec![
        line("kind", "points"),
        line("points", grouped(cloud.len() as u64)),
        line("lowest x, y, z", triple(low)),
        line("highest x, y, z", triple(high)),
    ];
    let mut objects = Vec::new();
    for marks in split(cloud) {
        let points: usize = marks.contours.iter().map(Vec::len).sum();
        let contours = if marks.drawn { marks.contours.len() } else { 0 };
        let on = if marks.drawn { format!(" on {contours} contours") } else { ", no contours".into() };
        lines.push(line(&format!("object {}", marks.object), format!("{} points{on}", grouped(points as u64))));
        objects.push(json!({ "object": marks.object, "points": points, "contours": contours }));
    }
    let document = json!({
        "kind": "points", "points": cloud.len(), "lowest_xyz": low, "highest_xyz": high, "objects": objects,
    });
    (document, lines)
}

fn triangles(mesh: &TriangleMesh) -> (Value, Lines) {
    let (low, high) = mesh.bounds().unwrap_or_default();
    let edges = mesh.boundary_edges();
    let mut closed = vec![edges.is_closed().to_string()];
    if !edges.is_closed() {
        closed.push(format!("{} boundary edges", grouped(edges.open)));
    }
    if !edges.is_oriented() {
        closed.push(format!("{} edges whose triangles disagree on what is outside", grouped(edges.flipped)));
    }
    let lines = vec![
        line("kind", "triangle mesh"),
        line("vertices", grouped(mesh.vertices.len() as u64)),
        line("triangles", grouped(mesh.len() as u64)),
        line("closed", closed.join(", ")),
        line("lowest x, y, z", triple(low)),
        line("highest x, y, z", triple(high)),
    ];
    let document = json!({
        "kind": "mesh", "vertices": mesh.vertices.len(), "triangles": mesh.len(), "closed": edges.is_closed(),
        "boundary_edges": edges.open, "flipped_edges": edges.flipped, "lowest_xyz": low, "highest_xyz": high,
    });
    (document, lines)
}

fn store(path: &Path) -> Result<(Value, Lines)> {
    let mut lines = vec![line("kind", "OME-Zarr store")];
    let mut images = Map::new();
    for group in groups(path) {
        // The root of a store may hold no image of its own.
        let Ok(image) = ImageReader::open(&path.join(&group)) else { continue };
        let name = if group.is_empty() { "image" } else { &group };
        let mut levels = Vec::new();
        for level in image.levels() {
            let g = &level.geometry;
            let [x, y, z] = g.shape;
            let unit = g.unit.as_deref().unwrap_or("");
            let text = format!("{x} x {y} x {z} {}, spacing {} {unit}", level.element, triple(g.spacing));
            lines.push(line(&format!("{name}, level {}", level.path), text.trim_end()));
            levels.push(json!({
                "path": level.path, "shape_xyz": g.shape, "spacing_xyz": g.spacing, "origin_xyz": g.origin,
                "unit": g.unit, "type": level.element,
            }));
        }
        images.insert(name.into(), levels.into());
    }
    if images.is_empty() {
        return Err(Error::input("holds no OME-Zarr 0.5 image with the axes z, y, x").at(path));
    }
    let report = std::fs::read(path.join("report.json")).ok().and_then(|text| serde_json::from_slice(&text).ok());
    if let Some(report) = &report {
        lines.extend(summary(report));
    }
    let result = report.as_ref().map_or(Value::Null, |report| report["result"].clone());
    Ok((json!({ "kind": "store", "images": images, "result": result }), lines))
}

/// The groups in which our stores keep images, the root first.
fn groups(store: &Path) -> Vec<String> {
    let below = |folder: &str| {
        let entries = std::fs::read_dir(store.join(folder)).into_iter().flatten().flatten();
        let mut names: Vec<String> = entries
            .filter(|entry| entry.path().join("zarr.json").is_file())
            .map(|entry| format!("{folder}/{}", entry.file_name().to_string_lossy()))
            .collect();
        names.sort();
        names
    };
    let mut groups = vec![String::new(), "levelset".into()];
    groups.extend(below("levelset"));
    groups.extend(below("labels"));
    groups.extend(below("closest-point"));
    groups
}

/// The inputs that a report names: an image, or sources.
fn made_from(settings: &Value) -> String {
    let sources = settings["sources"].as_array().into_iter().flatten();
    let single = ["image", "cloud"].iter().filter_map(|key| settings[key].as_str());
    let names: Vec<&str> = single.chain(sources.filter_map(Value::as_str)).collect();
    names.join(", ")
}

/// A few lines out of a report.
fn summary(report: &Value) -> Lines {
    let text = |value: &Value| value.as_str().map_or_else(|| value.to_string(), ToOwned::to_owned);
    let unit = report["grid"]["unit"].as_str().unwrap_or("").to_owned();
    let mut lines = vec![
        line("made by", format!("strandline {} {}", text(&report["version"]), text(&report["command"]))),
        line("from", made_from(&report["settings"])),
        line("seconds", report["seconds"].as_f64().map_or("?".into(), number)),
    ];
    for object in report["result"]["objects"].as_array().into_iter().flatten() {
        let value = |name: &str| object[name].as_f64().map_or("?".into(), number);
        lines.push(line(
            &format!("object {}", object["label"]),
            format!(
                "volume {}, area {} ({unit} cubed, squared), closed: {}",
                value("volume"),
                value("area"),
                object["closed"]
            ),
        ));
    }
    lines
}
