//! Files beside the store: each appears under its name when it is whole.

use std::fs::{File, Permissions};
use std::io::{self, BufWriter, Write};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

use super::config::folder_of;

/// Writes a file through `write`; it gets its name, and replaces what had it, only when all is written.
pub(super) fn write_whole(path: &Path, write: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>) -> io::Result<()> {
    // The permissions of any new file, not those of a private temporary one.
    let mut builder = tempfile::Builder::new();
    let file = builder
        .prefix(".strandline-")
        .suffix(".part")
        .permissions(Permissions::from_mode(0o666))
        .tempfile_in(folder_of(path))?;
    let mut sink = BufWriter::new(file.as_file());
    write(&mut sink)?;
    sink.flush()?;
    drop(sink);
    file.persist(path).map_err(|error| error.error)?;
    Ok(())
}

/// Copies a file, whole or not at all.
pub(super) fn copy_whole(from: &Path, to: &Path) -> io::Result<()> {
    let mut source = File::open(from)?;
    write_whole(to, |sink| io::copy(&mut source, sink).map(|_| ()))
}
