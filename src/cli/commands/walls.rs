//! `strandline middle` on a label volume that has walls alone to be drawn: where every voxel has a label, or against what has none.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use crate::cli::args::distance::{DistanceJobArgs, MiddleChoice};
use crate::cli::inputs::agreed::check_asked;
use crate::cli::inputs::settings;
use crate::cli::inputs::sources::open_volume;
use crate::cli::outputs::checks::Outputs;
use crate::cli::outputs::drawing::{Drawing, Finished, ForViewers, ToFile};
use crate::cli::outputs::files::{mesh_format, note_anchor};
use crate::cli::outputs::store::{begin_store_on_ranks, join_store};
use crate::cli::outputs::survival::{finished_before, survivable, told_of_room};
use crate::cli::print;
use crate::cli::report::page::evidence::{Evidence, Measure, Root};
use crate::cli::report::page::written::{Written, with_page};
use crate::cli::report::ranks::{RankReport, gather_ranks};
use crate::cli::report::run_report::{Ran, Report};
use crate::cli::report::table;
use crate::cli::report::walls::{Found, Settings, describe_found};
use crate::cli::terminal::console::{Console, Voice};
use crate::cli::terminal::log;
use crate::cli::terminal::signals;
use crate::cli::terminal::text::{bytes, duration, grouped, place, triple};
use crate::cli::terminal::world;
use crate::error::{Error, Result};
use crate::exec::{Budget, Cancel, Comm, Engine, Plan, Progress};
use crate::grid::DataSets;
use crate::io::ome_zarr::StoreWriter;
use crate::io::stack::label_volume::LabelVolume;
use crate::job::disk::Disk;
use crate::job::resources::{Resources, Sharing};
use crate::pipeline::distance::Needs;
use crate::pipeline::middle::{Survey, WallsFound, WallsSettings, walls};
use crate::pipeline::output::viewer_mesh::Segments;

/// Labels that have fewer voxels in the mean are grey values.
const FEWEST_VOXELS: u64 = 16;

/// Walls that are ready to be drawn.
struct Job {
    args: DistanceJobArgs,
    choice: MiddleChoice,
    typed: Vec<String>,
    settings: WallsSettings,
    resources: Resources,
    volume: LabelVolume,
    survey: Survey,
    console: Arc<Console>,
    cancel: Cancel,
    started: Instant,
    /// The ranks that run this job, each on its own part.
    comm: Arc<dyn Comm>,
}

/// Runs the job on as many ranks as were asked for.
pub(crate) fn run(mut args: DistanceJobArgs, choice: &MiddleChoice, typed: &[String]) -> Result<()> {
    let output = &mut args.job.output;
    let files = [output.report.clone(), choice.mesh.clone()];
    if finished_before(output, &files, typed)? {
        return Ok(());
    }
    settings::check_ranks(args.job.ranks)?;
    world::on_ranks(args.job.ranks, &args.sources, |comm| Job::new(&args, choice, typed, comm)?.run())
}

impl Job {
    fn new(args: &DistanceJobArgs, choice: &MiddleChoice, typed: &[String], comm: Arc<dyn Comm>) -> Result<Self> {
        let started = Instant::now();
        let cancel = signals::cancel_on_signals()?;
        let output = &args.job.output;
        let outputs = Outputs {
            inputs: args.sources.iter().map(PathBuf::as_path).collect(),
            store: output.store(),
            files: [&output.report, &choice.mesh].into_iter().flatten().map(PathBuf::as_path).collect(),
            overwrite: output.overwrite,
        };
        outputs.check()?;
        choice.mesh.as_deref().map(mesh_format).transpose()?;
        let resources = settings::resources_of_rank(&args.job.resources, output.store(), args.job.ranks)?;
        let console = Arc::new(Console::new(Voice::of_rank(comm.as_ref(), output)));
        let volume = open_volume(&args.sources[0], &args.job.grid, &console)?;
        let survey = Survey::new(&volume, || cancel.check()).map_err(|error| error.at(&args.sources[0]))?;
        let settings = WallsSettings { background: choice.background };
        let (args, choice, typed) = (args.clone(), choice.clone(), typed.to_vec());
        Ok(Self { args, choice, typed, settings, resources, volume, survey, console, cancel, started, comm })
    }

    fn run(&self) -> Result<()> {
        let output = &self.args.job.output;
        let writes = output.store().is_some();
        let written = if writes { WallsSettings::written(&self.volume) } else { 0 };
        let asked = (output.store(), output.live, output.dry_run, output.ome, output.compress);
        check_asked(self.comm.as_ref(), &format!("{:?} {:?} {asked:?}", self.volume.geometry(), self.settings))?;
        let threads = self.resources.threads;
        let needs = WallsSettings::needs(&self.volume, &self.survey, threads, writes);
        let plan = self.plan(&needs);
        if output.dry_run && self.comm.rank() == 0 {
            print(&format!("{plan}\n"))?;
            log::plan(Budget::least(needs.held), needs.scratch, written, needs.seconds);
        }
        let most = self.fits(&needs, written)?;
        if output.dry_run {
            return Ok(());
        }
        self.console.say(&plan);
        let console = self.console.as_ref();
        let engine = self.resources.engine(&self.cancel, self.console.clone())?.as_rank(self.comm.clone());
        let engine = survivable(engine, (output, &self.typed), None, console)?;
        let stages: Plan = WallsSettings::plan(self.volume.geometry(), threads, writes);
        engine.outlook().expect(with_page(stages, writes));
        let result = self.draw_and_write(&engine);
        self.console.clear();
        engine.settle_save_points(&result);
        let found = told_of_room(result, most, output)?;
        if !output.quiet && self.comm.rank() == 0 {
            let [labels_in, pairs_in] = ["meshes/labels.csv", "meshes/pairs.csv"]
                .map(|name| table::whole_in(writes, output.report.is_some(), name));
            let told = describe_found(&found, &labels_in, &pairs_in);
            print(&format!("{}\n{told}", table::stages(&engine.reports())))?;
        }
        Ok(())
    }

    fn draw_and_write(&self, engine: &Engine) -> Result<Found> {
        let output = &self.args.job.output;
        let geometry = self.volume.geometry();
        // The first rank alone puts surfaces together.
        let is_first = self.comm.rank() == 0;
        let mesh = self.choice.mesh.as_deref().filter(|_| is_first);
        let (store, telling) = begin_store_on_ranks(output, engine)?;
        let (scratch, is_copy, replace) = (self.resources.scratch.as_path(), store.is_some(), output.overwrite);
        let to = mesh.map(|path| ToFile { path, scratch, is_tagged: true, is_copy, replace, values: None });
        let mut drawing = Drawing::new(store.as_ref().filter(|_| is_first), to, geometry, true)?;
        let found = self.draw(engine, store.as_ref(), &mut drawing)?;
        let ranks = gather_ranks(engine)?;
        let store = join_store(store, engine)?;
        if !is_first {
            return Ok(Found::new(&found));
        }
        let segments = Segments::Pairs;
        let (file, copy) = drawing.finish(&ForViewers { engine, store: store.as_ref(), geometry, segments })?;
        let found = Found::new(&found).with_copy(copy);
        note_anchor(mesh, geometry, &self.console);
        if let Some(store) = store {
            let written = Written { store: &store, engine, console: self.console.as_ref() };
            let (sources, middle) = (DataSets::default(), geometry.shape.map(|n| n / 2));
            let centre = geometry.position(middle);
            let evidence = Evidence {
                root: Root::Labels,
                measure: Measure::Thickness,
                sources: &sources,
                centre,
                points: "points",
            };
            written.write(&evidence, || self.report(engine, &ranks, &found))?;
            engine.check()?;
            drop(telling);
            store.finish()?;
        }
        file.map_or(Ok(()), Finished::place)?;
        match &output.report {
            Some(path) => self.report(engine, &ranks, &found).write(path, output.overwrite)?,
            None => engine.check()?,
        }
        Ok(found)
    }

    fn draw(&self, engine: &Engine, store: Option<&StoreWriter>, drawing: &mut Drawing) -> Result<WallsFound> {
        let path = &self.args.sources[0];
        let found = walls(engine, (&self.volume, &self.survey), self.settings, store, drawing)
            .map_err(|error| error.at(path))?;
        let (labels, voxels) = (found.label_voxels.len() as u64, self.volume.geometry().domain().volume());
        if FEWEST_VOXELS * labels > voxels {
            self.console.note(&format!(
                "{}: {} labels on {} voxels; is it an image, and no label volume?",
                path.display(),
                grouped(labels),
                grouped(voxels)
            ));
        }
        Ok(found)
    }

    /// Refuses a run that cannot fit memory or disk.
    fn fits(&self, needs: &Needs, written: u64) -> Result<u64> {
        let geometry = self.volume.geometry();
        Budget { total: self.resources.memory }.window(needs.held).map_err(|error| {
            let voxels = grouped(geometry.domain().volume());
            Error::usage(format!(
                "a grid of {voxels} voxels needs {} of memory for its walls; {error}",
                bytes(needs.held)
            ))
        })?;
        // Ranks beside this one keep as much on the same disk.
        let Sharing { machine, process } = world::sharing(self.args.job.ranks);
        let all = Needs { scratch: needs.scratch.saturating_mul(machine.max(process) as u64), ..*needs };
        let disk = Disk::of_grid(&self.resources, self.args.job.output.store(), geometry, &all, written)?;
        disk.with_waiting(if self.choice.mesh.is_some() { needs.waiting } else { 0 })
            .check(|text| self.console.note(text))
    }

    /// What the run will take, in a few lines.
    fn plan(&self, needs: &Needs) -> String {
        let g = self.volume.geometry();
        let [x, y, z] = g.shape;
        let between = if self.settings.background { "labels, and around each of them" } else { "labels" };
        format!(
            "walls between {between}\n\
             grid {x} x {y} x {z} (x, y, z), {} voxels, spacing {}, origin {}\n\
             about {}; memory up to {}, at least {}; {} of temporary fields, in memory or in {}",
            grouped(g.domain().volume()),
            triple(g.spacing),
            place(g.origin, g.min_spacing()),
            duration(needs.seconds),
            bytes(self.resources.memory),
            bytes(Budget::least(needs.held)),
            bytes(needs.scratch),
            self.resources.scratch.display()
        )
    }

    fn report<'a>(
        &self,
        engine: &Engine,
        rank_reports: &[RankReport],
        found: &'a Found,
    ) -> Report<Settings, &'a Found> {
        let ran = Ran {
            command: "middle",
            typed: &self.typed,
            resources: &self.resources,
            console: &self.console,
            engine,
            ranks: self.comm.ranks(),
            rank_reports,
            started: self.started,
        };
        Report::new(&ran, Settings::new(&self.args, self.settings, &self.resources), self.volume.geometry(), found)
    }
}
