//! A store with an axis of time, joined from stores of single times.
//!
//! A shard holds the chunks of one box of an array, and with shards of length 1 along t nothing in it tells the time: the bytes of
//! a shard of a 3-D array `z, y, x` are those of a shard of the 4-D array `t, z, y, x` (so are chunks of Zarr v2, which have no shards).
//! So each time is written as a store of its own, and its files get a second name in the joined one, a hard link, or a copy on
//! disks without links: what is joined stays whole where it is, and nothing is read or packed again.

use std::fs;
use std::path::Path;

use serde_json::{Map, Value, json};

use super::files::{create_parent, io_error, write_json};
use super::root::ATTRIBUTE;
use super::store::StoreWriter;
use super::sums::{FileSum, listed_sums, store_files};
use super::version::OmeVersion;
use crate::error::{Error, Result};

/// The group of what belongs to single times, in groups of theirs.
pub const TIMES: &str = "times";

/// What a time is called in names of groups and files: `t0003`.
#[must_use]
pub fn time_name(time: u32) -> String {
    format!("t{time:04}")
}

/// The times of a joined image.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TimeAxis {
    /// The time of the first, in `unit`.
    pub first: f64,
    /// From one to the next.
    pub step: f64,
    /// What times are counted in, as OME-Zarr spells it; none where they are only numbered.
    pub unit: Option<String>,
}

impl StoreWriter {
    /// Joins the image that the store of a single time holds in a group to those of other times: it is the `n`-th of so many. The
    /// first that is joined says what the image is; times that are not there have fill values, and so does one that has no such image.
    ///
    /// # Errors
    /// When it differs from those before in shape, type or how it is packed, or files cannot be written.
    pub fn join_time(&self, group: &str, (n, times): (usize, usize), from: &Path, axis: &TimeAxis) -> Result<()> {
        if !has_image(&from.join(group), self.version()) {
            return Ok(());
        }
        self.join(group, (n, times), from, axis).map_err(|error| error.at(self.path()))
    }

    /// Makes a group, and those above it, that hold no image of their own.
    ///
    /// # Errors
    /// When they cannot be written.
    pub fn group(&self, group: &str) -> Result<()> {
        self.begin_group(group).map_err(|error| error.at(self.path()))
    }

    /// Takes over all files below a folder of another store, or one file of it, under another name.
    ///
    /// # Errors
    /// When they cannot be written.
    pub fn take_over(&self, from: &Path, relative: &str, name: &str) -> Result<()> {
        let all = store_files(from).map_err(|error| io_error("a store cannot be read", &error))?;
        let folder = format!("{relative}/");
        let below = all.iter().filter_map(|file| {
            let rest = if file == relative { Some("") } else { file.strip_prefix(&folder) };
            rest.map(|rest| (file, if rest.is_empty() { name.to_owned() } else { format!("{name}/{rest}") }))
        });
        let files: Vec<(String, String)> = below.map(|(file, name)| (file.clone(), name)).collect();
        self.link(from, &files).map_err(|error| error.at(self.path()))
    }

    fn join(&self, group: &str, (n, times): (usize, usize), from: &Path, axis: &TimeAxis) -> Result<()> {
        let (single, joined) = (from.join(group), self.folder().join(group));
        let described = attributes(&single, self.version())?;
        let levels = levels_of(&described);
        let is_first = !has_image(&joined, self.version());
        let mut ome = if is_first {
            let mut ome = described.as_object().cloned().unwrap_or_default();
            over_time(&mut ome, axis);
            self.begin_group(group)?;
            ome
        } else {
            attributes(&joined, self.version())?.as_object().cloned().unwrap_or_default()
        };
        take_window(&mut ome, &described);
        for level in &levels {
            let array = |folder: &Path| folder.join(level).join(array_document(self.version()));
            let document = array_over_time(read(&array(&single))?, times);
            if is_first {
                write_json(&array(&joined), &document)?;
            } else if read(&array(&joined))? != document {
                return Err(Error::failed(format!(
                    "the times differ in the shape, type or packing of {group}/{level}; they cannot be one array"
                )));
            }
        }
        self.link_shards(group, &levels, n, from)?;
        self.end_group(group, ome)
    }

    /// Gives the shards of a time their names in the joined image.
    fn link_shards(&self, group: &str, levels: &[String], time: usize, store: &Path) -> Result<()> {
        let folder = |level: &String| if group.is_empty() { level.clone() } else { format!("{group}/{level}") };
        let chunks = if self.version() == OmeVersion::V05 { "c/" } else { "" };
        let all = store_files(store).map_err(|error| io_error("the store of a time cannot be read", &error))?;
        let mut files = Vec::new();
        for level in levels {
            let folder = folder(level);
            for file in &all {
                let place = file.strip_prefix(&format!("{folder}/{chunks}"));
                // Documents lie beside shards of Zarr v2.
                if let Some(place) = place.filter(|place| place.split('/').count() == 3) {
                    files.push((file.clone(), format!("{folder}/{chunks}{time}/{place}")));
                }
            }
        }
        self.link(store, &files)
    }

    /// Gives files of another store a name in this one; their sums are known from there.
    fn link(&self, from: &Path, files: &[(String, String)]) -> Result<()> {
        let listed = listed_sums(from)?.unwrap_or_default();
        for (file, name) in files {
            let (source, target) = (from.join(file), self.folder().join(name));
            create_parent(&target)?;
            if fs::hard_link(&source, &target).is_err() {
                fs::copy(&source, &target)
                    .map_err(|error| io_error("a file of a time cannot be taken over", &error))?;
            }
            if let Some(sum) = listed.get(file).and_then(|line| FileSum::of_line(line)) {
                self.took_over(&target, sum);
            }
        }
        Ok(())
    }
}

fn array_document(version: OmeVersion) -> &'static str {
    if version == OmeVersion::V05 { "zarr.json" } else { ".zarray" }
}

fn read(path: &Path) -> Result<Value> {
    let text = fs::read(path).map_err(|error| io_error("the store of a time cannot be read", &error).at(path))?;
    serde_json::from_slice(&text)
        .map_err(|error| Error::failed(format!("the store of a time is damaged: {error}")).caused_by(error).at(path))
}

/// The OME attributes of a group, as 0.5 has them without their version, which are written in that of the store.
fn attributes(group: &Path, version: OmeVersion) -> Result<Value> {
    let mut told = match version {
        OmeVersion::V05 => read(&group.join("zarr.json"))?["attributes"]["ome"].take(),
        OmeVersion::V04 => read(&group.join(".zattrs"))?,
    };
    if let Some(told) = told.as_object_mut() {
        told.remove("version");
        // Of 0.4 what a live store says of itself lies beside.
        told.remove(ATTRIBUTE);
    }
    Ok(told)
}

fn has_image(group: &Path, version: OmeVersion) -> bool {
    attributes(group, version).is_ok_and(|told| told["multiscales"].is_array())
}

/// The paths of an image's levels.
fn levels_of(described: &Value) -> Vec<String> {
    let datasets = described["multiscales"][0]["datasets"].as_array().into_iter().flatten();
    datasets.filter_map(|dataset| dataset["path"].as_str().map(ToOwned::to_owned)).collect()
}

/// Puts the axis of time before those of space.
fn over_time(ome: &mut Map<String, Value>, axis: &TimeAxis) {
    let Some(multiscale) = ome.get_mut("multiscales").and_then(|all| all.get_mut(0)) else { return };
    let mut time = json!({ "name": "t", "type": "time" });
    if let Some(unit) = &axis.unit {
        time["unit"] = json!(unit);
    }
    prepend(multiscale.get_mut("axes"), time);
    for dataset in multiscale["datasets"].as_array_mut().into_iter().flatten() {
        for transformation in dataset["coordinateTransformations"].as_array_mut().into_iter().flatten() {
            for (kind, value) in [("scale", axis.step), ("translation", axis.first)] {
                prepend(transformation.get_mut(kind), json!(value));
            }
        }
    }
}

/// Widens window and colours to those of another time.
fn take_window(ome: &mut Map<String, Value>, other: &Value) {
    if let Some(window) = ome.get_mut("omero").and_then(|told| told.pointer_mut("/channels/0/window")) {
        let more = &other["omero"]["channels"][0]["window"];
        for (key, is_low) in [("start", true), ("min", true), ("end", false), ("max", false)] {
            if let (Some(own), Some(more)) = (window[key].as_f64(), more[key].as_f64()) {
                window[key] = json!(if is_low { own.min(more) } else { own.max(more) });
            }
        }
    }
    let Some(own) = ome.get_mut("image-label").and_then(|told| told.get_mut("colors")).and_then(Value::as_array_mut)
    else {
        return;
    };
    for color in other["image-label"]["colors"].as_array().into_iter().flatten() {
        if !own.iter().any(|known| known["label-value"] == color["label-value"]) {
            own.push(color.clone());
        }
    }
    own.sort_by_key(|color| color["label-value"].as_u64());
}

/// The document of an array of so many times whose shards are those of single ones.
fn array_over_time(mut document: Value, times: usize) -> Value {
    prepend(document.get_mut("shape"), json!(times));
    prepend(document.get_mut("dimension_names"), json!("t"));
    // Of Zarr v2 the first, of Zarr v3 shards and the chunks in them.
    for shape in ["/chunks", "/chunk_grid/configuration/chunk_shape", "/codecs/0/configuration/chunk_shape"] {
        prepend(document.pointer_mut(shape), json!(1));
    }
    document
}

fn prepend(list: Option<&mut Value>, first: Value) {
    if let Some(list) = list.and_then(Value::as_array_mut) {
        list.insert(0, first);
    }
}
