//! Text of unknown origin: lines of bounded length, and how to quote it in a message.

use std::borrow::Cow;
use std::io::{self, BufRead, Read};

use crate::error::{Error, Result};

/// The longest line that is read; a point or a triangle takes some 80 bytes.
pub(super) const LONGEST_LINE: u64 = 1 << 20;

/// The lines of a text, counted.
#[derive(Debug)]
pub(super) struct Lines<'r, R> {
    reader: &'r mut R,
    bytes: Vec<u8>,
    /// The number of the line last read, counted from 1.
    pub(super) number: u64,
}

impl<'r, R: BufRead> Lines<'r, R> {
    /// The lines that follow `number` lines already read.
    pub(super) fn after(number: u64, reader: &'r mut R) -> Self {
        Self { reader, bytes: Vec::new(), number }
    }

    /// The next line; none at the end of the text.
    pub(super) fn advance(&mut self) -> Result<Option<Cow<'_, str>>> {
        if !next_line(self.reader, &mut self.bytes, self.number + 1)? {
            return Ok(None);
        }
        self.number += 1;
        let line = String::from_utf8_lossy(&self.bytes);
        refuse_bare_returns(&line, self.number)?;
        Ok(Some(line))
    }

    /// The next line that holds more than blanks and a comment from `#` on; none at the end of the text.
    pub(super) fn advance_to_words(&mut self) -> Result<Option<String>> {
        while let Some(line) = self.advance()? {
            let text = line.split('#').next().unwrap_or_default().trim();
            if !text.is_empty() {
                return Ok(Some(text.to_owned()));
            }
        }
        Ok(None)
    }
}

/// Reads up to and with the next line feed into `line`, which has this number; false at the end of the file.
///
/// A line has at most [`LONGEST_LINE`] bytes: a file without line ends must not fill the memory.
pub(super) fn next_line(reader: &mut impl BufRead, line: &mut Vec<u8>, number: u64) -> Result<bool> {
    line.clear();
    let read = reader.by_ref().take(LONGEST_LINE).read_until(b'\n', line).map_err(|e| unreadable(&e))?;
    if read as u64 == LONGEST_LINE && line.last() != Some(&b'\n') {
        return Err(Error::input(format!(
            "line {number} is longer than {LONGEST_LINE} bytes; give one point or face a line"
        )));
    }
    Ok(read > 0)
}

/// Refuses a carriage return inside a line: the line ends of old Macs, which would make one line of all.
pub(super) fn refuse_bare_returns(line: &str, number: u64) -> Result<()> {
    if line.trim_end().contains('\r') {
        return Err(Error::input(format!(
            "line {number} ends in a carriage return alone, near {}; convert the line ends to LF",
            quoted(line)
        )));
    }
    Ok(())
}

/// The place of the first byte that stands in no text: zero bytes and control characters.
pub(super) fn first_binary_byte(head: &[u8]) -> Option<usize> {
    let is_text = |byte: &u8| *byte >= b' ' || matches!(byte, b'\t' | b'\n' | b'\r' | 0x0c);
    head.iter().position(|byte| !is_text(byte))
}

/// An error of the operating system while a file was read.
pub(super) fn unreadable(error: &io::Error) -> Error {
    Error::input(format!("cannot be read: {error}")).caused_by_io(error)
}

/// Text from a file for use in a message: short and without control characters.
pub(super) fn quoted(text: &str) -> String {
    const LONGEST: usize = 60;
    let mut shown: String = text.trim().chars().take(LONGEST).flat_map(char::escape_debug).collect();
    if text.trim().chars().nth(LONGEST).is_some() {
        shown.push_str("...");
    }
    format!("'{shown}'")
}
