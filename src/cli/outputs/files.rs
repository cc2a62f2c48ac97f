//! Files beside the store: each appears under its name when it is whole.

use std::fs::{File, Permissions};
use std::io::{self, BufWriter, Write};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

use crate::cli::terminal::console::Console;
use crate::error::{Error, Result};
use crate::exec::Progress;
use crate::grid::Geometry;
use crate::io::geometry::write::formats::{FORMATS, Format};
use crate::job::resources::folder_of;
use crate::store::Unfinished;

/// Writes a file through `write`; it gets its name, and replaces what had it, only when all is written.
pub(crate) fn write_whole(path: &Path, write: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>) -> io::Result<()> {
    // The permissions of any new file, not those of a private temporary one.
    let mut builder = tempfile::Builder::new();
    let file = builder
        .prefix(".strandline-")
        .suffix(".part")
        .permissions(Permissions::from_mode(0o666))
        .tempfile_in(folder_of(path))?;
    let unfinished = Unfinished::new(file.path());
    let mut sink = BufWriter::new(file.as_file());
    write(&mut sink)?;
    sink.flush()?;
    drop(sink);
    unfinished.finish(|| file.persist(path)).map_err(|error| error.error)?;
    Ok(())
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
