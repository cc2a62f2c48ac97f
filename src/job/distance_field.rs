//! `DistanceField`: the distance to points, triangle meshes and the borders of labels, on a grid of any size.

use super::field::{Field, check_part};
use super::run::{finish_store, run_setters};
use super::task::{Ready, Task, task_setters};
use super::volume::Image;
use super::words::in_builders_words;
use crate::error::{Error, Result};
use crate::grid::NO_SOURCE;
use crate::grid::{Box3, DataSets, Geometry};
use crate::kernel::distance::features::source_labels;
use crate::kernel::distance::state::precision::Precision;
use crate::kernel::geometry::triangle::Triangle;
use crate::pipeline::distance::{DistanceFound, Kept, Writes, distance_kept, travel_times};
use crate::store::{BoxSource, BrickArray, Sample, VolumeSource};

/// The distance to points, triangle meshes and the borders of labels.
///
/// ```
/// use strandline::DistanceField;
///
/// # fn main() -> strandline::Result<()> {
/// let cloud = [[0.0, 0.0, 0.0], [3.0, 0.0, 0.0]];
/// let found = DistanceField::new().points(&cloud).spacing([0.25; 3]).labels().solve()?;
/// let voxel = found.geometry().to_voxels([1.0, 0.5, 0.0]).map(|v| v.round() as i64);
/// assert!((found.distance().at(voxel)? - 1.25_f32.sqrt()).abs() < 1e-6);
/// # Ok(())
/// # }
/// ```
#[derive(Default)]
#[must_use]
pub struct DistanceField<'a> {
    task: Task<'a>,
}

impl<'a> DistanceField<'a> {
    /// A distance to nothing yet.
    pub fn new() -> Self {
        Self::default()
    }

    task_setters!();

    /// As far as that, a length; voxels farther away hold this distance.
    pub fn max_distance(mut self, farthest: f64) -> Self {
        self.task.settings.farthest = Some(farthest);
        self
    }

    /// Negative inside of the meshes, which then are the only sources.
    pub fn signed(mut self) -> Self {
        self.task.settings.signed = true;
        self
    }

    /// Also tells the label of the nearest data set of each voxel.
    pub fn labels(mut self) -> Self {
        self.task.settings.labels = true;
        self
    }

    /// Without an error: each voxel asks the sources that can be nearest, and no method is used.
    pub fn exact(mut self) -> Self {
        self.task.settings.exact = true;
        self
    }

    /// Not distances but travel times through a volume of speeds, which lies on a grid of its shape; that grid is then that of
    /// the times. Each voxel holds the speed F at which a front passes it, a length by a time, 0 where nothing passes, and
    /// `|grad T| = 1/F` is solved by [`Method::FMM`](crate::Method) or [`Method::FSM`](crate::Method). Times are infinite
    /// where no front comes, and labels are told along the ways of the fronts.
    pub fn speed<T: Sample + 'a>(mut self, speeds: impl BoxSource<T> + Send + 'a, grid: Geometry) -> Self {
        self.task.speeds = Some((Box::new(Image::new(speeds)), grid));
        self
    }

    run_setters!(task.run);

    /// Computes the distance, in single precision.
    ///
    /// # Errors
    /// When sources, grid or settings make no sense, what is needed does not fit the memory, the store cannot be written, or
    /// the run is cancelled.
    pub fn solve(self) -> Result<SolvedDistance<f32>> {
        self.solve_as()
    }

    /// Computes the distance, stored as `P`: `f32`, `f64` or `half::f16`.
    ///
    /// # Errors
    /// As [`DistanceField::solve`].
    pub fn solve_as<P: Precision>(self) -> Result<SolvedDistance<P>> {
        in_builders_words(self.solved())
    }

    fn solved<P: Precision>(&self) -> Result<SolvedDistance<P>> {
        let mut ready = self.task.ready::<P>()?;
        let Ready { sets, geometry, settings, resources, notes } = &mut ready;
        let writes = if self.task.run.store.is_some() { Writes::Fields } else { Writes::Nothing };
        let needs = settings.needs::<P>(geometry, sets, [resources.threads, 1], writes);
        let needs = needs.keeping::<P>(geometry, settings.keeps_sources());
        let speeds = self.task.speeds.as_ref().map(|(speeds, _)| speeds.as_ref() as &dyn VolumeSource);
        let needs = speeds.map_or(needs, |speeds| needs.reading(speeds, resources.threads));
        let engine = self.task.run.engine(resources, needs.held)?;
        self.task.run.check_disk(&self.task.disk::<P>((resources, geometry, settings), &needs, false)?, notes)?;
        let store = self.task.run.begin_store()?;
        let kept = Kept::new(&engine, geometry, settings.keeps_sources())?;
        let (to, kept_to) = (store.as_ref(), Some(&kept));
        let found = match speeds {
            Some(speeds) => travel_times(&engine, geometry, sets, (settings, speeds), to, kept_to)?,
            None => distance_kept(&engine, geometry, sets, settings, to, kept_to)?,
        };
        finish_store(&engine, store)?;
        Ok(SolvedDistance::new(ready, found, kept))
    }
}

/// A distance that was computed.
pub struct SolvedDistance<P: Precision> {
    geometry: Geometry,
    sets: DataSets,
    asked: Asked,
    found: DistanceFound,
    notes: Vec<String>,
    kept: Kept<P>,
}

/// What was asked for beside the distance.
struct Asked {
    labels: bool,
    closest_point: bool,
}

impl<P: Precision> SolvedDistance<P> {
    pub(super) fn new(ready: Ready, found: DistanceFound, kept: Kept<P>) -> Self {
        let Ready { sets, geometry, settings, notes, .. } = ready;
        let asked = Asked { labels: settings.labels, closest_point: settings.closest_point };
        Self { geometry, sets, asked, found, notes, kept }
    }

    /// The grid.
    #[must_use]
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// The largest distance, voxels of each label, and what else was counted.
    #[must_use]
    pub fn found(&self) -> &DistanceFound {
        &self.found
    }

    /// What should be known of the sources, one sentence each.
    #[must_use]
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// The distances, lengths; or times, through a volume of speeds.
    #[must_use]
    pub fn distance(&self) -> Field<'_, P> {
        Field::new(&self.geometry, &self.kept.values)
    }

    /// The label of the nearest data set of each voxel; 0 where none was reached.
    ///
    /// # Errors
    /// When labels were not asked for.
    pub fn labels(&self) -> Result<Field<'_, u32>> {
        let sources = self.sources(self.asked.labels, "labels")?;
        Ok(Field::new(&self.geometry, LabelsOf { sets: &self.sets, sources }))
    }

    /// The world positions at which the nearest sources of a box of voxels are closest, dense `[z][y][x]`; NaN where none was
    /// reached.
    ///
    /// # Errors
    /// When closest points were not asked for, the box reaches out of the grid, or what is stored cannot be read.
    pub fn closest_points(&self, part: &Box3) -> Result<Vec<[f64; 3]>> {
        let sources = self.sources(self.asked.closest_point, "closest_point")?;
        check_part(part, &self.geometry)?;
        let mut nearest = vec![NO_SOURCE; part.len()];
        sources.read_box(part, &mut nearest)?;
        let voxels = part.rows().flat_map(|(y, z)| (part.lo[0]..part.hi[0]).map(move |x| [x, y, z]));
        Ok(voxels.zip(nearest).map(|(voxel, source)| self.closest_point(voxel, source)).collect())
    }

    fn closest_point(&self, voxel: [i64; 3], source: u32) -> [f64; 3] {
        let (source, points) = (source as usize, &self.sets.positions);
        match points.get(source) {
            Some(point) => *point,
            None if source < self.sets.len() => {
                let triangle = Triangle::new(self.sets.mesh.corners(source - points.len()));
                triangle.closest_point(self.geometry.position(voxel))
            }
            None => [f64::NAN; 3],
        }
    }

    fn sources(&self, were_asked: bool, what: &str) -> Result<&BrickArray<u32>> {
        let sources = self.kept.sources.as_ref().filter(|_| were_asked);
        sources.ok_or_else(|| Error::usage(format!("`{what}` was not asked for before the distance was computed")))
    }
}

/// The labels of voxels by their sources.
struct LabelsOf<'a> {
    sets: &'a DataSets,
    sources: &'a BrickArray<u32>,
}

impl BoxSource<u32> for LabelsOf<'_> {
    fn shape(&self) -> [i64; 3] {
        self.sources.shape()
    }

    fn read_box(&self, part: &Box3, out: &mut [u32]) -> Result<()> {
        self.sources.read_box(part, out)?;
        let mut labels = Vec::new();
        source_labels::of_sources(self.sets, out, &mut labels);
        out.copy_from_slice(&labels);
        Ok(())
    }
}
