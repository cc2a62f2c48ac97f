//! What OME-Zarr says of an image (versions 0.4 and 0.5): its axes, grey range, colours of labels.

use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::io::geometry::read::points::LengthUnit;
use crate::io::stack::interval::seconds;

/// A file of metadata is shorter than this.
const MOST_BYTES: u64 = 16 << 20;

/// What an image's values are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Kind {
    /// Grey values.
    Picture,
    /// Numbers of objects.
    Labels,
    /// A field beside an image, such as a distance.
    Field,
}

/// A multiscale image.
#[derive(Clone, Debug)]
pub(super) struct Image {
    /// Its path on the server, without a slash at its ends.
    pub(super) path: String,
    pub(super) name: String,
    pub(super) kind: Kind,
    /// Whether it is a Zarr of version 2, as OME-Zarr 0.4 is.
    pub(super) is_version_2: bool,
    /// Whether a voxel has four bytes or more.
    pub(super) is_wide: bool,
    pub(super) axes: Vec<Axis>,
    /// The values from black to white.
    pub(super) window: Option<[f64; 2]>,
    /// What stands where nothing was solved.
    pub(super) unsolved: Unsolved,
    /// Colours of labels: number, red, green, blue.
    pub(super) colors: Vec<(u64, [u8; 3])>,
}

/// Values of an image of real numbers that are none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Unsolved {
    /// What stands in chunks that are not there.
    pub(super) fill: Option<f64>,
    /// What all voxels hold that are as far away as this, or farther.
    pub(super) beyond: Option<f64>,
}

/// An axis of an image.
#[derive(Clone, Debug)]
pub(super) struct Axis {
    pub(super) name: String,
    /// Metres of a unit; none where the axis has no length.
    pub(super) metres: Option<f64>,
    /// Seconds of a unit, where it is one of time.
    pub(super) seconds: Option<f64>,
    pub(super) voxels: u64,
    /// In units of the axis.
    pub(super) spacing: f64,
    pub(super) origin: f64,
}

/// Attributes of a multiscale image, and whether its Zarr is of version 2.
pub(super) struct Multiscale {
    attributes: Value,
    is_version_2: bool,
}

impl Multiscale {
    /// Whether its first axis is one of time.
    pub(super) fn has_time(&self) -> bool {
        self.attributes["multiscales"][0]["axes"][0]["type"] == "time"
    }
}

pub(super) fn multiscale(folder: &Path) -> Option<Multiscale> {
    let of = |attributes: Value, is_version_2: bool| {
        attributes["multiscales"][0]["datasets"].is_array().then_some(Multiscale { attributes, is_version_2 })
    };
    match json(&folder.join("zarr.json")) {
        Some(mut group) => of(group["attributes"]["ome"].take(), false),
        None => of(json(&folder.join(".zattrs"))?, true),
    }
}

/// The document of a folder that cannot be understood, and why.
pub(super) fn fault(folder: &Path) -> Option<(PathBuf, String)> {
    let path = ["zarr.json", ".zattrs"].map(|name| folder.join(name)).into_iter().find(|path| path.exists())?;
    let why = match std::fs::metadata(&path).and_then(|found| Ok((found.len(), std::fs::read(&path)?))) {
        Ok((length, _)) if length > MOST_BYTES => format!("is larger than {} MiB", MOST_BYTES >> 20),
        Ok((_, text)) => format!("is no JSON: {}", serde_json::from_slice::<Value>(&text).err()?),
        Err(error) => format!("cannot be read: {error}"),
    };
    Some((path, why))
}

fn json(path: &Path) -> Option<Value> {
    let is_short = std::fs::metadata(path).ok()?.len() <= MOST_BYTES;
    serde_json::from_slice(&std::fs::read(path).ok().filter(|_| is_short)?).ok()
}

pub(super) fn image(path: &str, folder: &Path, found: &Multiscale) -> Option<Image> {
    let described = &found.attributes["multiscales"][0];
    let finest = &described["datasets"][0];
    let array = folder.join(finest["path"].as_str()?);
    let array = json(&array.join(if found.is_version_2 { ".zarray" } else { "zarr.json" }))?;
    let transforms = [&finest["coordinateTransformations"], &described["coordinateTransformations"]];
    let vector = |kind: &str, n: usize, neutral: f64, joined: fn(f64, f64) -> f64| {
        let all = transforms.iter().flat_map(|list| list.as_array().into_iter().flatten());
        all.filter_map(|t| t[kind][n].as_f64()).fold(neutral, joined)
    };
    let axis = |(n, axis): (usize, &Value)| {
        // Version 0.3 named axes by words alone.
        let name = axis["name"].as_str().or(axis.as_str())?;
        let unit = axis["unit"].as_str().map(LengthUnit::named);
        let seconds = axis["unit"].as_str().and_then(seconds).filter(|_| axis["type"] == "time");
        let is_space = axis["type"].as_str().map_or(["x", "y", "z"].contains(&name), |kind| kind == "space");
        Some(Axis {
            name: name.to_owned(),
            metres: unit.flatten().map(|unit| unit.metres).filter(|_| is_space),
            seconds,
            voxels: array["shape"][n].as_u64()?,
            spacing: vector("scale", n, 1.0, |a, b| a * b),
            origin: vector("translation", n, 0.0, |a, b| a + b),
        })
    };
    let axes: Vec<Axis> = described["axes"].as_array()?.iter().enumerate().map(axis).collect::<Option<_>>()?;
    // Nothing could be placed on such axes.
    if axes.iter().any(|axis| axis.voxels == 0 || axis.spacing == 0.0) {
        return None;
    }
    let window = &found.attributes["omero"]["channels"][0]["window"];
    let is_labels = found.attributes["image-label"].is_object() || path.contains("/labels/");
    let kind = match (is_labels, path.contains('/')) {
        (true, _) => Kind::Labels,
        (_, true) => Kind::Field,
        _ => Kind::Picture,
    };
    let window = window["start"].as_f64().zip(window["end"].as_f64()).map(|(low, high)| [low, high]);
    let name = described["name"].as_str().filter(|name| !name.is_empty()).unwrap_or(path);
    let beyond = if name != "distance" {
        None
    } else if kind == Kind::Field {
        // Those beside an image or a surface are solved near it, and hold the farthest beyond.
        window.map(|[_, high]| high)
    } else {
        json(&folder.join("report.json")).and_then(|report| report["settings"]["max_distance"].as_f64())
    };
    let fill = array["fill_value"].as_f64();
    let unsolved = if is_real(&array) { Unsolved { fill, beyond } } else { Unsolved::default() };
    Some(Image {
        path: path.to_owned(),
        name: name.to_owned(),
        kind,
        is_version_2: found.is_version_2,
        is_wide: is_wide(&array),
        axes,
        window,
        unsolved,
        colors: colors(&found.attributes["image-label"]["colors"]),
    })
}

/// Whether an array's voxels are real numbers.
fn is_real(array: &Value) -> bool {
    let name = array["data_type"].as_str().or(array["dtype"].as_str()).unwrap_or_default();
    name.starts_with("float") || name.trim_start_matches(['<', '>']).starts_with('f')
}

/// Whether an array's voxels have four bytes or more: its type is `float32`, or `<f4` in version 2.
fn is_wide(array: &Value) -> bool {
    let name = array["data_type"].as_str().or(array["dtype"].as_str()).unwrap_or_default();
    let size = name.trim_start_matches(|c: char| !c.is_ascii_digit()).parse().unwrap_or(0);
    if array["dtype"].is_string() { size >= 4 } else { size >= 32 }
}

fn colors(list: &Value) -> Vec<(u64, [u8; 3])> {
    let channel = |color: &Value, n: usize| color["rgba"][n].as_u64().and_then(|v| u8::try_from(v).ok());
    let color = |color: &Value| {
        Some((color["label-value"].as_u64()?, [channel(color, 0)?, channel(color, 1)?, channel(color, 2)?]))
    };
    list.as_array().into_iter().flatten().filter_map(color).collect()
}
