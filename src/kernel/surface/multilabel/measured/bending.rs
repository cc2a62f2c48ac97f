//! The mean curvature of surfaces between labels, summed over them: half the sum, over all edges within a surface, of an edge's length
//! times the angle by which its two facets turn there (Steiner's formula for polyhedra: of a cube 3 pi times its edge, of a ball 4 pi
//! times its radius). Lines where three labels meet are no part of it.
//!
//! Angles of a patch are told where it is made; of edges in its sides, which have their second facet in another patch, when
//! that has come.

use std::collections::BTreeMap;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::kernel::surface::mesh::growing::Growing;
use crate::kernel::surface::mesh::key_hash::KeyMap;
use crate::kernel::surface::mesh::patch::Patch;
use crate::kernel::surface::mesh::vertex_key::VertexKey;

/// Of the surfaces in one patch.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Bending {
    /// Sums within the patch, by labels.
    sums: Vec<([u32; 2], f64)>,
    /// Edges that have one facet here.
    seams: Vec<Seam>,
}

/// An edge with one of its facets.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Seam {
    labels: [u32; 2],
    /// In order.
    ends: [VertexKey; 2],
    /// Along the edge as the facet goes around, physical; and across the facet, of unit length.
    along: [f64; 3],
    normal: [f64; 3],
}

/// An edge as a facet has it: its ends in order, which facet, whether it runs from the first to the second.
type Side = (u32, u32, u32, bool);

impl Bending {
    /// Of a patch on voxels of some spacing.
    #[must_use]
    pub fn of(patch: &Patch, spacing: [f64; 3]) -> Self {
        let place = |n: u32| DVec3::from(patch.positions[n as usize]) * DVec3::from(spacing);
        let normal = |n: u32| {
            let [a, b, c] = patch.triangles[n as usize].map(place);
            (b - a).cross(c - a).normalize_or_zero()
        };
        let mut sides: Vec<Side> = Vec::with_capacity(3 * patch.triangles.len());
        for (n, &[a, b, c]) in (0..).zip(&patch.triangles) {
            sides.extend([(a, b), (b, c), (c, a)].map(|(from, to)| (from.min(to), from.max(to), n, from < to)));
        }
        sides.sort_unstable();
        let (mut sums, mut seams) = (BTreeMap::new(), Vec::new());
        for edge in sides.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            let labels = |side: &Side| patch.pairs[side.2 as usize];
            for (n, side) in edge.iter().enumerate() {
                let (low, high) = if side.3 { (side.0, side.1) } else { (side.1, side.0) };
                let along = place(high) - place(low);
                match edge.iter().position(|other| other.2 != side.2 && labels(other) == labels(side)) {
                    Some(other) if other > n => {
                        let turned = turned(along, [normal(side.2), normal(edge[other].2)]);
                        *sums.entry(labels(side)).or_insert(0.0) += turned;
                    }
                    Some(_) => {}
                    None => {
                        let mut ends = [side.0, side.1].map(|n| patch.keys[n as usize]);
                        ends.sort_unstable();
                        if (0..3).any(|a| [patch.cells.lo[a], patch.cells.hi[a]].iter().any(|&at| lies_in(ends, a, at)))
                        {
                            let normal = normal(side.2).into();
                            seams.push(Seam { labels: labels(side), ends, along: along.into(), normal });
                        }
                    }
                }
            }
        }
        Self { sums: sums.into_iter().collect(), seams }
    }

    /// Bytes of memory.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        (self.sums.capacity() * size_of::<([u32; 2], f64)>() + self.seams.capacity() * size_of::<Seam>()) as u64
    }
}

fn lies_in(ends: [VertexKey; 2], axis: usize, index: i64) -> bool {
    ends.iter().all(|end| end.lies_in(axis, index))
}

/// Half the length of an edge times the angle by which the surface turns there, positive where it bulges to where its normals point.
fn turned(along: DVec3, [here, beyond]: [DVec3; 2]) -> f64 {
    let length = along.length();
    if length == 0.0 {
        return 0.0;
    }
    0.5 * length * libm::atan2(here.cross(beyond).dot(along) / length, here.dot(beyond))
}

/// An edge on the side of a box: the labels of its facets, and its ends.
type Seamed = ([u32; 2], [VertexKey; 2]);

/// The bending of all patches, put together in their order.
#[derive(Clone, Debug, Default)]
pub struct Bendings {
    sums: BTreeMap<[u32; 2], f64>,
    /// Edges whose second facet is still to come: along which way they go, and the normal of the first.
    waiting: KeyMap<Seamed, [[f64; 3]; 2]>,
    most: usize,
    layer: i64,
}

impl Bendings {
    /// Adds that of a patch whose cells begin at a layer; patches come in the order of their boxes.
    pub fn add(&mut self, bending: &Bending, layer: i64) {
        if layer != self.layer {
            self.waiting.retain(|(_, ends), _| ends.iter().all(|end| end.layer() >= layer));
            self.layer = layer;
        }
        for (labels, sum) in &bending.sums {
            *self.sums.entry(*labels).or_insert(0.0) += sum;
        }
        for seam in &bending.seams {
            let key = (seam.labels, seam.ends);
            if let Some([along, normal]) = self.waiting.remove(&key) {
                let turned = turned(along.into(), [normal.into(), seam.normal.into()]);
                *self.sums.entry(seam.labels).or_insert(0.0) += turned;
            } else {
                self.waiting.insert(key, [seam.along, seam.normal]);
                self.most = self.most.max(self.waiting.len());
            }
        }
    }

    /// What it holds in memory.
    #[must_use]
    pub fn table(&self) -> Growing {
        Growing::of_table(&self.waiting, self.most)
    }

    /// The mean curvature summed over the surface between two labels, positive where the first bulges into the second.
    #[must_use]
    pub fn of(&self, labels: [u32; 2]) -> f64 {
        self.sums.get(&labels).copied().unwrap_or(0.0)
    }
}
