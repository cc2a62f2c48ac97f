//! `Patch`: a piece of a mesh, as one brick gives it.

use serde::{Deserialize, Serialize};

use super::vertex_key::VertexKey;
use crate::grid::Box3;

/// The surface inside the cells of one brick.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Patch {
    /// The cells that were walked, by their lowest corners.
    pub cells: Box3,
    /// What each vertex lies on or within.
    pub keys: Vec<VertexKey>,
    /// Positions of the vertices in voxel units of the domain, whole numbers at voxel centres, `[x, y, z]`.
    pub positions: Vec<[f64; 3]>,
    /// Triangles as places in `keys` and `positions`, counter-clockwise as seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// The two labels that each triangle separates, the smaller first; empty where there are no labels.
    pub pairs: Vec<[u32; 2]>,
}

impl Patch {
    /// Gives back what it does not fill: it waits to be welded.
    pub fn shrink(&mut self) {
        self.keys.shrink_to_fit();
        self.positions.shrink_to_fit();
        self.triangles.shrink_to_fit();
        self.pairs.shrink_to_fit();
    }

    /// Bytes of memory.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let of_vertices =
            self.keys.capacity() * size_of::<VertexKey>() + self.positions.capacity() * size_of::<[f64; 3]>();
        let of_triangles =
            (self.triangles.capacity() * size_of::<[u32; 3]>()) + self.pairs.capacity() * size_of::<[u32; 2]>();
        (of_vertices + of_triangles) as u64
    }
}

impl Default for Patch {
    fn default() -> Self {
        Self {
            cells: Box3::from_shape([0; 3]),
            keys: Vec::new(),
            positions: Vec::new(),
            triangles: Vec::new(),
            pairs: Vec::new(),
        }
    }
}
