//! `Fan`: a polygon cut into triangles that share its first corner.
//!
//! This is exact for flat convex polygons. The triangles of others still have the polygon's rim, which is all that a
//! format says about the surface between the corners of a polygon that is not flat.

use crate::error::{Error, Result};
use crate::grid::MOST_SOURCES;

/// A polygon whose corners come one by one, in any number.
#[derive(Debug)]
pub(in crate::io) struct Fan<'t> {
    triangles: &'t mut Vec<[u32; 3]>,
    vertices: u64,
    first: u32,
    last: u32,
    corners: u64,
}

impl<'t> Fan<'t> {
    /// A polygon that gives its triangles to `triangles`; its corners are numbers below `vertices`.
    pub(in crate::io) fn new(triangles: &'t mut Vec<[u32; 3]>, vertices: u64) -> Self {
        Self { triangles, vertices, first: 0, last: 0, corners: 0 }
    }

    /// The next corner, a vertex number counted from 0 as read from a file.
    pub(in crate::io) fn push(&mut self, vertex: f64) -> Result<()> {
        let is_there = vertex >= 0.0 && vertex < self.vertices as f64 && vertex.fract() == 0.0;
        // Vertex numbers are below MOST_SOURCES once the vertices are read; until then this keeps them in 32 bits.
        if !is_there || vertex > f64::from(u32::MAX) {
            return Err(Error::input(format!(
                "names vertex {vertex} of {}, counted from 0; the file is damaged",
                self.vertices
            )));
        }
        self.push_index(vertex as u32)
    }

    /// The next corner; whether the vertex exists is for the caller to tell.
    pub(in crate::io) fn push_index(&mut self, vertex: u32) -> Result<()> {
        if self.corners == 0 {
            self.first = vertex;
        } else if self.corners > 1 {
            if self.triangles.len() == MOST_SOURCES {
                return Err(Error::input(format!(
                    "has more than {MOST_SOURCES} triangles, which cannot be numbered; simplify or divide the mesh"
                )));
            }
            self.triangles.push([self.first, self.last, vertex]);
        }
        self.last = vertex;
        self.corners += 1;
        Ok(())
    }

    /// Ends the polygon, which must have three corners at least.
    pub(in crate::io) fn finish(self) -> Result<()> {
        if self.corners < 3 {
            return Err(Error::input(format!(
                "a face with {} corners; it needs three at least, so delete or complete it",
                self.corners
            )));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fan(corners: &[f64]) -> Result<Vec<[u32; 3]>> {
        let mut triangles = Vec::new();
        let mut fan = Fan::new(&mut triangles, 9);
        corners.iter().try_for_each(|&v| fan.push(v))?;
        fan.finish()?;
        Ok(triangles)
    }

    #[test]
    fn polygons_become_fans() {
        assert_eq!(fan(&[4.0, 0.0, 8.0]).unwrap(), [[4, 0, 8]]);
        assert_eq!(fan(&[5.0, 1.0, 2.0, 3.0, 4.0]).unwrap(), [[5, 1, 2], [5, 2, 3], [5, 3, 4]]);
    }

    #[test]
    fn impossible_corners_are_refused() {
        for vertex in [-1.0, 9.0, 1.5, f64::NAN, f64::INFINITY, 1e300] {
            assert!(fan(&[0.0, 1.0, vertex]).unwrap_err().to_string().contains("of 9"), "{vertex}");
        }
        assert!(fan(&[0.0, 1.0]).unwrap_err().to_string().contains("2 corners"));
        assert!(fan(&[]).unwrap_err().to_string().contains("0 corners"));
    }
}
