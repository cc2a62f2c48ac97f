//! How large the pieces of a surface are, counted while it is drawn.

use crate::error::Result;
use crate::kernel::topology::union_find::Forest;
use crate::store::MeshSink;

/// The pieces of a mesh by their vertices.
#[derive(Default)]
pub(super) struct PieceSizes {
    pieces: Forest,
}

impl PieceSizes {
    /// What a vertex takes: what is above it, and the size of a piece.
    pub(super) const VERTEX_BYTES: u64 = 8;

    /// Vertices of the piece that has the fewest.
    pub(super) fn smallest(mut self) -> u64 {
        let roots = self.pieces.roots();
        let mut sizes = vec![0_u32; roots.len()];
        for root in roots {
            sizes[root as usize] += 1;
        }
        sizes.into_iter().filter(|&size| size > 0).min().unwrap_or(0).into()
    }
}

impl MeshSink for PieceSizes {
    fn vertex(&mut self, _position: [f64; 3]) -> Result<()> {
        self.pieces.push();
        Ok(())
    }

    fn triangle(&mut self, [a, b, c]: [u32; 3]) -> Result<()> {
        self.pieces.join(a, b);
        self.pieces.join(a, c);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_smallest_of_two_pieces_is_told() {
        let mut sizes = PieceSizes::default();
        for _ in 0..9 {
            sizes.vertex([0.0; 3]).unwrap();
        }
        for corners in [[0, 5, 8], [1, 3, 2], [4, 1, 7], [2, 6, 4]] {
            sizes.triangle(corners).unwrap();
        }
        assert_eq!(sizes.smallest(), 3);
    }
}
