//! `EdgeTally`: whether a mesh is closed, told exactly while its triangles pass.

use super::growing::Growing;
use super::key_hash::KeyMap;

/// The directed edges whose opposite has not come yet.
///
/// In a closed, consistently oriented mesh each edge is walked once in either direction for every pair of triangles
/// that meet there. An edge leaves the tally as its opposite comes; what stays at the end is the border. With
/// triangles in the order of bricks the tally holds no more than the edges of the current layer.
#[derive(Clone, Debug, Default)]
pub struct EdgeTally {
    waiting: KeyMap<(u32, u32), u32>,
    open: u64,
    /// Entries that waited at the same time.
    most: usize,
}

impl EdgeTally {
    /// Counts the three edges of a triangle, from each corner to the next; an edge from a vertex to itself is none. Of each is told
    /// whether it waits from now on (1), closes one that waited (-1), or is none (0).
    pub fn add(&mut self, [a, b, c]: [u32; 3]) -> [i8; 3] {
        [(a, b), (b, c), (c, a)].map(|(from, to)| if from == to { 0 } else { self.walk(from, to) })
    }

    /// Forgets edges that no later triangle has: those of which an end is none of some vertices, in order of their numbers. If their
    /// opposite has not come, they stay open.
    pub fn forget_but(&mut self, kept: &[u32]) {
        let is_kept = |vertex: &u32| kept.binary_search(vertex).is_ok();
        self.waiting.retain(|(from, to), _| is_kept(from) && is_kept(to));
    }

    /// Number of edges that still lack their opposite: 0 for a closed mesh.
    #[must_use]
    pub fn open(&self) -> u64 {
        self.open
    }

    /// What it holds in memory.
    #[must_use]
    pub fn table(&self) -> Growing {
        Growing::of_table(&self.waiting, self.most)
    }

    fn walk(&mut self, from: u32, to: u32) -> i8 {
        if let Some(count) = self.waiting.get_mut(&(to, from)) {
            self.open -= 1;
            *count -= 1;
            if *count == 0 {
                self.waiting.remove(&(to, from));
            }
            -1
        } else {
            self.open += 1;
            *self.waiting.entry((from, to)).or_insert(0) += 1;
            self.most = self.most.max(self.waiting.len());
            1
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TETRAHEDRON: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];

    fn open_edges(triangles: &[[u32; 3]]) -> u64 {
        let mut tally = EdgeTally::default();
        for &triangle in triangles {
            tally.add(triangle);
        }
        tally.open()
    }

    #[test]
    fn a_tetrahedron_is_closed_and_without_a_side_it_is_not() {
        assert_eq!(open_edges(&TETRAHEDRON), 0);
        assert_eq!(open_edges(&TETRAHEDRON[..3]), 3);
    }

    #[test]
    fn a_flipped_triangle_shows() {
        let mut flipped = TETRAHEDRON;
        flipped[1].swap(0, 1);
        assert_eq!(open_edges(&flipped), 6);
    }

    #[test]
    fn closed_meshes_that_share_an_edge_are_closed() {
        let second = TETRAHEDRON.map(|t| t.map(|v| if v < 2 { v } else { v + 2 }));
        assert_eq!(open_edges(&[TETRAHEDRON, second].concat()), 0);
        assert_eq!(open_edges(&[[5, 5, 5]]), 0);
    }
}
