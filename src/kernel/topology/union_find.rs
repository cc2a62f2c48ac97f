//! `Forest`: which things are connected, told pair by pair (union-find, paths halved on the way).
//!
//! The smallest number of a tree is its root, so nothing that is told of a tree depends on the order of its joins.

const ABSENT: u32 = u32::MAX;

/// Trees over things that are numbered from 0.
#[derive(Clone, Debug, Default)]
pub struct Forest {
    /// What is above each thing, itself at a root, [`ABSENT`] before it was entered.
    above: Vec<u32>,
}

impl Forest {
    /// So many trees of one thing.
    #[must_use]
    pub fn of_singles(len: usize) -> Self {
        Self { above: (0..len as u32).collect() }
    }

    /// What is held in memory: a place for each thing.
    pub(crate) fn places(&self) -> &Vec<u32> {
        &self.above
    }

    /// Enters a thing as a tree of its own; false when it is known.
    ///
    /// # Panics
    /// When its number is `u32::MAX`.
    pub fn enter(&mut self, thing: u32) -> bool {
        assert!(thing != ABSENT, "a number must lie below 2^32 - 1");
        let place = thing as usize;
        if place >= self.above.len() {
            self.above.resize(place + 1, ABSENT);
        }
        let is_new = self.above[place] == ABSENT;
        if is_new {
            self.above[place] = thing;
        }
        is_new
    }

    /// The root of a thing that was entered.
    pub fn root(&mut self, mut thing: u32) -> u32 {
        loop {
            let above = self.above[thing as usize];
            if above == thing {
                return thing;
            }
            let next = self.above[above as usize];
            self.above[thing as usize] = next;
            thing = next;
        }
    }

    /// Makes the trees of two things one; false when they are already.
    pub fn join(&mut self, a: u32, b: u32) -> bool {
        let (a, b) = (self.root(a), self.root(b));
        self.above[a.max(b) as usize] = a.min(b);
        a != b
    }

    /// The roots of all things, in order; all must have been entered.
    #[must_use]
    pub fn roots(&mut self) -> Vec<u32> {
        (0..self.above.len() as u32).map(|thing| self.root(thing)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_smallest_is_the_root_whatever_the_order() {
        let pairs = [[4, 2], [1, 3], [6, 4], [3, 6]];
        for order in [[0, 1, 2, 3], [3, 2, 1, 0], [2, 0, 3, 1]] {
            let mut forest = Forest::of_singles(7);
            let joined = order.map(|n| forest.join(pairs[n][0], pairs[n][1]));
            assert_eq!((joined, forest.roots()), ([true; 4], vec![0, 1, 1, 1, 1, 5, 1]));
            assert!(!forest.join(2, 3));
        }
    }

    #[test]
    fn things_are_entered_once() {
        let mut forest = Forest::default();
        assert_eq!([5, 0, 5].map(|thing| forest.enter(thing)), [true, true, false]);
        assert!(forest.join(5, 0));
        assert_eq!(forest.root(5), 0);
    }
}
