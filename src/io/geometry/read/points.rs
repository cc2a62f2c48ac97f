//! Point clouds from files: tables as many programs write them, PLY vertices, ROIs of ImageJ. Told apart by content, never
//! by the name.
//!
//! - `csv`: a header names the columns (`names`), `object` and `contour` where there are any. Other columns are left aside.
//! - `xyz`: three numbers a line and perhaps more, separated by blanks, tabs, commas or semicolons.
//! - PLY, text or binary: its vertices, by `crate::io::geometry::read::ply`.
//! - ROIs: outlines, by `crate::io::geometry::read::roi`.
//!
//! [`PointFile`] says with the points how their numbers count: lengths, voxels from 0, or slices from 1.

mod columns;
mod corner;
mod csv;
mod layout;
mod names;
mod shapes;
mod words;
mod xyz;

use std::path::Path;

use super::input::{HEAD, Input};
use super::point_file::PointFile;
use super::{ply, roi};
use crate::error::{Error, Result};
use crate::grid::PointCloud;
use crate::io::text::first_binary_byte;
use layout::{Layout, Separator};
use names::Form;

pub use super::point_units::LengthUnit;
pub(crate) use layout::foreign_line;

/// Reads a file of points, or standard input where the path is `-`, and says how it is to be understood.
///
/// # Errors
/// When the file cannot be read, holds no point, or any line of it cannot be understood: names line and reason.
pub fn read_points(path: &Path) -> Result<PointFile> {
    let read = || {
        let mut input = Input::open(path, "points (CSV, XYZ, PLY or ROIs)")?;
        let head = input.head()?;
        let file = if ply::is_ply(head) {
            PointFile::physical("PLY", ply::read_vertices(&mut input)?)
        } else if roi::is_roi(head) {
            roi::read_roi(&mut input)?
        } else if roi::is_zip(head) {
            roi::read_zip(&mut input)?
        } else {
            read_table(&mut input)?
        };
        refuse_empty(file.cloud).map(|cloud| PointFile { cloud, ..file })
    };
    read().map_err(|error: Error| error.at(path))
}

/// Refuses a cloud without points.
pub(crate) fn refuse_empty(cloud: PointCloud) -> Result<PointCloud> {
    if cloud.is_empty() {
        return Err(Error::input("holds no point; give a file with at least one line of coordinates"));
    }
    Ok(cloud)
}

/// Reads a table, CSV or XYZ.
pub(crate) fn read_table(input: &mut Input) -> Result<PointFile> {
    let head = input.head()?;
    refuse_binary(head)?;
    let layout = Layout::of(head)?;
    let has_more = head.len() as u64 >= HEAD - 3;
    let text = &mut input.reader;
    match layout {
        None if has_more => Err(Error::input("starts with more than 64 kB of comments; delete some of them")),
        None => Ok(PointFile::physical("", PointCloud::default())),
        Some(Layout::Xyz { separator, columns, first_line, counted }) => {
            let unnamed = columns.form == Form::FirstThree && separator != Separator::Blanks;
            let mut file = xyz::read(text, separator, columns, first_line, counted)?;
            if unnamed {
                file.notes.insert(0, "has no header: its first three columns are taken as x, y, z".into());
            }
            Ok(file)
        }
        Some(Layout::Csv { separator, columns, header_line }) => csv::read(text, separator, columns, header_line),
    }
}

/// True for what starts like a table with named columns between separators.
pub(crate) fn is_csv(head: &[u8]) -> bool {
    matches!(text_layout(head), Some(Layout::Csv { .. }))
}

/// True for what starts like lines of numbers, with or without a header.
pub(crate) fn is_xyz(head: &[u8]) -> bool {
    matches!(text_layout(head), Some(Layout::Xyz { .. }))
}

fn text_layout(head: &[u8]) -> Option<Layout> {
    if refuse_binary(head).is_err() { None } else { Layout::of(head).ok().flatten() }
}

/// Refuses what is not text.
fn refuse_binary(head: &[u8]) -> Result<()> {
    match first_binary_byte(head) {
        None => Ok(()),
        Some(place) => Err(Error::input(format!(
            "holds binary data that is not PLY (byte {place} is no text); give points as CSV, XYZ, PLY or ROIs of ImageJ"
        ))),
    }
}
