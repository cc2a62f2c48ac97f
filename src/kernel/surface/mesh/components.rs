//! `Components`: how many connected pieces a mesh has, counted while its triangles pass.

use super::growing::Growing;
use crate::kernel::topology::union_find::Forest;

/// The pieces of a mesh; two vertices are in one when triangles connect them.
#[derive(Clone, Debug, Default)]
pub struct Components {
    forest: Forest,
    count: u64,
    vertices: u64,
}

impl Components {
    /// Connects the corners of a triangle.
    ///
    /// # Panics
    /// When a corner is `u32::MAX`, which no mesh of this crate has.
    pub fn add(&mut self, corners: [u32; 3]) {
        let entered: u64 = corners.map(|corner| u64::from(self.forest.enter(corner))).iter().sum();
        let joined = [corners[1], corners[2]].map(|corner| u64::from(self.forest.join(corners[0], corner)));
        self.vertices += entered;
        self.count = self.count + entered - joined.iter().sum::<u64>();
    }

    /// Number of connected pieces; vertices without a triangle do not count.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.count
    }

    /// What it holds in memory.
    #[must_use]
    pub fn table(&self) -> Growing {
        Growing::of_list(self.forest.places())
    }

    /// Number of vertices that triangles have.
    #[must_use]
    pub fn vertices(&self) -> u64 {
        self.vertices
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_are_counted_as_they_join() {
        let mut pieces = Components::default();
        pieces.add([0, 1, 2]);
        pieces.add([7, 8, 9]);
        assert_eq!((pieces.count(), pieces.vertices()), (2, 6));
        pieces.add([4, 5, 6]);
        pieces.add([9, 2, 20]);
        assert_eq!((pieces.count(), pieces.vertices()), (2, 10));
    }
}
