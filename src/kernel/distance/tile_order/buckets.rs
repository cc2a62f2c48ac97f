//! A queue of a tile's voxels in the order of their values, to within a bucket's width, at a constant cost.
//!
//! An untidy priority queue (Yatziv, Bartesaghi & Sapiro 2006, doi:10.1016/j.jcp.2005.08.005) for methods in which a
//! voxel that fell too late may fall again: the width changes how often that happens, and not where it ends. A voxel
//! whose value falls is put into its new bucket, and its old entry is passed over when its turn comes.

use crate::kernel::distance::state::precision::Real;

/// A voxel that is in no bucket.
const NONE: u16 = u16::MAX;

/// The most buckets; values beyond the last one share it.
const MOST: usize = 4096;

/// Bytes of a place in a list: its number, in room that doubles when it is used up.
pub(crate) const LISTED_BYTES: u64 = 8;
/// Bytes of a queue for each place: its bucket, and its place in this one's list and in one that it has left.
pub(crate) const QUEUE_BYTES: u64 = 2 + 2 * LISTED_BYTES;

/// Buckets of places.
#[derive(Debug)]
pub(crate) struct Buckets<A> {
    lists: Vec<Vec<u32>>,
    /// The bucket that each place waits in.
    of: Vec<u16>,
    /// The bucket whose turn it is.
    turn: usize,
    /// Where the first bucket begins, and one over the width.
    least: A,
    scale: A,
}

impl<A: Real> Buckets<A> {
    /// For places below `places`; values from the smallest to `range` above it get buckets of about `width`.
    pub(crate) fn new(places: usize) -> Self {
        Self { lists: Vec::new(), of: vec![NONE; places], turn: 0, least: A::default(), scale: A::default() }
    }

    /// Makes an empty queue ready for values from `least` on: as many buckets of `width` as reach `range` further.
    pub(crate) fn start(&mut self, least: A, width: f64, range: f64) {
        let count = ((range / width).ceil() as usize).clamp(1, MOST - 1) + 1;
        if self.lists.len() < count {
            self.lists.resize_with(count, Vec::new);
        }
        (self.turn, self.least, self.scale) = (0, least, A::of(1.0 / width));
    }

    /// Puts a place where its value belongs, or where the queue has got to.
    #[inline(always)]
    pub(crate) fn push(&mut self, place: u32, value: A) {
        let bucket = ((value - self.least) * self.scale).whole().clamp(self.turn, self.lists.len() - 1);
        if self.of[place as usize] != bucket as u16 {
            self.of[place as usize] = bucket as u16;
            self.lists[bucket].push(place);
        }
    }

    /// Takes the places of the first bucket that has any; they may come back into the same one. False when all is
    /// empty.
    pub(crate) fn take(&mut self, places: &mut Vec<u32>) -> bool {
        places.clear();
        while let Some(list) = self.lists.get_mut(self.turn) {
            if list.is_empty() {
                self.turn += 1;
                continue;
            }
            std::mem::swap(list, places);
            let turn = self.turn as u16;
            let of = &mut self.of;
            places.retain(|&place| {
                let due = of[place as usize] == turn;
                if due {
                    of[place as usize] = NONE;
                }
                due
            });
            if !places.is_empty() {
                return true;
            }
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_come_by_bucket_once_and_where_they_last_fell_to() {
        let mut queue = Buckets::<f32>::new(10);
        let mut places = Vec::new();
        for _ in 0..2 {
            queue.start(1.0, 0.5, 4.0);
            for (place, value) in [(3, 4.6), (1, 1.1), (2, 2.4), (4, 99.0), (3, 2.2), (1, 1.2)] {
                queue.push(place, value);
            }
            assert!(queue.take(&mut places) && places == [1]);
            queue.push(5, 1.3);
            assert!(queue.take(&mut places) && places == [5]);
            assert!(queue.take(&mut places) && places == [2, 3]);
            // Below the bucket whose turn it is: taken at once.
            queue.push(6, 1.0);
            assert!(queue.take(&mut places) && places == [6]);
            assert!(queue.take(&mut places) && places == [4]);
            assert!(!queue.take(&mut places) && places.is_empty());
        }
    }
}
