//! `Pairs`: what the surface between each pair of labels measures; sums in f64, in the order of the triangles.

use std::collections::BTreeMap;

use glam::DVec3;

/// The surface between two labels. Lengths physical.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    /// The labels, the smaller first.
    pub labels: [u32; 2],
    /// Its area.
    pub area: f64,
    /// Number of triangles.
    pub triangles: u64,
    /// The lowest and the highest corner of the box around it, world coordinates.
    pub extent: [[f64; 3]; 2],
    /// The smallest and the largest distance of its vertices to the two sets; the gap between these is twice as wide.
    pub distance: [f64; 2],
}

/// Pairs while their triangles pass.
#[derive(Clone, Debug, Default)]
pub struct Pairs {
    known: BTreeMap<[u32; 2], Pair>,
}

impl Pairs {
    /// Adds a triangle: its corners in the world, and their distances.
    pub fn add(&mut self, labels: [u32; 2], corners: [[f64; 3]; 3], distances: [f64; 3]) {
        let far = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        let new = Pair { labels, area: 0.0, triangles: 0, extent: far, distance: [f64::INFINITY, f64::NEG_INFINITY] };
        let pair = self.known.entry(labels).or_insert(new);
        let [a, b, c] = corners.map(DVec3::from);
        pair.area += 0.5 * (b - a).cross(c - a).length();
        pair.triangles += 1;
        for (corner, distance) in corners.into_iter().zip(distances) {
            for (axis, place) in corner.into_iter().enumerate() {
                pair.extent[0][axis] = pair.extent[0][axis].min(place);
                pair.extent[1][axis] = pair.extent[1][axis].max(place);
            }
            pair.distance = [pair.distance[0].min(distance), pair.distance[1].max(distance)];
        }
    }

    /// All of them, in the order of their labels.
    #[must_use]
    pub fn finish(self) -> Vec<Pair> {
        self.known.into_values().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_are_summed_by_their_pair() {
        let mut pairs = Pairs::default();
        let triangle = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 3.0, -1.0]];
        pairs.add([1, 3], triangle, [0.5, 0.25, 1.0]);
        pairs.add([1, 2], triangle, [2.0; 3]);
        pairs.add([1, 3], triangle.map(|p| p.map(|x: f64| x + 1.0)), [0.75; 3]);
        let found = pairs.finish();
        assert_eq!(
            found.iter().map(|pair| (pair.labels, pair.triangles)).collect::<Vec<_>>(),
            [([1, 2], 1), ([1, 3], 2)]
        );
        // Half of |(2, 0, 0) x (0, 3, -1)|, twice.
        assert!((found[1].area - 40.0_f64.sqrt()).abs() < 1e-12);
        assert_eq!((found[1].distance, found[1].extent), ([0.25, 1.0], [[0.0, 0.0, -1.0], [3.0, 4.0, 1.0]]));
    }
}
