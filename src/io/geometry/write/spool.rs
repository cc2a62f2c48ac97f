//! Triangles that wait in a temporary file, which has no name and goes with its handle.

use std::io::{self, BufReader, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::Path;

use super::body::BUFFER;
use super::temporary::Temporary;

/// Takes triangles: three numbers each, and two labels where they have any.
pub(super) struct Spool {
    file: BufWriter<Temporary>,
    is_tagged: bool,
    count: u64,
}

/// Triangles that were taken.
pub(super) struct Spooled {
    file: BufReader<Temporary>,
    is_tagged: bool,
    pub(super) count: u64,
}

impl Spool {
    /// An empty one in a folder.
    pub(super) fn new(folder: &Path, is_tagged: bool) -> io::Result<Self> {
        let file = BufWriter::with_capacity(BUFFER, Temporary::new(folder)?);
        Ok(Self { file, is_tagged, count: 0 })
    }

    pub(super) fn push(&mut self, [a, b, c]: [u32; 3], [low, high]: [u32; 2]) -> io::Result<()> {
        let bytes = [a, b, c, low, high].map(u32::to_le_bytes);
        self.count += 1;
        self.file.write_all(bytes[..words(self.is_tagged)].as_flattened())
    }

    /// Ready to be read.
    pub(super) fn finish(self) -> io::Result<Spooled> {
        let file = self.file.into_inner().map_err(io::IntoInnerError::into_error)?;
        Ok(Spooled { file: BufReader::with_capacity(BUFFER, file), is_tagged: self.is_tagged, count: self.count })
    }
}

impl Spooled {
    /// All triangles from the first on, with their labels, which are 0 where they have none.
    pub(super) fn each(&mut self, mut f: impl FnMut([u32; 3], [u32; 2]) -> io::Result<()>) -> io::Result<()> {
        self.file.seek(SeekFrom::Start(0))?;
        let mut bytes = [[0; 4]; 5];
        for _ in 0..self.count {
            self.file.read_exact(bytes[..words(self.is_tagged)].as_flattened_mut())?;
            let [a, b, c, low, high] = bytes.map(u32::from_le_bytes);
            f([a, b, c], [low, high])?;
        }
        Ok(())
    }
}

fn words(is_tagged: bool) -> usize {
    if is_tagged { 5 } else { 3 }
}
