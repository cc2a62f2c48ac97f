//! `Forest`: which things are connected, told pair by pair (union-find, paths halved on the way).
//!
//! The smallest number of a tree is its root, so nothing that is told of a tree depends on the order of its joins.

/// Trees over things that are numbered from 0.
#[derive(Clone, Debug, Default)]
pub struct Forest {
    /// What is above each thing, itself at a root.
    above: Vec<u32>,
}

impl Forest {
    /// So many trees of one thing.
    #[must_use]
    pub fn of_singles(len: usize) -> Self {
        Self { above: (0..len as u32).collect() }
    }

    /// One more tree of one thing; returns its number.
    pub fn push(&mut self) -> u32 {
        let thing = self.above.len() as u32;
        self.above.push(thing);
        thing
    }

    /// The root of a thing.
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

    /// The roots of all things, in order.
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
}
