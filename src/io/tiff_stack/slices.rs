//! A folder of slices: one TIFF file per plane, in the natural order of their names (`s2.tif` before `s10.tif`).

use std::cmp::Ordering;
use std::path::{Path, PathBuf};

use super::ifd::{Tags, TiffFile};
use super::layout::{Description, Dimensions};
use super::page::Page;
use super::source::{self, Opened, Source};
use super::{Select, ome_xml};
use crate::error::{Error, Result};

/// Opens a folder of slices.
pub(super) fn open_folder(folder: &Path, select: Select) -> Result<Opened> {
    let files = list(folder)?;
    let (file, offset) = open_slice(&files[0])?;
    let tags = Tags::read(&file, offset, 1)?;
    let first = Page::parse(&tags)?;
    let description = describe_slice(&tags)?;
    for path in &files[1..] {
        let (file, offset) = open_slice(path)?;
        let page = Page::parse(&Tags::read(&file, offset, 1)?)?;
        if page.kind != first.kind {
            return Err(file.error(format!(
                "this slice is {} but the first of its folder ({}) is {}; all slices must be alike",
                page.kind,
                files[0].file_name().unwrap_or_default().to_string_lossy(),
                first.kind
            )));
        }
    }
    let dimensions = Dimensions::only_z(files.len() as u64);
    let (_, sample) = source::choose(&file, &dimensions, first.kind.samples, select)?;
    let info = source::info(&first, &dimensions, description);
    Ok(Opened { info, source: Source::Slices { files, kind: first.kind, sample } })
}

/// What the first slice says of its spacing.
fn describe_slice(tags: &Tags) -> Result<Description> {
    let text = tags.text(270, ome_xml::MAX_TEXT)?.unwrap_or_default();
    if ome_xml::is_ome(&text) {
        return ome_xml::spacing_of_slice(&text).map_err(|reason| tags.file.error(reason));
    }
    let (_, description) = source::describe(tags.file, &[tags.offset])?;
    if description.dimensions.and_then(|d| d.count()).is_some_and(|planes| planes > 1) {
        return Err(tags.file.error("it is a stack itself, but in a folder of slices every file is one plane"));
    }
    Ok(description)
}

/// Opens a file that must hold one page.
pub(super) fn open_slice(path: &Path) -> Result<(TiffFile, u64)> {
    let file = TiffFile::open(path)?;
    let offsets = file.pages()?;
    match offsets[..] {
        [only] => Ok((file, only)),
        _ => Err(file.error(format!(
            "it has {} pages, but in a folder of slices every file is one plane; name the file itself to read it",
            offsets.len()
        ))),
    }
}

/// The slices in a folder, in order.
fn list(folder: &Path) -> Result<Vec<PathBuf>> {
    let unreadable = |e: std::io::Error| Error::input(format!("the folder cannot be read: {e}")).at(folder);
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(unreadable)? {
        let path = entry.map_err(unreadable)?.path();
        if is_slice(&path) {
            files.push(path);
        }
    }
    if files.is_empty() {
        return Err(Error::input("the folder holds no slices (files named *.tif or *.tiff)").at(folder));
    }
    files.sort_by(|a, b| natural(&name(a), &name(b)));
    Ok(files)
}

/// A file with the right ending that is not hidden (file managers and macOS leave `._name.tif` behind).
fn is_slice(path: &Path) -> bool {
    let tiff = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("tif") || e.eq_ignore_ascii_case("tiff"));
    tiff && !name(path).starts_with('.') && path.is_file()
}

fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Compares names with runs of digits taken as numbers of any length; names that differ only in leading zeros are
/// compared as text, so that the order is total.
fn natural(a: &str, b: &str) -> Ordering {
    let (mut left, mut right) = (a, b);
    loop {
        let ((p, rest_left), (q, rest_right)) = (split_token(left), split_token(right));
        if p.is_empty() || q.is_empty() {
            return p.len().cmp(&q.len()).then_with(|| a.cmp(b));
        }
        let digits = |s: &str| s.starts_with(|c: char| c.is_ascii_digit());
        let order = if digits(p) && digits(q) {
            let (p, q) = (p.trim_start_matches('0'), q.trim_start_matches('0'));
            p.len().cmp(&q.len()).then_with(|| p.cmp(q))
        } else {
            p.cmp(q)
        };
        if order != Ordering::Equal {
            return order;
        }
        (left, right) = (rest_left, rest_right);
    }
}

/// The leading run of digits, or else one character, and the rest.
fn split_token(text: &str) -> (&str, &str) {
    let Some(first) = text.chars().next() else { return ("", "") };
    if !first.is_ascii_digit() {
        return text.split_at(first.len_utf8());
    }
    text.split_at(text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_in_names_count_as_numbers() {
        let mut names = ["s10.tif", "s9.tif", "s009a.tif", "a.tif", "s.tif", "s99999999999999999999999.tif", "s09.tif"];
        names.sort_by(|a, b| natural(a, b));
        assert_eq!(
            names,
            ["a.tif", "s.tif", "s09.tif", "s9.tif", "s009a.tif", "s10.tif", "s99999999999999999999999.tif"]
        );
    }
}
