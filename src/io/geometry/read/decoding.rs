//! Readers that turn other encodings into UTF-8 lines: UTF-16 as spreadsheets save it (RFC 2781), and the line ends of old
//! Macs.

use std::io::{self, Read};

/// UTF-16 as UTF-8; what is no text becomes U+FFFD.
pub(crate) struct Utf16<R> {
    reader: R,
    is_big: bool,
    /// UTF-8 that was not handed out yet, and how much of it was.
    decoded: Vec<u8>,
    given: usize,
    /// Bytes of a character that is not whole yet: three at most.
    pending: Vec<u8>,
}

impl<R: Read> Utf16<R> {
    /// Decodes what follows the byte order mark.
    pub(crate) fn new(reader: R, is_big: bool) -> Self {
        Self { reader, is_big, decoded: Vec::new(), given: 0, pending: Vec::new() }
    }

    /// Decodes a piece more; false at the end.
    fn refill(&mut self) -> io::Result<bool> {
        let mut piece = [0; 1 << 13];
        let read = self.reader.read(&mut piece)?;
        self.pending.extend_from_slice(&piece[..read]);
        let unit = |pair: [u8; 2]| if self.is_big { u16::from_be_bytes(pair) } else { u16::from_le_bytes(pair) };
        let (pairs, _) = self.pending.as_chunks::<2>();
        let mut units: Vec<u16> = pairs.iter().map(|&pair| unit(pair)).collect();
        // The first half of a pair waits for the second.
        if read > 0 && units.last().is_some_and(|last| (0xd800..0xdc00).contains(last)) {
            units.pop();
        }
        let used = if read == 0 { self.pending.len() } else { 2 * units.len() };
        self.pending.drain(..used);
        self.decoded = String::from_utf16_lossy(&units).into_bytes();
        self.given = 0;
        Ok(read > 0)
    }
}

impl<R: Read> Read for Utf16<R> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let mut goes_on = true;
        while self.given == self.decoded.len() && goes_on {
            goes_on = self.refill()?;
        }
        let rest = &self.decoded[self.given..];
        let count = rest.len().min(into.len());
        into[..count].copy_from_slice(&rest[..count]);
        self.given += count;
        Ok(count)
    }
}

/// Line feeds in place of carriage returns.
pub(crate) struct LineFeeds<R>(pub(crate) R);

impl<R: Read> Read for LineFeeds<R> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let count = self.0.read(into)?;
        into[..count].iter_mut().filter(|byte| **byte == b'\r').for_each(|byte| *byte = b'\n');
        Ok(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Hands out a byte at a time.
    struct Slow<'a>(&'a [u8]);

    impl Read for Slow<'_> {
        fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
            let Some((first, rest)) = self.0.split_first() else { return Ok(0) };
            into[0] = *first;
            self.0 = rest;
            Ok(1)
        }
    }

    #[test]
    fn both_byte_orders_are_decoded_however_they_come() {
        let text = "x;y;z [\u{b5}m]\n\u{1d54f}\n";
        let units: Vec<u16> = text.encode_utf16().collect();
        for is_big in [false, true] {
            let bytes: Vec<u8> =
                units.iter().flat_map(|unit| if is_big { unit.to_be_bytes() } else { unit.to_le_bytes() }).collect();
            let mut found = String::new();
            Utf16::new(Slow(&bytes), is_big).read_to_string(&mut found).unwrap();
            assert_eq!(found, text);
            let mut cut = String::new();
            Utf16::new(&bytes[..bytes.len() - 1], is_big).read_to_string(&mut cut).unwrap();
            assert_eq!(cut, text[..text.len() - 1], "an odd byte at the end is left out");
        }
    }

    #[test]
    fn returns_become_feeds() {
        let mut found = String::new();
        LineFeeds(&b"a\rb\r"[..]).read_to_string(&mut found).unwrap();
        assert_eq!(found, "a\nb\n");
    }
}
