//! Damage to the directories of TIFF files.

use super::mutate::{ReverseIf, interesting, put};
use crate::common::random::Random;

/// Another tag, type, count or value in an entry of one of a TIFF file's directories, or another place of the next one.
pub(super) fn edit_tag(bytes: &mut [u8], random: &mut Random) {
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
