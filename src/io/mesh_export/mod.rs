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
    write: fn(&mut Written, &mut dyn Write) -> io::Result<()>,
}

/// The formats.
pub const FORMATS: &[Format] = &[
    Format { name: "PLY", extension: "ply", write: Written::copy },
    Format { name: "OBJ", extension: "obj", write: obj::write },
    Format { name: "STL", extension: "stl", write: stl::write },
    Format { name: "VTP", extension: "vtp", write: vtp::write },
];

impl Format {
    /// The format that a file's name asks for.
    #[must_use]
    pub fn of(path: &Path) -> Option<&'static Self> {
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        FORMATS.iter().find(|format| format.extension == extension)
    }

    /// Writes the surface that stands in `ply`, a file of [`PlyWriter`](super::mesh_ply::PlyWriter), to `out`.
    ///
    /// # Errors
    /// When `ply` cannot be read or `out` not written.
    pub fn export(&self, ply: &Path, out: &mut dyn Write) -> io::Result<()> {
        (self.write)(&mut Written::open(ply)?, out)
    }
}
