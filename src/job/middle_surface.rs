//! `MiddleSurface`: the surfaces equally far from data sets.

use super::distance_field::SolvedDistance;
use super::mesh::{Drawing, LabelledMesh};
use super::run::{finish_store, mesh_file, run_setters};
use super::task::{Ready, Task, task_setters};
use super::words::in_builders_words;
use crate::error::{Error, Result};
use crate::kernel::distance::state::precision::Precision;
use crate::kernel::surface::{LabelMeasures, Measures, Pair};
use crate::pipeline::distance::Kept;
use crate::pipeline::distance::seeding::label_borders::Labels;
use crate::pipeline::middle::{
    LabelMode, MiddleFound, MiddleSettings, MiddleSources, SurfaceKind, check_sets, middle_kept, with_touching,
};
use crate::pipeline::output::viewer_mesh::Segments;
use crate::store::MeshSink;

/// The surfaces equally far from two data sets or more.
///
/// ```
/// use strandline::MiddleSurface;
///
/// # fn main() -> strandline::Result<()> {
/// let (left, right) = ([[0.0, 0.0, 0.0]], [[2.0, 0.0, 0.0]]);
/// let found = MiddleSurface::new().points(&left).points(&right).spacing([0.1; 3]).solve()?;
/// assert!(found.mesh.mesh.vertices.iter().all(|v| (v[0] - 1.0).abs() < 1e-6));
/// assert_eq!(found.pairs[0].labels, [1, 2]);
/// # Ok(())
/// # }
/// ```
#[must_use]
pub struct MiddleSurface<'a> {
    task: Task<'a>,
    surface: SurfaceKind,
    mode: LabelMode,
    background: bool,
}

impl Default for MiddleSurface<'_> {
    fn default() -> Self {
        Self { task: Task::default(), surface: SurfaceKind::Exact, mode: LabelMode::Tracked, background: false }
    }
}

impl<'a> MiddleSurface<'a> {
    /// A surface between nothing yet.
    pub fn new() -> Self {
        Self::default()
    }

    task_setters!();

    /// Which surface is drawn; that between the voxels where this is left out.
    pub fn surface(mut self, surface: SurfaceKind) -> Self {
        self.surface = surface;
        self
    }

    /// How labels are told; by the sources that the method tracks where this is left out.
    pub fn labels(mut self, mode: LabelMode) -> Self {
        self.mode = mode;
        self
    }

    /// Of one label volume: the walls between its labels and around each of them, against what has no label (0) and what lies around the volume.
    pub fn background(mut self) -> Self {
        self.background = true;
        self
    }

    run_setters!(task.run);

    /// Computes the surfaces and keeps them in memory, with distances in single precision.
    ///
    /// # Errors
    /// When there are fewer than two data sets, sources, grid or settings make no sense, what is needed does not fit the
    /// memory, the store cannot be written, or the run is cancelled.
    pub fn solve(self) -> Result<SolvedMiddle<f32>> {
        self.solve_as()
    }

    /// Computes the surfaces and keeps them in memory, with distances stored as `P`: `f32`, `f64` or `half::f16`.
    ///
    /// # Errors
    /// As [`MiddleSurface::solve`].
    pub fn solve_as<P: Precision>(self) -> Result<SolvedMiddle<P>> {
        let mut mesh = LabelledMesh::default();
        let solved = in_builders_words(self.solved(&mut mesh))?;
        Ok(SolvedMiddle { mesh, ..solved })
    }

    /// Computes the surfaces and hands them to `mesh` as they are drawn; the mesh of the result is empty.
    ///
    /// # Errors
    /// As [`MiddleSurface::solve`], or when the mesh is not taken.
    pub fn solve_into(self, mesh: &mut dyn MeshSink) -> Result<SolvedMiddle<f32>> {
        in_builders_words(self.solved(mesh))
    }

    fn solved<P: Precision>(&self, mesh: &mut dyn MeshSink) -> Result<SolvedMiddle<P>> {
        let mut ready = self.task.ready::<P>()?;
        let volume = self.task.sole_volume().filter(|volume| *volume.geometry == ready.geometry);
        if self.background && (volume.is_none() || self.surface == SurfaceKind::Labels) {
            return Err(Error::usage(
                "--background draws surfaces around the labels of one label volume, on its own voxels; leave out other sources, --surface labels \
                 and what lays another grid",
            ));
        }
        check_sets(&ready.sets, (self.surface, self.background))?;
        ready.settings.labels = true;
        let settings = MiddleSettings { distance: ready.settings, surface: self.surface, labels: self.mode };
        let Ready { sets, geometry, resources, notes, settings: distance } = &mut ready;
        let writes = self.task.run.store.is_some();
        let needs = settings.needs::<P>(geometry, sets, resources.threads, 1, writes).keeping::<P>(geometry, true);
        let labels = volume.as_ref().map(|volume| volume as &dyn Labels);
        let needs = with_touching(needs, labels, resources.threads);
        let engine = self.task.run.engine(resources, needs.held)?;
        self.task.run.check_disk(&self.task.disk::<P>((resources, geometry, distance), &needs, true)?, notes)?;
        let store = self.task.run.begin_store()?;
        let mut drawing = Drawing::new(mesh, mesh_file(store.as_ref())?.as_deref(), geometry, true)?;
        let kept = Kept::new(&engine, geometry, true)?;
        let sources = MiddleSources { sets, volume: labels, background: self.background };
        let found = middle_kept(&engine, geometry, &sources, &settings, (store.as_ref(), Some(&kept)), &mut drawing)?;
        drawing.finish(&engine, store.as_ref(), geometry, Segments::Pairs)?;
        finish_store(&engine, store)?;
        let MiddleFound { distance, measures, pairs, labels } = found;
        let distance = SolvedDistance::new(ready, distance, kept);
        Ok(SolvedMiddle { distance, mesh: LabelledMesh::default(), measures, pairs, labels })
    }
}

/// Middle surfaces that were computed.
pub struct SolvedMiddle<P: Precision> {
    /// The distance to all data sets, with labels.
    pub distance: SolvedDistance<P>,
    /// All surfaces.
    pub mesh: LabelledMesh,
    /// The measures of all surfaces as one mesh.
    pub measures: Measures,
    /// What lies between each two labels that meet.
    pub pairs: Vec<Pair>,
    /// What each label measures.
    pub labels: Vec<LabelMeasures>,
}
