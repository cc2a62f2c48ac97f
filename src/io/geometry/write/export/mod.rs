//! Surfaces in other formats than PLY, each made out of the finished PLY file: what a run writes is written once, and
//! an export that fails costs no result.
//!
//! [`FORMATS`] is the one table of what is written.

mod obj;
mod stl;
mod vtp;
mod written;

use std::io::{self, Write};
use std::path::Path;

use written::Written;

/// A file format of surfaces.
#[derive(Debug)]
pub struct Format {
    /// Its usual name.
    pub name: &'static str,
    /// How names of such files end, without the dot; it decides.
    pub extension: &'static str,
    /// Whether it holds f32 alone: positions far from zero are then written as seen from an anchor.
    pub is_single: bool,
    write: fn(&mut Written, [f64; 3], &mut dyn Write) -> io::Result<()>,
}

/// The formats.
pub const FORMATS: &[Format] = &[
    Format { name: "PLY", extension: "ply", is_single: false, write: |mesh, _, out| mesh.copy(out) },
    Format { name: "OBJ", extension: "obj", is_single: false, write: |mesh, _, out| obj::write(mesh, out) },
    Format { name: "STL", extension: "stl", is_single: true, write: stl::write },
    Format { name: "VTP", extension: "vtp", is_single: false, write: |mesh, _, out| vtp::write(mesh, out) },
];

impl Format {
    /// The format that a file's name asks for.
    #[must_use]
    pub fn of(path: &Path) -> Option<&'static Self> {
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        FORMATS.iter().find(|format| format.extension == extension)
    }

    /// Writes the surface that stands in `ply`, a file of [`PlyWriter`](super::mesh_ply::PlyWriter), to `out`; positions
    /// of a format that holds f32 alone as seen from `anchor`.
    ///
    /// # Errors
    /// When `ply` cannot be read or `out` not written.
    pub fn export(&self, ply: &Path, anchor: [f64; 3], out: &mut dyn Write) -> io::Result<()> {
        (self.write)(&mut Written::open(ply)?, anchor, out)
    }
}
