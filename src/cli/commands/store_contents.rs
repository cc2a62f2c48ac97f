//! What lies in a store: its groups, the range of an image's values, its meshes and tables.

use std::ffi::OsStr;
use std::fs::{self, File};
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

use crate::cli::terminal::text::{bytes, grouped};
use crate::error::Result;
use crate::io::ome_zarr::{TIMES, is_store};
use crate::io::stack::volume::Select;
use crate::io::stack::zarr::{LevelDescription, ZarrImage};
use crate::pipeline::image::value_range::value_range;

/// Groups lie no deeper than this: `labels/segmentation`, `levelset/object-1`.
const DEEPEST: usize = 3;
/// Voxels of a level that are read to tell the range of its values; the finest level that has no more is taken.
const MOST_READ: u128 = 1 << 26;
/// A header of a mesh or a table is not longer than this.
const HEADER_LINES: usize = 64;

/// The groups of a store, the root first.
pub(crate) fn groups(store: &Path) -> Vec<String> {
    let mut found = vec![String::new()];
    let mut next = 0;
    while let Some(group) = found.get(next).cloned() {
        next += 1;
        let depth = if group.is_empty() { 0 } else { group.split('/').count() };
        let below = |path: PathBuf| {
            let name = path.file_name()?.to_string_lossy().into_owned();
            // Those of single times are told as one.
            let is_told = is_group(&path) && !(group.is_empty() && name == TIMES);
            is_told.then(|| if group.is_empty() { name } else { format!("{group}/{name}") })
        };
        if depth < DEEPEST {
            let here = found.len();
            found.extend(entries(&store.join(&group)).into_iter().filter_map(below));
            found[here..].sort();
        }
    }
    found
}

/// True for a folder that holds images, false for an array, a level of one.
fn is_group(path: &Path) -> bool {
    let is_array = || {
        let text = fs::read(path.join("zarr.json")).ok()?;
        let document: serde_json::Value = serde_json::from_slice(&text).ok()?;
        (document["node_type"] == "array").then_some(())
    };
    is_store(path) && !path.join(".zarray").exists() && is_array().is_none()
}

fn entries(folder: &Path) -> Vec<PathBuf> {
    fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()).collect()
}

/// The smallest and largest value of an image, that of this number where there are several, and the level that was read
/// for them; none where no level is small enough.
pub(crate) fn range(path: &Path, image: Option<u32>, levels: &[LevelDescription]) -> Result<Option<(usize, [f64; 2])>> {
    let voxels = |level: &LevelDescription| level.shape.iter().map(|&n| u128::from(n.unsigned_abs())).product::<u128>();
    let Some(level) = levels.iter().position(|level| voxels(level) <= MOST_READ) else { return Ok(None) };
    let image = ZarrImage::open(path, Select { level: level as u32, image, ..Select::default() })?;
    Ok(value_range(&image)?.map(|range| (level, range)))
}

/// The files beside the images, and what each holds.
pub(crate) fn contents(store: &Path) -> Vec<(String, String)> {
    let times = entries(&store.join(TIMES)).into_iter().filter(|path| is_group(path)).count();
    let what = || format!("level sets, distances, marks and report of each of {times} times; surfaces in meshes");
    let of_times = (times > 0).then(|| (TIMES.to_owned(), what()));
    files(store).iter().filter_map(|file| described(store, file)).chain(of_times).collect()
}

/// The files of the root and its folders without arrays, by name.
fn files(store: &Path) -> Vec<PathBuf> {
    // Metadata of Zarr itself are told with the images.
    let is_metadata = |name: &OsStr| name == "zarr.json" || name.to_string_lossy().starts_with(".z");
    let is_plain = |path: &PathBuf| path.is_file() && !path.file_name().is_some_and(is_metadata);
    let mut found: Vec<PathBuf> = entries(store).into_iter().filter(is_plain).collect();
    found.extend(entries(&store.join("meshes")).into_iter().filter(is_plain));
    found.sort();
    found
}

/// A file's name in the store and what it holds.
fn described(store: &Path, file: &Path) -> Option<(String, String)> {
    let name = file.strip_prefix(store).ok()?.to_string_lossy().into_owned();
    let length = file.metadata().ok()?.len();
    // What is no text ends the lines.
    let header: Vec<String> =
        BufReader::new(File::open(file).ok()?).lines().take(HEADER_LINES).map_while(std::io::Result::ok).collect();
    let count = |element: &str| {
        let line =
            header.iter().find_map(|line| line.strip_prefix("element ")?.strip_prefix(element)?.strip_prefix(' '))?;
        line.trim().parse::<u64>().ok()
    };
    let what = match (count("vertex"), count("face")) {
        (Some(vertices), Some(faces)) => {
            format!("mesh of {} vertices, {} triangles, {}", grouped(vertices), grouped(faces), bytes(length))
        }
        _ if file.extension().is_some_and(|ending| ending == "csv") => {
            let rows = BufReader::new(File::open(file).ok()?).lines().count().saturating_sub(1);
            format!("table of {} rows: {}", grouped(rows as u64), header.first()?)
        }
        _ => bytes(length),
    };
    Some((name, what))
}
