//! `strandline segment`: opens the inputs, says what it will take, runs, writes, tells what was found.

mod notes;
mod plan;
mod series;
mod told;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use crate::cli::args::common::SegmentArgs;
use crate::cli::inputs::agreed::check_agreed;
use crate::cli::inputs::image::{OpenStack, chosen_notes, crop_box, open_stack};
use crate::cli::inputs::marks::{Objects, Reading, check_all_marks, read_marks};
use crate::cli::inputs::over_time::MarksAt;
use crate::cli::inputs::settings;
use crate::cli::outputs::checks::{Outputs, numbered};
use crate::cli::outputs::drawing::{ObjectFiles, ToFile};
use crate::cli::outputs::files::{mesh_format, note_anchor};
use crate::cli::outputs::store::{begin_store_on_ranks, join_store};
use crate::cli::outputs::survival::{finished_before, survivable, told_of_room};
use crate::cli::print;
use crate::cli::report::page::evidence::{Evidence, Measure, Root};
use crate::cli::report::page::written::{Written, with_page};
use crate::cli::report::ranks::{RankReport, gather_ranks};
use crate::cli::report::{picture, table};
use crate::cli::terminal::console::{Console, Voice};
use crate::cli::terminal::signals;
use crate::cli::terminal::text::{bytes, duration};
use crate::cli::terminal::world;
use crate::error::{Error, Result};
use crate::exec::{Cancel, Comm, Engine, Progress};
use crate::grid::{Box3, Geometry};
use crate::io::ome_zarr::StoreWriter;
use crate::io::stack::volume::Stack;
use crate::job::resources::Resources;
use crate::pipeline::segment::{
    Estimate, Grids, Guides, ObjectMeshes, Outcome, SegmentSettings, check_lengths, check_seed, check_smoothing, plan,
    segment,
};
use crate::store::HiddenFolder;
use crate::store::checkpoint::Identity;
use notes::refusal;

/// A segmentation that is ready to start: all inputs are open and checked.
pub(crate) struct Job {
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
    /// The marks, and where they are from where they are those of a series.
    marks: MarksAt,
    objects: Objects,
    console: Arc<Console>,
    cancel: Cancel,
    /// The ranks that run this job, each on its own objects.
    comm: Arc<dyn Comm>,
    started: Instant,
    /// The image's time, counted from 0.
    time: u32,
    /// What tells the run from others, where its inputs have been looked at before.
    identity: Option<Identity>,
    /// Whether the store gets a page of its report.
    has_page: bool,
    /// Whether what was found is printed at the end, and not with that of other times.
    prints: bool,
}

/// How the command and its inputs are called.
pub(crate) struct Names {
    pub(crate) command: &'static str,
    pub(crate) image: String,
    pub(crate) points: Vec<String>,
}

/// Runs the command.
pub(crate) fn run(args: &SegmentArgs, typed: &[String]) -> Result<()> {
    settings::check_ranks(args.ranks)?;
    if args.picture.time.one().is_none() {
        if world::number(args.ranks) > 1 {
            let what = "several times are solved by one rank; give one --time, or run the times as items of a batch";
            return Err(Error::usage(what));
        }
        return series::run(args, typed);
    }
    let mut args = args.clone();
    let files = [&args.output.report, &args.drawn.mesh, &args.drawn.picture].map(Clone::clone);
    if finished_before(&mut args.output, &files, typed)? {
        return Ok(());
    }
    if world::number(args.ranks) > 1 && args.drawn.picture.is_some() && args.output.store().is_none() {
        return Err(Error::usage(
            "a picture is drawn from a store, which several ranks write together; give -o OUT.zarr too",
        ));
    }
    let cancel = signals::cancel_on_signals()?;
    world::on_ranks(args.ranks, &args.points, |comm| run_rank(args.clone(), typed, cancel.clone(), comm))
}

/// Runs the command on one of the ranks.
fn run_rank(args: SegmentArgs, typed: &[String], cancel: Cancel, comm: Arc<dyn Comm>) -> Result<()> {
    let (names, dry_run) = (Names::of(&args), args.output.dry_run);
    let job = Job::new(names, args, typed, (cancel, comm))?;
    job.check_agreed()?;
    let estimate = job.estimate();
    if dry_run {
        if job.comm.rank() == 0 {
            job.print_plan(&estimate)?;
        }
        return job.fits(&estimate).map(drop);
    }
    job.run(&estimate).map(|_| ())
}

impl Names {
    /// Those of a segmentation.
    fn of(args: &SegmentArgs) -> Self {
        let points = args.points.iter().map(|path| path.display().to_string()).collect();
        Self { command: "segment", image: args.image.display().to_string(), points }
    }
}

/// Where a job's marks come from: they are read when its image is open.
type Marking<'a> = &'a mut dyn FnMut(&OpenStack, &Console) -> Result<MarksAt>;

impl Job {
    /// Understands what was typed and opens the inputs.
    pub(crate) fn new(
        names: Names,
        args: SegmentArgs,
        typed: &[String],
        (cancel, comm): (Cancel, Arc<dyn Comm>),
    ) -> Result<Self> {
        let console = Console::new(Voice::of_rank(comm.as_ref(), &args.output));
        let (points, points_in, time) = (args.points.clone(), args.points_in, args.picture.time.first());
        let mut marking = |opened: &OpenStack, console: &Console| {
            let reading = Reading { image: &opened.geometry, points_in, time: Some(time) };
            Ok(MarksAt { marks: read_marks(&points, &reading, console)?, origins: BTreeMap::new() })
        };
        Self::of_time(names, args, typed, (cancel, console, comm), time, &mut marking)
    }

    /// The same for a time of the image, with marks from somewhere.
    fn of_time(
        names: Names,
        args: SegmentArgs,
        typed: &[String],
        (cancel, console, comm): (Cancel, Console, Arc<dyn Comm>),
        time: u32,
        marking: Marking<'_>,
    ) -> Result<Self> {
        let started = Instant::now();
        let settings = settings::settings(&args)?;
        let spacing = settings::spacing("--image-spacing", args.picture.image_spacing)?;
        let output = &args.output;
        let outputs = Outputs {
            inputs: std::iter::once(&args.image).chain(&args.points).map(PathBuf::as_path).collect(),
            store: output.store(),
            files: [&output.report, &args.drawn.mesh, &args.drawn.picture]
                .into_iter()
                .flatten()
                .map(PathBuf::as_path)
                .collect(),
            overwrite: output.overwrite,
        };
        outputs.check()?;
        args.drawn.mesh.as_deref().map(mesh_format).transpose()?;
        args.drawn.picture.as_deref().map(picture::check_name).transpose()?;
        let resources = settings::resources_of_rank(&args.resources, args.output.store(), args.ranks)?;
        let console = Arc::new(console);
        let select = args.picture.volume.select_at(time);
        let opened = open_stack(&args.image, select, spacing)?;
        let mut notes = opened.notes.clone();
        notes.extend(chosen_notes(&args.image, opened.stack.info(), select));
        // Who asks for all times need not be told that there are several.
        notes.retain(|note| args.picture.time.one().is_some() || !note.contains("--time"));
        for note in &notes {
            console.note(note);
        }
        let crop = crop_box(args.picture.crop, opened.geometry.shape)?;
        let marks = marking(&opened, &console)?;
        let geometry = opened.geometry.crop(&crop);
        check_lengths(&settings, &geometry)?;
        let grids = Grids { whole: &opened.geometry, part: &geometry, guessed: opened.guessed };
        let objects = check_all_marks(&marks.marks, &grids, &args.seed, &console)?;
        let numbers = objects.numbers();
        if let Some(path) = args.drawn.mesh.as_deref().filter(|_| numbers.len() > 1) {
            let meshes: Vec<PathBuf> = numbers.iter().map(|&object| numbered(path, object)).collect();
            let others = [&output.report, &args.drawn.picture].into_iter().flatten();
            let files = meshes.iter().chain(others).map(PathBuf::as_path).collect();
            Outputs { store: None, files, ..outputs }.check()?;
        }
        check_smoothing(&settings, &geometry)?;
        args.seed.iter().try_for_each(|seed| check_seed(seed, &geometry))?;
        let typed = typed.to_vec();
        let stack = opened.stack;
        Ok(Self {
            names,
            typed,
            args,
            settings,
            resources,
            stack,
            geometry,
            crop,
            marks,
            objects,
            console,
            cancel,
            comm,
            started,
            time,
            identity: None,
            has_page: true,
            prints: true,
        })
    }

    /// Refuses ranks that were given something else.
    fn check_agreed(&self) -> Result<()> {
        let (info, output) = (self.stack.info(), &self.args.output);
        let written = (output.store(), output.live, output.dry_run, output.ome, output.compress);
        let of_image = (&self.geometry, &self.crop, self.stack.shape(), self.stack.element().name(), &info.file_type);
        let numbers = (self.objects.numbers(), &self.args.seed);
        check_agreed(
            self.comm.as_ref(),
            &format!("{of_image:?} {numbers:?} {:?} {written:?}", self.settings),
            &self.marks_by_label(),
        )
    }

    fn guides(&self) -> Guides<'_> {
        Guides { geometry: &self.geometry, objects: &self.objects.fit, refused: &self.objects.refused }
    }

    /// Fields are written out, or needed for a picture of them.
    fn needs_store(&self) -> bool {
        self.args.output.store().is_some() || self.args.drawn.picture.is_some()
    }

    /// Runs the segmentation and writes all that was asked for; returns what was found.
    pub(crate) fn run(&self, estimate: &Estimate) -> Result<Outcome> {
        let most = self.fits(estimate)?;
        let tell = |line: &str| {
            if self.prints {
                self.console.say(line);
            }
        };
        tell(&format!(
            "{}: {}, about {}; memory up to {}, {} of temporary fields in {}",
            self.names.image,
            match self.objects.numbers().len() {
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
        let engine = self.resources.engine(&self.cancel, self.console.clone())?.as_rank(self.comm.clone());
        let asked = (&self.args.output, self.typed.as_slice());
        let engine = survivable(engine, asked, self.identity.as_ref(), self.console.as_ref())?;
        let (voxels, threads, writes) = (self.crop.volume(), self.resources.threads, self.needs_store());
        engine.outlook().expect(with_page(
            plan(estimate, &self.guides(), self.comm.as_ref(), (voxels, threads, writes)),
            self.has_page && self.args.output.store().is_some(),
        ));
        let result = self.solve_and_write(&engine);
        self.console.clear();
        engine.settle_save_points(&result);
        let outcome = told_of_room(result, most, &self.args.output)?;
        if self.comm.rank() > 0 {
            return Ok(outcome);
        }
        if self.prints && !self.args.output.quiet {
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
        let passing = HiddenFolder::create(&self.resources.scratch)
            .map_err(|e| Error::from_io("cannot make a folder for temporary fields", &e).at(&self.resources.scratch))?;
        let (store, telling) = begin_store_on_ranks(output, engine)?;
        let store = match store {
            None if self.needs_store() => Some(StoreWriter::create(&passing.path().join("passing.zarr"), false)?),
            store => store,
        };
        let meshes = self.mesh_files(engine);
        let taken = meshes.as_ref().map(|meshes| meshes as &dyn ObjectMeshes);
        let out = (store.as_ref(), taken);
        let outcome = segment(engine, self.stack.as_ref(), &self.crop, &self.guides(), &self.settings, out)
            .map_err(|error| self.marks.marks.named_in(error))?;
        let ranks = gather_ranks(engine)?;
        let store = join_store(store, engine)?;
        if self.comm.rank() > 0 {
            meshes.map_or(Ok(()), ObjectFiles::place)?;
            return Ok(outcome);
        }
        self.note_findings(&outcome);
        note_anchor(self.args.drawn.mesh.as_deref(), &self.geometry, &self.console);
        if let Some(store) = &store {
            if self.names.command == "demo" {
                picture::draw(store.folder(), self.centre(), &store.file("picture.png")?, true)?;
            }
            let sources = self.marks_by_label();
            let evidence = Evidence {
                root: Root::Image,
                measure: Measure::ToMarks,
                sources: &sources,
                centre: self.centre(),
                points: "marks",
            };
            let written = Written { store, engine, console: self.console.as_ref() };
            if self.has_page {
                written.write(&evidence, || self.report(engine, &ranks, &outcome))?;
            } else {
                self.report(engine, &ranks, &outcome).write(&store.file("report.json")?, true)?;
            }
        }
        engine.check()?;
        drop(telling);
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
        meshes.map_or(Ok(()), ObjectFiles::place)?;
        self.write_copies(engine, (&ranks, &outcome), &folder)?;
        Ok(outcome)
    }

    /// The files that surfaces are drawn into, where they were asked for.
    fn mesh_files<'a>(&'a self, engine: &'a Engine) -> Option<ObjectFiles<'a>> {
        let path = self.args.drawn.mesh.as_deref()?;
        let (scratch, output) = (self.resources.scratch.as_path(), &self.args.output);
        let (is_copy, replace) = (output.store().is_some(), output.overwrite);
        let to = ToFile { path, scratch, is_tagged: false, is_copy, replace, values: None };
        let marks = (engine, self.objects.fit.as_slice());
        Some(ObjectFiles::new(to, self.objects.numbers().len() > 1, &self.geometry, marks))
    }

    /// The picture and the report beside the store.
    fn write_copies(&self, engine: &Engine, (ranks, outcome): (&[RankReport], &Outcome), folder: &Path) -> Result<()> {
        if let Some(path) = &self.args.drawn.picture {
            picture::draw(folder, self.centre(), path, self.args.output.overwrite)?;
        }
        match &self.args.output.report {
            Some(path) => self.report(engine, ranks, outcome).write(path, self.args.output.overwrite),
            None => Ok(()),
        }
    }

    /// The middle of all marks, kept inside the image.
    fn centre(&self) -> [f64; 3] {
        let seed = self.args.seed.first().map_or([0.0; 3], |seed| seed.centre);
        let (low, high) = self.marks.marks.cloud.bounds().unwrap_or((seed, seed));
        std::array::from_fn(|a| 0.5 * (low[a] + high[a]))
    }
}
