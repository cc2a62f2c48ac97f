//! `Reconstruction`: a closed surface from a point cloud without normals.

use std::borrow::Cow;

use super::disk::Disk;
use super::field::Field;
use super::given::check_points;
use super::mesh::Drawing;
use super::motion::motion_setters;
use super::run::{Run, finish_store, mesh_file, run_setters};
use super::words::in_builders_words;
use crate::error::{Error, Result};
use crate::exec::Engine;
use crate::grid::{Geometry, TriangleMesh};
use crate::kernel::surface::{Hausdorff, Measures};
use crate::pipeline::distance::Method;
use crate::pipeline::laying::{check_grid, check_spacing};
use crate::pipeline::level_set::time_loop::Evolution;
use crate::pipeline::limits::{ABOVE_ZERO, check_given};
use crate::pipeline::output::viewer_mesh::Segments;
use crate::pipeline::reconstruct;
use crate::pipeline::reconstruct::{
    ReconstructSettings, Vertices, estimate, grid_for, refuse_too_fine, typical_spacing, without_isolated,
};
use crate::pipeline::topology::Removed;
use crate::store::MeshSink;

/// A closed surface from a point cloud without normals.
///
/// ```
/// use strandline::Reconstruction;
///
/// # fn main() -> strandline::Result<()> {
/// // Points on the unit sphere, by the golden angle.
/// let place = |n: u32| {
///     let (z, turn) = (1.0 - (2.0 * f64::from(n) + 1.0) / 400.0, 2.399_963 * f64::from(n));
///     let radius = (1.0 - z * z).sqrt();
///     [radius * turn.cos(), radius * turn.sin(), z]
/// };
/// let found = Reconstruction::of((0..400).map(place).collect::<Vec<_>>()).solve()?;
/// assert!(found.measures().is_closed() && (found.measures().volume - 4.19).abs() < 0.2);
/// # Ok(())
/// # }
/// ```
#[must_use]
pub struct Reconstruction<'a> {
    cloud: Cow<'a, [[f64; 3]]>,
    grid: Option<Geometry>,
    spacing: Option<[f64; 3]>,
    drop_isolated: Option<f64>,
    settings: ReconstructSettings,
    run: Run,
}

/// What is solved: a cloud on a grid.
struct Ready<'a> {
    cloud: Cow<'a, [[f64; 3]]>,
    geometry: Geometry,
    engine: Engine,
    notes: Vec<String>,
}

impl<'a> Reconstruction<'a> {
    /// The surface of these points; world positions `[x, y, z]`.
    pub fn of(points: impl Into<Cow<'a, [[f64; 3]]>>) -> Self {
        Self {
            cloud: points.into(),
            grid: None,
            spacing: None,
            drop_isolated: None,
            settings: ReconstructSettings::default(),
            run: Run::default(),
        }
    }

    /// Distance between voxels along x, y and z; half the spacing of the points where this is left out.
    pub fn spacing(mut self, spacing: [f64; 3]) -> Self {
        self.spacing = Some(spacing);
        self
    }

    /// The grid that fields are read on; where this is left out, a box around the surface. The surface is that of all points
    /// in either case.
    pub fn grid(mut self, grid: Geometry) -> Self {
        self.grid = Some(grid);
        self
    }

    /// Leaves out points that have fewer than three others within so many spacings of the cloud.
    pub fn drop_isolated(mut self, spacings: f64) -> Self {
        self.drop_isolated = Some(spacings);
        self
    }

    /// The distance method; the vector distance transform where this is left out.
    pub fn method(mut self, method: Method) -> Self {
        self.settings.method = method;
        self
    }

    /// Distance of the start surface from the points, a length; found where this is left out.
    pub fn beta(mut self, beta: f64) -> Self {
        self.settings.beta = Some(beta);
        self
    }

    /// Standard deviation of the points from the surface, a length, 0 to take all as they are; told from the points where this is left
    /// out.
    pub fn noise(mut self, deviation: f64) -> Self {
        self.settings.noise = Some(deviation);
        self
    }

    /// Lets the surface end where the points do, with a rim, where it would else be closed: for a scan from one side, or a sheet.
    pub fn open(mut self) -> Self {
        self.settings.open = true;
        self
    }

    /// Where the mesh has its vertices; where this is left out, where the points have the surface, unless a surface is asked for that leaves
    /// them (a smaller `theta`, a larger `delta`).
    pub fn vertices(mut self, vertices: Vertices) -> Self {
        self.settings.vertices = Some(vertices);
        self
    }

    /// Leaves handles, tunnels and pieces of a few spacings as they are; else they are taken away.
    pub fn keep_topology(mut self) -> Self {
        self.settings.keeps_topology = true;
        self
    }

    /// Weight of the attraction to the points.
    pub fn theta(mut self, theta: f64) -> Self {
        self.settings.motion.theta = theta;
        self
    }

    motion_setters!(settings.motion);
    run_setters!(run);

    /// Finds the surface and keeps it in memory.
    ///
    /// # Errors
    /// When the points enclose nothing, the surface vanishes, settings make no sense, what is needed does not fit the memory,
    /// the store cannot be written, or the run is cancelled.
    pub fn solve(self) -> Result<SolvedReconstruction> {
        let mut mesh = TriangleMesh::default();
        let solved = self.solve_into(&mut mesh)?;
        Ok(SolvedReconstruction { mesh, ..solved })
    }

    /// Finds the surface and hands it to `mesh` as it is drawn; the mesh of the result is empty.
    ///
    /// # Errors
    /// As [`Reconstruction::solve`], or when the mesh is not taken.
    pub fn solve_into(self, mesh: &mut dyn MeshSink) -> Result<SolvedReconstruction> {
        in_builders_words(self.solved(mesh))
    }

    fn solved(mut self, mesh: &mut dyn MeshSink) -> Result<SolvedReconstruction> {
        self.settings.keeps_grid = self.grid.is_some();
        let Ready { cloud, geometry, engine, notes } = self.ready()?;
        let store = self.run.begin_store()?;
        let mut drawing = Drawing::new(mesh, mesh_file(store.as_ref())?.as_deref(), &geometry, false)?;
        let found = reconstruct::reconstruct(&engine, &geometry, &cloud, &self.settings, &mut drawing)?;
        drawing.finish(&engine, store.as_ref(), &geometry, Segments::Object(1))?;
        if let Some(store) = &store {
            found.write(&engine, store)?;
        }
        finish_store(&engine, store)?;
        Ok(SolvedReconstruction { mesh: TriangleMesh::default(), found, notes })
    }

    /// Checks everything, and lays the grid.
    fn ready(&self) -> Result<Ready<'_>> {
        self.settings.check()?;
        check_spacing("--spacing", self.spacing)?;
        check_given("--drop-isolated", self.drop_isolated, ABOVE_ZERO)?;
        if self.grid.is_some() && self.spacing.is_some() {
            return Err(Error::usage("--grid says all of the grid; leave out --spacing"));
        }
        check_points(&self.cloud).map_err(|error| error.reworded(|text| format!("the cloud {text}")))?;
        let resources = self.run.resources()?;
        let mut notes = Vec::new();
        let cloud = self.without_isolated(&mut notes);
        let geometry = self.lay(&cloud)?;
        refuse_too_fine(&geometry, resources.memory)?;
        let threads = resources.threads as u64;
        let needs = estimate(&geometry, &cloud, &self.settings, threads, self.run.store.is_some());
        let engine = self.run.engine(&resources, needs.held)?;
        self.run.check_disk(&Disk::of_cloud(&resources, self.run.store.as_deref(), &needs)?, &mut notes)?;
        Ok(Ready { cloud, geometry, engine, notes })
    }

    fn without_isolated(&self, notes: &mut Vec<String>) -> Cow<'_, [[f64; 3]]> {
        let spacing = self.drop_isolated.and_then(|spacings| Some(spacings * typical_spacing(&self.cloud)?));
        let Some(within) = spacing else { return Cow::Borrowed(self.cloud.as_ref()) };
        let kept = without_isolated(&self.cloud, within);
        let dropped = self.cloud.len() - kept.len();
        self.run.note(notes, &format!("{dropped} of {} points stand alone and are left out", self.cloud.len()));
        Cow::Owned(kept)
    }

    fn lay(&self, cloud: &[[f64; 3]]) -> Result<Geometry> {
        if let Some(grid) = &self.grid {
            check_grid(grid)?;
            check_spacing("the grid's spacing", Some(grid.spacing))?;
            return Ok(grid.clone());
        }
        let what = "all points lie in one place, which tells no spacing and encloses nothing";
        grid_for(cloud, self.spacing).ok_or_else(|| Error::input(what))
    }
}

/// A surface that was reconstructed.
pub struct SolvedReconstruction {
    /// The surface.
    pub mesh: TriangleMesh,
    found: reconstruct::Reconstruction,
    notes: Vec<String>,
}

impl SolvedReconstruction {
    /// The grid of the fields.
    #[must_use]
    pub fn geometry(&self) -> &Geometry {
        &self.found.geometry
    }

    /// What the surface measures.
    #[must_use]
    pub fn measures(&self) -> &Measures {
        &self.found.measures
    }

    /// Distances of the points from the surface.
    #[must_use]
    pub fn hausdorff(&self) -> Option<Hausdorff> {
        self.found.hausdorff
    }

    /// Points farther from the surface than the largest spacing.
    #[must_use]
    pub fn lost_points(&self) -> u64 {
        self.found.lost_points
    }

    /// Distance of the start surface from the points.
    #[must_use]
    pub fn beta(&self) -> f64 {
        self.found.beta
    }

    /// Standard deviation of the points from the surface; none where they do not tell it.
    #[must_use]
    pub fn noise(&self) -> Option<f64> {
        self.found.noise.deviation
    }

    /// The area that was cut off because no points support it; none where the surface was not to be open.
    #[must_use]
    pub fn trimmed_area(&self) -> Option<f64> {
        self.found.trimmed
    }

    /// Handles and pieces of a few spacings that were taken away; none where they were to stay.
    #[must_use]
    pub fn removed(&self) -> Option<Removed> {
        self.found.removed
    }

    /// How the time loop ended.
    #[must_use]
    pub fn evolution(&self) -> Evolution {
        self.found.evolution.clone()
    }

    /// What should be known of the points, one sentence each.
    #[must_use]
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// The segmentation function: 1 inside, 0 outside, the surface at 1/2.
    #[must_use]
    pub fn level_set(&self) -> Field<'_, f32> {
        Field::new(&self.found.geometry, self.found.level_set())
    }

    /// The distance to the points, a length, as far as it had to be known.
    #[must_use]
    pub fn distance(&self) -> Field<'_, f32> {
        Field::new(&self.found.geometry, self.found.distance())
    }
}
