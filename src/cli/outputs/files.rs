//! Files beside the store: each appears under its name when it is whole.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use crate::cli::terminal::console::Console;
use crate::error::{Error, Result};
use crate::exec::Progress;
use crate::grid::Geometry;
use crate::io::geometry::write::formats::{FORMATS, Format};
use crate::store::HiddenFile;

/// Writes a file through `write`; it gets its name only when all is written, in place of what has it if it may `replace` that.
pub(crate) fn write_whole(
    path: &Path,
    replace: bool,
    write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> io::Result<()> {
    let (hidden, file) = HiddenFile::create(path, "")?;
    let mut sink = BufWriter::new(file);
    write(&mut sink)?;
    sink.flush()?;
    drop(sink);
    hidden.place(replace)
}

/// Says from where positions are seen in a mesh file that cannot hold them as they are.
pub(crate) fn note_anchor(mesh: Option<&Path>, geometry: &Geometry, console: &Console) {
    let Some((path, format)) = mesh.and_then(|path| Some((path, Format::of(path)?))) else { return };
    let [x, y, z] = geometry.anchor();
    if format.is_single && [x, y, z] != [0.0; 3] {
        console.note(&format!(
            "{}: {} holds single precision alone, so its coordinates are relative to {x}, {y}, {z}; add these, or write \
             OBJ, PLY or VTP",
            path.display(),
            format.name
        ));
    }
}

/// The format of a mesh that is to be written.
pub(crate) fn mesh_format(path: &Path) -> Result<&'static Format> {
    Format::of(path).ok_or_else(|| {
        let endings: Vec<String> = FORMATS.iter().map(|format| format!(".{}", format.extension)).collect();
        Error::usage(format!("ends like no format of meshes; give a name that ends in {}", endings.join(", "))).at(path)
    })
}
