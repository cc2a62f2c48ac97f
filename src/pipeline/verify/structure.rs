//! What a store says of itself: groups and arrays, the levels of its images and where they lie, files that belong to none.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use serde_json::Value;

use super::found::Check;
use crate::error::{Error, Result};
use crate::io::ome_zarr::{ImageReader, LiveState, StoredLevel, TIMES, live, store_files, time_name};

/// An image of a store: its group, `""` for the root, and its levels.
pub(super) struct Image {
    /// Of a time of a series, that which it would have in a store of that time alone.
    pub(super) group: String,
    /// Its group in the store.
    folder: String,
    pub(super) reader: ImageReader,
}

/// The images of a time of a series, the `place`-th of its store, as a store of that time alone would have them.
pub(super) fn of_time(images: &[Image], place: u64, time: u32) -> Vec<Image> {
    let own = format!("{TIMES}/{}/", time_name(time));
    let of = |image: &Image| match image.reader.times() {
        Some(times) => (place < times).then(|| image.at(place)),
        None => image.group.strip_prefix(&own).map(|group| {
            let (folder, reader) = (image.folder.clone(), image.reader.clone());
            Image { group: group.to_owned(), folder, reader }
        }),
    };
    images.iter().filter_map(of).collect()
}

impl Image {
    /// The file of a voxel as a path in the store.
    pub(super) fn file(&self, level: usize, voxel: [i64; 3]) -> String {
        joined(&self.folder, &self.reader.levels()[level].file_of(voxel))
    }

    /// The same image at one of its times.
    pub(super) fn at(&self, time: u64) -> Self {
        Self { group: self.group.clone(), folder: self.folder.clone(), reader: self.reader.at(time) }
    }

    /// The image at each of its times; itself where it has no axis of time.
    pub(super) fn all_times(&self) -> Vec<Self> {
        match self.reader.times() {
            Some(times) => (0..times).map(|time| self.at(time)).collect(),
            None => vec![Self { group: self.group.clone(), folder: self.folder.clone(), reader: self.reader.clone() }],
        }
    }

    /// What it is called.
    pub(super) fn name(&self) -> &str {
        if self.group.is_empty() { "image" } else { &self.group }
    }
}

fn joined(group: &str, below: &str) -> String {
    if group.is_empty() { below.to_owned() } else { format!("{group}/{below}") }
}

/// The names of the documents of a group or an array, of versions 3 and 2.
const DOCUMENTS: [&str; 4] = ["zarr.json", ".zgroup", ".zarray", ".zattrs"];

/// What a folder says that it is.
enum Node {
    Group(Value),
    Array,
    Nothing,
    Unreadable(String),
}

/// Looks at all groups and arrays; the images that can be read.
///
/// # Errors
/// When the store's folders cannot be read.
pub(super) fn check(store: &Path) -> Result<(Check, Vec<Image>)> {
    let mut found = Check::new("structure");
    let mut images = Vec::new();
    walk(store, "", &mut found, &mut images);
    if images.is_empty() {
        found.wrong("the store holds no image that can be read");
    }
    let files = store_files(store).map_err(|e| Error::from_io("the store cannot be read", &e).at(store))?;
    strays(&files, &images, &mut found);
    if let Some(said) = live(store).filter(|said| said.state != LiveState::Complete) {
        let state = said.state.name();
        found.wrong(format!("the store says that it is {state}: {:.0} % of the run were done", 100.0 * said.done));
    }
    let levels: usize = images.iter().map(|image| image.reader.levels().len()).sum();
    found.told = format!("{} images, {levels} arrays", images.len());
    Ok((found, images))
}

fn walk(store: &Path, group: &str, found: &mut Check, images: &mut Vec<Image>) {
    let folder = store.join(group);
    let document = match node(&folder) {
        Node::Group(document) => document,
        Node::Array => return,
        Node::Unreadable(what) => return found.wrong_in(group, what),
        Node::Nothing => {
            if has_nodes(&folder) {
                found.wrong_in(group, "holds groups or arrays and does not say what it is");
            }
            return;
        }
    };
    if document["multiscales"].is_array() {
        match ImageReader::open(&folder) {
            Ok(reader) => {
                check_levels(store, group, &document, &reader, found);
                images.push(Image { group: group.to_owned(), folder: group.to_owned(), reader });
            }
            Err(error) => found.wrong_in(group, error.to_string()),
        }
    }
    let below = folders(&folder);
    if let Some(listed) = document["labels"].as_array() {
        let listed: BTreeSet<&str> = listed.iter().filter_map(Value::as_str).collect();
        if listed != below.iter().map(String::as_str).collect() {
            found.wrong_in(group, format!("names the label images {listed:?}, and holds {below:?}"));
        }
    }
    for name in below {
        walk(store, &joined(group, &name), found, images);
    }
}

/// What a folder says that it is, with the OME attributes of a group.
fn node(folder: &Path) -> Node {
    let read = |name: &str| -> Option<std::result::Result<Value, String>> {
        let text = fs::read(folder.join(name)).ok()?;
        Some(serde_json::from_slice(&text).map_err(|error| format!("its {name} is no JSON: {error}")))
    };
    match (read("zarr.json"), read(".zgroup"), read(".zarray")) {
        (Some(Ok(document)), None, None) => match document["node_type"].as_str() {
            Some("group") if document["zarr_format"] == 3 => Node::Group(document["attributes"]["ome"].clone()),
            Some("array") if document["zarr_format"] == 3 => Node::Array,
            _ => Node::Unreadable("its zarr.json is neither that of a group nor of an array of Zarr 3".into()),
        },
        (None, Some(Ok(document)), None) if document["zarr_format"] == 2 => match read(".zattrs") {
            Some(Err(what)) => Node::Unreadable(what),
            attributes => Node::Group(attributes.and_then(std::result::Result::ok).unwrap_or_default()),
        },
        (None, None, Some(Ok(document))) if document["zarr_format"] == 2 => Node::Array,
        (None, None, None) => Node::Nothing,
        (Some(Err(what)), ..) | (_, Some(Err(what)), _) | (.., Some(Err(what))) => Node::Unreadable(what),
        _ => Node::Unreadable("has documents of Zarr that contradict each other".into()),
    }
}

fn folders(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut names: Vec<String> = entries
        .filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_dir()))
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .collect();
    names.sort_unstable();
    names
}

fn has_nodes(folder: &Path) -> bool {
    folders(folder).iter().any(|name| !matches!(node(&folder.join(name)), Node::Nothing))
}

/// Levels that are named and those that are there, one type for all, and each where the one before puts it.
fn check_levels(store: &Path, group: &str, document: &Value, reader: &ImageReader, found: &mut Check) {
    let named: BTreeSet<&str> = reader.levels().iter().map(|level| level.path.as_str()).collect();
    let datasets = document["multiscales"][0]["datasets"].as_array().map_or(0, Vec::len);
    if named.len() != datasets {
        found.wrong_in(group, "names a level twice");
    }
    let folder = store.join(group);
    for name in folders(&folder).iter().filter(|name| matches!(node(&folder.join(name)), Node::Array)) {
        if !named.contains(name.as_str()) {
            found.wrong_in(joined(group, name), "is an array that the image does not name as a level");
        }
    }
    for pair in reader.levels().windows(2) {
        if pair[0].element != pair[1].element {
            let text = format!("holds {}, and the finer level {}", pair[1].element, pair[0].element);
            found.wrong_in(joined(group, &pair[1].path), text);
        }
        if factors(&pair[0], &pair[1]).is_none() {
            let text = "has not the extents, spacing and place of halved axes of the finer level";
            found.wrong_in(joined(group, &pair[1].path), text);
        }
    }
}

/// Voxels of the finer level that one of the coarser covers along each axis; none where the one is not made of the other.
pub(super) fn factors(fine: &StoredLevel, coarse: &StoredLevel) -> Option<[i64; 3]> {
    let (fine, coarse) = (&fine.geometry, &coarse.geometry);
    let factors: [i64; 3] = std::array::from_fn(|a| if coarse.spacing[a] > 1.5 * fine.spacing[a] { 2 } else { 1 });
    let fits = (0..3).all(|a| {
        let f = factors[a];
        let origin = fine.origin[a] + 0.5 * (f - 1) as f64 * fine.spacing[a];
        coarse.shape[a] == (fine.shape[a] + f - 1) / f
            && coarse.spacing[a] == fine.spacing[a] * f as f64
            && coarse.origin[a] == origin
    });
    fits.then_some(factors)
}

/// Files in the folders of images that are neither documents nor shards of them.
fn strays(files: &[String], images: &[Image], found: &mut Check) {
    for image in images {
        for level in image.reader.levels() {
            let folder = joined(&image.group, &level.path) + "/";
            let from = files.partition_point(|file| *file < folder);
            for file in files[from..].iter().take_while(|file| file.starts_with(&folder)) {
                let below = &file[folder.len()..];
                if !DOCUMENTS.contains(&below) && !is_shard(image, level, file) {
                    found.wrong_in(file, "is no part of the array");
                }
            }
        }
    }
}

/// Whether a file has the name of a shard of a level.
fn is_shard(image: &Image, level: &StoredLevel, file: &str) -> bool {
    let mut numbers = file.rsplit('/').map(|part| part.parse::<i64>().ok());
    let [x, y, z] = [(); 3].map(|()| numbers.next().flatten());
    let time = numbers.next().flatten().and_then(|time| u64::try_from(time).ok());
    let of_time = match (image.reader.times(), time) {
        (Some(times), Some(time)) if time < times => Some(image.at(time)),
        (Some(_), _) => return false,
        (None, _) => None,
    };
    let image = of_time.as_ref().unwrap_or(image);
    let Some(level) = image.reader.levels().iter().find(|other| other.path == level.path) else { return false };
    let (Some(x), Some(y), Some(z)) = (x, y, z) else { return false };
    let place = [x, y, z];
    let voxel: Option<[i64; 3]> = (0..3)
        .map(|a| place[a].checked_mul(level.shard[a]).filter(|v| (0..level.geometry.shape[a]).contains(v)))
        .collect::<Option<Vec<i64>>>()
        .and_then(|voxel| voxel.try_into().ok());
    voxel.is_some_and(|voxel| joined(&image.group, &level.file_of(voxel)) == file)
}
