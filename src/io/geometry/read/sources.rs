//! Sources of a distance from files: point clouds and triangle meshes, told apart by content, never by the name.
//!
//! [`FORMATS`] is the one table of what is read. Polygons are cut into triangles; a vertex that no face names is no
//! source of a mesh.

use std::path::Path;

use super::source::Source;

pub use super::input::{Input, is_standard_input};

use super::mesh::{obj, off, stl};
use super::point_file::PointFile;
use super::single::rounded_note;
use super::{foreign, ply, points, roi};
use crate::error::{Error, Result};
use crate::io::text::{first_binary_byte, quoted};

/// A file format of sources.
#[derive(Debug)]
pub struct Format {
    /// Its usual name.
    pub name: &'static str,
    /// Whether a file that starts with these bytes (64 kB, or all of a smaller file) is of this format.
    pub sniff: fn(&[u8]) -> bool,
    /// Reads a file of this format. Fails with an input error that says what is wrong and where.
    pub read: fn(&mut Input) -> Result<Source>,
}

/// The formats, in the order in which they are tried.
pub const FORMATS: &[Format] = &[
    Format { name: "PLY", sniff: ply::is_ply, read: ply::read },
    Format { name: "OFF", sniff: off::is_off, read: off::read },
    Format { name: "STL", sniff: stl::is_stl, read: stl::read },
    Format { name: "OBJ", sniff: obj::is_obj, read: obj::read },
    Format { name: "CSV", sniff: points::is_csv, read: read_table },
    Format { name: "XYZ", sniff: points::is_xyz, read: read_table },
    Format {
        name: "ROI",
        sniff: roi::is_roi,
        read: |input| roi::read_roi(input).and_then(|file| cloud_of(file, input)),
    },
    Format {
        name: "ROI set",
        sniff: roi::is_zip,
        read: |input| roi::read_zip(input).and_then(|file| cloud_of(file, input)),
    },
];

/// Reads points or triangles in physical coordinates.
///
/// # Errors
/// When the file cannot be read, is of no format in [`FORMATS`], holds neither a point nor a triangle, holds more than
/// can be numbered, or is damaged: names the file, the place in it and the reason.
pub fn read_source(path: &Path) -> Result<Source> {
    describe(path).map(|(source, ..)| source)
}

/// As [`read_source`], what the user should know about how the file was understood, and how the points of a table or of ROIs
/// are to be understood; their cloud is left out there.
///
/// # Errors
/// As [`read_source`].
pub fn describe(path: &Path) -> Result<(Source, Option<PointFile>, Vec<String>)> {
    let (source, points, mut notes) = read_parts(path)?;
    let told = points.iter().flat_map(PointFile::notes_without_image);
    notes.extend(told.map(|note| format!("{}: {note}", path.display())));
    Ok((source, points, notes))
}

/// As [`describe`], for whoever knows the image that points lie in: of tables and ROIs nothing is told here, what is to be
/// told of their numbers depends on the image.
///
/// # Errors
/// As [`read_source`].
pub fn read_parts(path: &Path) -> Result<(Source, Option<PointFile>, Vec<String>)> {
    let read_parts = || {
        let open = || Input::open(path, &format!("points or a mesh ({})", names()));
        let mut input = open()?;
        let is_counted = off::starts_with_counts(input.head()?) && path.is_file();
        let source = read(&mut input).or_else(|error| {
            // What tells a mesh without its first word from points may lie beyond the bytes that are looked at.
            let mut again = if is_counted { open()? } else { return Err(error) };
            let mesh = off::read(&mut again).map_err(|_| error)?;
            input = again;
            Ok::<_, Error>(mesh)
        })?;
        let positions = match &source {
            Source::Cloud(cloud) => &cloud.positions,
            Source::Mesh(mesh) => &mesh.vertices,
        };
        input.notes.extend(rounded_note(positions));
        let note = |note: String| format!("{}: {note}", path.display());
        Ok((source, input.points, input.notes.into_iter().map(note).collect()))
    };
    read_parts().map_err(|error: Error| error.at(path))
}

fn read(input: &mut Input) -> Result<Source> {
    let length = input.length;
    let head = input.head()?;
    // What the length says counts for more than any looks, but for those of an outline: it starts with a word of its own,
    // and its corners may say of triangles whatever they like.
    if stl::has_binary_length(head, length) && !roi::is_roi(head) {
        return stl::read(input);
    }
    if let Some(error) = foreign::no_source(head, &names()) {
        return Err(error);
    }
    if let Some(format) = FORMATS.iter().find(|format| (format.sniff)(head)) {
        return (format.read)(input);
    }
    if let Some(place) = first_binary_byte(head) {
        return Err(Error::input(format!(
            "holds binary data of no known format (byte {place} is no text); give points or a mesh ({})",
            names()
        )));
    }
    if let Some((line, text)) = points::foreign_line(head) {
        return Err(Error::input(format!(
            "is neither a point cloud nor a mesh: line {line}, {}, holds no numbers, no names x, y, z of columns and \
             no start of a mesh; give one of {}",
            quoted(&text),
            names()
        )));
    }
    // What is text and nothing else is a table that cannot be understood; its reader says why.
    read_table(input)
}

fn read_table(input: &mut Input) -> Result<Source> {
    points::read_table(input).and_then(|file| cloud_of(file, input))
}

/// The points of a file, with how they are to be understood.
fn cloud_of(file: PointFile, input: &mut Input) -> Result<Source> {
    let mut file = file.in_one_unit();
    let cloud = points::refuse_empty(std::mem::take(&mut file.cloud))?;
    input.points = Some(file);
    Ok(Source::Cloud(cloud))
}

/// The names of all formats, for a message.
fn names() -> String {
    let names: Vec<&str> = FORMATS.iter().map(|format| format.name).collect();
    names.join(", ")
}
