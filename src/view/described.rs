//! What OME-Zarr says of an image (versions 0.4 and 0.5): its axes, grey range, colours of labels; or what it does not say, without which
//! the image cannot be shown.

use std::path::{Path, PathBuf};

use serde_json::Value;

use super::documents::json;
use crate::io::stack::interval::{Interval, seconds};
use crate::io::stack::units;

/// Types that the page draws, as Zarr 3 names them; those of version 2 without their byte order.
const DRAWN: [&str; 10] = ["bool", "uint8", "int8", "uint16", "int16", "uint32", "int32", "uint64", "int64", "float32"];
const DRAWN_OLDER: [&str; 10] = ["b1", "u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", "f4"];
/// Versions that the page does not draw, of those that OME-Zarr had.
const OLDER: [&str; 3] = ["0.1", "0.2", "0.3"];

/// What a document says, or what is missing in it.
type Said<T> = std::result::Result<T, String>;

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
    /// Where it lies.
    pub(super) folder: PathBuf,
    pub(super) name: String,
    pub(super) kind: Kind,
    /// Whether it is a Zarr of version 2, as OME-Zarr 0.4 is.
    pub(super) is_version_2: bool,
    /// Whether a voxel has four bytes or more.
    pub(super) is_wide: bool,
    pub(super) axes: Vec<Axis>,
    pub(super) levels: u32,
    /// What is said of its channels, as far as anything is.
    pub(super) channels: Vec<Channel>,
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

/// What is said of a channel.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Channel {
    pub(super) name: Option<String>,
    pub(super) color: Option<[u8; 3]>,
    /// The values from black to white.
    pub(super) window: Option<[f64; 2]>,
    /// Whether it is not to be seen at first.
    pub(super) is_off: bool,
}

/// An axis of an image.
#[derive(Clone, Debug)]
pub(super) struct Axis {
    pub(super) name: String,
    /// Whether it counts channels.
    pub(super) is_channel: bool,
    /// Whether its unit is spelled in a way of its own, or is none that is known, or whether it does not say that it counts channels: the
    /// page has to be told.
    pub(super) is_odd: bool,
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

/// The axes of an image, and the document of its finest level.
///
/// # Errors
/// What is missing, or cannot be drawn.
fn axes(folder: &Path, found: &Multiscale) -> Said<(Vec<Axis>, Value)> {
    let described = &found.attributes["multiscales"][0];
    let version = found.attributes["version"].as_str().or(described["version"].as_str());
    if let Some(older) = version.filter(|version| OLDER.contains(version)) {
        return Err(format!(
            "is of OME-Zarr {older}, which the page does not draw; strandline convert makes one of 0.5"
        ));
    }
    let finest = &described["datasets"][0];
    let level = finest["path"].as_str().ok_or("names no level (no datasets)")?;
    let document = if found.is_version_2 { ".zarray" } else { "zarr.json" };
    let array = json(&folder.join(level).join(document))
        .filter(|array| array["shape"].is_array())
        .ok_or_else(|| format!("names the level {level}, and {level}/{document} is no array of Zarr"))?;
    let (drawn, key) = if found.is_version_2 { (DRAWN_OLDER, "dtype") } else { (DRAWN, "data_type") };
    let of_type = array[key].as_str().unwrap_or("a type of its own");
    if !drawn.contains(&of_type.trim_start_matches(['<', '>', '|'])) {
        return Err(format!("is of {of_type}, which the page does not draw"));
    }
    let named = described["axes"].as_array().filter(|axes| !axes.is_empty()).ok_or("names no axes")?;
    let rank = array["shape"].as_array().map_or(0, Vec::len);
    if named.len() != rank {
        return Err(format!("names {} axes, and its level {level} has {rank}", named.len()));
    }
    let transforms = [&finest["coordinateTransformations"], &described["coordinateTransformations"]];
    let axes: Said<Vec<Axis>> = named
        .iter()
        .enumerate()
        .map(|(n, axis)| self::axis(axis, array["shape"][n].as_u64(), (transforms, n)))
        .collect();
    Ok((axes?, array))
}

/// The n-th axis, with the transformations of the level and of the image.
fn axis(axis: &Value, voxels: Option<u64>, (transforms, n): ([&Value; 2], usize)) -> Said<Axis> {
    let vector = |kind: &str, neutral: f64, joined: fn(f64, f64) -> f64| {
        let all = transforms.iter().flat_map(|list| list.as_array().into_iter().flatten());
        all.filter_map(|t| t[kind][n].as_f64()).fold(neutral, joined)
    };
    // Version 0.3 named axes by words alone.
    let name = axis["name"].as_str().or(axis.as_str()).ok_or_else(|| format!("gives axis {} no name", n + 1))?;
    let kind = axis["type"].as_str();
    let is_channel = kind.map_or(["c", "channel"].contains(&name), |kind| kind == "channel");
    let is_space = kind.map_or(["x", "y", "z"].contains(&name), |kind| kind == "space");
    let spelled = axis["unit"].as_str().unwrap_or_default();
    let length = match units::parse(spelled) {
        units::Unit::Length(name, metres) if is_space => Some((name, metres)),
        _ => None,
    };
    let interval = Interval::told(1.0, spelled).filter(|_| kind == Some("time"));
    let known = length.map(|(name, _)| name).or(interval.as_ref().map(|interval| interval.unit.as_str()));
    let is_odd = known.unwrap_or_default() != spelled || (is_channel && kind.is_none());
    let voxels = voxels.filter(|voxels| *voxels > 0).ok_or_else(|| format!("has no voxels along {name}"))?;
    let (spacing, origin) = (vector("scale", 1.0, |a, b| a * b), vector("translation", 0.0, |a, b| a + b));
    // Nothing could be placed on such an axis.
    if !(spacing > 0.0 && spacing.is_finite() && origin.is_finite()) {
        return Err(format!("has a scale of {spacing} along {name}, with which nothing can be drawn"));
    }
    let (metres, seconds) = (length.map(|(_, metres)| metres), interval.and_then(|interval| seconds(&interval.unit)));
    Ok(Axis { name: name.to_owned(), is_channel, is_odd, metres, seconds, voxels, spacing, origin })
}

/// What an image is, in a store whose root is an image or not.
///
/// # Errors
/// Why it cannot be shown.
pub(super) fn image(path: &str, folder: &Path, found: &Multiscale, is_beside_one: bool) -> Said<Image> {
    let described = &found.attributes["multiscales"][0];
    let (axes, array) = axes(folder, found)?;
    let said = found.attributes["omero"]["channels"].as_array();
    let channels: Vec<Channel> = said.into_iter().flatten().map(channel).collect();
    let is_labels = found.attributes["image-label"].is_object() || path.contains("/labels/");
    let kind = match (is_labels, is_beside_one) {
        (true, _) => Kind::Labels,
        (_, true) => Kind::Field,
        _ => Kind::Picture,
    };
    let window = channels.first().and_then(|channel| channel.window);
    let name = described["name"].as_str().filter(|name| !name.is_empty()).unwrap_or(path);
    let beyond = if name != "distance" {
        None
    } else if kind == Kind::Field {
        // Those beside an image or a surface are solved near it, and hold the farthest beyond.
        window.map(|[_, high]| high)
    } else {
        json(&folder.join("report.json")).and_then(|report| report["settings"]["max_distance"].as_f64())
    };
    // A zero of another program's image is a value like any other.
    let is_ours = kind == Kind::Field || name == "distance" || folder.join("report.json").exists();
    let fill = array["fill_value"].as_f64();
    let unsolved = if is_real(&array) && is_ours { Unsolved { fill, beyond } } else { Unsolved::default() };
    Ok(Image {
        path: path.to_owned(),
        folder: folder.to_path_buf(),
        name: name.to_owned(),
        kind,
        is_version_2: found.is_version_2,
        is_wide: is_wide(&array),
        axes,
        levels: described["datasets"].as_array().map_or(1, |levels| levels.len() as u32),
        channels,
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

fn channel(said: &Value) -> Channel {
    let window = &said["window"];
    let hex = said["color"].as_str().map(|color| color.trim_start_matches('#')).filter(|color| color.is_ascii());
    let part = |n: usize| u8::from_str_radix(hex?.get(2 * n..2 * n + 2)?, 16).ok();
    let color = || Some([part(0)?, part(1)?, part(2)?]);
    let ends = window["start"].as_f64().zip(window["end"].as_f64());
    Channel {
        name: said["label"].as_str().filter(|label| !label.is_empty()).map(ToOwned::to_owned),
        // Black would not be seen.
        color: color().filter(|color| *color != [0; 3]),
        window: ends.filter(|(low, high)| low < high).map(|(low, high)| [low, high]),
        is_off: said["active"] == false,
    }
}

fn colors(list: &Value) -> Vec<(u64, [u8; 3])> {
    let channel = |color: &Value, n: usize| color["rgba"][n].as_u64().and_then(|v| u8::try_from(v).ok());
    let color = |color: &Value| {
        Some((color["label-value"].as_u64()?, [channel(color, 0)?, channel(color, 1)?, channel(color, 2)?]))
    };
    list.as_array().into_iter().flatten().filter_map(color).collect()
}
