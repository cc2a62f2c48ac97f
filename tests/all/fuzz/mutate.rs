//! Damage to files: bytes, numbers and lines of text, pieces of other files; and by the forms that files have, what would
//! not get past their first check by chance: documents (`json`), what is packed or summed (`packed`), directories (`tags`).

use super::tags::edit_tag;
use super::words::{NUMBERS, WORDS};
use super::{json, packed};
use crate::common::random::Random;

/// No damaged file is longer.
const LONGEST: usize = 1 << 17;

/// Damages a file; `other` is another file of the format.
pub(super) fn mutate(bytes: &[u8], other: &[u8], random: &mut Random) -> Vec<u8> {
    // What is damaged blindly, too, is the outside of what has an inside.
    let inside =
        (random.below(4) > 0).then(|| json::mutate(bytes, random).or_else(|| packed::mutate(bytes, other, random)));
    let mut damaged = inside.flatten().unwrap_or_else(|| mutate_blindly(bytes, other, random));
    damaged.truncate(LONGEST);
    damaged
}

/// Damages a file in up to six places, whatever it holds.
pub(super) fn mutate_blindly(bytes: &[u8], other: &[u8], random: &mut Random) -> Vec<u8> {
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
    bytes
}

/// A range of at most `most` bytes.
fn range(len: usize, most: usize, random: &mut Random) -> std::ops::Range<usize> {
    let start = random.below(len + 1);
    start..(start + random.below(most + 1)).min(len)
}

/// A place in a file; often among its first or last bytes, where headers and indices lie.
fn place(len: usize, random: &mut Random) -> usize {
    let end = random.below(len.min(64));
    match random.below(4) {
        0 => end,
        1 => len - 1 - end,
        _ => random.below(len),
    }
}

/// A number at which readers may go wrong.
pub(super) fn interesting(len: usize, random: &mut Random) -> u64 {
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
pub(super) fn put(bytes: &mut [u8], at: usize, width: usize, value: u64, is_big: bool) {
    let mut number = value.to_le_bytes();
    number[..width].reverse_if(is_big);
    let end = bytes.len().min(at + width);
    if at < end {
        bytes[at..end].copy_from_slice(&number[..end - at]);
    }
}

pub(super) trait ReverseIf {
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
    let at = place(bytes.len(), random);
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
