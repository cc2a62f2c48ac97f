//! Writes a triangle mesh as binary little-endian PLY (Turk 1994) while it is found, whatever its size.
//!
//! How many vertices and triangles there are is known only at the end. The file therefore starts with a header of
//! fixed length, filled up by a comment; vertices follow it as they come, in single precision or, on a grid whose
//! positions that would move, in double; triangles gather in a second scratch
//! file that is appended at the end. Nothing stands under the final name before the file is whole.

use std::fs::File;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use super::again::Written;
use super::body::{BUFFER, Body, Form};
use super::temporary::Temporary;
use crate::error::{Error, Result};
use crate::grid::Geometry;
use crate::store::{HiddenFile, MeshSink};

/// A PLY file in the making: a [`MeshSink`] that [`PlyWriter::finish`] completes.
#[derive(Debug)]
pub struct PlyWriter {
    path: PathBuf,
    hidden: HiddenFile,
    body: Ply,
}

/// What is in it.
#[derive(Debug)]
struct Ply {
    form: Form,
    /// The header, or at first the room for it, and the vertices.
    file: BufWriter<File>,
    triangles: BufWriter<Temporary>,
    vertex_count: u64,
    triangle_count: u64,
}

impl PlyWriter {
    /// Starts the file that will stand at `path`; `unit` names the length unit, where it is known.
    ///
    /// Scratch files lie in the folder of `path` and go when the writer is dropped unfinished.
    ///
    /// # Errors
    /// When no file can be made in that folder.
    pub fn create(path: &Path, unit: Option<&str>) -> Result<Self> {
        Self::start(path, Form { unit: unit.map(ToOwned::to_owned), ..Form::default() })
    }

    /// As `create`, for a mesh on a grid: its unit, and positions in double precision where single does not hold them.
    ///
    /// # Errors
    /// When no file can be made in that folder.
    pub fn on_grid(path: &Path, geometry: &Geometry) -> Result<Self> {
        Self::start(path, Form::of(geometry, false))
    }

    /// As `on_grid`; each triangle has the properties `label_low` and `label_high`, the labels that it separates.
    ///
    /// # Errors
    /// When no file can be made in that folder.
    pub fn tagged_on_grid(path: &Path, geometry: &Geometry) -> Result<Self> {
        Self::start(path, Form::of(geometry, true))
    }

    fn start(path: &Path, form: Form) -> Result<Self> {
        let start = || -> io::Result<_> {
            let (hidden, file) = HiddenFile::create(path, ".ply")?;
            let body = Ply::start(file, folder_of(path), form)?;
            Ok(Self { path: path.to_path_buf(), hidden, body })
        };
        start().map_err(|e| unwritable(&e, path))
    }

    /// Completes the file and puts it under its name, in place of any file that was there; returns what is in it.
    ///
    /// # Errors
    /// When the file cannot be written or renamed.
    pub fn finish(self) -> Result<Written> {
        let Self { path, hidden, body } = self;
        let written = body.written(&path);
        let finish = || -> io::Result<()> {
            body.end()?;
            hidden.sync()?;
            hidden.place(true)
        };
        finish().map_err(|e| unwritable(&e, &path))?;
        Ok(written)
    }
}

impl MeshSink for PlyWriter {
    fn vertex(&mut self, position: [f64; 3]) -> Result<()> {
        self.body.vertex(position).map_err(|e| unwritable(&e, &self.path))
    }

    fn triangle(&mut self, corners: [u32; 3]) -> Result<()> {
        self.facet(corners, [0; 2])
    }

    fn facet(&mut self, corners: [u32; 3], labels: [u32; 2]) -> Result<()> {
        self.body.facet(corners, labels).map_err(|e| unwritable(&e, &self.path))
    }
}

pub(super) fn start(file: File, folder: &Path, form: &Form) -> io::Result<Box<dyn Body>> {
    Ok(Box::new(Ply::start(file, folder, form.clone())?))
}

impl Ply {
    fn start(file: File, folder: &Path, form: Form) -> io::Result<Self> {
        let mut file = BufWriter::with_capacity(BUFFER, file);
        file.write_all(&header(&form, u64::MAX, u64::MAX))?;
        let triangles = BufWriter::with_capacity(BUFFER, Temporary::new(folder)?);
        Ok(Self { form, file, triangles, vertex_count: 0, triangle_count: 0 })
    }

    /// Where things lie in the file when it is complete.
    fn written(&self, path: &Path) -> Written {
        Written {
            path: path.to_path_buf(),
            start: header(&self.form, u64::MAX, u64::MAX).len() as u64,
            vertices: self.vertex_count,
            triangles: self.triangle_count,
            is_double: self.form.is_double,
            is_tagged: self.form.is_tagged,
        }
    }

    fn end(self) -> io::Result<()> {
        let mut triangles = self.triangles.into_inner().map_err(io::IntoInnerError::into_error)?;
        let mut file = self.file.into_inner().map_err(io::IntoInnerError::into_error)?;
        triangles.seek(SeekFrom::Start(0))?;
        io::copy(&mut triangles, &mut file)?;
        file.seek(SeekFrom::Start(0))?;
        file.write_all(&header(&self.form, self.vertex_count, self.triangle_count))
    }
}

impl Body for Ply {
    fn vertex(&mut self, position: [f64; 3]) -> io::Result<()> {
        self.vertex_count += 1;
        if self.form.is_double {
            self.file.write_all(position.map(f64::to_le_bytes).as_flattened())
        } else {
            self.file.write_all(position.map(|v| (v as f32).to_le_bytes()).as_flattened())
        }
    }

    fn facet(&mut self, corners: [u32; 3], labels: [u32; 2]) -> io::Result<()> {
        let mut bytes = [3; 21];
        for (place, value) in bytes[1..].chunks_exact_mut(4).zip(corners.into_iter().chain(labels)) {
            place.copy_from_slice(&value.to_le_bytes());
        }
        self.triangle_count += 1;
        self.triangles.write_all(if self.form.is_tagged { &bytes } else { &bytes[..13] })
    }

    fn complete(self: Box<Self>) -> io::Result<()> {
        self.end()
    }
}

/// The header, of one length for all counts.
fn header(form: &Form, vertices: u64, triangles: u64) -> Vec<u8> {
    let longest = header_text(form, u64::MAX, u64::MAX, 0).len();
    let padding = longest - header_text(form, vertices, triangles, 0).len();
    header_text(form, vertices, triangles, padding).into_bytes()
}

fn header_text(form: &Form, vertices: u64, triangles: u64, padding: usize) -> String {
    // A line end in the unit would end the comment. Signed indices are what most readers expect.
    let unit =
        form.unit.as_ref().map_or(String::new(), |u| format!("comment unit {}\n", u.replace(char::is_control, " ")));
    let index = if vertices <= 1 << 31 { "int" } else { "uint" };
    let tags = if form.is_tagged { "property uint label_low\nproperty uint label_high\n" } else { "" };
    let number = if form.is_double { "double" } else { "float" };
    format!(
        "ply\nformat binary_little_endian 1.0\ncomment made by strandline\n{unit}comment {:padding$}\n\
         element vertex {vertices}\nproperty {number} x\nproperty {number} y\nproperty {number} z\n\
         element face {triangles}\nproperty list uchar {index} vertex_indices\n{tags}end_header\n",
        ""
    )
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or_else(|| Path::new("."))
}

fn unwritable(error: &io::Error, path: &Path) -> Error {
    Error::failed(format!("the mesh cannot be written: {error}; check the folder and its free space"))
        .caused_by_io(error)
        .at(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn form(unit: Option<&str>, is_tagged: bool) -> Form {
        Form { unit: unit.map(ToOwned::to_owned), is_tagged, is_double: is_tagged, anchor: [0.0; 3] }
    }

    #[test]
    fn headers_have_one_length() {
        for (unit, tags) in [(None, false), (Some("micrometer"), true), (Some("two\nlines"), false)] {
            let counts = [(0, 0), (7, 12), (1 << 31, 9), (u64::MAX, u64::MAX)];
            let sizes = counts.map(|(v, t)| header(&form(unit, tags), v, t).len());
            assert!(sizes.iter().all(|&size| size == sizes[0]), "{sizes:?}");
        }
        let text = String::from_utf8(header(&form(Some("a\nb"), false), 1 << 31, 1)).unwrap();
        assert!(text.contains("comment unit a b\n") && text.contains("uchar int "));
        assert!(String::from_utf8(header(&form(None, true), (1 << 31) + 1, 1)).unwrap().contains("uchar uint "));
    }
}
