//! Point clouds from files: CSV with a header, plain XYZ, PLY vertices. Told apart by content, never by the name.
//!
//! - `csv`: a header names the columns: `x`, `y`, `z`, or `axis-0`, `axis-1`, `axis-2` (z, y, x) as napari writes
//!   them; `object` and `contour` where there are any. Other columns are left aside.
//! - `xyz`: three numbers a line and perhaps more, separated by blanks, tabs, commas or semicolons.
//! - `ply`: the vertices of a PLY file, text or binary.

mod columns;
mod csv;
mod layout;
mod ply;
mod ply_header;
mod xyz;

use std::fs::{self, File};
use std::io::{self, BufRead, BufReader, Cursor, Read};
use std::path::Path;

use crate::error::{Error, Result};
use crate::grid::PointCloud;
use layout::Layout;

/// Bytes looked at to tell what a file holds; its header must lie within them.
const HEAD: u64 = 1 << 16;

/// The longest line that is read; a point takes some 80 bytes.
const LONGEST_LINE: u64 = 1 << 20;

/// Reads a point cloud in physical coordinates; `objects` and `contours` are empty where the file names none.
///
/// # Errors
/// When the file cannot be read, holds no point, or any line of it cannot be understood: names line and reason.
pub fn read_cloud(path: &Path) -> Result<PointCloud> {
    let cloud = read(path).map_err(|error| error.at(path))?;
    if cloud.is_empty() {
        return Err(Error::input("holds no point; give a file with at least one line of coordinates").at(path));
    }
    Ok(cloud)
}

fn read(path: &Path) -> Result<PointCloud> {
    let metadata = fs::metadata(path).map_err(|e| unreadable(&e))?;
    if metadata.is_dir() {
        return Err(Error::input("is a folder; give one file with points (CSV, XYZ or PLY)"));
    }
    let mut file = File::open(path).map_err(|e| unreadable(&e))?;
    let mut head = Vec::new();
    file.by_ref().take(HEAD).read_to_end(&mut head).map_err(|e| unreadable(&e))?;
    // Pipes tell no length.
    let length = metadata.is_file().then_some(metadata.len());
    read_after_head(head, file, length)
}

/// Reads the cloud in `head` followed by `rest`, together of the given length in bytes where it is known.
fn read_after_head(mut head: Vec<u8>, rest: impl Read, length: Option<u64>) -> Result<PointCloud> {
    if head.is_empty() {
        return Err(Error::input("is empty; give a file with points (CSV, XYZ or PLY)"));
    }
    if head.starts_with(b"ply\n") || head.starts_with(b"ply\r") {
        return ply::read(&mut BufReader::with_capacity(1 << 18, Cursor::new(head).chain(rest)), length);
    }
    if head.starts_with(b"\xef\xbb\xbf") {
        head.drain(..3);
    }
    refuse_binary(&head)?;
    let layout = Layout::of(&head)?;
    let has_more = head.len() as u64 >= HEAD - 3;
    let mut text = BufReader::with_capacity(1 << 18, Cursor::new(head).chain(rest));
    match layout {
        None if has_more => Err(Error::input("starts with more than 64 kB of comments; delete some of them")),
        None => Ok(PointCloud::default()),
        Some(Layout::Xyz { separator, columns, first_line }) => xyz::read(&mut text, separator, columns, first_line),
        Some(Layout::Csv { separator, columns, header_line }) => csv::read(&mut text, separator, columns, header_line),
    }
}

/// Refuses what is not text: zero bytes and control characters stand in no table.
fn refuse_binary(head: &[u8]) -> Result<()> {
    if head.starts_with(b"\xff\xfe") || head.starts_with(b"\xfe\xff") {
        return Err(Error::input("is text in UTF-16; save it as UTF-8"));
    }
    let is_text = |byte: &u8| *byte >= b' ' || matches!(byte, b'\t' | b'\n' | b'\r' | 0x0c);
    match head.iter().position(|byte| !is_text(byte)) {
        None => Ok(()),
        Some(place) => Err(Error::input(format!(
            "holds binary data that is not PLY (byte {place} is no text); give points as CSV, XYZ or PLY"
        ))),
    }
}

fn unreadable(error: &io::Error) -> Error {
    Error::input(format!("cannot be read: {error}"))
}

/// Text from a file for use in a message: short and without control characters.
fn quoted(text: &str) -> String {
    const LONGEST: usize = 60;
    let mut shown: String = text.trim().chars().take(LONGEST).flat_map(char::escape_debug).collect();
    if text.trim().chars().nth(LONGEST).is_some() {
        shown.push_str("...");
    }
    format!("'{shown}'")
}

/// Reads up to and with the next line feed into `line`; false at the end of the file.
///
/// A line has at most `longest` bytes: a file without line ends must not fill the memory.
fn next_line(reader: &mut impl BufRead, line: &mut Vec<u8>, longest: u64, number: u64) -> Result<bool> {
    line.clear();
    let read = reader.by_ref().take(longest).read_until(b'\n', line).map_err(|e| unreadable(&e))?;
    if read as u64 == longest && line.last() != Some(&b'\n') {
        return Err(Error::input(format!("line {number} is longer than {longest} bytes; give one point a line")));
    }
    Ok(read > 0)
}
