//! Sources of a distance: the triangles of a mesh in the world (docs/algorithms.md, "Triangles").

use std::borrow::Cow;

use super::Weld;
use crate::error::{Error, Result};

/// The most sources that a distance field can tell apart: indices have 31 bits, of which the highest 257 mean none, or
/// one that is not known yet.
pub const MOST_SOURCES: usize = (u32::MAX >> 1) as usize - 256;

/// A triangle mesh in physical coordinates. A triangle's index is the source number that distance fields carry.
///
/// Vertices need not be shared: three of its own for each triangle, as STL gives them, make the same surface.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriangleMesh {
    /// World positions, `[x, y, z]`, all finite.
    pub vertices: Vec<[f64; 3]>,
    /// The three corners of each triangle, places in `vertices`; counterclockwise when seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

/// The edges of a mesh that keep it from being the boundary of a solid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BoundaryEdges {
    /// Edges with an odd number of triangles: rims of holes, mostly.
    pub open: u64,
    /// Edges with an even number of triangles that do not run through them in opposite directions in pairs.
    pub flipped: u64,
}

impl BoundaryEdges {
    /// True when no edge is open: the mesh encloses what is inside.
    #[must_use]
    pub fn is_closed(self) -> bool {
        self.open == 0
    }

    /// True when triangles that meet at an edge have the same side outside.
    #[must_use]
    pub fn is_oriented(self) -> bool {
        self.flipped == 0
    }
}

impl From<TriangleMesh> for Cow<'_, TriangleMesh> {
    fn from(mesh: TriangleMesh) -> Self {
        Self::Owned(mesh)
    }
}

impl<'a> From<&'a TriangleMesh> for Cow<'a, TriangleMesh> {
    fn from(mesh: &'a TriangleMesh) -> Self {
        Self::Borrowed(mesh)
    }
}

impl TriangleMesh {
    /// The mesh of these vertices and triangles.
    ///
    /// # Errors
    /// When a coordinate is not finite, a triangle names a vertex that does not exist, or there are more than
    /// [`MOST_SOURCES`] triangles or vertices.
    pub fn new(vertices: Vec<[f64; 3]>, triangles: Vec<[u32; 3]>) -> Result<Self> {
        refuse_too_many("vertices", vertices.len() as u64)?;
        refuse_too_many("triangles", triangles.len() as u64)?;
        if let Some(n) = vertices.iter().position(|v| !v.iter().all(|x| x.is_finite())) {
            return Err(Error::input(format!("vertex {n} (counted from 0) has a coordinate that is not finite")));
        }
        if let Some(n) = triangles.iter().position(|t| t.iter().any(|&v| v as usize >= vertices.len())) {
            return Err(Error::input(format!(
                "triangle {n} (counted from 0) names the vertices {:?} of {}, counted from 0",
                triangles[n],
                vertices.len()
            )));
        }
        Ok(Self { vertices, triangles })
    }

    /// Number of triangles.
    #[must_use]
    pub fn len(&self) -> usize {
        self.triangles.len()
    }

    /// True when the mesh has no triangle.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// World positions of the corners of triangle `n`.
    ///
    /// # Panics
    /// When there is no such triangle, or it names a vertex that does not exist.
    #[must_use]
    pub fn corners(&self, n: usize) -> [[f64; 3]; 3] {
        self.triangles[n].map(|v| self.vertices[v as usize])
    }

    /// The smallest box that holds all triangles, `(lowest, highest)`; vertices without a triangle do not count.
    /// None for a mesh without triangles.
    #[must_use]
    pub fn bounds(&self) -> Option<([f64; 3], [f64; 3])> {
        let mut corners = self.triangles.iter().flatten().map(|&v| self.vertices[v as usize]);
        let first = corners.next()?;
        Some(corners.fold((first, first), |(lo, hi), p| {
            (std::array::from_fn(|a| lo[a].min(p[a])), std::array::from_fn(|a| hi[a].max(p[a])))
        }))
    }

    /// Edges that are open or run the wrong way, after vertices of one place are taken for one.
    #[must_use]
    pub fn boundary_edges(&self) -> BoundaryEdges {
        self.edges_between(&self.weld().names)
    }

    /// The same, of vertices that have these names.
    ///
    /// # Panics
    /// When there are fewer names than vertices.
    #[must_use]
    pub fn edges_between(&self, names: &[u32]) -> BoundaryEdges {
        let mut edges = Vec::with_capacity(3 * self.triangles.len());
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|v| names[v as usize]);
            // An edge of a degenerate triangle from a vertex to itself is none.
            let sides = [(a, b), (b, c), (c, a)].into_iter().filter(|(from, to)| from != to);
            edges.extend(sides.map(|(from, to)| (from.min(to), from.max(to), from < to)));
        }
        edges.sort_unstable();
        let mut found = BoundaryEdges::default();
        for edge in edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            let upward = edge.iter().filter(|side| side.2).count();
            if edge.len() % 2 == 1 {
                found.open += 1;
            } else if 2 * upward != edge.len() {
                found.flipped += 1;
            }
        }
        found
    }

    /// Which vertices are one place, up to rounding.
    #[must_use]
    pub fn weld(&self) -> Weld {
        Weld::new(self)
    }
}

/// Refuses a count of sources, or of what they are made of, that 31 bits cannot number.
///
/// # Errors
/// When `count` is larger than [`MOST_SOURCES`].
pub fn refuse_too_many(what: &str, count: u64) -> Result<()> {
    if count > MOST_SOURCES as u64 {
        return Err(Error::input(format!(
            "has {count} {what}, more than the {MOST_SOURCES} that can be numbered; simplify it or divide it"
        )));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tetrahedron, outward.
    fn tetrahedron() -> TriangleMesh {
        let vertices = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [9.0, 9.0, 9.0]];
        TriangleMesh::new(vertices, vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]).unwrap()
    }

    fn edges(open: u64, flipped: u64) -> BoundaryEdges {
        BoundaryEdges { open, flipped }
    }

    #[test]
    fn corners_and_bounds() {
        let mesh = tetrahedron();
        assert_eq!(mesh.corners(3), [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
        assert_eq!(mesh.bounds(), Some(([0.0; 3], [1.0; 3])));
        assert_eq!(TriangleMesh::default().bounds(), None);
    }

    #[test]
    fn closed_open_and_flipped() {
        let mut mesh = tetrahedron();
        assert_eq!(mesh.boundary_edges(), edges(0, 0));
        mesh.triangles[2].swap(0, 1);
        assert_eq!(mesh.boundary_edges(), edges(0, 3));
        mesh.triangles.remove(2);
        assert_eq!(mesh.boundary_edges(), edges(3, 0));
        assert!(!mesh.boundary_edges().is_closed() && mesh.boundary_edges().is_oriented());
    }

    #[test]
    fn vertices_of_equal_place_are_one() {
        let mesh = tetrahedron();
        let mut vertices: Vec<[f64; 3]> = (0..mesh.len()).flat_map(|n| mesh.corners(n)).collect();
        vertices[0] = [-0.0, 0.0, -0.0];
        let mut soup = TriangleMesh::new(vertices, (0..4).map(|n| [3 * n, 3 * n + 1, 3 * n + 2]).collect()).unwrap();
        assert_eq!(soup.boundary_edges(), edges(0, 0));
        // Degenerate triangles change nothing: a point, and a segment there and back.
        soup.triangles.extend([[1, 1, 1], [1, 2, 2]]);
        assert_eq!(soup.boundary_edges(), edges(0, 0));
    }

    #[test]
    fn unusable_meshes_are_refused() {
        let bad = |vertices, triangles| TriangleMesh::new(vertices, triangles).unwrap_err().to_string();
        assert!(bad(vec![[0.0; 3], [0.0, f64::NAN, 0.0]], vec![]).contains("vertex 1"));
        assert!(bad(vec![[0.0; 3]], vec![[0; 3], [0, 1, 0]]).contains("triangle 1"));
        assert!(refuse_too_many("triangles", MOST_SOURCES as u64).is_ok());
        assert!(refuse_too_many("triangles", 1 << 31).unwrap_err().to_string().contains("2147483648 triangles"));
    }
}
