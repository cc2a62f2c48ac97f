//! `Pairs`: what the surface between each pair of labels measures; sums in f64, in the order of the triangles.

use std::collections::BTreeMap;

use glam::DVec3;

use super::bending::Bendings;

/// The surface between two labels. Lengths physical.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    /// The labels, the smaller first.
    pub labels: [u32; 2],
    /// Its area.
    pub area: f64,
    /// Of what of it lies between voxels that touch.
    pub contact_area: f64,
    /// Number of triangles.
    pub triangles: u64,
    /// The lowest and the highest corner of the box around it, world coordinates.
    pub extent: [[f64; 3]; 2],
    /// The smallest and the largest distance of its vertices to the two sets; the gap between these is twice as wide. 0 where
    /// labels touch.
    pub distance: [f64; 2],
    /// The mean width of the gap.
    pub thickness: f64,
    /// Its mean curvature summed over it, positive where the first label bulges into the second.
    pub bending: f64,
    /// A third of what flows through it to the second label, of a flow that leaves the middle of the grid as fast as it is away:
    /// over a closed surface, the volume within.
    pub(crate) flux: f64,
    /// The sum of a number for each edge, of the other sign where it is walked the other way: 0 over a closed surface.
    pub(crate) edges: u64,
}

impl Pair {
    fn new(labels: [u32; 2]) -> Self {
        let far = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        let distance = [f64::INFINITY, f64::NEG_INFINITY];
        let (area, contact_area, thickness, bending, flux) = (0.0, 0.0, 0.0, 0.0, 0.0);
        Self { labels, area, contact_area, triangles: 0, extent: far, distance, thickness, bending, flux, edges: 0 }
    }

    /// The mean of its mean curvature.
    #[must_use]
    pub fn mean_curvature(&self) -> f64 {
        self.bending / self.area.max(f64::MIN_POSITIVE)
    }
}

/// A triangle as [`Pairs`] are told of it.
#[derive(Clone, Copy, Debug)]
pub struct Facet {
    /// The labels that it separates, the smaller first.
    pub labels: [u32; 2],
    /// Its corners as vertices of the whole mesh, counter-clockwise as seen from the second label.
    pub corners: [u32; 3],
    /// The same in the world.
    pub places: [[f64; 3]; 3],
    /// The distance of each to the two sets.
    pub distances: [f64; 3],
}

/// Pairs while their triangles pass.
#[derive(Clone, Debug)]
pub struct Pairs {
    /// Where positions are seen from, so that a mesh far from the origin loses no digits.
    from: DVec3,
    known: BTreeMap<[u32; 2], Pair>,
    /// The one that the last triangle was of: the next one mostly is too.
    last: Option<Pair>,
}

impl Pairs {
    /// None yet; positions are seen from one that is near the mesh.
    #[must_use]
    pub fn new(from: [f64; 3]) -> Self {
        Self { from: from.into(), known: BTreeMap::new(), last: None }
    }

    /// Adds a triangle.
    pub fn add(&mut self, facet: &Facet) {
        let mut pair = self.take(facet.labels);
        let [a, b, c] = facet.places.map(|place| DVec3::from(place) - self.from);
        let area = 0.5 * (b - a).cross(c - a).length();
        pair.area += area;
        pair.flux += a.dot(b.cross(c)) / 6.0;
        pair.triangles += 1;
        if facet.distances == [0.0; 3] {
            pair.contact_area += area;
        }
        // The moment, until it is divided by the area.
        pair.thickness += 2.0 * area * facet.distances.iter().sum::<f64>() / 3.0;
        for (corner, distance) in facet.places.into_iter().zip(facet.distances) {
            for (axis, place) in corner.into_iter().enumerate() {
                pair.extent[0][axis] = pair.extent[0][axis].min(place);
                pair.extent[1][axis] = pair.extent[1][axis].max(place);
            }
            pair.distance = [pair.distance[0].min(distance), pair.distance[1].max(distance)];
        }
        let [a, b, c] = facet.corners;
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let number = number(from.min(to), from.max(to));
            pair.edges = if from < to { pair.edges.wrapping_add(number) } else { pair.edges.wrapping_sub(number) };
        }
        self.last = Some(pair);
    }

    /// A pair as it is so far; it is put back with the next one.
    fn take(&mut self, labels: [u32; 2]) -> Pair {
        if let Some(last) = self.last.take() {
            if last.labels == labels {
                return last;
            }
            self.known.insert(last.labels, last);
        }
        self.known.get(&labels).copied().unwrap_or_else(|| Pair::new(labels))
    }

    /// All of them, in the order of their labels, with how they are bent.
    #[must_use]
    pub fn finish(mut self, bendings: &Bendings) -> Vec<Pair> {
        if let Some(last) = self.last.take() {
            self.known.insert(last.labels, last);
        }
        let finished = |pair: Pair| {
            let thickness = pair.thickness / pair.area.max(f64::MIN_POSITIVE);
            Pair { thickness, bending: bendings.of(pair.labels), ..pair }
        };
        self.known.into_values().map(finished).collect()
    }
}

/// A number of an edge that looks like chance.
fn number(low: u32, high: u32) -> u64 {
    let mixed = (u64::from(low) << 32 | u64::from(high)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let mixed = (mixed ^ mixed >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    mixed ^ mixed >> 32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_are_summed_by_their_pair() {
        let mut pairs = Pairs::new([0.0; 3]);
        let triangle = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 3.0, -1.0]];
        let mut add = |labels, places, distances| pairs.add(&Facet { labels, corners: [0, 1, 2], places, distances });
        add([1, 3], triangle, [0.5, 0.25, 1.0]);
        add([1, 2], triangle, [0.0; 3]);
        add([1, 3], triangle.map(|p| p.map(|x: f64| x + 1.0)), [0.75; 3]);
        let found = pairs.finish(&Bendings::default());
        assert_eq!(
            found.iter().map(|pair| (pair.labels, pair.triangles)).collect::<Vec<_>>(),
            [([1, 2], 1), ([1, 3], 2)]
        );
        // Half of |(2, 0, 0) x (0, 3, -1)|, twice.
        assert!((found[1].area - 40.0_f64.sqrt()).abs() < 1e-12);
        assert_eq!((found[1].distance, found[1].extent), ([0.25, 1.0], [[0.0, 0.0, -1.0], [3.0, 4.0, 1.0]]));
        assert!((found[1].thickness - (1.75 / 3.0 + 0.75)).abs() < 1e-12);
        assert_eq!((found[0].contact_area, found[1].contact_area), (found[0].area, 0.0));
    }
}
