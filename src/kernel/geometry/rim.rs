//! Where a mesh is open: the edges that its triangles do not walk as often one way as the other, and how fast the winding number
//! changes away from them (docs/algorithms.md, "Signed distance").
//!
//! The winding number w of a mesh jumps across its triangles, and between them it follows from the rim alone: its gradient is that of
//! the rim's solid angle, a line integral as Biot and Savart have it, with r from the place to the rim
//!
//! ```text
//! grad w = 1 / (4 pi) integral of r x dl / |r|^3          |grad w| <= 1 / (4 pi) integral of dl / |r|^2
//! ```
//!
//! The bound is what is told here, over a hierarchy of the rim's edges: a group far away counts as if all of it were at its nearest
//! place. In: world positions, f64. Out: one over a length.

use std::f64::consts::PI;

use glam::DVec3;

use crate::grid::TriangleMesh;

/// Groups of no more edges than this are leaves.
const LEAF: usize = 8;

/// A group is taken as one from this many of its radii on.
const FAR: f64 = 2.0;

/// The rim of a mesh; empty for a closed one.
#[derive(Clone, Debug)]
pub struct Rim {
    /// Depth first: the first of a group's two halves follows it.
    groups: Vec<Group>,
    edges: Vec<Edge>,
}

#[derive(Clone, Copy, Debug)]
struct Edge {
    ends: [DVec3; 2],
    /// Its length, as often as it is walked one way more than the other.
    length: f64,
}

#[derive(Clone, Debug)]
struct Group {
    centre: DVec3,
    radius: f64,
    length: f64,
    /// The edges of a leaf; none where halves follow.
    leaf: std::ops::Range<u32>,
    /// The group after this one and all within it.
    next: u32,
}

impl Rim {
    /// The rim of a mesh, vertices of one place taken for one.
    #[must_use]
    pub fn new(mesh: &TriangleMesh) -> Self {
        let welded = mesh.weld();
        let mut sides = Vec::with_capacity(3 * mesh.len());
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|vertex| (welded.names[vertex as usize], vertex));
            let walked = [(a, b), (b, c), (c, a)].into_iter().filter(|(from, to)| from.0 != to.0);
            sides.extend(walked.map(|(from, to)| (from.0.min(to.0), from.0.max(to.0), from.0 < to.0, [from.1, to.1])));
        }
        sides.sort_unstable();
        let mut edges = Vec::new();
        for edge in sides.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            let upward = edge.iter().filter(|side| side.2).count();
            let more = (2 * upward).abs_diff(edge.len());
            if more > 0 {
                let ends = edge[0].3.map(|vertex| DVec3::from(mesh.vertices[vertex as usize]));
                edges.push(Edge { ends, length: more as f64 * ends[0].distance(ends[1]) });
            }
        }
        let mut rim = Self { groups: Vec::new(), edges: Vec::new() };
        if !edges.is_empty() {
            rim.add(&mut edges);
        }
        rim
    }

    /// Bytes that a rim takes at most, with the list that it is made from, of a mesh of so many triangles.
    #[must_use]
    pub fn bytes(triangles: u64) -> u64 {
        let edges = 3 * triangles;
        let side = 2 * size_of::<u32>() + size_of::<[u32; 3]>();
        edges * (side + 2 * size_of::<Edge>()) as u64 + edges.div_ceil(LEAF as u64 / 4) * size_of::<Group>() as u64
    }

    /// What the gradient of the winding number does not exceed within `reach` of a place; infinite where the rim is as near.
    #[must_use]
    pub fn steepest(&self, place: [f64; 3], reach: f64) -> f64 {
        let place = DVec3::from(place);
        let mut sum = 0.0;
        let mut at = 0;
        while let Some(group) = self.groups.get(at) {
            let away = group.centre.distance(place) - group.radius - reach;
            if away > FAR * group.radius {
                sum += group.length / (away * away);
                at = group.next as usize;
                continue;
            }
            for edge in &self.edges[group.leaf.start as usize..group.leaf.end as usize] {
                let away = edge.distance(place) - reach;
                if away <= 0.0 {
                    return f64::INFINITY;
                }
                sum += edge.length / (away * away);
            }
            at += 1;
        }
        sum / (4.0 * PI)
    }

    /// Adds the group of these edges and all groups within it.
    fn add(&mut self, members: &mut [Edge]) {
        let place = self.groups.len();
        let start = self.edges.len() as u32;
        let lowest = members.iter().flat_map(|edge| edge.ends).reduce(DVec3::min).unwrap_or_default();
        let highest = members.iter().flat_map(|edge| edge.ends).reduce(DVec3::max).unwrap_or_default();
        let (centre, radius) = (0.5 * (lowest + highest), 0.5 * lowest.distance(highest));
        let length = members.iter().map(|edge| edge.length).sum();
        self.groups.push(Group { centre, radius, length, leaf: 0..0, next: 0 });
        if members.len() <= LEAF {
            self.edges.extend_from_slice(members);
            self.groups[place].leaf = start..self.edges.len() as u32;
        } else {
            let extent = highest - lowest;
            let axis = (1..3).fold(0, |longest, a| if extent[a] > extent[longest] { a } else { longest });
            members.sort_by(|a, b| a.middle()[axis].total_cmp(&b.middle()[axis]));
            let (below, above) = members.split_at_mut(members.len() / 2);
            self.add(below);
            self.add(above);
        }
        self.groups[place].next = self.groups.len() as u32;
    }
}

impl Edge {
    fn middle(&self) -> DVec3 {
        0.5 * (self.ends[0] + self.ends[1])
    }

    /// How far a place is from it.
    fn distance(&self, place: DVec3) -> f64 {
        let [a, b] = self.ends;
        let along = b - a;
        let part = (place - a).dot(along) / along.length_squared();
        // Ends that rounding took for two places.
        let part = if part.is_finite() { part.clamp(0.0, 1.0) } else { 0.0 };
        place.distance(a + part * along)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::geometry::winding_number::WindingTree;

    /// A sphere without its cap.
    fn bowl() -> TriangleMesh {
        let (rows, columns) = (40, 80);
        let mut vertices = Vec::new();
        for row in 0..=rows {
            let (ring, height) = libm::sincos(2.6 * f64::from(row) / f64::from(rows));
            for column in 0..columns {
                let (sine, cosine) = libm::sincos(std::f64::consts::TAU * f64::from(column) / f64::from(columns));
                vertices.push([ring * cosine, ring * sine, height]);
            }
        }
        let mut triangles = Vec::new();
        for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
            let at = |row: i32, column: i32| (row * columns + column % columns) as u32;
            triangles.push([at(row, column), at(row + 1, column), at(row, column + 1)]);
            triangles.push([at(row, column + 1), at(row + 1, column), at(row + 1, column + 1)]);
        }
        TriangleMesh::new(vertices, triangles).unwrap()
    }

    #[test]
    fn the_rim_of_a_bowl_is_a_circle_and_that_of_a_closed_mesh_nothing() {
        let mesh = bowl();
        let rim = Rim::new(&mesh);
        let length: f64 = rim.edges.iter().map(|edge| edge.length).sum();
        assert_eq!(rim.edges.len(), 80);
        assert!((length - std::f64::consts::TAU * libm::sin(2.6)).abs() < 0.01, "{length}");
        let vertices = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let closed = TriangleMesh::new(vertices, vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]).unwrap();
        assert_eq!(Rim::new(&closed).steepest([0.1; 3], 5.0), 0.0);
    }

    /// Against differences of the winding number itself.
    #[test]
    fn the_winding_number_changes_no_faster_than_is_told() {
        let mesh = bowl();
        let (rim, tree) = (Rim::new(&mesh), WindingTree::new(&mesh));
        for n in 0..400 {
            let (sine, cosine) = libm::sincos(f64::from(n) * 2.399);
            let away = 0.9 * f64::from(n) / 400.0;
            let place = [away * cosine, away * sine, 0.8 - f64::from(n % 9) / 5.0];
            if (place.iter().map(|v| v * v).sum::<f64>().sqrt() - 1.0).abs() < 0.1 {
                continue;
            }
            let reach = 0.04;
            let told = rim.steepest(place, reach);
            let w = |offset: [f64; 3]| tree.winding_number(std::array::from_fn(|a| place[a] + offset[a]));
            for offset in [[reach, 0.0, 0.0], [0.0, -reach, 0.0], [0.0, 0.0, reach]] {
                // The hierarchy is off by less than 0.001 on this mesh.
                let change = (w(offset) - w([0.0; 3])).abs();
                assert!(change <= told * reach + 0.002, "{change} at {place:?}, told {told}");
            }
        }
        // In the middle of a circle the bound is 1 / (2 radius); of groups that count from their nearest place, a little more.
        let told = rim.steepest([0.0, 0.0, libm::cos(2.6)], 0.0) * 2.0 * libm::sin(2.6);
        assert!((0.99..2.3).contains(&told), "{told}");
    }
}
