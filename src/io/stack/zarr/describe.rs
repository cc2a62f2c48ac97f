//! What a Zarr image is, for people: version, axes, levels with their chunks, codecs and transformations.

use std::num::NonZeroU64;
use std::path::{Path, PathBuf};

use serde_json::Value;

use super::find::Found;
use super::node::{Node, children};
use super::{axes, find, lengths, open_level};
use crate::error::{Error, Result};

/// What an image is.
#[derive(Clone, Debug)]
pub struct ZarrDescription {
    /// The version of OME-Zarr, where the file tells it.
    pub version: Option<String>,
    /// The image's name, where it has one.
    pub name: Option<String>,
    /// The names of the axes as stored, slowest first.
    pub axes: Vec<String>,
    /// The levels, as the file lists them: finest first.
    pub levels: Vec<LevelDescription>,
    /// What the user should know about how the file was understood.
    pub notes: Vec<String>,
}

/// What a level is.
#[derive(Clone, Debug)]
pub struct LevelDescription {
    /// Its folder below the image's.
    pub path: String,
    /// The version of Zarr: 2 or 3.
    pub format: u8,
    /// Voxels along x, y, z.
    pub shape: [i64; 3],
    /// Entries along all axes as stored.
    pub stored_shape: Vec<u64>,
    /// Distance between voxel centres along x, y, z, where the file tells it.
    pub spacing: [Option<f64>; 3],
    /// World position of the first voxel's centre.
    pub origin: [f64; 3],
    /// The unit of both.
    pub unit: Option<String>,
    /// The type of a value as Zarr names it.
    pub element: String,
    /// The shape of the chunks, axes as stored.
    pub chunks: Vec<u64>,
    /// The shape of the shards, where there are some.
    pub shards: Option<Vec<u64>>,
    /// The codecs.
    pub codecs: String,
}

/// Describes the image at a path; `image` chooses among several, counted from 0.
///
/// # Errors
/// When there is none that can be read.
pub fn describe(path: &Path, image: Option<u32>) -> Result<ZarrDescription> {
    let found = find::find(path, image)?;
    let mut notes = found.notes.clone();
    let (mut levels, mut names) = (Vec::new(), Vec::new());
    let mut unreadable = None;
    for number in found.level.map_or(0..found.multiscale.levels.len(), |level| level..level + 1) {
        let mut told = Vec::new();
        match describe_level(&found, number, &mut told) {
            Ok((level, axes)) => {
                if levels.is_empty() {
                    notes.extend(told);
                    names = axes;
                }
                levels.push(level);
            }
            Err(error) => {
                // One level that is not there does not hide the others.
                notes.push(format!("level {number} cannot be read: {error}"));
                unreadable.get_or_insert(error);
            }
        }
    }
    if let Some(error) = unreadable.filter(|_| levels.is_empty()) {
        return Err(error);
    }
    let multiscale = found.multiscale;
    Ok(ZarrDescription { version: multiscale.version, name: multiscale.name, axes: names, levels, notes })
}

/// One level, and the names of its axes.
fn describe_level(found: &Found, number: usize, notes: &mut Vec<String>) -> Result<(LevelDescription, Vec<String>)> {
    let opened = open_level(found, number)?;
    let space = axes::places(&opened.axes).map_err(|reason| Error::input(reason).at(&opened.folder))?;
    if !opened.axes_told {
        notes.push(format!("the axes are not named; {} is taken", axes::names(&opened.axes)));
    }
    notes.extend(opened.array.note());
    let lengths = lengths(&opened.axes, space, opened.placed.as_ref(), notes);
    let plain = |list: &[NonZeroU64]| list.iter().map(|n| n.get()).collect();
    let level = LevelDescription {
        path: found.multiscale.levels[number].path.clone(),
        format: Node::read(&opened.folder)?.map_or(3, |node| node.format),
        shape: space.map(|axis| opened.array.shape[axis] as i64),
        stored_shape: opened.array.shape.clone(),
        spacing: lengths.spacing,
        origin: lengths.origin,
        unit: lengths.unit,
        element: opened.array.type_name.clone(),
        chunks: plain(&opened.array.chunk),
        shards: opened.array.shards().map(plain),
        codecs: codecs_of(&opened.folder)?,
    };
    Ok((level, opened.axes.iter().map(|axis| axis.name.clone()).collect()))
}

/// Whether a folder is an array or a group that names a multiscale image, or tries to.
#[must_use]
pub fn holds_image(path: &Path) -> bool {
    match Node::read(path) {
        Ok(Some(node)) => node.array.is_some() || !node.ome()["multiscales"].is_null(),
        Ok(None) => false,
        Err(_) => true,
    }
}

/// The label images that an image's `labels` group lists, or holds where it lists none: their folders.
#[must_use]
pub fn label_images(path: &Path) -> Vec<PathBuf> {
    let folder = path.join("labels");
    let Ok(Some(node)) = Node::read(&folder) else { return Vec::new() };
    let listed: Vec<String> = node.ome()["labels"]
        .as_array()
        .into_iter()
        .flatten()
        .filter_map(Value::as_str)
        .map(ToOwned::to_owned)
        .collect();
    let names = if listed.is_empty() { children(&folder) } else { listed };
    names.iter().map(|name| folder.join(name)).filter(|group| group.is_dir()).collect()
}

/// The colours of a label image's numbers, red, green, blue and opacity, where it tells some; none where a group, or the one
/// that an array lies in, is no label image.
#[must_use]
pub fn label_colors(path: &Path) -> Option<Vec<(u32, [u8; 4])>> {
    let folders = [Some(path), path.parent()];
    let node = folders
        .into_iter()
        .flatten()
        .find_map(|folder| Node::read(folder).ok().flatten().filter(|n| n.array.is_none()))?;
    let told = node.ome()["image-label"].as_object()?;
    let color = |color: &Value| {
        let part = |n: usize| color["rgba"][n].as_u64().and_then(|part| u8::try_from(part).ok());
        let rgba = [part(0)?, part(1)?, part(2)?, part(3)?];
        Some((u32::try_from(color["label-value"].as_u64()?).ok()?, rgba))
    };
    Some(told.get("colors").and_then(Value::as_array).into_iter().flatten().filter_map(color).collect())
}

/// The codecs of the array in a folder, in the order of writing: those of the chunks in shards.
pub(crate) fn codecs_of(folder: &Path) -> Result<String> {
    let document = Node::read(folder)?.and_then(|node| node.array).unwrap_or_default();
    let mut names = Vec::new();
    if document["order"] == "F" {
        names.push("order F".to_owned());
    }
    for filter in document["filters"].as_array().into_iter().flatten() {
        names.push(filter["id"].as_str().unwrap_or("?").to_owned());
    }
    if document["compressor"].is_object() {
        names.push(with_algorithm(document["compressor"]["id"].as_str(), &document["compressor"]));
    }
    add_codecs(&document["codecs"], &mut names, 0);
    Ok(if names.is_empty() { "none".to_owned() } else { names.join(", ") })
}

/// Adds the codecs of a list; what a codec holds other codecs for is opened, a few times at most.
fn add_codecs(list: &Value, names: &mut Vec<String>, depth: u32) {
    for codec in list.as_array().into_iter().flatten() {
        let (name, told) = (codec.as_str().or_else(|| codec["name"].as_str()), &codec["configuration"]);
        match name {
            Some("bytes") if told["endian"] == "big" => names.push("big-endian".into()),
            Some("bytes") => {}
            Some("sharding_indexed") if depth < 8 => add_codecs(&told["codecs"], names, depth + 1),
            _ => names.push(with_algorithm(name, told)),
        }
    }
}

fn with_algorithm(name: Option<&str>, told: &Value) -> String {
    let name = name.unwrap_or("?");
    told["cname"].as_str().map_or_else(|| name.to_owned(), |algorithm| format!("{name} ({algorithm})"))
}
