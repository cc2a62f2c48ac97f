//! `--time all|A:B`: the times of an image one after the other, each a run of its own, joined to one store and one report.
//!
//! Each time is written as a store of its own, in the folder of the run's checkpoints, where those of the time that is solved lie
//! beside it: what is whole there is not made again by `--resume`.

mod joined;
mod plan;
mod work;

use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use super::{Job, Names};
use crate::cli::args::common::SegmentArgs;
use crate::cli::args::survive::Checkpoint;
use crate::cli::args::values::Output;
use crate::cli::inputs::image::{OpenStack, crop_box, open_stack};
use crate::cli::inputs::marks::Reading;
use crate::cli::inputs::over_time::{MarksAt, MarksOverTime};
use crate::cli::inputs::settings;
use crate::cli::outputs::checks::{Outputs, numbered, of_time};
use crate::cli::outputs::survival::finished_before;
use crate::cli::print;
use crate::cli::report::series::TimeReport;
use crate::cli::report::table;
use crate::cli::terminal::console::{Console, Voice};
use crate::cli::terminal::signals;
use crate::error::{Error, ErrorKind, Result};
use crate::exec::{Cancel, Progress, SelfComm};
use crate::grid::Geometry;
use crate::io::ome_zarr::{StoreWriter, TimeAxis};
use crate::io::stack::formats;
use crate::pipeline::image::follow::Follower;
use crate::pipeline::segment::image_alone;
use crate::store::VolumeSource;
use work::Work;

/// Runs the command.
pub(super) fn run(args: &SegmentArgs, typed: &[String]) -> Result<()> {
    let mut args = args.clone();
    let is_kept = args.output.store().is_some();
    if !is_kept && args.output.survive.resume {
        return Err(Error::usage(
            "--resume of several times goes on from the stores of those that are done; give -o OUT.zarr",
        ));
    }
    let files = [args.output.report.clone()];
    if finished_before(&mut args.output, &files, typed)? {
        return Ok(());
    }
    let series = Series::new(args, typed, signals::cancel_on_signals()?)?;
    if series.args.output.dry_run { series.print_plan() } else { series.run() }
}

/// A series that is ready to start.
struct Series<'a> {
    args: SegmentArgs,
    typed: &'a [String],
    times: Range<u32>,
    axis: TimeAxis,
    /// The grid of the image.
    geometry: Geometry,
    marks: MarksOverTime,
    console: Console,
    cancel: Cancel,
    started: Instant,
}

impl<'a> Series<'a> {
    fn new(args: SegmentArgs, typed: &'a [String], cancel: Cancel) -> Result<Self> {
        let started = Instant::now();
        settings::settings(&args)?;
        let spacing = settings::spacing("--image-spacing", args.picture.image_spacing)?;
        let store_and_report = Outputs {
            inputs: std::iter::once(&args.image).chain(&args.points).map(PathBuf::as_path).collect(),
            store: args.output.store(),
            files: args.output.report.iter().map(PathBuf::as_path).collect(),
            overwrite: args.output.overwrite,
        };
        store_and_report.check()?;
        let console = Console::new(Voice::of_run(&args.output));
        let opened = open_stack(&args.image, args.picture.volume.select_at(0), spacing)?;
        let info = opened.stack.info();
        let times = args.picture.time.of(info.times).map_err(|error| error.at(&args.image))?;
        if info.times == 1 {
            console
                .note(&format!("{}: has one time; the store has an axis of time all the same", args.image.display()));
        }
        let reading = Reading { image: &opened.geometry, points_in: args.points_in, time: None };
        let marks = MarksOverTime::read(&args.points, &reading, (&times, info.times), &console)?;
        let (step, unit) = info.interval.clone().map_or((1.0, None), |interval| (interval.step, Some(interval.unit)));
        let axis = TimeAxis { first: f64::from(times.start) * step, step, unit };
        let geometry = opened.geometry;
        Ok(Self { args, typed, times, axis, geometry, marks, console, cancel, started })
    }

    /// The job of a time.
    fn job(
        &self,
        args: SegmentArgs,
        time: u32,
        said: Vec<String>,
        marking: &mut dyn FnMut(&Console) -> Result<MarksAt>,
    ) -> Result<Job> {
        let console = Console::after(Voice::of_run(&args.output), said);
        let names = Names::of(&args);
        let mut marking = |_: &OpenStack, console: &Console| marking(console);
        let job = Job::of_time(
            names,
            args,
            self.typed,
            (self.cancel.clone(), console, Arc::new(SelfComm)),
            time,
            &mut marking,
        )?;
        Ok(Job { prints: false, ..job })
    }

    /// A job for each set of marks that times are made from, where nothing moved, and for how many times.
    fn plans(&self) -> Result<Vec<(Job, u32)>> {
        let (mut plans, mut refused, mut before) = (Vec::new(), None, None);
        let mut args = self.args.clone();
        args.output.quiet = true;
        (args.drawn.mesh, args.drawn.picture, args.output.report) = (None, None, None);
        for time in self.times.clone() {
            let origins = self.marks.origins(time);
            if before.as_ref() == Some(&origins) {
                plans.last_mut().into_iter().for_each(|(_, count): &mut (Job, u32)| *count += 1);
                continue;
            }
            before = Some(origins);
            match self.job(args.clone(), time, Vec::new(), &mut |_| Ok(self.marks.unmoved(time))) {
                Ok(job) => plans.push((job, 1)),
                Err(error) if error.kind() == ErrorKind::Input => {
                    refused.get_or_insert(error);
                    before = None;
                }
                Err(error) => return Err(error),
            }
        }
        match refused {
            Some(error) if plans.is_empty() => Err(error),
            _ => Ok(plans),
        }
    }

    fn run(self) -> Result<()> {
        self.fits(&self.plans()?)?;
        let work = Work::begin(&self.args, self.typed, &self.console)?;
        let result = self.run_in(&work);
        work.settle(&result, &self.console, self.times.clone());
        result
    }

    fn run_in(&self, work: &Work) -> Result<()> {
        self.check_files(work)?;
        let output = &self.args.output;
        let create = if output.live { StoreWriter::create_live_as } else { StoreWriter::create_as };
        let begin = |path| -> Result<StoreWriter> {
            Ok(create(output.ome.into(), path, output.overwrite)?.packed(output.compress.into()))
        };
        let store = output.store().map(begin).transpose()?;
        let done = self.solve_all(work, store.as_ref())?;
        self.cancel.check()?;
        let refused = refusals(&done, &self.whole_in());
        self.finish(work, store, &done)?;
        refused.map_or(Ok(()), Err)
    }

    /// Solves all times that are not done, one after the other; each is joined to the store when it is.
    fn solve_all(&self, work: &Work, store: Option<&StoreWriter>) -> Result<Vec<TimeReport>> {
        let opens = |time: u32| -> Result<Box<dyn VolumeSource>> {
            Ok(formats::open_stack(&self.args.image, self.args.picture.volume.select_at(time))?)
        };
        let mut follower = Follower::new(&opens);
        let (mut done, mut said, mut first_error) = (Vec::new(), self.console.notes(), None);
        let is_done = |report: TimeReport, done: &mut Vec<TimeReport>| -> Result<()> {
            store.map_or(Ok(()), |store| self.join(work, store, &report))?;
            done.push(report);
            Ok(())
        };
        for time in self.times.clone() {
            self.cancel.check()?;
            if let Some(report) = work.done(time, &self.files_of(time)) {
                is_done(TimeReport::solved(time, report), &mut done)?;
                continue;
            }
            let (n, all) = (time - self.times.start + 1, self.times.len());
            self.console.say(&format!("time {time} ({n} of {all})"));
            let mut moved = None;
            let mut marking = |console: &Console| {
                let marks = self.marks.at(time, &self.geometry, &mut follower, console)?;
                moved = Some(marks.origins.clone());
                Ok(marks)
            };
            let job = self.job(self.args_of(time, work), time, said.clone(), &mut marking);
            let ran = job.and_then(|job| {
                let job = Job { identity: work.identity().cloned(), has_page: self.has_page(time), ..job };
                let ran = job.run(&job.estimate());
                let more: Vec<String> = job.console.notes().into_iter().filter(|note| !said.contains(note)).collect();
                said.extend(more);
                ran.map(drop)
            });
            match ran {
                Err(error) if matches!(error.kind(), ErrorKind::Input | ErrorKind::Vanished) => {
                    self.console.note(&format!("time {time}: nothing of it could be solved: {error}"));
                    self.keep_image(time, work)?;
                    let asked = self.marks.asked(time, self.args.seed.len(), moved.as_ref());
                    let report = TimeReport { time, report: None, reason: Some(error.to_string()), asked };
                    is_done(report, &mut done)?;
                    first_error.get_or_insert(error);
                    continue;
                }
                Err(error) if error.kind() != ErrorKind::Partly => return Err(error),
                _ => {}
            }
            is_done(TimeReport::solved(time, work.report(time)?), &mut done)?;
        }
        match first_error {
            Some(error) if done.iter().all(|time| time.report.is_none()) => Err(error),
            _ => Ok(done),
        }
    }

    /// Writes the image of a time of which nothing could be solved, so that the store has it; where that cannot be, it has none.
    fn keep_image(&self, time: u32, work: &Work) -> Result<()> {
        let output = &self.args.output;
        if output.store().is_none() {
            return Ok(());
        }
        let write = || -> Result<()> {
            let settings = settings::settings(&self.args)?;
            let resources = settings::resources(&self.args.resources, output.store())?;
            let stack = formats::open_stack(&self.args.image, self.args.picture.volume.select_at(time))?;
            let crop = crop_box(self.args.picture.crop, self.geometry.shape)?;
            let engine = resources.engine(&self.cancel, Arc::new(Console::new(Voice::Quiet)))?;
            let store =
                StoreWriter::create_as(output.ome.into(), &work.store(time), true)?.packed(output.compress.into());
            image_alone(&engine, stack.as_ref(), &crop, &self.geometry.crop(&crop), &settings, &store)?;
            engine.check()?;
            store.finish()
        };
        match write() {
            Err(error) if matches!(error.kind(), ErrorKind::Interrupted { .. }) => Err(error),
            Err(error) => {
                self.console.note(&format!("time {time}: its image is left out of the store: {error}"));
                Ok(())
            }
            Ok(()) => Ok(()),
        }
    }

    /// Whether a time has a page of its own: the first, the middle and the last one, as pictures take longer than small objects.
    fn has_page(&self, time: u32) -> bool {
        let Range { start, end } = self.times;
        [start, start + (end - start) / 2, end - 1].contains(&time)
    }

    /// What was typed, as the run of one time takes it.
    fn args_of(&self, time: u32, work: &Work) -> SegmentArgs {
        let mut args = self.args.clone();
        (args.drawn.mesh, args.drawn.picture) =
            (args.drawn.mesh.map(|path| of_time(&path, time)), args.drawn.picture.map(|path| of_time(&path, time)));
        let output = &mut args.output;
        if output.store().is_some() {
            let store = work.store(time);
            // A time whose store is whole is run again only where a file beside it is missing.
            output.overwrite |= store.exists();
            output.survive.resume = work.has_checkpoint(time);
            if output.survive.checkpoint != Some(Checkpoint::Off) {
                output.survive.checkpoint = None;
            }
            (output.output, output.report, output.live) = (Output::Store(store), None, false);
        } else {
            (output.report, output.survive.checkpoint) = (Some(work.report_file(time)), Some(Checkpoint::Off));
        }
        args
    }

    /// The files beside the store that a time writes.
    fn files_of(&self, time: u32) -> Vec<PathBuf> {
        let (meshes, objects) = (self.args.drawn.mesh.as_deref(), self.marks.objects(self.args.seed.len()));
        let mesh = meshes.map(|path| of_time(path, time));
        let meshes = mesh.into_iter().flat_map(|path| match objects.as_slice() {
            [_] => vec![path],
            several => several.iter().map(|&object| numbered(&path, object)).collect(),
        });
        meshes.chain(self.args.drawn.picture.as_deref().map(|path| of_time(path, time))).collect()
    }

    /// Checks the files of all times that are to be run before the first one is.
    fn check_files(&self, work: &Work) -> Result<()> {
        let due = self.times.clone().filter(|&time| work.done(time, &self.files_of(time)).is_none());
        let files: Vec<PathBuf> =
            due.filter(|&time| !work.store(time).exists()).flat_map(|time| self.files_of(time)).collect();
        Outputs {
            inputs: std::iter::once(&self.args.image).chain(&self.args.points).map(PathBuf::as_path).collect(),
            store: None,
            files: files.iter().map(PathBuf::as_path).collect(),
            overwrite: self.args.output.overwrite,
        }
        .check()
    }

    /// Where all that was found is told.
    fn whole_in(&self) -> String {
        let output = &self.args.output;
        table::whole_in(output.store().is_some(), output.report.is_some(), "volumes.csv")
    }

    /// Prints, where anything is.
    fn print(&self, text: &str) -> Result<()> {
        if self.args.output.quiet { Ok(()) } else { print(text) }
    }
}

/// What to say where objects or whole times were refused.
fn refusals(times: &[TimeReport], whole_in: &str) -> Option<Error> {
    let rows: Vec<_> = times.iter().flat_map(TimeReport::rows).collect();
    let mut reasons: Vec<String> = rows
        .iter()
        .filter_map(|row| row.reason.as_ref().map(|reason| format!("time {}: {reason}", row.time)))
        .collect();
    let refused = reasons.len();
    // Of a time of which nothing could be solved all objects have the same.
    reasons.dedup();
    (refused > 0).then(|| {
        let reasons = table::cut(reasons, "of them", whole_in).join("\n");
        Error::partly(format!("{refused} of {} objects at all times could not be solved: {reasons}", rows.len()))
    })
}
