//! `strandline segment`: opens the inputs, says what it will take, runs, writes, tells what was found.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use super::args::SegmentArgs;
use super::config::{self, Resources};
use super::console::{Console, Voice};
use super::disk::Disk;
use super::files::{export_mesh, mesh_format, tell_of_anchor};
use super::input::{chosen_notes, crop_box, open_stack};
use super::marks::{Marks, Reading, look_at_marks, read_marks};
use super::outputs::{Outputs, numbered};
use super::report::{Found, Ran, Report, Settings, Solver, crop_xyz};
use super::text::{bytes, duration, grouped, number, place, triple};
use super::{picture, print, signals, table};
use crate::error::{Error, Result};
use crate::exec::{Budget, Cancel, Engine, Progress};
use crate::grid::{Box3, Geometry};
use crate::io::ome_zarr::StoreWriter;
use crate::io::stacks::Stack;
use crate::pipeline::marks::{split, split_and_seed};
use crate::pipeline::segment::{
    Estimate, Grids, Guides, ImageModel, LARGEST_WHOLE, ObjectReport, Outcome, Refused, SegmentSettings, check_lengths,
    check_seed, check_smoothing, estimate, segment,
};
use crate::store::Unfinished;

/// A segmentation that is ready to start: all inputs are open and checked.
pub(super) struct Job {
    /// How the image and its marks are called in messages and in the report.
    names: Names,
    typed: Vec<String>,
    args: SegmentArgs,
    settings: SegmentSettings,
    resources: Resources,
    stack: Box<dyn Stack>,
    /// The grid of the part that is segmented.
    geometry: Geometry,
    crop: Box3,
    marks: Marks,
    console: Arc<Console>,
    cancel: Cancel,
    started: Instant,
}

/// How the command and its inputs are called.
pub(super) struct Names {
    pub(super) command: &'static str,
    pub(super) image: String,
    pub(super) points: Vec<String>,
}

/// Runs the command.
pub(super) fn run(args: &SegmentArgs, typed: &[String]) -> Result<()> {
    let points = args.points.iter().map(|path| path.display().to_string()).collect();
    let names = Names { command: "segment", image: args.image.display().to_string(), points };
    let job = Job::new(names, args.clone(), typed, signals::cancel_on_signals()?)?;
    let estimate = job.estimate();
    if args.output.dry_run {
        job.print_plan(&estimate)?;
        return job.fits(&estimate).map(|_| ());
    }
    job.run(&estimate).map(|_| ())
}

impl Job {
    /// Understands what was typed and opens the inputs.
    pub(super) fn new(names: Names, args: SegmentArgs, typed: &[String], cancel: Cancel) -> Result<Self> {
        let started = Instant::now();
        let settings = config::settings(&args)?;
        let spacing = config::spacing("--image-spacing", args.picture.image_spacing)?;
        let output = &args.output;
        let outputs = Outputs {
            inputs: std::iter::once(&args.image).chain(&args.points).map(PathBuf::as_path).collect(),
            store: output.store(),
            files: [&output.report, &output.mesh, &output.picture]
                .into_iter()
                .flatten()
                .map(PathBuf::as_path)
                .collect(),
            overwrite: output.overwrite,
        };
        outputs.check()?;
        args.output.mesh.as_deref().map(mesh_format).transpose()?;
        args.output.picture.as_deref().map(picture::check_name).transpose()?;
        let resources = config::resources(&args.resources, args.output.store())?;
        let console = Arc::new(Console::new(Voice::of(args.output.quiet, args.output.verbose)));
        let picture = &args.picture;
        let select = picture.pages.select(picture.channel, picture.time, picture.level);
        let opened = open_stack(&args.image, select, spacing)?;
        let chosen = chosen_notes(&args.image, opened.stack.info(), select);
        opened.notes.iter().chain(&chosen).for_each(|note| console.note(note));
        let crop = crop_box(args.picture.crop, opened.geometry.shape)?;
        let reading = Reading { image: &opened.geometry, points_in: args.points_in, time: select.time };
        let marks = read_marks(&args.points, &reading, &console)?;
        let geometry = opened.geometry.crop(&crop);
        check_lengths(&settings, &geometry)?;
        let grids = Grids { whole: &opened.geometry, part: &geometry, guessed: opened.guessed };
        let several = look_at_marks(&marks, &grids, args.seed.len(), &console)?;
        if let Some(path) = args.output.mesh.as_deref().filter(|_| several) {
            let objects = split_and_seed(&marks.cloud, &args.seed);
            let meshes: Vec<PathBuf> = objects.iter().map(|object| numbered(path, object.object)).collect();
            let others = [&output.report, &output.picture].into_iter().flatten();
            let files = meshes.iter().chain(others).map(PathBuf::as_path).collect();
            Outputs { store: None, files, ..outputs }.check()?;
        }
        check_smoothing(&settings, &geometry)?;
        args.seed.iter().try_for_each(|seed| check_seed(seed, &geometry))?;
        let typed = typed.to_vec();
        let stack = opened.stack;
        Ok(Self { names, typed, args, settings, resources, stack, geometry, crop, marks, console, cancel, started })
    }

    fn guides(&self) -> Guides<'_> {
        Guides { geometry: &self.geometry, cloud: &self.marks.cloud, seeds: &self.args.seed }
    }

    /// What the run will take.
    pub(super) fn estimate(&self) -> Estimate {
        let guides = self.guides();
        let threads = self.resources.threads as u64;
        estimate(self.stack.as_ref(), &self.crop, &guides, &self.settings, threads, self.needs_store())
    }

    /// Fields are written out, or needed for what is drawn from them.
    fn needs_store(&self) -> bool {
        let output = &self.args.output;
        output.store().is_some() || output.mesh.is_some() || output.picture.is_some()
    }

    /// Refuses a run that cannot fit memory or disk.
    pub(super) fn fits(&self, estimate: &Estimate) -> Result<u64> {
        let window = Budget { total: self.resources.memory }.window(estimate.held)?;
        Disk {
            what: format!("an image with {} voxels near the marks", grouped(estimate.near_voxels)),
            scratch: &self.resources.scratch,
            needed: estimate.scratch.saturating_sub(window / 2),
            output: self.args.output.store().unwrap_or(&self.resources.scratch),
            written: estimate.output,
            coarser: "a part of the image with --crop; a spacing of the image that is wrong is put right with --image-spacing",
        }
        .check(&self.console)?;
        Ok(window)
    }

    /// Runs the segmentation and writes all that was asked for; returns what was found.
    pub(super) fn run(&self, estimate: &Estimate) -> Result<Outcome> {
        let window = self.fits(estimate)?;
        self.console.say(&format!(
            "{}: {}, about {}; memory up to {}, {} of temporary fields in {}",
            self.names.image,
            match self.marks.files.len() + self.args.seed.len() {
                1 => "1 object".into(),
                objects => format!("{objects} objects"),
            },
            duration(estimate.seconds),
            bytes(self.resources.memory),
            bytes(estimate.scratch),
            self.resources.scratch.display()
        ));
        if self.console.is_verbose() {
            self.describe().lines().for_each(|line| self.console.say(line));
        }
        let engine = self.resources.engine(window, &self.cancel, &self.console)?;
        engine.reserve(estimate.held)?;
        let result = self.solve_and_write(&engine);
        self.console.clear();
        let outcome = result?;
        if !self.args.output.quiet {
            print(&format!("{}\n{}", table::stages(&engine.reports()), table::objects(&outcome, &self.whole_in())))?;
        }
        match outcome.refused.as_slice() {
            [] => Ok(outcome),
            refused => Err(refusal(refused, outcome.objects.len(), &self.whole_in())),
        }
    }

    /// Where all objects are told.
    fn whole_in(&self) -> String {
        table::whole_in(self.args.output.store().is_some(), self.args.output.report.is_some(), "")
    }

    fn solve_and_write(&self, engine: &Engine) -> Result<Outcome> {
        let output = &self.args.output;
        // What is drawn from fields that nobody wants to keep needs them for a while all the same.
        let passing = tempfile::tempdir_in(&self.resources.scratch)
            .map_err(|e| Error::from_io("cannot make a folder for temporary fields", &e).at(&self.resources.scratch))?;
        let _passes = Unfinished::new(passing.path());
        let store = match output.store() {
            Some(path) => Some(StoreWriter::create(path, output.overwrite)?),
            None if self.needs_store() => Some(StoreWriter::create(&passing.path().join("passing.zarr"), false)?),
            None => None,
        };
        let outcome = segment(engine, self.stack.as_ref(), &self.crop, &self.guides(), &self.settings, store.as_ref())
            .map_err(|error| self.marks.named_in(error))?;
        self.tell(&outcome);
        tell_of_anchor(output.mesh.as_deref(), &self.geometry, &self.console);
        if let Some(store) = &store {
            if self.names.command == "demo" {
                picture::draw(store.folder(), self.centre(), &store.file("picture.png")?)?;
            }
            self.report(engine, &outcome).write(&store.file("report.json")?)?;
        }
        engine.check()?;
        // A failure from here on costs a copy, not the result.
        let folder = match (store, output.store()) {
            (Some(store), Some(path)) => {
                store.finish()?;
                path.to_path_buf()
            }
            (Some(store), None) => {
                store.finish()?;
                passing.path().join("passing.zarr")
            }
            (None, _) => PathBuf::new(),
        };
        self.write_copies(engine, &outcome, &folder)?;
        Ok(outcome)
    }

    /// Says what deserves a second look.
    fn tell(&self, outcome: &Outcome) {
        self.tell_rounded(outcome.extremes);
        for object in outcome.objects.iter().filter(|object| object.marks_off > 0) {
            let verb = if object.marks_off == 1 { "mark lies" } else { "marks lie" };
            let (label, off) = (object.label, object.marks_off);
            self.console.note(&format!("object {label}: {off} {verb} more than a voxel from the surface"));
        }
        for object in &outcome.objects {
            self.tell_odd(object, outcome.label_voxels.get(&object.label).copied().unwrap_or(0));
            if self.settings.cross_validate && object.cross_validation.is_none() {
                let label = object.label;
                self.console.note(&format!("object {label}: --cross-validate needs three outlines in parallel planes"));
            }
            let Some(found) = object.cross_validation else { continue };
            let next = found.next_slice.map_or(String::new(), |(axis, slice)| {
                format!("; the next outline helps most on slice {slice} across {}", ["x", "y", "z"][axis])
            });
            let (label, mean, p90) = (object.label, number(found.mean), number(found.p90));
            self.console.say(&format!(
                "object {label}: marks of an outline that is left out lie {mean} off in the mean, nine of ten within \
                 {p90}{next}"
            ));
        }
    }

    /// Says that grey values are not those of the file: 64-bit integers are read as doubles, which do not hold all of them.
    fn tell_rounded(&self, extremes: [f64; 2]) {
        let file_type = &self.stack.info().file_type;
        if ["int64", "uint64"].contains(&file_type.as_str()) && extremes.iter().any(|v| v.abs() >= LARGEST_WHOLE) {
            self.console.note(&format!(
                "{}: grey values of type {file_type} reach from {:.0} to {:.0}; those beyond 2^53 are rounded to doubles, which \
                 have 53 bits, in the output too",
                self.args.image.display(),
                extremes[0],
                extremes[1]
            ));
        }
    }

    /// What a good result would not show.
    fn tell_odd(&self, object: &ObjectReport, voxels: u64) {
        let (label, pieces) = (object.label, object.measures.components);
        if voxels == 0 {
            self.console.note(&format!("object {label}: all of its voxels went to others that lie where it does"));
        }
        if pieces > 1 {
            self.console.note(&format!("object {label}: its surface is in {pieces} pieces"));
        }
        if self.settings.image == ImageModel::Auto && self.settings.uses_image() && object.image_model == "none" {
            self.console.note(&format!(
                "object {label}: the image shows no border at its outlines, which alone decide; are they where they were \
                 drawn (--image-spacing, --channel, the order of x, y, z)?"
            ));
        }
    }

    /// The files beside the store.
    fn write_copies(&self, engine: &Engine, outcome: &Outcome, folder: &Path) -> Result<()> {
        let output = &self.args.output;
        if let Some(path) = &output.mesh {
            for object in &outcome.objects {
                let several = outcome.objects.len() + outcome.refused.len() > 1;
                let name = if several { format!("object-{}.ply", object.label) } else { "surface.ply".into() };
                let target = if several { numbered(path, object.label) } else { path.clone() };
                export_mesh(&folder.join("meshes").join(name), &self.geometry, &target)?;
            }
        }
        if let Some(path) = &output.picture {
            picture::draw(folder, self.centre(), path)?;
        }
        match &output.report {
            Some(path) => self.report(engine, outcome).write(path),
            None => Ok(()),
        }
    }

    /// The middle of all marks, kept inside the image.
    fn centre(&self) -> [f64; 3] {
        let seed = self.args.seed.first().map_or([0.0; 3], |seed| seed.centre);
        let (low, high) = self.marks.cloud.bounds().unwrap_or((seed, seed));
        std::array::from_fn(|a| 0.5 * (low[a] + high[a]))
    }

    fn report(&self, engine: &Engine, outcome: &Outcome) -> Report<Settings, Found> {
        let (picture, output) = (&self.args.picture, &self.args.output);
        let settings = Settings {
            image: self.names.image.clone(),
            points: self.names.points.clone(),
            seeds: self.args.seed.iter().map(|s| [s.centre[0], s.centre[1], s.centre[2], s.radius]).collect(),
            output: output.store().map(|path| path.display().to_string()),
            channel: picture.channel,
            axes: picture.pages.axes.map(|axes| axes.to_string()),
            image_index: picture.pages.image_index,
            time: picture.time,
            level: picture.level,
            crop_xyz: crop_xyz(&self.crop),
            image_type: outcome.element.name(),
            solver: Solver::new(&self.settings, &self.geometry),
            scratch: self.resources.scratch.display().to_string(),
        };
        let ran = Ran {
            command: self.names.command,
            typed: &self.typed,
            resources: &self.resources,
            console: &self.console,
            engine,
            ranks: engine.comm().ranks(),
            started: self.started,
        };
        Report::new(&ran, settings, &outcome.geometry, Found::new(outcome))
    }

    /// The image and its settings in a few lines.
    fn describe(&self) -> String {
        let (g, s) = (&self.geometry, &self.settings);
        let unit = g.unit.as_deref().map_or(String::new(), |unit| format!(" {unit}"));
        let [x, y, z] = g.shape;
        format!(
            "image {x} x {y} x {z} (x, y, z) {}, spacing {}{unit}, origin {}\n\
             theta {} rho {} delta {} k {} sigma {} beta {} tau {} epsilon {} omega {} brick {} threads {}",
            self.stack.element().name(),
            triple(g.spacing),
            place(g.origin, g.min_spacing()),
            number(s.motion.theta),
            s.rho.map_or("automatic".into(), number),
            number(s.motion.delta_on(g)),
            number(s.k),
            s.sigma.map_or("automatic".into(), number),
            s.beta.map_or("automatic".into(), number),
            number(s.motion.tau_on(g)),
            number(s.motion.epsilon_on(g)),
            number(s.motion.omega),
            s.brick,
            self.resources.threads
        )
    }

    fn print_plan(&self, estimate: &Estimate) -> Result<()> {
        let (mut lines, mut objects) = (vec![self.describe()], Vec::new());
        for object in split(&self.marks.cloud) {
            let points: usize = object.contours.iter().map(Vec::len).sum();
            let file = self.marks.files[&object.object].display();
            let contours = if object.drawn { format!(" on {} contours", object.contours.len()) } else { String::new() };
            objects.push(format!("object {}: {points} marks{contours}, {file}", object.object));
        }
        lines.extend(table::cut(objects, "objects", "(info FILE --json has them all)"));
        for (n, seed) in self.args.seed.iter().enumerate() {
            let at = place(seed.centre, 0.1 * seed.radius);
            lines.push(format!("seed {}: a ball of radius {} at {at}", n + 1, number(seed.radius)));
        }
        let (held, allowed) = (bytes(estimate.held), bytes(self.resources.memory));
        let (scratch, folder) = (bytes(estimate.scratch), self.resources.scratch.display());
        lines.push(format!("{} voxels near the marks", grouped(estimate.near_voxels)));
        lines.push(format!("memory: {held} must be held, {allowed} are allowed"));
        lines.push(format!("temporary fields: about {scratch} in {folder}"));
        if self.needs_store() {
            lines.push(format!("output: up to {} before compression", bytes(estimate.output)));
        }
        lines.push(format!("time: very roughly {}\n", duration(estimate.seconds)));
        print(&lines.join("\n"))
    }
}

/// A line for each object that could not be solved.
fn refusal(refused: &[Refused], solved: usize, whole_in: &str) -> Error {
    let all = refused.len() + solved;
    let reasons = refused.iter().map(|refused| refused.reason.clone()).collect();
    let reasons = table::cut(reasons, "objects", whole_in);
    Error::partly(format!("{} of {all} objects could not be solved: {}", refused.len(), reasons.join("\n")))
}

impl super::args::OutputArgs {
    /// The store's path, where there is to be one.
    pub(super) fn store(&self) -> Option<&Path> {
        self.output.path()
    }
}
