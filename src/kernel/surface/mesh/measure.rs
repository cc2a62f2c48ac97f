//! `SurfaceMeasure`: volume, area, closedness and pieces of a mesh, summed while its triangles pass.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::growing::Growing;
use crate::kernel::surface::{Components, EdgeTally};

/// Running sums over triangles, in f64 and in the order the triangles come.
#[derive(Clone, Debug)]
pub struct SurfaceMeasure {
    centre: DVec3,
    /// Six times the volume.
    volume6: f64,
    /// The volumes that are summed, 24 of each, times the centroids of their tetrahedra.
    moment24: DVec3,
    /// Twice the area.
    area2: f64,
    /// The length of the edges that wait.
    rim: f64,
    triangles: u64,
    edges: EdgeTally,
    components: Components,
}

/// What a mesh measures, in the physical unit of its positions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Measures {
    /// Enclosed volume, positive for outward triangles; has a meaning only for a closed mesh.
    pub volume: f64,
    /// Centroid of what it encloses; has a meaning only for a closed mesh.
    pub centroid: [f64; 3],
    /// Area of all triangles.
    pub area: f64,
    /// Number of edges that no second triangle closes.
    pub open_edges: u64,
    /// The length of these edges.
    pub rim: f64,
    /// Number of connected pieces.
    pub components: u64,
    /// Number of triangles.
    pub triangles: u64,
    /// Number of vertices that triangles have.
    pub vertices: u64,
}

impl Measures {
    /// True when the mesh is closed and consistently oriented.
    #[must_use]
    pub fn is_closed(&self) -> bool {
        self.open_edges == 0
    }
}

impl SurfaceMeasure {
    /// Empty sums. `centre` is any world position near the mesh: volumes are summed as seen from there, so that a
    /// mesh far from the origin loses no digits.
    #[must_use]
    pub fn new(centre: [f64; 3]) -> Self {
        Self {
            centre: centre.into(),
            volume6: 0.0,
            moment24: DVec3::ZERO,
            area2: 0.0,
            rim: 0.0,
            triangles: 0,
            edges: EdgeTally::default(),
            components: Components::default(),
        }
    }

    /// Adds a triangle, its corners as vertex numbers and as world positions.
    pub fn add(&mut self, corners: [u32; 3], positions: [[f64; 3]; 3]) {
        let [a, b, c] = positions.map(|p| DVec3::from(p) - self.centre);
        // Divergence theorem: the tetrahedron from the centre to a triangle has the volume a . (b x c) / 6.
        let volume6 = a.dot(b.cross(c));
        self.volume6 += volume6;
        self.moment24 += volume6 * (a + b + c);
        self.area2 += (b - a).cross(c - a).length();
        self.triangles += 1;
        for (n, waits) in self.edges.add(corners).into_iter().enumerate() {
            self.rim += f64::from(waits) * [a, b, c][n].distance([b, c, a][n]);
        }
        self.components.add(corners);
    }

    /// No vertex so far but some, in order of their numbers, is the corner of a later triangle: what is known of others is forgotten.
    pub fn forget_but(&mut self, kept: &[u32]) {
        self.edges.forget_but(kept);
        self.components.forget_but(kept);
    }

    /// What it holds in memory: edges of the layer that is drawn, and a number for each of its vertices.
    #[must_use]
    pub fn tables(&self) -> [Growing; 2] {
        [self.edges.table(), self.components.table()]
    }

    /// The measures of all triangles so far.
    #[must_use]
    pub fn measures(&self) -> Measures {
        let centroid = self.centre + self.moment24 / (4.0 * self.volume6);
        Measures {
            volume: self.volume6 / 6.0,
            // Of what encloses nothing there is none.
            centroid: <[f64; 3]>::from(if centroid.is_finite() { centroid } else { self.centre }),
            area: self.area2 / 2.0,
            open_edges: self.edges.open(),
            // What rounding leaves of edges that came and went is no rim.
            rim: if self.edges.open() == 0 { 0.0 } else { self.rim },
            components: self.components.count(),
            triangles: self.triangles,
            vertices: self.components.vertices(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tetrahedron_far_from_the_origin() {
        let offset = 4_096_000.0;
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 3.0]];
        let mut measure = SurfaceMeasure::new([4_096_000.5; 3]);
        for triangle in [[0_u32, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]] {
            measure.add(triangle, triangle.map(|v| corners[v as usize].map(|x: f64| x + offset)));
        }
        let found = measure.measures();
        assert!((found.volume - 1.0).abs() < 1e-12);
        for (found, expected) in found.centroid.into_iter().zip([0.25, 0.5, 0.75]) {
            assert!((found - offset - expected).abs() < 1e-8);
        }
        // Three right triangles and the slanted one: 1 + 1.5 + 3 + sqrt(36 + 9 + 4) / 2.
        assert!((found.area - 9.0).abs() < 1e-12);
        assert!(found.is_closed());
        assert_eq!((found.components, found.triangles, found.vertices, found.rim), (1, 4, 4, 0.0));
        let mut open = SurfaceMeasure::new([4_096_000.5; 3]);
        for triangle in [[0_u32, 2, 1], [0, 1, 3], [0, 3, 2]] {
            open.add(triangle, triangle.map(|v| corners[v as usize].map(|x: f64| x + offset)));
        }
        // The slanted one is missing.
        let rim = 5f64.sqrt() + 13f64.sqrt() + 10f64.sqrt();
        assert!((open.measures().rim - rim).abs() < 1e-8 && open.measures().open_edges == 3);
    }
}
