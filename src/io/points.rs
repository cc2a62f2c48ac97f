//! Point clouds from files: CSV with a header, plain XYZ, PLY vertices. Told apart by content, never by the name.
//!
//! - `csv`: a header names the columns: `x`, `y`, `z`, or `axis-0`, `axis-1`, `axis-2` (z, y, x) as napari writes
//!   them; `object` and `contour` where there are any. Other columns are left aside.
//! - `xyz`: three numbers a line and perhaps more, separated by blanks, tabs, commas or semicolons.
//! - PLY, text or binary: its vertices, by `crate::io::ply`.

mod columns;
mod csv;
mod layout;
mod xyz;

use std::path::Path;

use super::input::{HEAD, Input};
use super::ply;
use super::text::{first_binary_byte, refuse_utf16};
use crate::error::{Error, Result};
use crate::grid::PointCloud;
use layout::Layout;
pub(super) use layout::foreign_line;

/// Reads a point cloud in physical coordinates; `objects` and `contours` are empty where the file names none.
///
/// # Errors
/// When the file cannot be read, holds no point, or any line of it cannot be understood: names line and reason.
pub fn read_cloud(path: &Path) -> Result<PointCloud> {
    let read = || {
        let mut input = Input::open(path, "points (CSV, XYZ or PLY)")?;
        let cloud = if ply::is_ply(input.head()?) { ply::read_vertices(&mut input)? } else { read_table(&mut input)? };
        refuse_empty(cloud)
    };
    read().map_err(|error: Error| error.at(path))
}

/// Refuses a cloud without points.
pub(super) fn refuse_empty(cloud: PointCloud) -> Result<PointCloud> {
    if cloud.is_empty() {
        return Err(Error::input("holds no point; give a file with at least one line of coordinates"));
    }
    Ok(cloud)
}

/// Reads a table, CSV or XYZ.
pub(super) fn read_table(input: &mut Input) -> Result<PointCloud> {
    let head = input.head()?;
    refuse_binary(head)?;
    let layout = Layout::of(head)?;
    let has_more = head.len() as u64 >= HEAD - 3;
    let text = &mut input.reader;
    match layout {
        None if has_more => Err(Error::input("starts with more than 64 kB of comments; delete some of them")),
        None => Ok(PointCloud::default()),
        Some(Layout::Xyz { separator, columns, first_line }) => xyz::read(text, separator, columns, first_line),
        Some(Layout::Csv { separator, columns, header_line }) => csv::read(text, separator, columns, header_line),
    }
}

/// True for what starts like a table with named columns between separators.
pub(super) fn is_csv(head: &[u8]) -> bool {
    matches!(text_layout(head), Some(Layout::Csv { .. }))
}

/// True for what starts like lines of numbers, with or without a header.
pub(super) fn is_xyz(head: &[u8]) -> bool {
    matches!(text_layout(head), Some(Layout::Xyz { .. }))
}

fn text_layout(head: &[u8]) -> Option<Layout> {
    if refuse_binary(head).is_err() { None } else { Layout::of(head).ok().flatten() }
}

/// Refuses what is not text.
fn refuse_binary(head: &[u8]) -> Result<()> {
    refuse_utf16(head)?;
    match first_binary_byte(head) {
        None => Ok(()),
        Some(place) => Err(Error::input(format!(
            "holds binary data that is not PLY (byte {place} is no text); give points as CSV, XYZ or PLY"
        ))),
    }
}
