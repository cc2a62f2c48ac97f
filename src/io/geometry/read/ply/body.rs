//! What follows the header of a PLY file, element by element: lines of text, or binary numbers.

use std::io::{self, BufRead, Read};

use super::header::{Element, Encoding, Header, Scalar};
use crate::error::{Error, Result};
use crate::io::text::{next_line, unreadable};

/// The elements of a file, read in their order.
#[derive(Debug)]
pub(crate) struct Body<'r, R> {
    pub(crate) reader: &'r mut R,
    pub(crate) encoding: Encoding,
    /// The number of the line last read of a text file.
    pub(crate) line: u64,
    bytes: Vec<u8>,
}

impl<'r, R: BufRead> Body<'r, R> {
    /// The elements after a header.
    pub(crate) fn after(header: &Header, reader: &'r mut R) -> Self {
        Self { reader, encoding: header.encoding, line: header.lines, bytes: Vec::new() }
    }

    /// The next line of a text file that is not blank, which is one element; none at the end of the file.
    pub(crate) fn element_line(&mut self) -> Result<Option<String>> {
        while next_line(self.reader, &mut self.bytes, self.line + 1)? {
            self.line += 1;
            let text = String::from_utf8_lossy(&self.bytes);
            if !text.trim().is_empty() {
                return Ok(Some(text.into_owned()));
            }
        }
        Ok(None)
    }

    /// Passes over all elements of one kind.
    pub(crate) fn skip(&mut self, element: &Element) -> Result<()> {
        if self.encoding == Encoding::Ascii {
            return (0..element.count)
                .try_for_each(|_| self.element_line()?.map(drop).ok_or_else(|| ends_early(&eof())));
        }
        if element.has_fixed_size() {
            return self.skip_bytes(element.count.saturating_mul(element.least_bytes(self.encoding)));
        }
        for _ in 0..element.count {
            for property in &element.properties {
                match property.list {
                    Some(length) => self.skip_list(length, property.item)?,
                    None => self.skip_bytes(property.item.size() as u64)?,
                }
            }
        }
        Ok(())
    }

    /// Passes over a list of a binary file.
    pub(crate) fn skip_list(&mut self, length: Scalar, item: Scalar) -> Result<()> {
        let length = self.number(length)?;
        // Out of range lengths saturate, and then pass the end of the file.
        self.skip_bytes((length as u64).saturating_mul(item.size() as u64))
    }

    /// The next number of a binary file.
    pub(crate) fn number(&mut self, scalar: Scalar) -> Result<f64> {
        let mut bytes = [0; 8];
        let bytes = &mut bytes[..scalar.size()];
        self.reader.read_exact(bytes).map_err(|e| ends_early(&e))?;
        Ok(scalar.decode(bytes, self.encoding))
    }

    fn skip_bytes(&mut self, bytes: u64) -> Result<()> {
        let taken = &mut self.reader.by_ref().take(bytes);
        let skipped = io::copy(taken, &mut io::sink()).map_err(|e| unreadable(&e))?;
        if skipped < bytes { Err(ends_early(&eof())) } else { Ok(()) }
    }
}

fn eof() -> io::Error {
    io::ErrorKind::UnexpectedEof.into()
}

fn ends_early(error: &io::Error) -> Error {
    if error.kind() == io::ErrorKind::UnexpectedEof {
        Error::input("ends before all elements that its PLY header declares; the file is cut off or damaged")
    } else {
        unreadable(error)
    }
}
