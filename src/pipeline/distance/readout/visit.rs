//! What is read of a box of a solved distance: values, from which side of meshes they are seen, sources, labels, their borders;
//! and what the report measures of them.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::field::Solved;
use super::found::DistanceFound;
use super::images::Wanted;
use super::kept::Kept;
use super::tile::Tile;
use crate::error::Result;
use crate::grid::{Box3, DataSets, Geometry, NO_SOURCE};
use crate::kernel::distance::features::closest_point::ClosestPoints;
use crate::kernel::distance::features::extent::extent;
use crate::kernel::distance::features::inside::{Flood, Inside};
use crate::kernel::distance::features::source_labels;
use crate::kernel::distance::state::precision::Precision;
use crate::kernel::image::labels;

/// What is read out, and how.
pub(crate) struct ReadOut<'a, P: Precision> {
    pub(crate) geometry: &'a Geometry,
    pub(crate) sets: &'a DataSets,
    /// Distances are negative inside meshes.
    pub(crate) is_signed: bool,
    /// They are times that fronts take.
    pub(crate) is_timed: bool,
    pub(crate) wanted: Wanted,
    /// What stays with who asked for it.
    pub(crate) kept: Option<&'a Kept<P>>,
}

/// What one thread reads into.
#[derive(Default)]
pub(super) struct Voxels<P> {
    values: Vec<P>,
    sources: Vec<u32>,
    labels: Vec<u32>,
    borders: Vec<u32>,
    /// With the voxels around, where borders are asked for.
    around: (Vec<P>, Vec<u32>, Vec<u32>),
    fixed: Vec<u8>,
    flood: Flood,
    inside: Vec<bool>,
}

/// What the voxels of a chunk hold, for the report.
#[derive(Default, Serialize, Deserialize)]
pub(super) struct Measured {
    pub(super) max: f64,
    unlabelled: u64,
    label_voxels: BTreeMap<u32, u64>,
}

impl<P: Precision> ReadOut<'_, P> {
    pub(super) fn measure(
        &self,
        part: &Box3,
        solved: &Solved<'_, P>,
        inside: Option<&Inside<'_>>,
        voxels: &mut Voxels<P>,
    ) -> Result<Measured> {
        self.read(part, solved, voxels)?;
        if let Some(inside) = inside {
            voxels.fixed.resize(part.len(), 0);
            solved.fixed.read_box(part, &mut voxels.fixed)?;
            inside.classify(part, &voxels.fixed, &mut voxels.flood, &mut voxels.inside);
            for (value, _) in voxels.values.iter_mut().zip(&voxels.inside).filter(|(_, inside)| **inside) {
                *value = P::from_f64(-value.to_f64());
            }
        }
        let (max, unlabelled) = extent(&voxels.values);
        Ok(Measured { max, unlabelled, label_voxels: labels::count(&voxels.labels) })
    }

    /// Reads what is asked for, once.
    fn read(&self, part: &Box3, solved: &Solved<'_, P>, voxels: &mut Voxels<P>) -> Result<()> {
        let Voxels { values, sources, labels, borders, around, .. } = voxels;
        if self.wanted.borders {
            let grown = part.grow(1).intersect(&self.geometry.domain());
            let (values_around, sources_around, labels_around) = around;
            read_both(solved, &grown, values_around, sources_around)?;
            source_labels::of_sources(self.sets, sources_around, labels_around);
            borders.resize(part.len(), 0);
            labels::border(labels_around, &grown, part, borders);
            grown.cut(values_around, part, values);
            grown.cut(sources_around, part, sources);
            grown.cut(labels_around, part, labels);
            return Ok(());
        }
        if self.wanted.labels || self.wanted.closest_point {
            read_both(solved, part, values, sources)?;
        } else {
            values.resize(part.len(), P::default());
            solved.values.read_box(part, values)?;
        }
        if self.wanted.labels {
            source_labels::of_sources(self.sets, sources, labels);
        }
        Ok(())
    }

    /// What the report tells; with the voxels that sources fixed, and the distances to triangles that took.
    pub(super) fn found(&self, measured: Measured, [fixed_voxels, triangle_distances]: [u64; 2]) -> DistanceFound {
        let mut label_voxels = measured.label_voxels;
        if self.wanted.labels {
            for &label in self.sets.labels() {
                label_voxels.entry(label).or_default();
            }
        }
        DistanceFound {
            max: measured.max,
            fixed_voxels,
            unlabelled_voxels: measured.unlabelled,
            triangle_distances: (!self.sets.mesh.is_empty()).then_some(triangle_distances),
            label_voxels,
        }
    }
}

fn read_both<P: Precision>(
    solved: &Solved<'_, P>,
    part: &Box3,
    values: &mut Vec<P>,
    sources: &mut Vec<u32>,
) -> Result<()> {
    values.resize(part.len(), P::default());
    sources.resize(part.len(), NO_SOURCE);
    solved.read_both(part, values, sources)
}

impl<P> Voxels<P> {
    pub(super) fn tile<'a>(&'a self, part: &'a Box3, closest: &'a ClosestPoints<'a>) -> Tile<'a, P> {
        let Self { values, sources, labels, borders, .. } = self;
        Tile { part, values, sources, labels, borders, closest }
    }
}

impl Measured {
    pub(super) fn and(mut self, other: Self) -> Self {
        for (label, n) in other.label_voxels {
            *self.label_voxels.entry(label).or_default() += n;
        }
        Self { max: self.max.max(other.max), unlabelled: self.unlabelled + other.unlabelled, ..self }
    }
}
