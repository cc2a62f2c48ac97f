//! The surfaces between labelled voxels in one brick, as one mesh for any number of labels: each cell cut into six
//! tetrahedra along its diagonal, and each of these by the labels of its corners (marching tetrahedra for many
//! materials, after Bloomenthal & Ferguson 1995).
//!
//! Vertices lie on edges between two labels, in triangles between three and in tetrahedra between four, so that every
//! edge of the mesh has two facets, and three along the lines where three labels meet. Neighbouring cells cut their
//! common face alike: no gaps, across bricks too.

use serde::{Deserialize, Serialize};

use std::collections::HashMap;

use glam::DVec3;

use super::corner::Corner;
use super::creases::{self, Crossing};
use super::equidistant::{Between, Candidates};
use super::known::Known;
use super::polygon::{self, Point};
use super::splits::Splits;
use super::tetrahedron::{ORDERS, Tetrahedron, corner_of};
use super::touching::wall;
use crate::grid::Box3;
use crate::kernel::surface::mesh::growing::table_bytes;
use crate::kernel::surface::mesh::patch::Patch;
use crate::kernel::surface::mesh::vertex_key::VertexKey;

/// The surfaces inside the cells of one brick.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct TaggedPatch {
    /// The mesh with its pairs of labels; triangles are counter-clockwise as seen from the side of the larger label.
    pub patch: Patch,
    /// The distance of each vertex to the sources that it lies between, physical.
    pub distances: Vec<f64>,
}

impl TaggedPatch {
    /// Gives back what it does not fill: it waits to be welded.
    pub fn shrink(&mut self) {
        self.patch.shrink();
        self.distances.shrink_to_fit();
    }

    /// Bytes of memory.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.patch.bytes() + (self.distances.capacity() * size_of::<f64>()) as u64
    }
}

/// The edges of a tetrahedron.
const EDGES: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];

/// Finds the surfaces brick by brick; keeps its working memory between bricks.
#[derive(Clone, Debug, Default)]
pub struct Interfaces {
    splits: Splits,
    vertices: HashMap<VertexKey, u32>,
    candidates: Candidates,
    /// The direction across the surface at each vertex of the patch.
    normals: Vec<DVec3>,
}

/// What splits the edges of a cell, by the middle of the edge in halves of voxels of the cell, x fastest.
type CellSplits = [Option<Corner>; 27];

impl Interfaces {
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
        self.splits.enter(known);
        for (y, z) in cells.rows() {
            for x in cells.lo[0]..cells.hi[0] {
                if self.splits.is_near(known, [x, y, z]) {
                    self.cut_cell(known, [x, y, z], patch);
                }
            }
        }
    }

    /// Bytes of memory that stay between bricks.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let normals = self.normals.capacity() * size_of::<[f64; 3]>();
        self.splits.bytes() + table_bytes(&self.vertices) + normals as u64
    }

    fn cut_cell(&mut self, known: &Known<'_>, cell: [i64; 3], patch: &mut TaggedPatch) {
        let voxels: [Corner; 8] = std::array::from_fn(|n| Corner::of_voxel(known, corner_of(cell, n as u8)));
        let splits = self.splits_of(known, cell);
        if voxels.iter().all(|corner| corner.label == voxels[0].label) && splits.iter().all(Option::is_none) {
            return;
        }
        for order in ORDERS {
            let second = 1 << order[0];
            let corners = [0, second, second | 1 << order[1], 7].map(|n: usize| voxels[n]);
            self.cut_splits(known, cell, &splits, Tetrahedron { corners }, patch);
        }
    }

    fn splits_of(&mut self, known: &Known<'_>, cell: [i64; 3]) -> CellSplits {
        let mut found = [None; 27];
        for step in 1..8_u8 {
            for corner in (0..8_u8).filter(|corner| corner & step == 0) {
                if let Some(split) = self.splits.of_edge(known, corner_of(cell, corner), step) {
                    found[place_in_cell(cell, split.halves)] = Some(split);
                }
            }
        }
        found
    }

    /// Cuts a tetrahedron in two at the first of its edges that is split, and these on; what is left along its labels.
    /// Of several edges always that with the lowest middle goes first, so that neighbours cut their common side alike.
    fn cut_splits(
        &mut self,
        known: &Known<'_>,
        cell: [i64; 3],
        splits: &CellSplits,
        tetrahedron: Tetrahedron,
        patch: &mut TaggedPatch,
    ) {
        let corners = tetrahedron.corners;
        let split = |ends: &[usize; 2]| {
            let [from, to] = ends.map(|n| corners[n].halves);
            // A corner that is no voxel has an odd coordinate.
            if from.iter().chain(&to).any(|v| v % 2 != 0) {
                return None;
            }
            let middle = std::array::from_fn(|a| i64::midpoint(from[a], to[a]));
            splits[place_in_cell(cell, middle)].map(|corner| (corner, *ends))
        };
        let Some((corner, ends)) = EDGES.iter().filter_map(split).min_by_key(|(corner, _)| corner.order()) else {
            if corners.iter().any(|corner| corner.label != corners[0].label) {
                self.cut(known, &tetrahedron, patch);
            }
            return;
        };
        for end in ends {
            let mut half = tetrahedron;
            half.corners[end] = corner;
            self.cut_splits(known, cell, splits, half, patch);
        }
    }

    /// Cuts a tetrahedron by the labels of its corners.
    fn cut(&mut self, known: &Known<'_>, tetrahedron: &Tetrahedron, patch: &mut TaggedPatch) {
        tetrahedron.pieces(|corners, polygon| self.facet(known, tetrahedron, corners, polygon, patch));
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
        let pair = tetrahedron.pair(corners);
        if pair.contains(&0) {
            return;
        }
        let is_upward = tetrahedron.is_upward(corners, polygon);
        for triangle in self.triangles(known, tetrahedron, polygon, is_upward, patch) {
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
        is_upward: bool,
        patch: &mut TaggedPatch,
    ) -> Vec<[u32; 3]> {
        let vertices: Vec<u32> = polygon.iter().map(|&set| self.vertex(known, tetrahedron, set, patch)).collect();
        let (mut ring, mut creased) = (Vec::with_capacity(2 * vertices.len()), Vec::new());
        for (n, &vertex) in vertices.iter().enumerate() {
            ring.push((polygon[n], vertex));
            let next = (n + 1) % vertices.len();
            let ends = [(polygon[n], vertex), (polygon[next], vertices[next])];
            if let Some(corner) = self.corner(known, tetrahedron, ends, patch) {
                creased.push(corner);
                ring.push((polygon[n] | polygon[next], corner));
            }
        }
        let number = |triangle: [usize; 3]| triangle.map(|n| ring[n].1);
        match creased.len() {
            0 => polygon::fan(ring.len()).map(number).collect(),
            1 | 2 => {
                let sign = if is_upward { 1.0 } else { -1.0 };
                let point = |&(within, vertex): &(u8, u32)| Point {
                    within,
                    place: physical(known, patch.patch.positions[vertex as usize]),
                    normal: sign * self.normals[vertex as usize],
                };
                polygon::cut(&ring.iter().map(point).collect::<Vec<_>>()).into_iter().map(number).collect()
            }
            _ => {
                // Creases meet here. So many run through no polygon but that of two labels, of which each tetrahedron has
                // one: no two ask for its peak.
                let peak = self.peak(known, tetrahedron, [&vertices, &creased], patch);
                let next = ring.iter().cycle().skip(1);
                ring.iter().zip(next).map(|(a, b)| [peak, a.1, b.1]).collect()
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
        let (corners, _, key) = tetrahedron.sorted(set);
        let triangle = [0, 1, 2].map(|n| physical(known, corners[n].place));
        let crossings = ends.map(|(_, vertex)| Crossing {
            place: physical(known, patch.patch.positions[vertex as usize]),
            normal: self.normals[vertex as usize],
        });
        let weights = creases::corner(triangle, crossings)?;
        let position = std::array::from_fn(|a| (0..3).map(|n| weights[n] * corners[n].place[a]).sum());
        Some(self.enter(key, patch, |candidates| candidates.at(known, &corners[..3], position)))
    }

    /// The vertex where sides meet: that of the surface at some vertices, in the middle of others.
    fn peak(
        &mut self,
        known: &Known<'_>,
        tetrahedron: &Tetrahedron,
        [sides, meeting]: [&[u32]; 2],
        patch: &mut TaggedPatch,
    ) -> u32 {
        let place = |vertex: u32| physical(known, patch.patch.positions[vertex as usize]);
        let around = meeting.iter().map(|&n| place(n)).sum::<DVec3>() / meeting.len() as f64;
        let sides: Vec<Crossing> =
            sides.iter().map(|&n| Crossing { place: place(n), normal: self.normals[n as usize] }).collect();
        let found = creases::peak(tetrahedron.corners.map(|corner| physical(known, corner.place)), &sides, around);
        let position = (found / DVec3::from(known.geometry.spacing)).into();
        let (corners, _, key) = tetrahedron.sorted(0b1111);
        self.enter(key, patch, |candidates| candidates.at(known, &corners, position))
    }

    /// The vertex within a set of the tetrahedron's corners, made when its first facet asks for it.
    fn vertex(&mut self, known: &Known<'_>, tetrahedron: &Tetrahedron, set: u8, patch: &mut TaggedPatch) -> u32 {
        let ([a, b, c, d], len, key) = tetrahedron.sorted(set);
        let placed = || wall(known, &[a, b, c, d][..len]);
        let between = |position| Between { position, distance: 0.0, normal: DVec3::ZERO };
        self.enter(key, patch, |candidates| match (len, placed()) {
            (_, Some(position)) => between(position),
            (2, _) => candidates.on_edge(known, [a, b]),
            (3, _) => candidates.within(known, [a, b, c]),
            _ => candidates.within(known, [a, b, c, d]),
        })
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

/// Where a place in halves of voxels stands among the 27 of a cell, x fastest.
fn place_in_cell(cell: [i64; 3], halves: [i64; 3]) -> usize {
    (0..3).rev().fold(0, |at, a| 3 * at + (halves[a] - 2 * cell[a]) as usize)
}

/// A place in physical units, from the centre of the domain's first voxel.
fn physical(known: &Known<'_>, place: [f64; 3]) -> DVec3 {
    DVec3::from(place) * DVec3::from(known.geometry.spacing)
}
