//! `Input`: a file of sources, opened once, whose first bytes can be looked at before it is read.

use std::fmt;
use std::fs::{self, File, Metadata};
use std::io::{self, BufRead, BufReader, Chain, Cursor, Read};
use std::os::unix::fs::FileTypeExt;
use std::path::Path;

use super::decoding::{LineFeeds, Utf16};
use super::point_file::PointFile;
use crate::error::{Error, Result};
use crate::io::text::{first_binary_byte, unreadable};

/// Bytes looked at to tell what a file holds; its header must lie within them.
pub(crate) const HEAD: u64 = 1 << 16;

/// Bytes that are read at once; not fewer than [`HEAD`].
const BUFFER: usize = 1 << 18;

/// What is read from: a file, a pipe, or either through a decoder.
type Bytes = Box<dyn Read>;
/// So many bytes are looked at after the last that is read: a pipe may never end.
const FAR: usize = 1 << 24;

/// An opened file.
pub struct Input {
    pub(crate) reader: BufReader<Chain<Cursor<Vec<u8>>, Bytes>>,
    /// Length of the whole file in bytes; pipes, and texts that are decoded, tell none.
    pub(crate) length: Option<u64>,
    /// What the user should know about how the file was understood.
    pub(crate) notes: Vec<String>,
    /// How points are to be understood; their cloud stands elsewhere.
    pub(crate) points: Option<PointFile>,
}

impl Input {
    /// Opens a file, or standard input where the path is `-`; `wanted` says in messages what it should hold.
    pub(crate) fn open(path: &Path, wanted: &str) -> Result<Self> {
        let (mut file, length): (Bytes, _) = if is_standard_input(path) {
            (Box::new(io::stdin()), None)
        } else {
            let metadata = fs::metadata(path).map_err(|e| unreadable(&e))?;
            if metadata.is_dir() {
                return Err(Error::input(format!("is a folder; give one file with {wanted}")));
            }
            refuse_endless(path, &metadata)?;
            let length = metadata.is_file().then_some(metadata.len());
            (Box::new(File::open(path).map_err(|e| unreadable(&e))?), length)
        };
        let head = first_bytes(&mut file)?;
        if head.is_empty() {
            return Err(Error::input(format!("is empty; give a file with {wanted}")));
        }
        let input = Self { reader: buffered(head, file), length, notes: Vec::new(), points: None };
        input.in_utf8()?.with_line_feeds()
    }

    /// Leaves out a byte order mark, and decodes UTF-16.
    fn in_utf8(mut self) -> Result<Self> {
        let mark = |head: &[u8], mark: &[u8]| head.starts_with(mark).then_some(mark.len());
        let head = self.head()?;
        let big = mark(head, b"\xfe\xff");
        if let Some(length) = mark(head, b"\xef\xbb\xbf") {
            self.reader.consume(length);
            return self.with_head();
        }
        let Some(length) = big.or(mark(head, b"\xff\xfe")) else { return Ok(self) };
        self.reader.consume(length);
        self.through(|bytes| Box::new(Utf16::new(bytes, big.is_some())))
    }

    /// Ends the lines of old Macs, which end in a carriage return alone, by line feeds.
    fn with_line_feeds(mut self) -> Result<Self> {
        let head = self.head()?;
        let is_old = head.contains(&b'\r') && !head.contains(&b'\n') && first_binary_byte(head).is_none();
        // The header of a PLY file may end its lines so, before bytes that are none.
        if !is_old || head.starts_with(b"ply") {
            return Ok(self);
        }
        self.through(|bytes| Box::new(LineFeeds(bytes)))
    }

    /// The same, decoded.
    fn through(mut self, decoder: impl FnOnce(Bytes) -> Bytes) -> Result<Self> {
        let reader = std::mem::replace(&mut self.reader, buffered(Vec::new(), Box::new(io::empty())));
        let mut decoded = decoder(Box::new(reader));
        let head = first_bytes(&mut decoded)?;
        self.reader = buffered(head, decoded);
        self.length = None;
        Ok(self)
    }

    /// The same after some bytes were consumed, with a whole head again.
    fn with_head(self) -> Result<Self> {
        let length = self.length;
        let mut input = self.through(|bytes| bytes)?;
        input.length = length;
        Ok(input)
    }

    /// Tells what stands after `what`, the last that is read; blanks do not count.
    pub(crate) fn note_rest(&mut self, what: &str) -> Result<()> {
        let (mut bytes, mut is_blank) = (0, true);
        while bytes < FAR {
            let piece = self.reader.fill_buf().map_err(|e| unreadable(&e))?;
            if piece.is_empty() {
                break;
            }
            is_blank &= piece.iter().all(u8::is_ascii_whitespace);
            bytes += piece.len();
            let read = piece.len();
            self.reader.consume(read);
        }
        if !is_blank {
            let more = if bytes < FAR { "" } else { " or more" };
            self.notes.push(format!("{bytes}{more} bytes after {what} are left aside"));
        }
        Ok(())
    }

    /// The first bytes of the file, [`HEAD`] at most, as long as nothing has been read.
    pub(crate) fn head(&mut self) -> Result<&[u8]> {
        // A chain fills the buffer from its first part alone, which is the head.
        self.reader.fill_buf().map_err(|e: io::Error| unreadable(&e))
    }

    /// All of a file of at most `most` bytes.
    pub(crate) fn read_whole(&mut self, most: u64) -> Result<Vec<u8>> {
        let mut bytes = Vec::new();
        self.reader.by_ref().take(most + 1).read_to_end(&mut bytes).map_err(|e| unreadable(&e))?;
        if bytes.len() as u64 > most {
            return Err(Error::input(format!("is longer than {} MiB, more than any such file; divide it", most >> 20)));
        }
        Ok(bytes)
    }
}

impl fmt::Debug for Input {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Input").field("length", &self.length).finish_non_exhaustive()
    }
}

/// True for the name by which standard input is called.
#[must_use]
pub fn is_standard_input(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// Refuses what may never give a byte: a named pipe, which waits for somebody who writes to it, and a device.
fn refuse_endless(path: &Path, metadata: &Metadata) -> Result<()> {
    let kind = metadata.file_type();
    // What a shell opens for a run, such as `<(command)`, has somebody at its other end, and no name of its own.
    let is_opened = path.starts_with("/dev/fd") || path == "/dev/stdin" || path.canonicalize().is_err();
    if kind.is_fifo() && !is_opened {
        let what =
            "is a named pipe, which waits for ever where nobody writes to it; give - and the pipe as standard input";
        return Err(Error::input(what));
    }
    if kind.is_char_device() || kind.is_block_device() {
        return Err(Error::input("is a device; give a file, or - for standard input"));
    }
    Ok(())
}

fn first_bytes(bytes: &mut Bytes) -> Result<Vec<u8>> {
    let mut head = Vec::new();
    bytes.by_ref().take(HEAD).read_to_end(&mut head).map_err(|e| unreadable(&e))?;
    Ok(head)
}

fn buffered(head: Vec<u8>, rest: Bytes) -> BufReader<Chain<Cursor<Vec<u8>>, Bytes>> {
    BufReader::with_capacity(BUFFER, Cursor::new(head).chain(rest))
}
