//! `Segmentation`: objects in a 3-D image, guided by border points that were marked on it.

use std::borrow::Cow;
use std::collections::BTreeMap;

use super::disk::Disk;
use super::field::Field;
use super::given::check_points;
use super::motion::motion_setters;
use super::run::{Run, finish_store, run_setters};
use super::volume::{Image, check_shape};
use super::words::in_builders_words;
use crate::error::{Error, Result};
use crate::exec::Engine;
use crate::grid::{Geometry, TriangleMesh};
use crate::pipeline::distance::Method;
use crate::pipeline::image::terms::Smoothing;
use crate::pipeline::laying::{check_grid, check_spacing};
use crate::pipeline::marks::{ObjectMarks, Seed};
use crate::pipeline::segment::{
    CheckedMarks, FillGaps, Grids, Guides, ImageModel, Kept, KeptObject, Outcome, Overlap, SegmentSettings, Start,
    check_all_marks, check_lengths, check_seed, check_smoothing, estimate, segment_kept,
};
use crate::pipeline::surface::{Isosurface, extract};
use crate::store::{BoxSource, MeshSink, Sample, VolumeSource};

/// Objects in a 3-D image, guided by border points that were marked on it.
///
/// ```
/// use strandline::{Geometry, Segmentation, Volume};
///
/// # fn main() -> strandline::Result<()> {
/// let away = |n: i64| ([n % 32, n / 32 % 32, n / 1024]).iter().map(|v| (v - 16).pow(2)).sum::<i64>();
/// let image: Vec<u8> = (0..32 * 32 * 32).map(|n| if away(n) <= 100 { 200 } else { 50 }).collect();
/// let image = Volume::new([32; 3], image)?;
/// let ring = |z: f64, r: f64| (0..24).map(|n| f64::from(n) / 24.0 * std::f64::consts::TAU)
///     .map(|a| [16.0 + r * a.cos(), 16.0 + r * a.sin(), z]).collect::<Vec<_>>();
/// let mut job = Segmentation::of(&image, Geometry::new([32; 3], [1.0; 3], [0.0; 3]));
/// for (z, r) in [(8.0, 6.0), (12.0, 9.2), (16.0, 10.0), (20.0, 9.2), (24.0, 6.0)] {
///     job = job.outline(1, ring(z, r));
/// }
/// let found = job.solve()?;
/// assert!((found.outcome().objects[0].measures.volume / 4189.0 - 1.0).abs() < 0.1);
/// # Ok(())
/// # }
/// ```
#[must_use]
pub struct Segmentation<'a> {
    image: Box<dyn VolumeSource + Send + 'a>,
    geometry: Geometry,
    marks: Vec<Mark<'a>>,
    settings: SegmentSettings,
    run: Run,
}

/// One call that marked an object.
struct Mark<'a> {
    object: u32,
    shape: MarkShape<'a>,
}

enum MarkShape<'a> {
    Outline(Cow<'a, [[f64; 3]]>),
    Points(Cow<'a, [[f64; 3]]>),
    Seed(Seed),
}

impl<'a> Segmentation<'a> {
    /// Objects of an image that lies on a grid of its shape; its voxels are `u8`, `u16`, `u32`, `f32` or `f64`.
    pub fn of<T: Sample>(image: impl BoxSource<T> + Send + 'a, grid: Geometry) -> Self {
        Self {
            image: Box::new(Image::<_, T>::new(image)),
            geometry: grid,
            marks: Vec::new(),
            settings: SegmentSettings::default(),
            run: Run::default(),
        }
    }

    /// Marks an object by an outline in a plane: world positions `[x, y, z]` in order, closed by themselves. Objects are
    /// numbered from 1 on; the number is the object's label.
    pub fn outline(self, object: u32, points: impl Into<Cow<'a, [[f64; 3]]>>) -> Self {
        self.mark(object, MarkShape::Outline(points.into()))
    }

    /// Marks an object by points on its border, all around and in no order; world positions `[x, y, z]`.
    pub fn points(self, object: u32, points: impl Into<Cow<'a, [[f64; 3]]>>) -> Self {
        self.mark(object, MarkShape::Points(points.into()))
    }

    /// Starts an object as a ball, with nothing marked; a world position and a length.
    pub fn seed(self, object: u32, centre: [f64; 3], radius: f64) -> Self {
        self.mark(object, MarkShape::Seed(Seed { centre, radius }))
    }

    fn mark(mut self, object: u32, shape: MarkShape<'a>) -> Self {
        self.marks.push(Mark { object, shape });
        self
    }

    /// What the image shows at the border of objects; found where this is left out.
    pub fn image(mut self, model: ImageModel) -> Self {
        self.settings.image = model;
        self
    }

    /// Where objects start; as the shape of their outlines where this is left out.
    pub fn start(mut self, start: Start) -> Self {
        self.settings.start = start;
        self
    }

    /// The distance method; the vector distance transform where this is left out.
    pub fn method(mut self, method: Method) -> Self {
        self.settings.method = method;
        self
    }

    /// Weight of the attraction to the marks; found for each object where this is left out.
    pub fn theta(mut self, theta: f64) -> Self {
        self.settings.theta = Some(theta);
        self.settings.motion.theta = theta;
        self
    }

    /// Weight of the image; found for each object where this is left out.
    pub fn rho(mut self, rho: f64) -> Self {
        self.settings.rho = Some(rho);
        self.settings.motion.rho = rho;
        self
    }

    /// Contrast parameter of the edge detector, for intensities from 0 to 1.
    pub fn k(mut self, k: f64) -> Self {
        self.settings.k = k;
        self
    }

    /// Form of the smoothing before edges are looked for.
    pub fn smoothing(mut self, smoothing: Smoothing) -> Self {
        self.settings.smoothing = smoothing;
        self
    }

    /// Width of the smoothing, a length.
    pub fn sigma(mut self, sigma: f64) -> Self {
        self.settings.sigma = Some(sigma);
        self
    }

    /// Distance of the start surface from the marks, a length; the start is then where a flood from outside ends.
    pub fn beta(mut self, beta: f64) -> Self {
        self.settings.beta = Some(beta);
        self
    }

    /// Leaves the ends of stacks of outlines open.
    pub fn no_caps(mut self) -> Self {
        self.settings.caps = false;
        self
    }

    /// Percentages of the image's values taken as black and white.
    pub fn percentiles(mut self, low: f64, high: f64) -> Self {
        self.settings.percentiles = [low, high];
        self
    }

    /// Which object a voxel belongs to where several overlap; the smaller one where this is left out.
    pub fn overlap(mut self, overlap: Overlap) -> Self {
        self.settings.overlap = overlap;
        self
    }

    /// Fills gaps between objects; they are left where this is left out.
    pub fn fill_gaps(mut self, width: FillGaps) -> Self {
        self.settings.fill_gaps = Some(width);
        self
    }

    /// Leaves out each outline in turn, and tells how far its marks then are.
    pub fn cross_validate(mut self) -> Self {
        self.settings.cross_validate = true;
        self
    }

    /// Edge of the bricks that hold the image, in voxels, a multiple of 16.
    pub fn brick(mut self, edge: i64) -> Self {
        self.settings.brick = edge;
        self
    }

    motion_setters!(settings.motion);
    run_setters!(run);

    /// Finds the objects.
    ///
    /// # Errors
    /// When image, marks or settings make no sense, no object can be solved, what is needed does not fit the memory, the
    /// store cannot be written, or the run is cancelled. Of several objects those that cannot be solved are told with the
    /// result.
    pub fn solve(self) -> Result<SolvedSegmentation> {
        in_builders_words(self.solved())
    }

    fn solved(&self) -> Result<SolvedSegmentation> {
        let settings = self.settings.together();
        settings.check()?;
        self.check_image(&settings)?;
        let mut notes = Vec::new();
        let CheckedMarks { fit, refused, first_error } = self.look(&mut notes)?;
        if let Some((_, error)) = first_error.filter(|_| fit.is_empty()) {
            return Err(error);
        }
        let guides = Guides { geometry: &self.geometry, objects: &fit, refused: &refused };
        let (image, resources) = (self.image.as_ref(), self.run.resources()?);
        let (whole, threads) = (self.geometry.domain(), resources.threads as u64);
        let needs = estimate(image, &whole, &guides, &settings, threads, self.run.store.is_some()).keeping();
        let engine = self.run.engine(&resources, needs.held)?;
        let coarser = "a part of the image, or a coarser one";
        let disk = Disk::of_image(&resources, self.run.store.as_deref(), &needs, coarser)?;
        self.run.check_disk(&disk, &mut notes)?;
        let store = self.run.begin_store()?;
        let (outcome, kept) = segment_kept(&engine, image, &guides, &settings, store.as_ref())?;
        finish_store(&engine, store)?;
        let kept = kept.ok_or_else(|| Error::failed("nothing was kept of the segmentation"))?;
        Ok(SolvedSegmentation { outcome, kept, engine, notes })
    }

    /// Refuses an image that does not fit its grid, or settings that do not fit the image.
    fn check_image(&self, settings: &SegmentSettings) -> Result<()> {
        check_shape(self.image.shape(), &self.geometry)?;
        check_grid(&self.geometry)?;
        check_spacing("the grid's spacing", Some(self.geometry.spacing))?;
        if self.geometry.shape.iter().any(|&n| n < 2) {
            return Err(Error::usage("the image has one voxel along an axis; give a stack of two slices or more"));
        }
        check_lengths(settings, &self.geometry)?;
        check_smoothing(settings, &self.geometry)
    }

    /// Looks at the marks of all objects.
    fn look(&self, notes: &mut Vec<String>) -> Result<CheckedMarks> {
        let (seeded, marked): (Vec<_>, Vec<_>) =
            objects_of(&self.marks)?.into_iter().partition(|object| object.seed.is_some());
        seeded.iter().filter_map(|object| object.seed.as_ref()).try_for_each(|s| check_seed(s, &self.geometry))?;
        let grids = Grids { whole: &self.geometry, part: &self.geometry, guessed: [false; 3] };
        let heard = std::cell::RefCell::new(Vec::new());
        let mut checked = check_all_marks(&marked, &grids, &[], &|text| heard.borrow_mut().push(text.to_owned()));
        heard.into_inner().iter().for_each(|text| self.run.note(notes, text));
        checked.fit.extend(seeded);
        Ok(checked)
    }
}

/// The marks of each object, in order of their numbers.
fn objects_of(marks: &[Mark<'_>]) -> Result<Vec<ObjectMarks>> {
    if marks.is_empty() {
        return Err(Error::usage("no object is marked; give outlines, points or a seed of one"));
    }
    let mut objects: BTreeMap<u32, ObjectMarks> = BTreeMap::new();
    for Mark { object, shape } in marks {
        let object = *object;
        if object == 0 {
            return Err(Error::usage("object 0 is what has no label; number objects from 1 on"));
        }
        let (points, drawn, seed) = match shape {
            MarkShape::Outline(points) => (Some(points), true, None),
            MarkShape::Points(points) => (Some(points), false, None),
            MarkShape::Seed(seed) => (None, false, Some(*seed)),
        };
        let fresh = || ObjectMarks { object, contours: Vec::new(), numbers: Vec::new(), drawn, seed };
        let is_new = !objects.contains_key(&object);
        let marks = objects.entry(object).or_insert_with(fresh);
        if !is_new && (marks.drawn != drawn || marks.seed.is_some() || seed.is_some()) {
            return Err(Error::usage(format!(
                "object {object} is marked in two ways; give it outlines, points, or one seed alone"
            )));
        }
        if let Some(points) = points {
            check_points(points).map_err(|error| error.reworded(|text| format!("a mark of object {object} {text}")))?;
            if drawn || is_new {
                marks.numbers.push(marks.contours.len() as i64 + i64::from(drawn));
                marks.contours.push(points.to_vec());
            } else {
                marks.contours[0].extend_from_slice(points);
            }
        }
    }
    Ok(objects.into_values().collect())
}

/// Objects that were found.
pub struct SolvedSegmentation {
    outcome: Outcome,
    kept: Kept,
    engine: Engine,
    notes: Vec<String>,
}

impl SolvedSegmentation {
    /// What was found of each object and of neighbours, and which objects could not be solved.
    #[must_use]
    pub fn outcome(&self) -> &Outcome {
        &self.outcome
    }

    /// The grid of the image.
    #[must_use]
    pub fn geometry(&self) -> &Geometry {
        &self.outcome.geometry
    }

    /// What should be known of the marks, one sentence each.
    #[must_use]
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// The label volume on the grid of the image; 0 is what has none.
    #[must_use]
    pub fn labels(&self) -> Field<'_, u32> {
        Field::new(&self.outcome.geometry, &self.kept.labels)
    }

    /// The segmentation function of an object, on a box of its own that may reach out of the image: 1 inside, 0 outside, the
    /// surface at 1/2.
    ///
    /// # Errors
    /// When no object of that number was solved.
    pub fn level_set(&self, object: u32) -> Result<Field<'_, f32>> {
        let KeptObject { geometry, u, .. } = self.object(object)?;
        Ok(Field::new(geometry, u))
    }

    /// The surface of an object.
    ///
    /// # Errors
    /// When no object of that number was solved, or the run is cancelled.
    pub fn mesh(&self, object: u32) -> Result<TriangleMesh> {
        let mut mesh = TriangleMesh::default();
        self.draw(object, &mut mesh)?;
        Ok(mesh)
    }

    /// Hands the surface of an object to `mesh` as it is drawn.
    ///
    /// # Errors
    /// When no object of that number was solved, the mesh is not taken, or the run is cancelled.
    pub fn draw(&self, object: u32, mesh: &mut dyn MeshSink) -> Result<()> {
        let KeptObject { geometry, u, .. } = self.object(object)?;
        let stage = self.engine.stage("surface", 0);
        extract(&stage, &Isosurface::of(u, geometry), mesh)?;
        stage.finish();
        Ok(())
    }

    fn object(&self, number: u32) -> Result<&KeptObject> {
        let found = self.kept.objects.iter().find(|object| object.label == number);
        found.ok_or_else(|| Error::usage(format!("there is no object {number} among those that were solved")))
    }
}
