//! Surfaces in files of any format, written while they are found: [`MeshFile`] takes what a surface is drawn into, vertices and
//! triangles, and nothing stands under the file's name before all of it is there.
//!
//! [`FORMATS`] is the one table of what is written.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::body::{Body, Form, Start};
use super::{obj, ply, stl, temporary, vtp};
use crate::error::{Error, Result};
use crate::grid::{Geometry, TriangleMesh};
use crate::store::{HiddenFile, MeshSink};

/// A file format of surfaces.
#[derive(Debug)]
pub struct Format {
    /// Its usual name.
    pub name: &'static str,
    /// How names of such files end, without the dot; it decides.
    pub extension: &'static str,
    /// Whether it holds f32 alone: positions far from zero are then written as seen from an anchor.
    pub is_single: bool,
    /// Whether it holds a number for each vertex.
    pub has_values: bool,
    /// Whether it is text: the digits of an f32 are then read as another number by who reads f64.
    pub is_text: bool,
    start: Start,
}

/// The formats.
pub const FORMATS: &[Format] = &[
    Format { name: "PLY", extension: "ply", is_single: false, has_values: false, is_text: false, start: ply::start },
    Format { name: "OBJ", extension: "obj", is_single: false, has_values: false, is_text: true, start: obj::start },
    Format { name: "STL", extension: "stl", is_single: true, has_values: false, is_text: false, start: stl::start },
    Format { name: "VTP", extension: "vtp", is_single: false, has_values: true, is_text: false, start: vtp::start },
];

impl Format {
    /// The format that a file's name asks for.
    #[must_use]
    pub fn of(path: &Path) -> Option<&'static Self> {
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        FORMATS.iter().find(|format| format.extension == extension)
    }
}

/// A file of any format in the making; dropped unfinished it is gone.
pub struct MeshFile {
    body: Box<dyn Body>,
    values: Option<Values>,
    named: Named,
}

/// A number that is told of each vertex in a format that holds it.
#[derive(Clone)]
pub struct Values {
    /// Its name in the file.
    pub name: &'static str,
    /// What it is at a place; none where it comes with the vertex, as [`MeshSink::valued_vertex`] has it.
    pub at: Option<Arc<dyn Fn([f64; 3]) -> f64 + Send + Sync>>,
}

/// A file that is whole and has no name yet; dropped without one it is gone.
pub struct WholeMesh(Named);

/// A hidden file beside the one that it is to be.
struct Named {
    path: PathBuf,
    hidden: HiddenFile,
}

impl MeshFile {
    /// Begins the file that will stand at `path`, for a surface on a grid; each triangle is written with its labels if it
    /// `is_tagged` and the format holds them. What has to wait for the end lies in the folder `temporary`.
    ///
    /// # Errors
    /// When no file can be made beside `path` or in that folder.
    pub fn create(
        format: &Format,
        path: &Path,
        geometry: &Geometry,
        is_tagged: bool,
        temporary: &Path,
    ) -> Result<Self> {
        Self::begin(format, path, temporary, &Form::of(geometry, is_tagged))
    }

    fn begin(format: &Format, path: &Path, temporary: &Path, form: &Form) -> Result<Self> {
        let begin = || -> io::Result<_> {
            let (hidden, file) = HiddenFile::create(path, &format!(".{}", format.extension))?;
            let body = (format.start)(file, temporary, form)?;
            Ok(Self { body, values: None, named: Named { path: path.to_path_buf(), hidden } })
        };
        begin().map_err(|error| unwritable(&error, path))
    }

    /// Begins the file that will stand at `path`, for a mesh that is there: with positions in double precision where single
    /// would move one.
    ///
    /// # Errors
    /// As [`MeshFile::create`].
    pub fn create_for(format: &Format, path: &Path, mesh: &TriangleMesh, temporary: &Path) -> Result<Self> {
        let is_single = mesh.vertices.iter().flatten().all(|&v| f64::from(v as f32) == v);
        let anchor = if is_single { [0.0; 3] } else { around(mesh).anchor() };
        Self::begin(
            format,
            path,
            temporary,
            &Form { is_double: !is_single || format.is_text, anchor, ..Form::default() },
        )
    }

    /// The same with a number for each vertex, in a format that holds it; said before the first of them.
    ///
    /// # Errors
    /// When no file can be made in the folder `temporary`.
    pub fn with_values(mut self, values: Values, temporary: &Path) -> Result<Self> {
        self.body.carry(values.name, temporary).map_err(|error| unwritable(&error, &self.named.path))?;
        Ok(Self { values: Some(values), ..self })
    }

    /// Where positions are seen from, in a format that holds f32 alone and cannot have them as they are.
    #[must_use]
    pub fn anchor_of(format: &Format, mesh: &TriangleMesh) -> Option<[f64; 3]> {
        let is_moved = |v: f64| f64::from(v as f32) != v;
        let moves = format.is_single && mesh.vertices.iter().flatten().any(|&v| is_moved(v));
        moves.then(|| around(mesh).anchor())
    }

    /// Completes the file; it still has no name.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn complete(self) -> Result<WholeMesh> {
        let Self { body, named, .. } = self;
        body.complete().map_err(|error| unwritable(&error, &named.path))?;
        Ok(WholeMesh(named))
    }
}

impl WholeMesh {
    /// Puts the file under its name, in place of any that was there if it may `replace` that.
    ///
    /// # Errors
    /// When it cannot be renamed, or something is there that it may not replace.
    pub fn place(self, replace: bool) -> Result<()> {
        let Named { path, hidden } = self.0;
        hidden.place(replace).map_err(|error| unwritable(&error, &path))
    }
}

impl MeshSink for MeshFile {
    fn on_grid(&mut self, grid: &Geometry) -> Result<()> {
        self.body.anchor(grid.anchor());
        Ok(())
    }

    fn vertex(&mut self, position: [f64; 3]) -> Result<()> {
        let value = self.values.as_ref().map(|values| values.at.as_ref().map_or(f64::NAN, |at| at(position)));
        let taken = self.body.vertex(position).and_then(|()| value.map_or(Ok(()), |value| self.body.value(value)));
        taken.map_err(|error| unwritable(&error, &self.named.path))
    }

    fn keeps_values(&self) -> bool {
        self.values.as_ref().is_some_and(|values| values.at.is_none())
    }

    fn valued_vertex(&mut self, position: [f64; 3], value: f64) -> Result<()> {
        if !self.keeps_values() {
            return self.vertex(position);
        }
        let taken = self.body.vertex(position).and_then(|()| self.body.value(value));
        taken.map_err(|error| unwritable(&error, &self.named.path))
    }

    fn triangle(&mut self, corners: [u32; 3]) -> Result<()> {
        self.facet(corners, [0; 2])
    }

    fn facet(&mut self, corners: [u32; 3], labels: [u32; 2]) -> Result<()> {
        self.body.facet(corners, labels).map_err(|error| unwritable(&error, &self.named.path))
    }
}

/// A grid around a mesh, about as fine as it.
fn around(mesh: &TriangleMesh) -> Geometry {
    let (low, high) = mesh.bounds().unwrap_or_default();
    let extent = (0..3).map(|a| high[a] - low[a]).fold(f64::MIN_POSITIVE, f64::max);
    Geometry::new([VOXELS as i64; 3], [extent / VOXELS; 3], low)
}

/// Voxels along the longest side of a grid around a mesh.
const VOXELS: f64 = 256.0;

fn unwritable(error: &io::Error, path: &Path) -> Error {
    temporary::told(error).unwrap_or_else(|| Error::from_io("the mesh cannot be written", error).at(path))
}
