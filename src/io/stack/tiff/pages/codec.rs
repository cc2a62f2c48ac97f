//! Unpacking one compressed strip or tile with the codecs and predictors of the `tiff` crate.
//!
//! The crate decodes files, not strips, and converts colours on the way. So every strip is shown to it as a file of
//! its own, made in memory: a header, one directory that says "gray, one strip", and the packed bytes. It then has
//! no chain of pages to follow and no declared size that was not checked here.

use std::io::Cursor;
use std::panic::{AssertUnwindSafe, catch_unwind};

use tiff::decoder::{Decoder, Limits};

use super::compression::Compression;
use super::page::Page;
use crate::io::stack::number::ByteOrder;

const ENTRIES: usize = 11;
/// Bytes of header and directory in front of the packed bytes.
pub(crate) const HEAD: usize = 8 + 2 + ENTRIES * 12 + 4;

/// Unpacks the strip or tile of `rows` rows whose packed bytes lie in `file[HEAD..]`; `file[..HEAD]` is overwritten.
///
/// `out` has the bytes of all rows. Returns the byte order of the samples in `out`, or the reason of failure.
pub(crate) fn unpack(page: &Page, rows: u32, file: &mut [u8], out: &mut [u8]) -> Result<ByteOrder, String> {
    // Predictors work on samples and fax lines on pixels; all else is unpacked as plain bytes.
    let typed = page.predictor != 1 || page.compression == Compression::Fax4;
    let packed = u32::try_from(file.len() - HEAD).map_err(|_| "too long".to_string())?;
    write_head(page, typed, rows, packed, &mut file[..HEAD]);
    // The codecs are third-party code on hostile bytes: should one panic, that is one unreadable strip, not the end of
    // the program. `out` and `file` hold plain bytes, so nothing half-changed can be seen afterwards.
    let outcome = catch_unwind(AssertUnwindSafe(|| -> tiff::TiffResult<()> {
        // Both lengths were limited by the caller.
        let mut decoder = Decoder::new(Cursor::new(&*file))?.with_limits(Limits::unlimited());
        decoder.read_chunk_bytes(0, out)
    }));
    match outcome {
        Ok(Ok(())) => Ok(if typed { ByteOrder::NATIVE } else { page.order }),
        Ok(Err(e)) => Err(e.to_string()),
        Err(_) => Err("the decoder gave up on the damaged data".to_string()),
    }
}

/// Writes the header and directory of the one-strip file.
fn write_head(page: &Page, typed: bool, rows: u32, packed: u32, head: &mut [u8]) {
    let kind = page.kind;
    let (width, bits, samples, format) = if typed {
        (page.chunk[0], kind.sample.bits(), page.interleaved(), kind.sample.format())
    } else {
        (page.row_bytes() as u32, 8, 1, 1)
    };
    let entries: [(u16, u16, u32); ENTRIES] = [
        (256, 4, width),
        (257, 4, rows),
        (258, 3, bits.into()),
        (259, 3, page.compression.tag().into()),
        (262, 3, 1),
        (273, 4, HEAD as u32),
        (277, 3, samples.into()),
        (278, 4, rows),
        (279, 4, packed),
        (317, 3, page.predictor.into()),
        (339, 3, format.into()),
    ];
    let mut bytes = Vec::with_capacity(HEAD);
    let little = page.order == ByteOrder::Little;
    let put16 = |to: &mut Vec<u8>, v: u16| to.extend(if little { v.to_le_bytes() } else { v.to_be_bytes() });
    let put32 = |to: &mut Vec<u8>, v: u32| to.extend(if little { v.to_le_bytes() } else { v.to_be_bytes() });
    bytes.extend(if little { b"II" } else { b"MM" });
    put16(&mut bytes, 42);
    put32(&mut bytes, 8);
    put16(&mut bytes, ENTRIES as u16);
    for (tag, field, value) in entries {
        put16(&mut bytes, tag);
        put16(&mut bytes, field);
        put32(&mut bytes, 1);
        if field == 3 {
            // A short stands at the front of its four-byte field in either byte order.
            put16(&mut bytes, value as u16);
            put16(&mut bytes, 0);
        } else {
            put32(&mut bytes, value);
        }
    }
    put32(&mut bytes, 0);
    head.copy_from_slice(&bytes);
}
