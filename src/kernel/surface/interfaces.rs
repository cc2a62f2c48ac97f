//! The surfaces between labelled voxels in one brick, as one mesh for any number of labels: each cell cut into six
//! tetrahedra along its diagonal, and each of these by the labels of its corners (marching tetrahedra for many
//! materials, after Bloomenthal & Ferguson 1995).
//!
//! Vertices lie on edges between two labels, in triangles between three and in tetrahedra between four, so that every
//! edge of the mesh has two facets, and three along the lines where three labels meet. Neighbouring cells cut their
//! common face alike: no gaps, across bricks too.

use std::collections::HashMap;

use super::creases::{self, Crossing};
use super::equidistant::{Between, Candidates, Known};
use super::marching_cubes::Patch;
use super::vertex_key::{VertexKey, VertexKeys};
use crate::grid::Box3;
use crate::kernel::vector::{cross, dot, sub};

/// The surfaces inside the cells of one brick.
#[derive(Clone, Debug, Default)]
pub struct TaggedPatch {
    /// The mesh with its pairs of labels; triangles are counter-clockwise as seen from the side of the larger label.
    pub patch: Patch,
    /// The distance of each vertex to the sources that it lies between, physical.
    pub distances: Vec<f64>,
}

/// Orders in which a way along a cell's edges can take the axes; each is a tetrahedron.
const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];

/// Finds the surfaces brick by brick; keeps its working memory between bricks.
#[derive(Clone, Debug)]
pub struct Interfaces {
    keys: VertexKeys,
    vertices: HashMap<VertexKey, u32>,
    candidates: Candidates,
    /// The direction across the surface at each vertex of the patch.
    normals: Vec<[f64; 3]>,
}

/// A tetrahedron: its corners as bits of the cell's corners, x in the lowest, and their labels.
struct Tetrahedron {
    cell: [i64; 3],
    corners: [u8; 4],
    labels: [u32; 4],
}

impl Interfaces {
    /// For a domain of `shape` voxels, `[x, y, z]`.
    #[must_use]
    pub fn new(shape: [i64; 3]) -> Self {
        Self {
            keys: VertexKeys::new(shape),
            vertices: HashMap::new(),
            candidates: Candidates::default(),
            normals: Vec::new(),
        }
    }

    /// Fills `patch` with the surfaces in `cells`, given by their lowest corners. What is known reaches one voxel
    /// around the corners of all cells, but for the domain's end. Voxels without a source have no surface.
    ///
    /// # Panics
    /// When `known` does not hold the corners of every cell, or its fields have another length than its box.
    pub fn extract(&mut self, known: &Known<'_>, cells: &Box3, patch: &mut TaggedPatch) {
        patch.patch = Patch { cells: *cells, ..Patch::default() };
        patch.distances.clear();
        self.vertices.clear();
        self.normals.clear();
        assert_eq!([known.sources.len(), known.labels.len()], [known.part.len(); 2], "fields are dense over their box");
        for (y, z) in cells.rows() {
            for x in cells.lo[0]..cells.hi[0] {
                self.cut_cell(known, [x, y, z], patch);
            }
        }
    }

    fn cut_cell(&mut self, known: &Known<'_>, cell: [i64; 3], patch: &mut TaggedPatch) {
        let labels: [u32; 8] = std::array::from_fn(|corner| known.label(corner_of(cell, corner as u8)));
        if labels.iter().all(|&label| label == labels[0]) {
            return;
        }
        for order in ORDERS {
            let second = 1 << order[0];
            let corners = [0, second, second | 1 << order[1], 7];
            let labels = corners.map(|corner: u8| labels[corner as usize]);
            if labels.iter().any(|&label| label != labels[0]) {
                self.cut(known, &Tetrahedron { cell, corners, labels }, patch);
            }
        }
    }

    /// The pieces of a tetrahedron: each is a polygon of vertices, named by the corners that they lie between, that
    /// separates two of its corners.
    fn cut(&mut self, known: &Known<'_>, tetrahedron: &Tetrahedron, patch: &mut TaggedPatch) {
        let labels = tetrahedron.labels;
        let like = |n: usize| (0..4).filter(|&m| labels[m] == labels[n]).fold(0_u8, |set, m| set | 1 << m);
        let mut kinds: Vec<u8> = (0..4).map(like).collect();
        kinds.sort_unstable_by_key(|set| (std::cmp::Reverse(set.count_ones()), *set));
        kinds.dedup();
        let members = |set: u8| (0..4).filter(move |n| set >> n & 1 == 1).map(|n| 1_u8 << n);
        let mut face = |corners: [u8; 2], polygon: &[u8]| self.facet(known, tetrahedron, corners, polygon, patch);
        match *kinds.as_slice() {
            [many, one] if one.is_power_of_two() => {
                let [a, b, c] = three(members(many));
                face([a, one], &[a | one, b | one, c | one]);
            }
            [pair, other] => {
                let ([a, b, _], [c, d, _]) = (three(members(pair)), three(members(other)));
                face([a, c], &[a | c, b | c, b | d, a | d]);
            }
            [pair, c, d] => {
                let [a, b, _] = three(members(pair));
                face([c, d], &[c | d, a | c | d, b | c | d]);
                for single in [c, d] {
                    face([a, single], &[a | single, b | single, b | c | d, a | c | d]);
                }
            }
            _ => {
                for (n, m) in [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)] {
                    let edge = 1_u8 << n | 1 << m;
                    let [k, l, _] = three(members(0b1111 & !edge));
                    face([1 << n, 1 << m], &[edge, edge | k, 0b1111, edge | l]);
                }
            }
        }
    }

    /// Adds a polygon that separates the labels of two corners.
    fn facet(
        &mut self,
        known: &Known<'_>,
        tetrahedron: &Tetrahedron,
        corners: [u8; 2],
        polygon: &[u8],
        patch: &mut TaggedPatch,
    ) {
        let place = |set: u8| set.trailing_zeros() as usize;
        let [from, to] = corners.map(place);
        let pair = [tetrahedron.labels[from], tetrahedron.labels[to]];
        if pair.contains(&0) {
            return;
        }
        // Which way round is told from the middles of what vertices lie within, which never fall together.
        let middles = [0, 1, 2].map(|n| tetrahedron.middle(polygon[n]));
        let normal = cross(sub(middles[1], middles[0]), sub(middles[2], middles[0]));
        let along = sub(tetrahedron.middle(1 << to), tetrahedron.middle(1 << from));
        let is_upward = (dot(normal, along) > 0.0) == (pair[0] < pair[1]);
        for triangle in self.triangles(known, tetrahedron, polygon, patch) {
            patch.patch.triangles.push(if is_upward { triangle } else { [triangle[0], triangle[2], triangle[1]] });
            patch.patch.pairs.push([pair[0].min(pair[1]), pair[0].max(pair[1])]);
        }
    }

    /// Cuts a polygon into triangles, along the crease where one runs through it.
    fn triangles(
        &mut self,
        known: &Known<'_>,
        tetrahedron: &Tetrahedron,
        polygon: &[u8],
        patch: &mut TaggedPatch,
    ) -> Vec<[u32; 3]> {
        let points: Vec<u32> = polygon.iter().map(|&set| self.vertex(known, tetrahedron, set, patch)).collect();
        let (mut ring, mut corners) = (Vec::with_capacity(2 * points.len()), Vec::new());
        for (n, &point) in points.iter().enumerate() {
            ring.push(point);
            let next = (n + 1) % points.len();
            let ends = [(polygon[n], point), (polygon[next], points[next])];
            if let Some(corner) = self.corner(known, tetrahedron, ends, patch) {
                corners.push(ring.len());
                ring.push(corner);
            }
        }
        match *corners.as_slice() {
            [] => fan(&ring),
            [only] => {
                ring.rotate_left(only);
                fan(&ring)
            }
            [a, b] => {
                let around: Vec<u32> = ring[b..].iter().chain(&ring[..=a]).copied().collect();
                [fan(&ring[a..=b]), fan(&around)].concat()
            }
            _ => {
                // Creases meet here. So many run through no polygon but that of two labels, of which each tetrahedron has
                // one: no two ask for its middle.
                let meeting: Vec<u32> = corners.iter().map(|&n| ring[n]).collect();
                let middle = self.middle_of(known, tetrahedron, &meeting, patch);
                let next = ring.iter().cycle().skip(1);
                ring.iter().zip(next).map(|(&a, &b)| [middle, a, b]).collect()
            }
        }
    }

    /// The vertex where the surface bends within the triangle of two crossed edges; none where it does not, or where
    /// the polygon's side does not lie in such a triangle.
    fn corner(
        &mut self,
        known: &Known<'_>,
        tetrahedron: &Tetrahedron,
        ends: [(u8, u32); 2],
        patch: &mut TaggedPatch,
    ) -> Option<u32> {
        let set = ends[0].0 | ends[1].0;
        if ends.iter().any(|(set, _)| set.count_ones() != 2) || set.count_ones() != 3 {
            return None;
        }
        let spacing = known.geometry.spacing;
        let physical = |position: [f64; 3]| -> [f64; 3] { std::array::from_fn(|a| position[a] * spacing[a]) };
        let (voxels, _, key) = self.chain(tetrahedron, set);
        let triangle = [0, 1, 2].map(|n| physical(voxels[n].map(|v| v as f64)));
        let crossings = ends.map(|(_, vertex)| Crossing {
            place: physical(patch.patch.positions[vertex as usize]),
            normal: self.normals[vertex as usize],
        });
        let weights = creases::corner(triangle, crossings)?;
        let position = std::array::from_fn(|a| (0..3).map(|n| weights[n] * voxels[n][a] as f64).sum());
        Some(self.enter(key, patch, |candidates| candidates.at(known, &voxels[..3], position)))
    }

    /// The vertex in the middle of others, within the tetrahedron.
    fn middle_of(
        &mut self,
        known: &Known<'_>,
        tetrahedron: &Tetrahedron,
        others: &[u32],
        patch: &mut TaggedPatch,
    ) -> u32 {
        let sum = |a: usize| others.iter().map(|&n| patch.patch.positions[n as usize][a]).sum::<f64>();
        let position = std::array::from_fn(|a| sum(a) / others.len() as f64);
        let (voxels, _, key) = self.chain(tetrahedron, 0b1111);
        self.enter(key, patch, |candidates| candidates.at(known, &voxels, position))
    }

    /// The vertex within a set of the tetrahedron's corners, made when its first facet asks for it.
    fn vertex(&mut self, known: &Known<'_>, tetrahedron: &Tetrahedron, set: u8, patch: &mut TaggedPatch) -> u32 {
        let ([a, b, c, d], len, key) = self.chain(tetrahedron, set);
        self.enter(key, patch, |candidates| match len {
            2 => candidates.on_edge(known, [a, b]),
            3 => candidates.within(known, [a, b, c]),
            _ => candidates.within(known, [a, b, c, d]),
        })
    }

    /// The voxels of a set of corners in order, how many they are, and the key of the vertex within them.
    fn chain(&self, tetrahedron: &Tetrahedron, set: u8) -> ([[i64; 3]; 4], usize, VertexKey) {
        let (mut corners, mut len) = ([0_u8; 4], 0);
        for corner in (0..4).filter(|n| set >> n & 1 == 1).map(|n| tetrahedron.corners[n]) {
            corners[len] = corner;
            len += 1;
        }
        let steps = std::array::from_fn(|n| if n + 1 < len { corners[n] ^ corners[n + 1] } else { 0 });
        let voxels = corners.map(|corner| corner_of(tetrahedron.cell, corner));
        (voxels, len, self.keys.within(voxels[0], steps))
    }

    /// The number of a vertex in the patch; its place is looked for when it is new.
    fn enter(
        &mut self,
        key: VertexKey,
        patch: &mut TaggedPatch,
        place: impl FnOnce(&mut Candidates) -> Between,
    ) -> u32 {
        let (candidates, normals) = (&mut self.candidates, &mut self.normals);
        *self.vertices.entry(key).or_insert_with(|| {
            let between = place(candidates);
            patch.patch.keys.push(key);
            patch.patch.positions.push(between.position);
            patch.distances.push(between.distance);
            normals.push(between.normal);
            patch.patch.keys.len() as u32 - 1
        })
    }
}

/// The triangles of a polygon from its first vertex on.
fn fan(polygon: &[u32]) -> Vec<[u32; 3]> {
    (1..polygon.len() - 1).map(|n| [polygon[0], polygon[n], polygon[n + 1]]).collect()
}

impl Tetrahedron {
    /// The middle of some of its corners, in voxels of the cell.
    fn middle(&self, set: u8) -> [f64; 3] {
        let corners = || (0..4).filter(|n| set >> n & 1 == 1).map(|n| self.corners[n]);
        std::array::from_fn(|a| {
            corners().map(|corner| f64::from(corner >> a & 1)).sum::<f64>() / f64::from(set.count_ones())
        })
    }
}

/// The first three of some sets; 0 where there are fewer.
fn three(sets: impl Iterator<Item = u8>) -> [u8; 3] {
    let mut found = [0; 3];
    found.iter_mut().zip(sets).for_each(|(place, set)| *place = set);
    found
}

fn corner_of(cell: [i64; 3], corner: u8) -> [i64; 3] {
    std::array::from_fn(|a| cell[a] + i64::from(corner >> a & 1))
}
