//! Damage to what is packed, encoded or summed: done to the content, which is packed again, so that it gets past the
//! checks of the outside.

use std::io::{Cursor, Read, Write};

use bzip2::read::MultiBzDecoder;
use bzip2::write::BzEncoder;
use flate2::Compression;
use flate2::read::{MultiGzDecoder, ZlibDecoder};
use flate2::write::{GzEncoder, ZlibEncoder};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

use super::mutate::mutate_blindly;
use crate::common::random::Random;

/// No more is unpacked.
const MOST: u64 = 1 << 17;

/// Damages the content of a file; none where it is not packed.
pub(super) fn mutate(bytes: &[u8], other: &[u8], random: &mut Random) -> Option<Vec<u8>> {
    if bytes.starts_with(b"PK\x03\x04") {
        return archive(bytes, other, random);
    }
    if bytes.starts_with(b"\xff\xfe") {
        let words: Vec<u16> = bytes[2..].as_chunks::<2>().0.iter().map(|&pair| u16::from_le_bytes(pair)).collect();
        let damaged = mutate_blindly(String::from_utf16_lossy(&words).as_bytes(), other, random);
        let words = String::from_utf8_lossy(&damaged).encode_utf16().flat_map(u16::to_le_bytes).collect::<Vec<_>>();
        return Some([b"\xff\xfe", &words[..]].concat());
    }
    stream(bytes, other, random).or_else(|| summed(bytes, other, random))
}

/// Unpacks, damages and packs again.
fn stream(bytes: &[u8], other: &[u8], random: &mut Random) -> Option<Vec<u8>> {
    let all = |packed: &mut dyn Read| {
        let mut content = Vec::new();
        packed.take(MOST).read_to_end(&mut content).ok().map(|_| content)
    };
    let put = |writer: &mut dyn Write, content: &[u8]| writer.write_all(content).ok();
    match *bytes {
        [0x1f, 0x8b, ..] => {
            let content = mutate_blindly(&all(&mut MultiGzDecoder::new(bytes))?, other, random);
            let mut packed = GzEncoder::new(Vec::new(), Compression::fast());
            put(&mut packed, &content)?;
            packed.finish().ok()
        }
        [0x78, ..] => {
            let content = mutate_blindly(&all(&mut ZlibDecoder::new(bytes))?, other, random);
            let mut packed = ZlibEncoder::new(Vec::new(), Compression::fast());
            put(&mut packed, &content)?;
            packed.finish().ok()
        }
        [b'B', b'Z', b'h', ..] => {
            let content = mutate_blindly(&all(&mut MultiBzDecoder::new(bytes))?, other, random);
            let mut packed = BzEncoder::new(Vec::new(), bzip2::Compression::fast());
            put(&mut packed, &content)?;
            packed.finish().ok()
        }
        [0x28, 0xb5, 0x2f, 0xfd, ..] => {
            let content = mutate_blindly(&all(&mut zstd::stream::read::Decoder::new(bytes).ok()?)?, other, random);
            zstd::stream::encode_all(&content[..], 1).ok()
        }
        _ => None,
    }
}

/// Damages a file of bytes and sets right a sum of CRC-32C that may stand at the end of it, or after an index of chunks at
/// its start; none where it is a text, or none such.
fn summed(bytes: &[u8], other: &[u8], random: &mut Random) -> Option<Vec<u8>> {
    let is_text = bytes.iter().all(|b| b.is_ascii_graphic() || b.is_ascii_whitespace());
    if is_text || bytes.len() < 8 || matches!(bytes[..2], [b'I', b'I' | b'o'] | [b'M', b'M']) || random.below(2) == 0 {
        return None;
    }
    let mut damaged = mutate_blindly(bytes, other, random);
    let at_end = random.below(2) == 0;
    let length = damaged.len();
    let index = 16 * (1 + random.below(32));
    let range = match random.below(3) {
        0 => 0..length.saturating_sub(4),
        _ if at_end => length.saturating_sub(index + 4)..length.saturating_sub(4),
        _ => 0..index.min(length.saturating_sub(4)),
    };
    let sum = crc32c(&damaged[range.clone()]).to_le_bytes();
    damaged.get_mut(range.end..range.end + 4)?.copy_from_slice(&sum);
    Some(damaged)
}

/// CRC-32C (Castagnoli), bit by bit.
fn crc32c(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| if crc & 1 == 1 { crc >> 1 ^ 0x82f6_3b78 } else { crc >> 1 })
    })
}

/// Another content, name, order or number of the entries of a ZIP archive.
fn archive(bytes: &[u8], other: &[u8], random: &mut Random) -> Option<Vec<u8>> {
    let mut entries = entries(bytes)?;
    let others = self::entries(other).filter(|others| !others.is_empty()).unwrap_or_else(|| entries.clone());
    for _ in 0..=random.below(3) {
        if entries.is_empty() {
            break;
        }
        let n = random.below(entries.len());
        let (name, content) = &mut entries[n];
        match random.below(12) {
            0 => *name = String::from_utf8_lossy(&mutate_blindly(name.as_bytes(), other, random)).into_owned() + ".roi",
            1 => {
                *name =
                    ["0012-0100-0088.roi", "a/.roi", ".ROI", "__MACOSX/b.roi", "c.txt", "d/"][random.below(6)].into();
            }
            2 => drop(entries.remove(n)),
            3 => entries.push(others[random.below(others.len())].clone()),
            4 => entries.reverse(),
            _ => *content = mutate_blindly(content, &others[random.below(others.len())].1, random),
        }
    }
    let mut written = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, content) in entries {
        let method = [CompressionMethod::Stored, CompressionMethod::Deflated][random.below(2)];
        // A name that is there already is refused, and left out.
        if written.start_file(name, SimpleFileOptions::default().compression_method(method)).is_ok() {
            written.write_all(&content).ok()?;
        }
    }
    written.finish().ok().map(Cursor::into_inner)
}

fn entries(bytes: &[u8]) -> Option<Vec<(String, Vec<u8>)>> {
    let mut archive = ZipArchive::new(Cursor::new(bytes)).ok()?;
    (0..archive.len().min(64))
        .map(|n| {
            let entry = archive.by_index(n).ok()?;
            let (name, mut content) = (entry.name().ok()?.into_owned(), Vec::new());
            entry.take(MOST).read_to_end(&mut content).ok()?;
            Some((name, content))
        })
        .collect()
}

#[test]
fn sums_are_those_of_the_standard() {
    // The check value of CRC-32C (RFC 3720, appendix B.4, and the catalogue of parametrised CRC algorithms).
    assert_eq!(crc32c(b"123456789"), 0xe306_9283);
}
