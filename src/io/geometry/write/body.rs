//! What a format makes of a surface as it passes: vertices, and triangles of those that came before, one after the other.

use std::fs::File;
use std::io;
use std::path::Path;

use crate::grid::Geometry;

/// Bytes that are gathered before they go to a file.
pub(super) const BUFFER: usize = 1 << 18;

/// What a file says of itself, as far as its grid tells.
#[derive(Clone, Debug, Default)]
pub(super) struct Form {
    /// The length unit, where it is known.
    pub(super) unit: Option<String>,
    /// Whether each triangle has the two labels that it separates.
    pub(super) is_tagged: bool,
    /// Whether positions are f64: those of f32 would move them.
    pub(super) is_double: bool,
    /// Where positions of a format that holds f32 alone are seen from.
    pub(super) anchor: [f64; 3],
}

impl Form {
    pub(super) fn of(geometry: &Geometry, is_tagged: bool) -> Self {
        let (unit, is_double) = (geometry.unit.clone(), !geometry.fits_single());
        Self { unit, is_tagged, is_double, anchor: geometry.anchor() }
    }
}

/// A file in the making.
pub(super) trait Body: Send {
    /// Says where positions are seen from, before the first of them.
    fn anchor(&mut self, _anchor: [f64; 3]) {}

    /// Says, before the first vertex, how the number is called that is told of each; what has to wait lies in a folder.
    fn carry(&mut self, _name: &'static str, _temporary: &Path) -> io::Result<()> {
        Ok(())
    }

    /// Takes the number of the last vertex.
    fn value(&mut self, _value: f64) -> io::Result<()> {
        Ok(())
    }

    /// Takes the next vertex.
    fn vertex(&mut self, position: [f64; 3]) -> io::Result<()>;

    /// Takes a triangle and its labels, which are 0 where it has none.
    fn facet(&mut self, corners: [u32; 3], labels: [u32; 2]) -> io::Result<()>;

    /// Writes what is still missing.
    fn complete(self: Box<Self>) -> io::Result<()>;
}

/// Begins a body in an empty file; what has to wait for the end lies in a folder for temporary files.
pub(super) type Start = fn(File, &Path, &Form) -> io::Result<Box<dyn Body>>;
