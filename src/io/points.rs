//! Point clouds from files: tables as many programs write them, PLY vertices, ROIs of ImageJ. Told apart by content, never
//! by the name.
//!
//! - `csv`: a header names the columns (`names`), `object` and `contour` where there are any. Other columns are left aside.
//! - `xyz`: three numbers a line and perhaps more, separated by blanks, tabs, commas or semicolons.
//! - PLY, text or binary: its vertices, by `crate::io::ply`.
//! - ROIs: outlines, by `crate::io::roi`.
//!
//! [`PointFile`] says with the points how their numbers count: lengths, voxels from 0, or slices from 1.

mod columns;
mod csv;
mod layout;
mod names;
mod shapes;
mod units;
mod words;
mod xyz;

use std::path::Path;

use super::input::{HEAD, Input};
use super::text::first_binary_byte;
use super::{ply, roi};
use crate::error::{Error, Result};
use crate::grid::PointCloud;
use layout::{Layout, Separator};
use names::Form;

pub(super) use layout::foreign_line;
pub(super) use shapes::ellipse;
pub use units::LengthUnit;

/// How the numbers along an axis count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Lengths.
    Physical,
    /// Indices of voxels, the first one 0.
    Voxels,
    /// Indices of slices, which a file counted from 1; here the first one is 0 all the same.
    Slices,
}

impl Scale {
    /// The number of the first one in a file.
    pub(super) fn first(self) -> f64 {
        f64::from(u8::from(self == Self::Slices))
    }
}

/// What a file of points holds, and how it is to be understood.
#[derive(Clone, Debug, PartialEq)]
pub struct PointFile {
    /// The points, their numbers as `scales` and `units` say.
    pub cloud: PointCloud,
    /// What the file is, in a few words.
    pub form: String,
    /// How the numbers along x, y and z count.
    pub scales: [Scale; 3],
    /// The units of those that are lengths, where the file tells them.
    pub units: [Option<LengthUnit>; 3],
    /// The time of each point, the first one 0; empty where the file names none.
    pub times: Vec<i64>,
    /// What the user should know about how the file was understood.
    pub notes: Vec<String>,
}

impl PointFile {
    /// Points whose numbers are lengths.
    #[must_use]
    pub fn physical(form: &str, cloud: PointCloud) -> Self {
        Self {
            cloud,
            form: form.into(),
            scales: [Scale::Physical; 3],
            units: [None; 3],
            times: Vec::new(),
            notes: Vec::new(),
        }
    }

    /// The same points with all lengths in one unit, that of the first axis that tells one; which is told.
    pub(super) fn in_one_unit(mut self) -> Self {
        let Some(to) = self.units.into_iter().flatten().next() else { return self };
        if self.units.into_iter().flatten().all(|unit| unit == to) {
            return self;
        }
        let told = (0..3).filter_map(|a| Some(format!("{} of {}", self.units[a]?.name, ["x", "y", "z"][a])));
        let told = told.collect::<Vec<_>>().join(", ");
        self.notes.push(format!("units differ ({told}); all lengths are told in {}", to.name));
        for (axis, unit) in self.units.iter_mut().enumerate() {
            if let Some(unit) = unit {
                let factor = unit.in_units_of(to);
                *unit = to;
                self.cloud.positions.iter_mut().for_each(|point| point[axis] *= factor);
            }
        }
        self
    }

    /// What is to be told where the points are taken as they are, without an image.
    pub(super) fn notes_without_image(&self) -> Vec<String> {
        let mut notes = self.notes.clone();
        if self.scales != [Scale::Physical; 3] {
            let axes: Vec<&str> =
                (0..3).filter(|&a| self.scales[a] != Scale::Physical).map(|a| ["x", "y", "z"][a]).collect();
            let axes = axes.join(", ");
            notes.push(format!(
                "its {axes} are voxel indices and no lengths ({}); they are taken as they are",
                self.form
            ));
        }
        let first = self.times.first();
        if self.times.iter().any(|time| Some(time) != first) {
            notes.push("has points of several times; all of them are taken".into());
        }
        notes
    }
}

/// Reads a point cloud with its numbers as they stand in the file; `objects` and `contours` are empty where the file names
/// none.
///
/// # Errors
/// As [`read_points`].
pub fn read_cloud(path: &Path) -> Result<PointCloud> {
    read_points(path).map(|file| file.cloud)
}

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
pub(super) fn refuse_empty(cloud: PointCloud) -> Result<PointCloud> {
    if cloud.is_empty() {
        return Err(Error::input("holds no point; give a file with at least one line of coordinates"));
    }
    Ok(cloud)
}

/// Reads a table, CSV or XYZ.
pub(super) fn read_table(input: &mut Input) -> Result<PointFile> {
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
    match first_binary_byte(head) {
        None => Ok(()),
        Some(place) => Err(Error::input(format!(
            "holds binary data that is not PLY (byte {place} is no text); give points as CSV, XYZ, PLY or ROIs of ImageJ"
        ))),
    }
}
