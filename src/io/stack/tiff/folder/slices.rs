//! A folder of slices: one TIFF file per plane, in the order that their names tell (`s2.tif` before `s10.tif`).

use std::path::Path;

use super::names::{Name, file_name};
use super::sequence;
use crate::error::{Error, Result};
use crate::io::stack::tiff::Select;
use crate::io::stack::tiff::description::layout::{Axis, Description};
use crate::io::stack::tiff::description::ome_xml;
use crate::io::stack::tiff::images;
use crate::io::stack::tiff::opened::open_slice;
use crate::io::stack::tiff::opened::{Opened, Source};
use crate::io::stack::tiff::pages::ifd::{Tags, TiffFile};
use crate::io::stack::tiff::pages::page::Page;
use crate::io::stack::tiff::source;

/// Endings of pictures that are no TIFF; a folder of these is no folder of slices.
const OTHER_PICTURES: [&str; 8] = ["png", "jpg", "jpeg", "bmp", "gif", "jp2", "dcm", "webp"];

/// Opens a folder of slices.
pub(crate) fn open_folder(folder: &Path, select: Select) -> Result<Opened> {
    let refuse = |reason: String| Error::input(reason).at(folder);
    if select.image.is_some_and(|image| image > 0) {
        return Err(
            Error::usage("--image-index is for one file with several images; a folder of slices is one").at(folder)
        );
    }
    if select.level > 0 {
        return Err(
            Error::usage("--level is for one file with smaller copies of its pages; slices are read whole").at(folder)
        );
    }
    let found = list(folder)?;
    let sequence = sequence::arrange(found.slices, select.axes.as_ref()).map_err(refuse)?;
    let dimensions = sequence.dimensions;
    // A channel need not be of the type of the first.
    let samples = open_first(sequence.any_file().ok_or_else(|| refuse("it has no slices".into()))?)?.1.kind.samples;
    let (channel, sample) = source::choose(folder, &dimensions, samples, select)?;
    let files = sequence.files(channel, select.time.into()).map_err(refuse)?;
    let (first_file, first) = open_first(&files[0])?;
    let told = [Axis::Channel, Axis::Time].map(|axis| dimensions.size(axis) > 1);
    let mut description = describe_slice(&first_file, told)?;
    for path in &files[1..] {
        let (file, page) = open_first(path)?;
        if page.kind != first.kind {
            return Err(file.error(format!(
                "this slice is {} but the first of its folder ({}) is {}; all slices must be alike",
                page.kind,
                file_name(&files[0]),
                first.kind
            )));
        }
    }
    if sample >= first.kind.samples {
        return Err(refuse(format!(
            "{} has {} samples in a pixel where others have {samples}",
            file_name(&files[0]),
            first.kind.samples
        )));
    }
    description.notes.extend(sequence.notes);
    description.notes.extend(found.notes);
    let info = source::info(&first, &dimensions, description);
    Ok(Opened { info, images: Vec::new(), source: Source::Slices { files, kind: first.kind, sample } })
}

/// What the first slice says of its spacing; `told` says whether the names tell channels and times.
fn describe_slice(file: &TiffFile, told: [bool; 2]) -> Result<Description> {
    let offsets = file.pages()?;
    let tags = Tags::read(file, offsets[0], 1)?;
    let text = tags.text(270, ome_xml::MAX_TEXT)?.unwrap_or_default();
    if ome_xml::is_ome(&text) {
        return ome_xml::spacing_of_slice(&text, told).map_err(|reason| file.error(reason));
    }
    let (_, description) = images::describe(file, &[(1, tags.offset)])?;
    if description.dimensions.and_then(|d| d.count()).is_some_and(|planes| planes > 1) {
        return Err(file.error("it is a stack itself, but in a folder of slices every file is one plane"));
    }
    Ok(description)
}

/// Opens a file that must hold one page, and reads what it is.
fn open_first(path: &Path) -> Result<(TiffFile, Page)> {
    let (file, offset) = open_slice(path)?;
    let page = Page::parse(&Tags::read(&file, offset, 1)?)?;
    Ok((file, page))
}

/// What a folder holds.
struct Listed {
    slices: Vec<Name>,
    notes: Vec<String>,
}

/// The slices in a folder.
fn list(folder: &Path) -> Result<Listed> {
    let unreadable =
        |e: std::io::Error| Error::input(format!("the folder cannot be read: {e}")).caused_by(e).at(folder);
    let (mut slices, mut pictures, mut folders) = (Vec::new(), 0, Vec::new());
    for entry in std::fs::read_dir(folder).map_err(unreadable)? {
        let path = entry.map_err(unreadable)?.path();
        if is_slice(&path) {
            slices.push(Name::of(&path));
        } else if is_named_as_slice(&path) && path.is_symlink() && !path.exists() {
            return Err(Error::input("is a link to a file that is not there; put it back or remove the link").at(&path));
        } else if ends_in(&path, &OTHER_PICTURES) && !file_name(&path).starts_with('.') {
            pictures += 1;
        } else if path.is_dir() {
            folders.push(path);
        }
    }
    if slices.is_empty() {
        folders.sort();
        let below = folders.iter().find(|below| holds_slices(below));
        let hint =
            below.map_or(String::new(), |below| format!("; the folder {} in it does: name that", file_name(below)));
        return Err(Error::input(format!("the folder holds no slices (files named *.tif or *.tiff){hint}")).at(folder));
    }
    let verb = if pictures == 1 { "picture is" } else { "pictures are" };
    let notes = if pictures > 0 { vec![format!("{pictures} {verb} no TIFF and left out")] } else { Vec::new() };
    Ok(Listed { slices, notes })
}

fn holds_slices(folder: &Path) -> bool {
    std::fs::read_dir(folder).is_ok_and(|entries| entries.flatten().any(|entry| is_slice(&entry.path())))
}

/// A file with the right ending that is not hidden (file managers and macOS leave `._name.tif` behind).
fn is_slice(path: &Path) -> bool {
    is_named_as_slice(path) && path.is_file()
}

fn is_named_as_slice(path: &Path) -> bool {
    ends_in(path, &["tif", "tiff"]) && !file_name(path).starts_with('.')
}

fn ends_in(path: &Path, endings: &[&str]) -> bool {
    path.extension().is_some_and(|ending| endings.iter().any(|wanted| ending.eq_ignore_ascii_case(wanted)))
}
