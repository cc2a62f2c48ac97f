//! Corners of the tetrahedra that a surface between labels is cut from: voxel centres, and places on edges between them
//! where a surface that crosses an edge twice has its inside.

use super::known::Known;

/// A place with a label.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Corner {
    /// Halves of voxels, `[x, y, z]`; a corner on an edge counts as the edge's middle. It names the corner.
    pub(crate) halves: [i64; 3],
    /// Where it lies, voxel units of the domain.
    pub(crate) place: [f64; 3],
    /// Whose it is; 0 for none.
    pub(crate) label: u32,
}

impl Corner {
    /// The centre of a voxel.
    pub(crate) fn of_voxel(known: &Known<'_>, voxel: [i64; 3]) -> Self {
        Self { halves: voxel.map(|v| 2 * v), place: voxel.map(|v| v as f64), label: known.label(voxel) }
    }

    /// A place on the edge between two voxels, that part of the way from the first.
    pub(crate) fn between(voxels: [[i64; 3]; 2], part: f64, label: u32) -> Self {
        let [from, to] = voxels;
        Self {
            halves: std::array::from_fn(|a| from[a] + to[a]),
            place: std::array::from_fn(|a| from[a] as f64 + part * (to[a] - from[a]) as f64),
            label,
        }
    }

    /// What corners are sorted by: z slowest, so that all cells name a vertex alike.
    pub(crate) fn order(&self) -> [i64; 3] {
        let [x, y, z] = self.halves;
        [z, y, x]
    }
}
