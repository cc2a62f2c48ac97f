//! The container: header, chain of page directories (IFDs) and tag values (TIFF 6.0 section 2, BigTIFF), read with
//! pread.
//!
//! The `tiff` crate walks the chain once per decoder and buffers what it meets; here a page is found again from its
//! offset alone, so that any number of threads share one open file, and declared counts never decide an allocation.

use std::collections::HashSet;
use std::fs::File;
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::io::stack::number::ByteOrder;

/// More entries than this in one directory mean a damaged file; real pages have 10 to 60.
const MAX_ENTRIES: u64 = 4096;

/// An open TIFF file, shared by all threads.
#[derive(Debug)]
pub(crate) struct TiffFile {
    file: File,
    pub(crate) path: PathBuf,
    pub(crate) len: u64,
    pub(crate) order: ByteOrder,
    /// `BigTIFF`: offsets and counts have eight bytes.
    big: bool,
    first: u64,
}

/// One entry of a directory: a tag with its values, or the offset where they lie.
#[derive(Clone, Copy, Debug)]
struct Entry {
    tag: u16,
    kind: u16,
    count: u64,
    field: [u8; 8],
}

/// The directory of one page.
#[derive(Debug)]
pub(crate) struct Directory {
    entries: Vec<Entry>,
    next: u64,
}

/// Bytes of one value of a field type; `None` for types this reader has no use for.
fn size_of(kind: u16) -> Option<u64> {
    match kind {
        1 | 2 | 6 | 7 => Some(1),
        3 | 8 => Some(2),
        4 | 9 | 11 | 13 => Some(4),
        5 | 10 | 12 | 16 | 17 | 18 => Some(8),
        _ => None,
    }
}

impl TiffFile {
    /// Opens a file and reads its header.
    pub(crate) fn open(path: &Path) -> Result<Self> {
        let unreadable =
            |e: std::io::Error| Error::input(format!("the file cannot be opened: {e}")).caused_by(e).at(path);
        let file = File::open(path).map_err(unreadable)?;
        let len = file.metadata().map_err(unreadable)?.len();
        let mut this = Self { file, path: path.to_path_buf(), len, order: ByteOrder::Little, big: false, first: 0 };
        if len == 0 {
            return Err(this.error("the file is empty"));
        }
        let head = this.read_up_to(0, 16)?;
        this.order = match head.get(..2) {
            Some(b"II") => ByteOrder::Little,
            Some(b"MM") => ByteOrder::Big,
            _ => return Err(this.error("not a TIFF file: it does not begin with II or MM")),
        };
        let number = |from: usize, to: usize| head.get(from..to).map(|b| this.order.number(b));
        (this.big, this.first) = match (number(2, 4), number(4, 8), number(8, 16)) {
            (Some(42), Some(first), _) => (false, first),
            (Some(43), _, Some(first)) if number(4, 6) == Some(8) && number(6, 8) == Some(0) => (true, first),
            (Some(42 | 43), ..) => return Err(this.error("the TIFF header is cut off or damaged")),
            _ => return Err(this.error("not a TIFF file: the version number is neither 42 nor 43")),
        };
        Ok(this)
    }

    /// An unusable-input error that names this file.
    pub(crate) fn error(&self, message: impl Into<String>) -> Error {
        Error::input(message).at(&self.path)
    }

    /// Fills `out` from `offset`.
    pub(crate) fn read_at(&self, offset: u64, out: &mut [u8]) -> Result<()> {
        let end = offset.saturating_add(out.len() as u64);
        if end > self.len {
            let len = self.len;
            return Err(self.error(format!(
                "bytes {offset} to {end} are needed but the file ends at {len}: it is truncated or damaged"
            )));
        }
        self.file.read_exact_at(out, offset).map_err(|e| self.error(format!("cannot be read: {e}")).caused_by(e))
    }

    fn read_up_to(&self, offset: u64, most: u64) -> Result<Vec<u8>> {
        let mut bytes = vec![0; most.min(self.len.saturating_sub(offset)) as usize];
        self.read_at(offset, &mut bytes)?;
        Ok(bytes)
    }

    /// Offsets of the main pages in the order of the chain.
    pub(crate) fn pages(&self) -> Result<Vec<u64>> {
        let mut offsets = Vec::new();
        let mut seen = HashSet::new();
        let mut next = self.first;
        while next != 0 {
            let page = offsets.len() + 1;
            if !seen.insert(next) {
                return Err(self.error(format!(
                    "the chain of pages is a loop: page {} leads back to an earlier one; the file is damaged",
                    page - 1
                )));
            }
            offsets.push(next);
            next = self.directory(next).map_err(|e| self.broken_chain(page, next, &e))?.next;
        }
        if offsets.is_empty() {
            return Err(self.error("the TIFF file has no pages"));
        }
        Ok(offsets)
    }

    fn broken_chain(&self, page: usize, offset: u64, cause: &Error) -> Error {
        let len = self.len;
        if offset >= len {
            return self.error(format!(
                "page {page} should begin at byte {offset} but the file ends at {len}: it is truncated"
            ));
        }
        let text = cause.to_string();
        let named = format!("{}: ", self.path.display());
        self.error(format!("page {page}: {}", text.strip_prefix(&named).unwrap_or(&text)))
    }

    /// Reads the directory at `offset`.
    pub(crate) fn directory(&self, offset: u64) -> Result<Directory> {
        let (head, width, pointer) = if self.big { (8, 20, 8) } else { (2, 12, 4) };
        let mut block = self.read_up_to(offset, 2048)?;
        let count = match block.get(..head) {
            Some(bytes) => self.order.number(bytes),
            None => return Err(self.error(format!("the page directory at byte {offset} is cut off"))),
        };
        if count == 0 || count > MAX_ENTRIES {
            return Err(self.error(format!(
                "the page directory at byte {offset} has {count} entries (1 to {MAX_ENTRIES} can be); the file is \
                 damaged"
            )));
        }
        let end = head + count as usize * width;
        if block.len() < end + pointer {
            block = vec![0; end + pointer];
            self.read_at(offset, &mut block)?;
        }
        let entries = block[head..end].chunks_exact(width).map(|bytes| self.entry(bytes)).collect();
        Ok(Directory { entries, next: self.order.number(&block[end..end + pointer]) })
    }

    /// Decodes one entry; `bytes` has the 12 (`BigTIFF` 20) bytes of it.
    fn entry(&self, bytes: &[u8]) -> Entry {
        let (tag, kind) = (self.order.number(&bytes[..2]) as u16, self.order.number(&bytes[2..4]) as u16);
        let (count, value) = if self.big { (&bytes[4..12], &bytes[12..]) } else { (&bytes[4..8], &bytes[8..]) };
        let mut field = [0; 8];
        field[..value.len()].copy_from_slice(value);
        Entry { tag, kind, count: self.order.number(count), field }
    }
}

/// The tags of one page, for reading their values.
#[derive(Debug)]
pub(crate) struct Tags<'a> {
    pub(crate) file: &'a TiffFile,
    /// Number of the page, counted from 1, for messages.
    pub(crate) page: usize,
    /// Where the directory lies.
    pub(crate) offset: u64,
    directory: Directory,
}

impl<'a> Tags<'a> {
    /// Reads the directory at `offset`, that of page number `page` (from 1).
    pub(crate) fn read(file: &'a TiffFile, offset: u64, page: usize) -> Result<Self> {
        Ok(Self { file, page, offset, directory: file.directory(offset)? })
    }

    /// An unusable-input error that names file and page.
    pub(crate) fn error(&self, message: impl std::fmt::Display) -> Error {
        self.file.error(format!("page {}: {message}", self.page))
    }

    /// The raw bytes of a tag, its field type and the bytes of one value; at most `most` bytes.
    fn bytes(&self, tag: u16, most: u64) -> Result<Option<(Vec<u8>, u16, usize)>> {
        let Some(entry) = self.directory.entries.iter().find(|e| e.tag == tag) else { return Ok(None) };
        let Some(size) = size_of(entry.kind) else {
            return Err(self.error(format!("tag {tag} has the unknown field type {}", entry.kind)));
        };
        let total = entry.count.saturating_mul(size);
        let room = if self.file.big { 8 } else { 4 };
        if total <= room {
            return Ok(Some((entry.field[..total as usize].to_vec(), entry.kind, size as usize)));
        }
        if total > most || total > self.file.len {
            return Err(self.error(format!("tag {tag} claims {total} bytes; the file is damaged")));
        }
        let mut bytes = vec![0; total as usize];
        self.file.read_at(self.file.order.number(&entry.field[..room as usize]), &mut bytes).map_err(|_| {
            self.error(format!("the values of tag {tag} lie beyond the end of the file: it is truncated or damaged"))
        })?;
        Ok(Some((bytes, entry.kind, size as usize)))
    }

    /// All values of a tag of unsigned integers, at most `most` of them.
    pub(crate) fn list(&self, tag: u16, most: u64) -> Result<Option<Vec<u64>>> {
        let Some((bytes, kind, size)) = self.bytes(tag, most.saturating_mul(8))? else { return Ok(None) };
        if !matches!(kind, 1 | 3 | 4 | 7 | 13 | 16 | 18) {
            return Err(self.error(format!("tag {tag} has field type {kind} where a whole number is due")));
        }
        Ok(Some(bytes.chunks_exact(size).map(|b| self.file.order.number(b)).collect()))
    }

    /// The first value of a tag of unsigned integers.
    pub(crate) fn number(&self, tag: u16) -> Result<Option<u64>> {
        Ok(self.list(tag, 1 << 16)?.and_then(|values| values.first().copied()))
    }

    /// The value of a tag that must be there.
    pub(crate) fn require(&self, tag: u16, name: &str) -> Result<u64> {
        self.number(tag)?.ok_or_else(|| self.error(format!("{name} (tag {tag}) is missing")))
    }

    /// A text tag up to its first NUL, as UTF-8 or else Latin-1 (older ImageJ writes the micro sign that way).
    pub(crate) fn text(&self, tag: u16, most: u64) -> Result<Option<String>> {
        let Some((mut bytes, ..)) = self.bytes(tag, most)? else { return Ok(None) };
        if let Some(end) = bytes.iter().position(|&b| b == 0) {
            bytes.truncate(end);
        }
        Ok(Some(String::from_utf8(bytes).unwrap_or_else(|e| e.as_bytes().iter().map(|&b| char::from(b)).collect())))
    }

    /// A rational tag as a positive finite number; anything else counts as absent.
    pub(crate) fn positive_rational(&self, tag: u16) -> Result<Option<f64>> {
        let Some((bytes, 5, 8)) = self.bytes(tag, 1 << 16)? else { return Ok(None) };
        let part = |from: usize| bytes.get(from..from + 4).map_or(0.0, |b| self.file.order.number(b) as f64);
        let value = part(0) / part(4);
        Ok((value.is_finite() && value > 0.0).then_some(value))
    }
}
