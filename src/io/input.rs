//! `Input`: a file of sources, opened once, whose first bytes can be looked at before it is read.

use std::fs::{self, File};
use std::io::{self, BufRead, BufReader, Chain, Cursor, Read};
use std::path::Path;

use super::text::unreadable;
use crate::error::{Error, Result};

/// Bytes looked at to tell what a file holds; its header must lie within them.
pub(super) const HEAD: u64 = 1 << 16;

/// Bytes that are read at once; not fewer than [`HEAD`].
const BUFFER: usize = 1 << 18;

/// An opened file.
#[derive(Debug)]
pub struct Input {
    pub(super) reader: BufReader<Chain<Cursor<Vec<u8>>, File>>,
    /// Length of the whole file in bytes; pipes tell none.
    pub(super) length: Option<u64>,
}

impl Input {
    /// Opens a file; `wanted` says in messages what it should hold.
    pub(super) fn open(path: &Path, wanted: &str) -> Result<Self> {
        let metadata = fs::metadata(path).map_err(|e| unreadable(&e))?;
        if metadata.is_dir() {
            return Err(Error::input(format!("is a folder; give one file with {wanted}")));
        }
        let mut file = File::open(path).map_err(|e| unreadable(&e))?;
        let mut head = Vec::new();
        file.by_ref().take(HEAD).read_to_end(&mut head).map_err(|e| unreadable(&e))?;
        if head.is_empty() {
            return Err(Error::input(format!("is empty; give a file with {wanted}")));
        }
        if head.starts_with(b"\xef\xbb\xbf") {
            head.drain(..3);
        }
        let length = metadata.is_file().then_some(metadata.len());
        Ok(Self { reader: BufReader::with_capacity(BUFFER, Cursor::new(head).chain(file)), length })
    }

    /// The first bytes of the file, [`HEAD`] at most, as long as nothing has been read.
    pub(super) fn head(&mut self) -> Result<&[u8]> {
        // A chain fills the buffer from its first part alone, which is the head.
        self.reader.fill_buf().map_err(|e: io::Error| unreadable(&e))
    }
}
