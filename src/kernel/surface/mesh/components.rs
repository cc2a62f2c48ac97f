//! `Components`: how many connected pieces a mesh has, counted while its triangles pass (union-find, paths halved on the way).
//!
//! Of a mesh that comes layer by layer nobody names the vertices of past layers again, but for those that the next patches share: what
//! is known of others is forgotten, so that a mesh of any size takes the memory of its largest layer.

use std::collections::HashMap;

use super::growing::Growing;

const ABSENT: u32 = u32::MAX;
/// Vertices whose places are held and given up together.
const CHUNK: usize = 1 << 14;

/// The pieces of a mesh; two vertices are in one when triangles connect them.
#[derive(Clone, Debug, Default)]
pub struct Components {
    /// What is above each vertex, itself at a root, [`ABSENT`] before it was entered; none of vertices that are forgotten.
    above: Vec<Option<Box<[u32]>>>,
    count: u64,
    vertices: u64,
}

impl Components {
    /// Connects the corners of a triangle.
    ///
    /// # Panics
    /// When a corner is `u32::MAX`, which no mesh of this crate has.
    pub fn add(&mut self, corners: [u32; 3]) {
        let entered: u64 = corners.map(|corner| u64::from(self.enter(corner))).iter().sum();
        let joined = [corners[1], corners[2]].map(|corner| u64::from(self.join(corners[0], corner)));
        self.vertices += entered;
        self.count = self.count + entered - joined.iter().sum::<u64>();
    }

    /// Forgets all vertices but some, in order of their numbers: no other one of those so far is the corner of a later triangle.
    pub fn forget_but(&mut self, kept: &[u32]) {
        // The first that is kept of a piece becomes its root.
        let mut roots: HashMap<u32, u32> = HashMap::new();
        let known: Vec<u32> = kept.iter().copied().filter(|&vertex| self.get(vertex) != ABSENT).collect();
        let above: Vec<u32> = known.iter().map(|&vertex| *roots.entry(self.root(vertex)).or_insert(vertex)).collect();
        let mut chunks = known.iter().map(|&vertex| vertex as usize / CHUNK).peekable();
        for (n, chunk) in self.above.iter_mut().enumerate() {
            if chunks.peek() != Some(&n) {
                *chunk = None;
            }
            while chunks.next_if_eq(&n).is_some() {}
        }
        known.into_iter().zip(above).for_each(|(vertex, above)| self.set(vertex, above));
    }

    /// Number of connected pieces; vertices without a triangle do not count.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.count
    }

    /// What it holds in memory.
    #[must_use]
    pub fn table(&self) -> Growing {
        let held = self.above.iter().flatten().count() * CHUNK * size_of::<u32>();
        Growing::of_chunks((held + size_of_val(self.above.as_slice())) as u64)
    }

    /// Number of vertices that triangles have.
    #[must_use]
    pub fn vertices(&self) -> u64 {
        self.vertices
    }

    fn get(&self, vertex: u32) -> u32 {
        let chunk = self.above.get(vertex as usize / CHUNK).and_then(Option::as_ref);
        chunk.map_or(ABSENT, |chunk| chunk[vertex as usize % CHUNK])
    }

    fn set(&mut self, vertex: u32, above: u32) {
        let chunk = vertex as usize / CHUNK;
        if chunk >= self.above.len() {
            self.above.resize(chunk + 1, None);
        }
        self.above[chunk].get_or_insert_with(|| vec![ABSENT; CHUNK].into())[vertex as usize % CHUNK] = above;
    }

    /// Enters a vertex as a piece of its own; false when it is known.
    fn enter(&mut self, vertex: u32) -> bool {
        assert!(vertex != ABSENT, "a number must lie below 2^32 - 1");
        let is_new = self.get(vertex) == ABSENT;
        if is_new {
            self.set(vertex, vertex);
        }
        is_new
    }

    fn root(&mut self, mut vertex: u32) -> u32 {
        loop {
            let above = self.get(vertex);
            if above == vertex {
                return vertex;
            }
            let next = self.get(above);
            self.set(vertex, next);
            vertex = next;
        }
    }

    /// Makes the pieces of two vertices one; false when they are already.
    fn join(&mut self, a: u32, b: u32) -> bool {
        let (a, b) = (self.root(a), self.root(b));
        self.set(a.max(b), a.min(b));
        a != b
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

    /// Columns of triangles, layer by layer; some join in the last one.
    #[test]
    fn what_is_forgotten_counts_as_before() {
        let (columns, layers) = (40_u32, 5000_u32);
        let vertex = |layer: u32, column: u32, n: u32| layer * 2 * columns + 2 * column + n;
        let (mut all, mut some) = (Components::default(), Components::default());
        let mut most = 0;
        for layer in 0..layers {
            for column in 0..columns {
                let [a, b] = [0, 1].map(|n| vertex(layer, column, n));
                let [c, d] = [0, 1].map(|n| vertex(layer + 1, column, n));
                for triangle in [[a, b, c], [b, c, d]] {
                    all.add(triangle);
                    some.add(triangle);
                }
            }
            let mut kept: Vec<u32> = (0..2 * columns).map(|n| vertex(layer + 1, 0, n)).collect();
            kept.push(u32::MAX - 1);
            some.forget_but(&kept);
            most = most.max(some.table().bytes());
        }
        for column in (0..columns - 1).step_by(2) {
            let bridge = [vertex(layers, column, 0), vertex(layers, column, 1), vertex(layers, column + 1, 0)];
            all.add(bridge);
            some.add(bridge);
        }
        assert_eq!((some.count(), some.vertices()), (u64::from(columns) / 2, all.vertices()));
        assert_eq!(some.count(), all.count());
        assert!(most < all.table().bytes() / 5, "{most} of {}", all.table().bytes());
    }
}
