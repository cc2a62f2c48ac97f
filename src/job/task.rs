//! What `DistanceField` and `MiddleSurface` have in common: sources, the grid, the method, and how it is run.

use super::disk::Disk;
use super::given::{Gathered, Given};
use super::resources::Resources;
use super::run::Run;
use super::volume::{PlacedLabels, check_shape};
use crate::error::{Error, Result};
use crate::grid::{DataSets, Geometry};
use crate::kernel::distance::state::neighbours::Neighbours;
use crate::kernel::distance::state::precision::Precision;
use crate::pipeline::distance::{DistanceSettings, Init, Method, Needs, Schedule, check_timed_sources, outside_note};
use crate::pipeline::laying::{around, check_grid, check_spacing};
use crate::store::VolumeSource;

/// What was said so far.
pub(super) struct Task<'a> {
    pub(super) given: Vec<Given<'a>>,
    pub(super) grid: Option<Geometry>,
    pub(super) spacing: Option<[f64; 3]>,
    pub(super) padding: Option<f64>,
    pub(super) brick: Option<i64>,
    pub(super) method: Option<Method>,
    /// What fronts go through, on its grid, where times are asked for.
    pub(super) speeds: Option<(Box<dyn VolumeSource + Send + 'a>, Geometry)>,
    pub(super) settings: DistanceSettings,
    pub(super) run: Run,
}

/// What is solved: sources on a grid.
pub(super) struct Ready {
    pub(super) sets: DataSets,
    pub(super) geometry: Geometry,
    pub(super) settings: DistanceSettings,
    pub(super) resources: Resources,
    pub(super) notes: Vec<String>,
}

impl Default for Task<'_> {
    fn default() -> Self {
        let method = Method::VDT;
        Self {
            given: Vec::new(),
            grid: None,
            spacing: None,
            padding: None,
            brick: None,
            method: None,
            speeds: None,
            settings: DistanceSettings {
                method,
                schedule: Schedule::Front,
                neighbours: Neighbours::Faces,
                init: Init::Cell,
                farthest: None,
                signed: false,
                labels: false,
                closest_point: false,
                brick: method.solver::<f32>().brick,
                exact: false,
                timed: false,
            },
            run: Run::default(),
        }
    }
}

impl Task<'_> {
    /// Checks everything, and lays the grid.
    pub(super) fn ready<P: Precision>(&self) -> Result<Ready> {
        let mut settings = self.settings;
        settings.timed = self.speeds.is_some();
        settings.method = self.method.unwrap_or(if settings.timed { Method::FMM } else { settings.method });
        settings.brick = self.brick.unwrap_or(settings.method.solver::<f32>().brick);
        settings.check()?;
        let resources = self.run.resources()?;
        self.check_grid()?;
        let mut notes = Vec::new();
        let note = |text: &str| self.run.note(&mut notes, text);
        let Gathered { sets, volume } = Gathered::new(&self.given, settings.signed, &self.run.cancel, note)?;
        let geometry = self.lay(&sets, volume)?;
        if let Some(text) = outside_note(&geometry, &sets, settings.timed) {
            self.run.note(&mut notes, &text);
        }
        check_timed_sources(&settings, &sets)?;
        if self.brick.is_none() {
            settings.brick = settings.brick_for(geometry.shape);
        }
        settings.check_on::<P>(&geometry, &sets)?;
        Ok(Ready { sets, geometry, settings, resources, notes })
    }

    /// What a run puts on disks.
    pub(super) fn disk<'d, P: Precision>(
        &'d self,
        (resources, geometry, settings): (&'d Resources, &Geometry, &DistanceSettings),
        needs: &Needs,
        is_middle: bool,
    ) -> Result<Disk<'d>> {
        let store = self.run.store.as_deref();
        let written = if store.is_some() { settings.written::<P>(geometry, is_middle) } else { 0 };
        Disk::of_grid(resources, store, geometry, needs, written)
    }

    /// The label volume that was given, where it alone was.
    pub(super) fn sole_volume(&self) -> Option<PlacedLabels<'_>> {
        match self.given.as_slice() {
            [Given::Volume(source, geometry)] => Some(PlacedLabels { source: source.as_ref(), geometry }),
            _ => None,
        }
    }

    fn check_grid(&self) -> Result<()> {
        check_spacing("--spacing", self.spacing)?;
        if let Some((speeds, grid)) = &self.speeds {
            if self.grid.is_some() || self.spacing.is_some() || self.padding.is_some() {
                return Err(Error::usage(
                    "--speed gives the grid of the times; leave out --grid, --spacing and --padding",
                ));
            }
            check_shape(speeds.shape(), grid)?;
            check_grid(grid)?;
            return check_spacing("the grid's spacing", Some(grid.spacing));
        }
        let Some(grid) = &self.grid else { return Ok(()) };
        if self.spacing.is_some() || self.padding.is_some() {
            return Err(Error::usage("--grid says all of the grid; leave out --spacing and --padding"));
        }
        check_grid(grid)?;
        check_spacing("the grid's spacing", Some(grid.spacing))
    }

    /// The grid that was given, that of a label volume, or one around the sources.
    fn lay(&self, sets: &DataSets, volume: Option<Geometry>) -> Result<Geometry> {
        if let Some((_, grid)) = &self.speeds {
            return Ok(grid.clone());
        }
        let volume = volume.filter(|_| self.spacing.is_none() && self.padding.is_none());
        if let Some(grid) = self.grid.clone().or(volume) {
            return Ok(grid);
        }
        let (low, high) = sets.bounds().ok_or_else(|| Error::input("the sources span no box"))?;
        around([low, high], self.spacing, self.padding)
    }
}

/// The functions of a builder that take sources and say how the distance to them is computed.
macro_rules! task_setters {
    () => {
        /// Adds points as a data set, with the next label; world positions `[x, y, z]`.
        pub fn points(mut self, points: impl Into<std::borrow::Cow<'a, [[f64; 3]]>>) -> Self {
            self.task.given.push($crate::job::given::Given::Points(None, points.into()));
            self
        }

        /// Adds points as the data set of a label; labels ascend from one data set to the next.
        pub fn labelled(mut self, label: u32, points: impl Into<std::borrow::Cow<'a, [[f64; 3]]>>) -> Self {
            self.task.given.push($crate::job::given::Given::Points(Some(label), points.into()));
            self
        }

        /// Adds a triangle mesh as a data set, with the next label.
        pub fn mesh(mut self, mesh: impl Into<std::borrow::Cow<'a, $crate::grid::TriangleMesh>>) -> Self {
            self.task.given.push($crate::job::given::Given::Mesh(mesh.into()));
            self
        }

        /// Adds each label of a volume as a data set: the centres of the voxels that border on another label. Label n of it is
        /// label n more than the last before it; 0 is what has none. The volume lies on a grid of its shape.
        pub fn label_volume(
            mut self,
            volume: impl $crate::store::BoxSource<u32> + Send + 'a,
            grid: $crate::grid::Geometry,
        ) -> Self {
            self.task.given.push($crate::job::given::Given::Volume(Box::new(volume), grid));
            self
        }

        /// The grid; where this is left out, that of the first label volume, or one around all sources.
        pub fn grid(mut self, grid: $crate::grid::Geometry) -> Self {
            self.task.grid = Some(grid);
            self
        }

        /// Distance between voxels of a grid around the sources, along x, y and z; where this is left out, a 256th of its
        /// longest side.
        pub fn spacing(mut self, spacing: [f64; 3]) -> Self {
            self.task.spacing = Some(spacing);
            self
        }

        /// Room between the sources and the border of a grid around them, a length; where this is left out, a sixth of their
        /// largest extent.
        pub fn padding(mut self, padding: f64) -> Self {
            self.task.padding = Some(padding);
            self
        }

        /// The method; where this is left out the vector distance transform, or fast marching through a volume of speeds.
        pub fn method(mut self, method: $crate::pipeline::distance::Method) -> Self {
            self.task.method = Some(method);
            self
        }

        /// The order in which bricks are computed; as distance reaches them where this is left out.
        pub fn schedule(mut self, schedule: $crate::pipeline::distance::Schedule) -> Self {
            self.task.settings.schedule = schedule;
            self
        }

        /// The neighbours whose sources a voxel is offered, with the methods VDT and DP; those across its faces where this is
        /// left out.
        pub fn neighbours(mut self, neighbours: $crate::kernel::distance::state::neighbours::Neighbours) -> Self {
            self.task.settings.neighbours = neighbours;
            self
        }

        /// The voxels that points fix; the corners of their cells where this is left out.
        pub fn init(mut self, init: $crate::pipeline::distance::Init) -> Self {
            self.task.settings.init = init;
            self
        }

        /// Edge of the bricks that the grid is cut into, in voxels, a multiple of 16; where this is left out, what is fastest.
        pub fn brick(mut self, edge: i64) -> Self {
            self.task.brick = Some(edge);
            self
        }

        /// Also tells where the nearest source of each voxel is closest.
        pub fn closest_point(mut self) -> Self {
            self.task.settings.closest_point = true;
            self
        }
    };
}

pub(super) use task_setters;
