//! What `middle` is asked for.

use super::surface::{Drawing, SurfaceKind};
use crate::exec::{Footprint, Plan};
use crate::grid::{DataSets, Geometry};
use crate::kernel::distance::state::precision::Precision;
use crate::kernel::geometry::triangle::Triangle;
use crate::pipeline::distance::{DistanceSettings, Needs, Writes, tree_bytes};
use crate::pipeline::output::viewer_mesh;

/// Seconds of one thread for a voxel whose label is made exact, and whose cell is looked at for surfaces.
const EXACT_SECONDS: f64 = 40e-9;
const SURFACE_SECONDS: f64 = 250e-9;
const VIEWER_SECONDS: f64 = 20e-9;

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
    /// What these settings take on a grid, on so many threads of one of so many ranks; `writes` says whether there is a
    /// store.
    #[must_use]
    pub fn needs<P: Precision>(
        &self,
        geometry: &Geometry,
        sets: &DataSets,
        threads: usize,
        ranks: usize,
        writes: bool,
    ) -> Needs {
        let distance = DistanceSettings { labels: true, ..self.distance };
        let fields = if writes { Writes::FieldsAndBorders } else { Writes::Nothing };
        let needs = distance.needs::<P>(geometry, sets, [threads, ranks], fields);
        let trees = if distance.looks_closer::<P>(sets) { 0 } else { tree_bytes(sets) };
        // A copy of the triangles of their own, for what lies on labels' borders.
        let shapes = (sets.mesh.len() * size_of::<Triangle>()) as u64;
        let drawing = Drawing::new(geometry, sets, threads);
        let footprint = needs.footprint.and(Footprint::of_all(trees + shapes)).and(drawing.footprint());
        let later = needs.later + drawing.footprint().bytes(threads as u64);
        let seconds: f64 = self.plan::<P>(geometry, threads, writes).iter().map(|(_, seconds)| seconds).sum();
        let seconds = seconds / ranks as f64;
        let held = footprint.bytes(threads as u64);
        Needs { footprint, held, later, waiting: drawing.waiting, seconds, ..needs }
    }

    /// The stages of the job, and what each will probably take.
    #[must_use]
    pub fn plan<P: Precision>(&self, geometry: &Geometry, threads: usize, writes: bool) -> Plan {
        let distance = DistanceSettings { labels: true, ..self.distance };
        let fields = if writes { Writes::FieldsAndBorders } else { Writes::Nothing };
        let mut plan = distance.plan::<P>(geometry, threads, fields);
        let all = geometry.domain().volume() as f64 / threads as f64;
        if self.labels == LabelMode::Exact {
            plan.insert(1, ("exact labels".into(), all * EXACT_SECONDS));
        }
        plan.insert(plan.len() - 1, ("surface".into(), all * SURFACE_SECONDS));
        if writes {
            plan.push((viewer_mesh::STAGE.to_owned(), all * VIEWER_SECONDS));
        }
        plan
    }
}
