//! Damage to files: bytes, numbers and lines of text, entries of TIFF directories, pieces of other files.

use crate::common::random::Random;

/// No damaged file is longer.
const LONGEST: usize = 1 << 17;

/// What is put in place of a number in a text.
const NUMBERS: &[&str] = &[
    "0",
    "-1",
    "1",
    "2",
    "-0",
    "nan",
    "-nan(ind)",
    "inf",
    "1e999",
    "-1e-320",
    "1e38",
    "0.5",
    "1,5",
    "255",
    "65536",
    "2147483647",
    "2147483648",
    "4294967295",
    "4294967296",
    "9223372036854775807",
    "18446744073709551615",
    "99999999999999999999",
    "1.#IND",
    "",
];

/// What is put anywhere in a text.
const WORDS: &[&str] = &[
    " ",
    "\n",
    "\r",
    "\r\n",
    "\t",
    ",",
    ";",
    "\"",
    "'",
    "#",
    "\0",
    "\u{feff}",
    "\u{b5}m",
    "null",
    "[]",
    "{}",
    "true",
    "x,y,z\n",
    "object,",
    "contour,",
    "axis-0,axis-1,axis-2\n",
    "sep=;\n",
    "ply\n",
    "end_header\n",
    "element face 4000000000\n",
    "element vertex 3\n",
    "property list uchar int vertex_indices\n",
    "property double x\n",
    "format ascii 1.0\n",
    "OFF\n",
    "COFF",
    "solid a\n",
    "endsolid\n",
    "facet normal 0 0 1\n",
    "outer loop\n",
    "vertex 0 0 0\n",
    "v 0 0 0\n",
    "f 1 2 3\n",
    "f -1 -2 -3 -4\n",
    "f 1/1/1 2//2 3\n",
    "\\\n",
    "ImageJ=1\n",
    "images=9999999\n",
    "slices=0\n",
    "spacing=-1\n",
    "unit=\\u00B5m\n",
    "<OME>",
    "</Pixels>",
    "SizeZ=\"0\"",
    "{\"shape\": [1]}",
    "\"int64\"",
    "\"scale\"",
    "\"translation\"",
    "\"gzip\"",
    "\"zstd\"",
    "\"blosc\"",
    "\"sharding_indexed\"",
    "\"transpose\"",
    "\"z\"",
    "\"c\"",
];

/// Damages a file in up to six places; `other` is another file of the format.
pub(super) fn mutate(bytes: &[u8], other: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    let is_tiff = matches!(bytes.get(..2), Some(b"II" | b"MM"));
    for _ in 0..=random.below(6) {
        if bytes.is_empty() {
            break;
        }
        match random.below(4) {
            0 => edit_bytes(&mut bytes, other, random),
            1 | 2 if is_tiff => edit_tag(&mut bytes, random),
            1 => edit_number(&mut bytes, random),
            2 => edit_text(&mut bytes, random),
            _ if is_tiff && random.below(2) == 0 => edit_number(&mut bytes, random),
            _ if random.below(2) == 0 => edit_bytes(&mut bytes, other, random),
            _ => edit_number(&mut bytes, random),
        }
    }
    bytes.truncate(LONGEST);
    bytes
}

/// A range of at most `most` bytes.
fn range(len: usize, most: usize, random: &mut Random) -> std::ops::Range<usize> {
    let start = random.below(len + 1);
    start..(start + random.below(most + 1)).min(len)
}

/// A number at which readers may go wrong.
fn interesting(len: usize, random: &mut Random) -> u64 {
    let len = len as u64;
    let values = [
        0,
        1,
        2,
        3,
        8,
        16,
        255,
        256,
        65535,
        65536,
        0x7fff_ffff,
        0x8000_0000,
        0xffff_fffe,
        0xffff_ffff,
        1 << 32,
        1 << 40,
        1 << 62,
        i64::MAX as u64,
        u64::MAX,
        len,
        len + 1,
        len.saturating_sub(1),
        len / 2,
    ];
    let n = random.below(values.len() + 3);
    values.get(n).copied().unwrap_or_else(|| random.next() >> random.below(64))
}

/// Writes the lowest bytes of a number, as far as there is room.
fn put(bytes: &mut [u8], at: usize, width: usize, value: u64, is_big: bool) {
    let mut number = value.to_le_bytes();
    number[..width].reverse_if(is_big);
    let end = bytes.len().min(at + width);
    if at < end {
        bytes[at..end].copy_from_slice(&number[..end - at]);
    }
}

trait ReverseIf {
    fn reverse_if(&mut self, is: bool);
}

impl ReverseIf for [u8] {
    fn reverse_if(&mut self, is: bool) {
        if is {
            self.reverse();
        }
    }
}

fn edit_bytes(bytes: &mut Vec<u8>, other: &[u8], random: &mut Random) {
    let at = random.below(bytes.len());
    match random.below(9) {
        0 => bytes[at] ^= 1 << random.below(8),
        1 => bytes[at] = random.next() as u8,
        2 | 3 => {
            let (width, value) = (1 << random.below(4), interesting(bytes.len(), random));
            put(bytes, at, width, value, random.below(2) == 0);
        }
        4 => bytes.truncate(at),
        5 => drop(bytes.drain(range(bytes.len(), 64, random))),
        6 => {
            let part = bytes[range(bytes.len(), 256, random)].to_vec();
            drop(bytes.splice(at..at, part));
        }
        7 => {
            let part = other[range(other.len(), 256, random)].to_vec();
            let end = if random.below(2) == 0 { at } else { (at + part.len()).min(bytes.len()) };
            drop(bytes.splice(at..end, part));
        }
        _ => {
            let value = [0, 0xff, b' ', b'9', b'\n'][random.below(5)];
            let part = range(bytes.len(), 32, random);
            bytes[part].fill(value);
        }
    }
}

/// Another number in place of one that is written in digits.
fn edit_number(bytes: &mut Vec<u8>, random: &mut Random) {
    let from = random.below(bytes.len());
    let Some(digit) = bytes[from..].iter().position(u8::is_ascii_digit).map(|at| from + at) else {
        return edit_text(bytes, random);
    };
    let is_part = |b: &&u8| b.is_ascii_digit() || matches!(b, b'.' | b'-' | b'+' | b'e');
    let start = digit - bytes[..digit].iter().rev().take_while(is_part).count();
    let end = digit + bytes[digit..].iter().take_while(is_part).count();
    let old = String::from_utf8_lossy(&bytes[start..end]).into_owned();
    let new = match random.below(8) {
        0 => format!("{old}0"),
        1 => format!("-{old}"),
        2 => old.parse::<f64>().map_or(old, |v| format!("{}", v + 1.0)),
        3 => old.parse::<f64>().map_or(old, |v| format!("{}", v - 1.0)),
        4 => format!("{old} {old}"),
        _ => NUMBERS[random.below(NUMBERS.len())].to_owned(),
    };
    drop(bytes.splice(start..end, new.into_bytes()));
}

/// Words put in, lines lost, doubled and moved.
fn edit_text(bytes: &mut Vec<u8>, random: &mut Random) {
    let at = random.below(bytes.len());
    let start = bytes[..at].iter().rposition(|&b| b == b'\n').map_or(0, |n| n + 1);
    let end = bytes[at..].iter().position(|&b| b == b'\n').map_or(bytes.len(), |n| at + n + 1);
    let line = bytes[start..end].to_vec();
    let line = &line[..line.len().min(4096)];
    match random.below(6) {
        0 => drop(bytes.drain(start..end)),
        1 => drop(bytes.splice(start..start, line.iter().copied())),
        2 => {
            let to = random.below(bytes.len());
            drop(bytes.splice(to..to, line.iter().copied()));
        }
        3 => {
            let to = [b' ', b',', b';', b'\t', b'\n', b'\r', b'"'][random.below(7)];
            if let Some(n) = bytes[at..].iter().position(|b| matches!(b, b' ' | b',' | b';' | b'\t' | b'\n')) {
                bytes[at + n] = to;
            }
        }
        4 => drop(bytes.splice(at..(at + 4).min(bytes.len()), WORDS[random.below(WORDS.len())].bytes())),
        _ => drop(bytes.splice(at..at, WORDS[random.below(WORDS.len())].bytes())),
    }
}

/// Another tag, type, count or value in an entry of one of a TIFF file's directories, or another place of the next one.
fn edit_tag(bytes: &mut [u8], random: &mut Random) {
    let is_big = bytes.starts_with(b"MM");
    let number = |bytes: &[u8], at: usize, width: usize| {
        let mut value = [0; 8];
        value[..width].copy_from_slice(bytes.get(at..at.checked_add(width)?)?);
        value[..width].reverse_if(is_big);
        Some(u64::from_le_bytes(value) as usize)
    };
    // Widths of an offset and of a count of entries.
    let (wide, counts, mut link) = if number(bytes, 2, 2) == Some(43) { (8, 8, 8) } else { (4, 2, 4) };
    let mut entries = Vec::new();
    let mut links = vec![link];
    for _ in 0..=random.below(4) {
        let Some(directory) = number(bytes, link, wide).filter(|&at| at > 0 && at < bytes.len()) else { break };
        let count = number(bytes, directory, counts).unwrap_or(0).min(64);
        let size = 4 + 2 * wide;
        entries.extend((0..count).map(|n| directory + counts + n * size));
        link = directory + counts + count * size;
        links.push(link);
    }
    let value = interesting(bytes.len(), random);
    if entries.is_empty() || random.below(16) == 0 {
        return put(bytes, links[random.below(links.len())], wide, value, is_big);
    }
    let entry = entries[random.below(entries.len())];
    let tags = [
        254, 256, 257, 258, 259, 262, 270, 273, 277, 278, 279, 282, 284, 317, 320, 322, 323, 324, 325, 339, 50838,
        50839,
    ];
    match random.below(8) {
        0 => put(bytes, entry, 2, tags[random.below(tags.len())], is_big),
        1 => put(bytes, entry + 2, 2, random.below(20) as u64, is_big),
        2 | 3 => put(bytes, entry + 4, wide, value, is_big),
        4 => {
            let from = entries[random.below(entries.len())] + 4 + wide;
            let value = number(bytes, from, wide).unwrap_or(0) as u64;
            put(bytes, entry + 4 + wide, wide, value, is_big);
        }
        5 => put(bytes, entry + 4 + wide, 2, random.below(70) as u64, is_big),
        _ => put(bytes, entry + 4 + wide, wide, value, is_big),
    }
}
