//! Lists and tables that grow while a surface passes: what they take, and what it takes to make them larger, for then the old
//! one is there until all of it is in the new one.

use std::collections::HashMap;

/// Bytes of a table.
pub(in crate::kernel::surface) fn table_bytes<K, V, S>(table: &HashMap<K, V, S>) -> u64 {
    bytes_for::<K, V>(table.capacity())
}

/// Bytes of a table for so many entries: its places are a power of two, an eighth of them empty, each with an entry and a byte.
fn bytes_for<K, V>(entries: usize) -> u64 {
    let places = if entries == 0 { 0 } else { (entries + entries / 7).next_power_of_two() };
    (places * (size_of::<(K, V)>() + 1)) as u64
}

/// A list or a table as large as it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Growing {
    bytes: u64,
    /// What it held at most, as a part of what it takes before it grows.
    full: f64,
}

impl Growing {
    /// Chunks, of which another one is made when all are full: nothing is copied but what names them.
    pub(super) fn of_chunks(bytes: u64) -> Self {
        Self::new(bytes, 1, 1)
    }

    /// A table that had so many entries at most. Where entries go as well as come it may double when it is half full: their
    /// places stay marked.
    pub(in crate::kernel::surface) fn of_table<K, V, S>(table: &HashMap<K, V, S>, most: usize) -> Self {
        // What is free is told without the places that are marked.
        let room = table.capacity().max(most);
        Self::new(bytes_for::<K, V>(room), most, room.div_ceil(2))
    }

    fn new(bytes: u64, most: usize, room: usize) -> Self {
        Self { bytes, full: if room == 0 { 0.0 } else { most as f64 / room as f64 } }
    }

    /// Bytes of memory.
    #[must_use]
    pub fn bytes(self) -> u64 {
        self.bytes
    }

    /// Bytes when it holds so many times as much.
    #[must_use]
    pub fn grown(self, times: f64) -> u64 {
        let (needed, mut room, mut bytes) = (self.full * times, 1.0, self.bytes);
        while room < needed {
            (room, bytes) = (2.0 * room, bytes.saturating_mul(2));
        }
        bytes
    }

    /// Bytes of several at most on the way to so many times as much: one at a time is there twice.
    #[must_use]
    pub fn on_the_way(all: &[Self], times: f64) -> u64 {
        let grown = all.iter().fold(0, |sum: u64, one| sum.saturating_add(one.grown(times)));
        let copied = all.iter().map(|one| one.grown(times)).zip(all).filter(|(grown, one)| *grown > one.bytes);
        grown.saturating_add(copied.map(|(grown, _)| grown / 2).max().unwrap_or(0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_full_doubles() {
        let told = Growing::new(512, 60, 64);
        assert_eq!((told.bytes(), told.grown(1.0), told.grown(64.0 / 60.0)), (512, 512, 512));
        assert_eq!((told.grown(65.0 / 60.0), told.grown(10.0)), (1024, 8192));
        assert_eq!(
            Growing::on_the_way(&[told, told], 65.0 / 60.0),
            1024 + 1024 + 512,
            "one of two is copied at a time"
        );
        assert_eq!(Growing::on_the_way(&[told, told], 1.0), 1024);
        assert_eq!(Growing::new(0, 0, 0).grown(1e9), 0, "nothing is known of what holds nothing");
    }

    /// Against the table itself, with entries that come and go as those of edges do.
    #[test]
    fn tables_grow_no_further_than_told() {
        let mut table: HashMap<(u32, u32), u32> = HashMap::new();
        let (mut most, mut told): (usize, Vec<(usize, Growing)>) = (0, Vec::new());
        for n in 0..40_000_u32 {
            table.insert((n, n + 1), n);
            if n % 3 != 0 {
                table.remove(&(n / 2, n / 2 + 1));
            }
            most = most.max(table.len());
            told.push((most, Growing::of_table(&table, most)));
            let (before, then) = told[n as usize / 2];
            let times = most as f64 / before as f64;
            assert!(then.grown(times) >= table_bytes(&table), "{n}: {then:?} grew by {times}");
        }
        let all = table_bytes(&table);
        assert!(all >= table.len() as u64 * 13 && all < table.len() as u64 * 13 * 5, "{all} of {}", table.len());
    }
}
