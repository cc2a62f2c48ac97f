//! What `middle` is asked for.

use super::surface::SurfaceKind;
use super::surface::held;
use crate::grid::{DataSets, Geometry};
use crate::kernel::distance::state::precision::Precision;
use crate::pipeline::distance::{DistanceSettings, Needs, tree_bytes};

/// How labels are told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LabelMode {
    /// By the sources that the method tracks. Of equally near ones the lower label is taken: by VDT and DP where the
    /// distances to both are equal; by FSM and FMM, which do not know these, where their own distance comes equally by
    /// way of either, to the bit.
    Tracked,
    /// By the nearest source, looked up wherever the tracked one may belong to the wrong set; of equal distances the
    /// lower label wins.
    Exact,
}

/// What is computed and how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MiddleSettings {
    /// The distance; with labels.
    pub distance: DistanceSettings,
    /// The surface.
    pub surface: SurfaceKind,
    /// The labels.
    pub labels: LabelMode,
}

impl MiddleSettings {
    /// What these settings take on a grid, on so many threads that so many ranks share.
    #[must_use]
    pub fn needs<P: Precision>(&self, geometry: &Geometry, sets: &DataSets, threads: usize, ranks: usize) -> Needs {
        let distance = DistanceSettings { labels: true, ..self.distance };
        let needs = distance.needs::<P>(geometry, sets, threads, ranks);
        let trees = if distance.looks_closer::<P>(sets) { 0 } else { tree_bytes(sets) };
        Needs { held: needs.held + trees + held(geometry), ..needs }
    }
}
