//! `KeyMap`: a table by the names of vertices and edges, which are many and small and come from no stranger: its hash is a
//! rotation and a product for each word of them, a tenth of the time of the standard one.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

/// A table by names.
pub(crate) type KeyMap<K, V> = HashMap<K, V, BuildHasherDefault<KeyHasher>>;

/// An odd number without a pattern: the golden ratio's digits, in 64 bits.
const FACTOR: u64 = 0x9e37_79b9_7f4a_7c15;
/// How far what was taken is rotated before the next word.
const ROTATION: u32 = 23;

/// The hash of a name, word by word.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct KeyHasher {
    state: u64,
}

impl KeyHasher {
    fn take(&mut self, word: u64) {
        self.state = (self.state.rotate_left(ROTATION) ^ word).wrapping_mul(FACTOR);
    }
}

impl Hasher for KeyHasher {
    fn write(&mut self, bytes: &[u8]) {
        for word in bytes.chunks(8) {
            let mut whole = [0; 8];
            whole[..word.len()].copy_from_slice(word);
            self.take(u64::from_le_bytes(whole));
        }
    }

    fn write_u32(&mut self, word: u32) {
        self.take(word.into());
    }

    fn write_u64(&mut self, word: u64) {
        self.take(word);
    }

    fn write_usize(&mut self, word: usize) {
        self.take(word as u64);
    }

    /// Tables look at the highest bits and at the lowest, and products leave the lowest as they were.
    fn finish(&self) -> u64 {
        self.state ^ self.state >> 32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::surface::VertexKey;
    use std::hash::{BuildHasher, Hash};

    fn hash(name: impl Hash) -> u64 {
        BuildHasherDefault::<KeyHasher>::default().hash_one(name)
    }

    #[test]
    fn names_near_each_other_spread_over_all_places() {
        let edges = (0..64_u32).flat_map(|a| (0..64_u32).map(move |b| hash((a, a + b))));
        let keys = (0..4096_i64).map(|n| hash(VertexKey::on_edge([n % 16, n / 16 % 16, n / 256], (n % 3) as usize)));
        for hashes in [edges.collect::<Vec<_>>(), keys.collect()] {
            for shift in [0, 20, 52] {
                let mut places = vec![0; 4096];
                for hash in &hashes {
                    places[(hash >> shift) as usize % 4096] += 1;
                }
                // Thrown at random, 4096 leave 37 % of 4096 places empty, and no place gets more than about 8.
                let empty = places.iter().filter(|n| **n == 0).count();
                assert!(empty < 2200 && places.iter().all(|n| *n < 24), "{empty} are empty");
            }
        }
    }
}
