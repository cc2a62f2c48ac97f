//! From a path to an image: an OME-Zarr group, one image of a `bioformats2raw` store, an array of an OME-Zarr group, or an
//! array that tells nothing of itself.

use std::path::{Path, PathBuf};

use serde_json::Value;

use super::axes::{self, Axis};
use super::multiscale::{self, Level, Multiscale};
use super::node::{Node, children};
use crate::error::{Error, Result};

/// An image whose levels are named and not yet opened.
#[derive(Clone, Debug)]
pub(crate) struct Found {
    /// The folder of the group, or of the array.
    pub(crate) folder: PathBuf,
    pub(crate) multiscale: Multiscale,
    /// The level that the path itself named.
    pub(crate) level: Option<usize>,
    /// How many images there are to choose from.
    pub(crate) images: usize,
    pub(crate) notes: Vec<String>,
}

/// Finds the image at a path; `image` chooses among several, counted from 0.
pub(crate) fn find(path: &Path, image: Option<u32>) -> Result<Found> {
    let node = read(path)?;
    if node.array.is_some() {
        return array(path, &node);
    }
    if let Some(found) = multiscales(path, &node)? {
        return choose_only(found, image);
    }
    let ome = node.ome();
    if ome["plate"].is_object() || ome["well"].is_object() {
        let what = if ome["plate"].is_object() { "a plate of wells" } else { "a well" };
        let example = if ome["plate"].is_object() { "A/1/0" } else { "0" };
        let example = path.join(example);
        return Err(Error::input(format!("is {what}; name one image in it, such as {}", example.display())).at(path));
    }
    if !ome["bioformats2raw.layout"].is_null() {
        return series(path, image);
    }
    Err(no_image(path, ome))
}

/// Reads the node at a path, which must be one.
fn read(path: &Path) -> Result<Node> {
    let missing = || Error::input("holds no Zarr metadata (zarr.json, .zarray, .zgroup)").at(path);
    Node::read(path)?.ok_or_else(missing)
}

fn multiscales(path: &Path, node: &Node) -> Result<Option<Found>> {
    let Some(list) = node.ome()["multiscales"].as_array().filter(|list| !list.is_empty()) else { return Ok(None) };
    let multiscale = multiscale::parse(&list[0], node.ome()).map_err(|reason| Error::input(reason).at(path))?;
    let mut notes = Vec::new();
    if list.len() > 1 {
        notes.push(format!("{} multiscale images lie in one group; the first is read", list.len()));
    }
    Ok(Some(Found { folder: path.to_path_buf(), multiscale, level: None, images: 1, notes }))
}

/// Refuses another image than the one that is there.
fn choose_only(found: Found, image: Option<u32>) -> Result<Found> {
    match image {
        Some(image @ 1..) => {
            Err(Error::usage(format!("image {image} was asked for but there is 1, counted from 0")).at(&found.folder))
        }
        _ => Ok(found),
    }
}

/// One of the images of a `bioformats2raw` store, which lie in groups of their own below it.
fn series(path: &Path, image: Option<u32>) -> Result<Found> {
    let listed = Node::read(&path.join("OME"))?.unwrap_or_default();
    let listed = listed.ome()["series"].as_array().cloned().unwrap_or_default();
    let mut names: Vec<String> = listed.iter().filter_map(Value::as_str).map(ToOwned::to_owned).collect();
    if names.is_empty() {
        let mut numbers: Vec<u32> = children(path).iter().filter_map(|name| name.parse().ok()).collect();
        numbers.sort_unstable();
        names = numbers.iter().map(u32::to_string).collect();
    }
    let number = image.unwrap_or(0) as usize;
    let Some(name) = names.get(number) else {
        let error = format!("image {number} was asked for but there are {}, counted from 0", names.len());
        return Err(if image.is_some() { Error::usage(error) } else { Error::input("names no images") }.at(path));
    };
    let inside = Path::new(name).components().all(|part| matches!(part, std::path::Component::Normal(_)));
    let group = path.join(name);
    if !inside {
        return Err(Error::input(format!("names the image '{name}', which is no folder below it")).at(path));
    }
    let Some(mut found) = multiscales(&group, &read(&group)?)? else {
        return Err(Error::input("holds no OME-Zarr image").at(&group));
    };
    found.images = names.len();
    let choose = if names.len() > 1 && image.is_none() { "; --image-index chooses another" } else { "" };
    found.notes.push(format!("image {number} of {} is read, {name}{choose}", names.len()));
    Ok(found)
}

/// An array: a level of the group around it where that names it, else one that tells nothing of itself.
fn array(path: &Path, node: &Node) -> Result<Found> {
    // The folder above is found by its real name, so that `.` has one too.
    let real = path.canonicalize().map_err(|e| Error::input(format!("cannot be read: {e}")).caused_by(e).at(path))?;
    for (up, folder) in real.ancestors().enumerate().skip(1).take(2) {
        let Some(around) = Node::read(folder).unwrap_or_default() else { continue };
        let name = real.strip_prefix(folder).unwrap_or(&real);
        let Some(found) = multiscales(folder, &around)? else { continue };
        if let Some(level) = found.multiscale.levels.iter().position(|level| Path::new(&level.path) == name) {
            // As it was typed, where no link is on the way.
            let typed = path.ancestors().nth(up).filter(|typed| typed.canonicalize().is_ok_and(|real| real == folder));
            let folder = typed.unwrap_or(folder);
            return Ok(Found { folder: folder.to_path_buf(), level: Some(level), ..found });
        }
    }
    let document = node.array.as_ref();
    let named = document.map(|document| &document["dimension_names"]).and_then(axes::parse);
    let named = named.or_else(|| axes::parse(&node.attributes["_ARRAY_DIMENSIONS"]));
    let notes = vec!["a plain array without OME-Zarr metadata".to_owned()];
    let multiscale = plain(named.filter(|axes| axes::places(axes).is_ok()));
    Ok(Found { folder: path.to_path_buf(), multiscale, level: None, images: 1, notes })
}

/// An array by itself as a multiscale image of one level.
fn plain(axes: Option<Vec<Axis>>) -> Multiscale {
    Multiscale { name: None, version: None, axes, levels: vec![Level { path: String::new(), placed: None }] }
}

/// Says what a group without an image holds instead.
fn no_image(path: &Path, ome: &Value) -> Error {
    let labels: Vec<&str> = ome["labels"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
    let mut names: Vec<String> = labels.into_iter().map(ToOwned::to_owned).collect();
    if names.is_empty() {
        names = children(path);
    }
    let error = match names.as_slice() {
        [] => "is a Zarr group without an OME-Zarr image, and empty".to_owned(),
        [only] => {
            format!("is a Zarr group without an OME-Zarr image; name what is in it, {}", path.join(only).display())
        }
        [first, ..] => {
            let shown = names.iter().take(8).cloned().collect::<Vec<_>>().join(", ");
            let more = if names.len() > 8 { ", ..." } else { "" };
            format!(
                "is a Zarr group without an OME-Zarr image; name one of what is in it ({shown}{more}), such as {}",
                path.join(first).display()
            )
        }
    };
    Error::input(error).at(path)
}
