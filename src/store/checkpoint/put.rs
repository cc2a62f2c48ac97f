//! A file of a checkpoint: written beside, flushed, and given its name when it is whole.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use crate::store::{HiddenFile, begin_writeback};

/// Bytes that are handed to the disk at a time.
const BUFFER: usize = 1 << 20;
/// After so many bytes the disk is to begin with them.
const FLOW: usize = 32 << 20;

/// Writes a file beside, flushes it, and gives it its name.
///
/// # Errors
/// When it cannot be written; then nothing of that name is new.
pub(super) fn put(path: &Path, write: &mut dyn FnMut(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let (hidden, file) = HiddenFile::create(path, "")?;
    let mut out = BufWriter::with_capacity(BUFFER, Flowing { file, waiting: 0 });
    write(&mut out)?;
    out.into_inner().map_err(io::IntoInnerError::into_error)?;
    hidden.sync()?;
    hidden.place(true)
}

/// A file of which the disk gets what was written while the rest still is: it is waited for in the end.
struct Flowing {
    file: File,
    waiting: usize,
}

impl Write for Flowing {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.file.write(bytes)?;
        self.waiting += written;
        if self.waiting >= FLOW {
            begin_writeback(&self.file);
            self.waiting = 0;
        }
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}
