//! `Components`: how many connected pieces a mesh has, counted while its triangles pass (union-find).

const UNUSED: u32 = u32::MAX;

/// A forest over vertices; two vertices are in one tree when triangles connect them.
#[derive(Clone, Debug, Default)]
pub struct Components {
    /// The vertex above each vertex, itself at the root, [`UNUSED`] while no triangle has it.
    parent: Vec<u32>,
    count: u64,
    vertices: u64,
}

impl Components {
    /// Connects the corners of a triangle.
    ///
    /// # Panics
    /// When a corner is `u32::MAX`, which no mesh of this crate has.
    pub fn add(&mut self, corners: [u32; 3]) {
        for corner in corners {
            self.enter(corner);
        }
        self.join(corners[0], corners[1]);
        self.join(corners[0], corners[2]);
    }

    /// Number of connected pieces; vertices without a triangle do not count.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Number of vertices that triangles have.
    #[must_use]
    pub fn vertices(&self) -> u64 {
        self.vertices
    }

    fn enter(&mut self, vertex: u32) {
        assert!(vertex != UNUSED, "a vertex number must lie below 2^32 - 1");
        let place = vertex as usize;
        if place >= self.parent.len() {
            self.parent.resize(place + 1, UNUSED);
        }
        if self.parent[place] == UNUSED {
            self.parent[place] = vertex;
            self.count += 1;
            self.vertices += 1;
        }
    }

    /// Joins two trees; the lower root stays, so that the forest does not depend on how it was built.
    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        if a != b {
            self.parent[a.max(b) as usize] = a.min(b);
            self.count -= 1;
        }
    }

    /// The root above a vertex; halves the path on its way.
    fn root(&mut self, mut vertex: u32) -> u32 {
        loop {
            let above = self.parent[vertex as usize];
            if above == vertex {
                return vertex;
            }
            let next = self.parent[above as usize];
            self.parent[vertex as usize] = next;
            vertex = next;
        }
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
