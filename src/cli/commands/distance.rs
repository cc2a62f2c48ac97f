//! `strandline distance`: reads the sources, lays the grid, says what it will take, runs, writes, tells what was found.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use half::f16;

use crate::cli::args::distance::MiddleChoice;
use crate::cli::args::distance::{DistanceJobArgs, InitArg, PrecisionArg, ScheduleArg};
use crate::cli::inputs::agreed::check_agreed;
use crate::cli::inputs::grid;
use crate::cli::inputs::settings;
use crate::cli::inputs::sources::{Read, open_volume, read_sets};
use crate::cli::inputs::speed::open_speed;
use crate::cli::outputs::checks::Outputs;
use crate::cli::outputs::drawing::{Drawing, Finished, ForViewers, ToFile};
use crate::cli::outputs::files::{mesh_format, note_anchor};
use crate::cli::outputs::store::{begin_store_on_ranks, join_store};
use crate::cli::outputs::survival::{finished_before, survivable, told_of_room};
use crate::cli::print;
use crate::cli::report::distance::{Found, Settings, describe_found};
use crate::cli::report::page::evidence::{Evidence, Measure, Root};
use crate::cli::report::page::written::{Written, with_page};
use crate::cli::report::ranks::{RankReport, gather_ranks};
use crate::cli::report::run_report::{Ran, Report};
use crate::cli::report::table;
use crate::cli::terminal::console::{Console, Voice};
use crate::cli::terminal::log;
use crate::cli::terminal::signals;
use crate::cli::terminal::text::{bytes, duration, grouped, place, triple};
use crate::cli::terminal::world;
use crate::error::{Error, Result};
use crate::exec::{Budget, Cancel, Comm, Engine, Plan, Progress};
use crate::grid::{DataSets, Geometry};
use crate::io::geometry::write::formats::Values;
use crate::io::ome_zarr::StoreWriter;
use crate::io::stack::label_volume::{LabelVolume, is_label_volume};
use crate::io::stack::volume::Stack;
use crate::job::disk::Disk;
use crate::job::resources::{Resources, Sharing};
use crate::kernel::distance::state::precision::Precision;
use crate::pipeline::distance::seeding::label_borders::Labels;
use crate::pipeline::distance::{
    DistanceSettings, Init, Needs, Schedule, Writes, check_iterations, check_timed_sources, distance, outside_note,
    travel_times,
};
use crate::pipeline::middle::{MiddleSettings, MiddleSources, check_sets, middle_kept, with_touching};
use crate::pipeline::output::viewer_mesh::Segments;
use crate::store::{MeshSink, VolumeSource};

/// A distance that is ready to be computed: all inputs are read and checked.
struct Job {
    args: DistanceJobArgs,
    middle: Option<MiddleChoice>,
    typed: Vec<String>,
    settings: DistanceSettings,
    resources: Resources,
    sets: DataSets,
    geometry: Geometry,
    /// The label volume that all sources are from, if so.
    volume: Option<LabelVolume>,
    /// The speeds that a front has, where times are asked for.
    speeds: Option<Box<dyn Stack>>,
    console: Arc<Console>,
    cancel: Cancel,
    started: Instant,
    /// The ranks that run this job, each on its own part.
    comm: Arc<dyn Comm>,
}

/// Runs the command.
pub(crate) fn run(args: &DistanceJobArgs, typed: &[String]) -> Result<()> {
    begin(args.clone(), None, typed)
}

/// Runs `middle`: a distance with labels, and the surface between them.
pub(crate) fn run_middle(args: DistanceJobArgs, choice: &MiddleChoice, typed: &[String]) -> Result<()> {
    begin(args, Some(choice), typed)
}

fn begin(mut args: DistanceJobArgs, middle: Option<&MiddleChoice>, typed: &[String]) -> Result<()> {
    let mesh = middle.and_then(|choice| choice.mesh.clone());
    let output = &mut args.job.output;
    let files = [output.report.clone(), mesh];
    if finished_before(output, &files, typed)? {
        return Ok(());
    }
    settings::check_ranks(args.job.ranks)?;
    let in_process = args.job.ranks;
    world::on_ranks(in_process, &args.sources, |comm| {
        Job::new(args.clone(), middle.cloned(), typed, comm)?.run_precise()
    })
}

impl Job {
    fn new(args: DistanceJobArgs, middle: Option<MiddleChoice>, typed: &[String], comm: Arc<dyn Comm>) -> Result<Self> {
        let started = Instant::now();
        let cancel = signals::cancel_on_signals()?;
        let mut settings = settings(&args)?;
        let mesh = middle.as_ref().map_or(&None, |choice| &choice.mesh);
        let output = &args.job.output;
        let outputs = Outputs {
            inputs: args.sources.iter().chain(&args.job.grid.like).chain(&args.speed).map(PathBuf::as_path).collect(),
            store: output.store(),
            files: [&output.report, mesh].into_iter().flatten().map(PathBuf::as_path).collect(),
            overwrite: output.overwrite,
        };
        outputs.check()?;
        mesh.as_deref().map(mesh_format).transpose()?;
        let job = &args.job;
        let resources = settings::resources_of_rank(&job.resources, job.output.store(), job.ranks)?;
        let console = Arc::new(Console::new(Voice::of_rank(comm.as_ref(), &job.output)));
        let mut notes = Vec::new();
        let mut given = grid::given(&args.job.grid, &mut notes)?;
        let mut speeds = None;
        if let Some(path) = &args.speed {
            let (stack, geometry) = open_speed(path, &args.job.grid, given, &mut notes)?;
            (speeds, given) = (Some(stack), Some(geometry));
        }
        for note in &notes {
            console.note(note);
        }
        let Read { sets, volume } = read_sets(&args, given.as_ref(), resources.memory, &console, &cancel)?;
        middle.as_ref().map_or(Ok(()), |choice| check_sets(&sets, (choice.surface, choice.background)))?;
        let bounds = sets.bounds().ok_or_else(|| Error::input("the files hold no source"))?;
        let geometry = match (given, volume) {
            (Some(geometry), _) => geometry,
            (None, Some(geometry)) if !args.job.grid.is_asked_for() => geometry,
            _ => grid::around(&args.job.grid, bounds)?,
        };
        let sole =
            args.sources.first().filter(|path| middle.is_some() && args.sources.len() == 1 && is_label_volume(path));
        let quiet = Console::new(Voice::Quiet);
        let volume = sole.map(|path| open_volume(path, &args.job.grid, &quiet)).transpose()?;
        check_timed_sources(&settings, &sets)?;
        if let Some(note) = outside_note(&geometry, &sets, settings.timed) {
            console.note(&note);
        }
        if args.job.resources.brick.is_none() {
            settings.brick = settings.brick_for(geometry.shape);
        }
        let typed = typed.to_vec();
        Ok(Self {
            args,
            middle,
            typed,
            settings,
            resources,
            sets,
            geometry,
            volume,
            speeds,
            console,
            cancel,
            started,
            comm,
        })
    }

    fn run_precise(&self) -> Result<()> {
        match self.args.job.field.precision {
            PrecisionArg::F16 => self.run::<f16>(),
            PrecisionArg::F32 => self.run::<f32>(),
            PrecisionArg::F64 => self.run::<f64>(),
        }
    }

    fn run<P: Precision>(&self) -> Result<()> {
        self.settings.check_on::<P>(&self.geometry, &self.sets)?;
        check_agreed(self.comm.as_ref(), &self.asked::<P>(), &self.sets)?;
        let threads = self.resources.threads;
        let needs = self.needs::<P>(threads);
        let plan = self.plan(&needs);
        if self.args.job.output.dry_run && self.comm.rank() == 0 {
            print(&format!("{plan}\n"))?;
            let written = if self.args.job.output.store().is_some() { self.written() } else { 0 };
            log::plan(Budget::least(needs.held), needs.scratch, written, needs.seconds);
        }
        let most = self.fits(&needs)?;
        if self.args.job.output.dry_run {
            return Ok(());
        }
        self.console.say(&plan);
        self.note_without_checkpoints::<P>();
        let engine = self.resources.engine(&self.cancel, self.console.clone())?.as_rank(self.comm.clone());
        let engine = survivable(engine, (&self.args.job.output, &self.typed), None, self.console.as_ref())?;
        engine.outlook().expect(with_page(self.stages::<P>(threads), self.args.job.output.store().is_some()));
        let result = self.solve_and_write::<P>(&engine);
        self.console.clear();
        engine.settle_save_points(&result);
        let found = told_of_room(result, most, &self.args.job.output)?;
        if !self.args.job.output.quiet && self.comm.rank() == 0 {
            let output = &self.args.job.output;
            let [labels_in, pairs_in] = ["", "meshes/pairs.csv"]
                .map(|table| table::whole_in(output.store().is_some(), output.report.is_some(), table));
            let told = describe_found(&found, &labels_in, &pairs_in);
            print(&format!("{}\n{told}", table::stages(&engine.reports())))?;
        }
        Ok(())
    }

    /// Says where there will be no checkpoints although somebody asked for them.
    fn note_without_checkpoints<P: Precision>(&self) {
        let asks = self.args.job.output.survive.asks() && self.comm.ranks() == 1;
        if asks && self.settings.heap_bytes::<P>(&self.geometry) > 0 {
            self.console.note(&format!(
                "in the textbook's order {} solves in one heap and takes no checkpoint before it is solved; leave --schedule out where a run may be ended",
                self.settings.method.name()
            ));
        }
    }

    fn solve_and_write<P: Precision>(&self, engine: &Engine) -> Result<Found> {
        let output = &self.args.job.output;
        // The first rank alone puts surfaces together.
        let is_first = self.comm.rank() == 0;
        let mesh = self.middle.as_ref().and_then(|choice| choice.mesh.as_deref()).filter(|_| is_first);
        let (store, telling) = begin_store_on_ranks(output, engine)?;
        let (scratch, is_copy) = (self.resources.scratch.as_path(), store.is_some());
        let replace = output.overwrite;
        let thickness = Values { name: "thickness", at: None };
        let values = Some(&thickness);
        let to = mesh.map(|path| ToFile { path, scratch, is_tagged: true, is_copy, replace, values });
        let has_surface = self.middle.is_some() && is_first;
        let mut drawing = Drawing::new(store.as_ref().filter(|_| has_surface), to, &self.geometry, true)?;
        let found = self.solve::<P>(engine, store.as_ref(), &mut drawing)?;
        let ranks = gather_ranks(engine)?;
        let store = join_store(store, engine)?;
        if self.comm.rank() > 0 {
            return Ok(found);
        }
        let (geometry, segments) = (&self.geometry, Segments::Pairs);
        let (file, copy) = drawing.finish(&ForViewers { engine, store: store.as_ref(), geometry, segments })?;
        let found = found.with_copy(copy);
        note_anchor(mesh, &self.geometry, &self.console);
        if let Some(store) = store {
            let written = Written { store: &store, engine, console: self.console.as_ref() };
            written.write(&self.evidence(), || self.report(engine, &ranks, &found))?;
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

    fn solve<P: Precision>(
        &self,
        engine: &Engine,
        store: Option<&StoreWriter>,
        mesh: &mut dyn MeshSink,
    ) -> Result<Found> {
        let (geometry, sets) = (&self.geometry, &self.sets);
        match self.middle_settings() {
            Some(settings) => {
                let volume = self.volume.as_ref().map(|volume| volume as &dyn Labels);
                let sources = MiddleSources { sets, volume, background: false };
                let found = middle_kept::<P>(engine, geometry, &sources, &settings, (store, None), mesh)?;
                Ok(Found::of_middle(&found, sets.count()))
            }
            None => match &self.speeds {
                Some(speeds) => {
                    let settings = (&self.settings, speeds.as_ref() as &dyn VolumeSource);
                    let found = travel_times::<P>(engine, geometry, sets, settings, store, None)?;
                    Ok(Found::new(&found).timed(geometry))
                }
                None => Ok(Found::new(&distance::<P>(engine, geometry, sets, &self.settings, store)?)),
            },
        }
    }

    fn middle_settings(&self) -> Option<MiddleSettings> {
        let MiddleChoice { surface, labels, .. } = *self.middle.as_ref()?;
        Some(MiddleSettings { distance: self.settings, surface, labels })
    }

    /// What all ranks have to be asked for alike.
    fn asked<P: Precision>(&self) -> String {
        let output = &self.args.job.output;
        let written = (output.store(), output.live, output.dry_run, output.ome, output.compress);
        format!("{:?} {:?} {:?} {:?} {}", self.geometry, self.settings, self.middle_settings(), written, P::TYPE.name())
    }

    /// What this rank takes.
    fn needs<P: Precision>(&self, threads: usize) -> Needs {
        let (writes, ranks) = (self.args.job.output.store().is_some(), self.comm.ranks());
        if let Some(middle) = self.middle_settings() {
            let needs = middle.needs::<P>(&self.geometry, &self.sets, threads, ranks, writes);
            return with_touching(needs, self.volume.as_ref().map(|volume| volume as &dyn Labels), threads);
        }
        let needs = self.settings.needs::<P>(&self.geometry, &self.sets, [threads, ranks], self.writes());
        self.speeds.as_ref().map_or(needs, |speeds| needs.reading(speeds.as_ref(), threads))
    }

    /// The stages of the run, and what each will probably take.
    fn stages<P: Precision>(&self, threads: usize) -> Plan {
        let writes = self.args.job.output.store().is_some();
        match self.middle_settings() {
            Some(middle) => middle.plan::<P>(&self.geometry, threads, writes),
            None => self.settings.plan::<P>(&self.geometry, threads, self.writes()),
        }
    }

    fn writes(&self) -> Writes {
        match self.args.job.output.store() {
            Some(_) if self.args.job.output.live && !self.settings.timed => Writes::FieldsMeanwhile,
            Some(_) => Writes::Fields,
            None => Writes::Nothing,
        }
    }

    /// Refuses a run that cannot fit memory or disk.
    fn fits(&self, needs: &Needs) -> Result<u64> {
        Budget { total: self.resources.memory }.window(needs.held).map_err(|error| {
            let name = self.settings.method.name();
            let textbook = if self.settings.heap_bytes::<f32>(&self.geometry) == 0 {
                String::new()
            } else {
                format!(", or leave --schedule out: in the textbook's order {name} keeps all voxels in one heap")
            };
            Error::usage(format!(
                "a grid of {} voxels needs {} of memory and {} of temporary fields; {error}, or a coarser \
                 grid{textbook}",
                grouped(self.geometry.domain().volume()),
                bytes(needs.held),
                bytes(needs.scratch)
            ))
        })?;
        let output = self.args.job.output.store();
        let written = if output.is_some() { self.written() } else { 0 };
        // Ranks beside this one keep as much on the same disk.
        let Sharing { machine, process } = world::sharing(self.args.job.ranks);
        let all = Needs { scratch: needs.scratch.saturating_mul(machine.max(process) as u64), ..*needs };
        let disk = Disk::of_grid(&self.resources, output, &self.geometry, &all, written)?;
        let has_mesh = self.middle.as_ref().is_some_and(|choice| choice.mesh.is_some());
        disk.with_waiting(if has_mesh { needs.waiting } else { 0 }).check(|text| self.console.note(text))
    }

    /// Bytes of the output, if nothing of it could be compressed.
    fn written(&self) -> u64 {
        let is_middle = self.middle.is_some();
        match self.args.job.field.precision {
            PrecisionArg::F16 => self.settings.written::<f16>(&self.geometry, is_middle),
            PrecisionArg::F32 => self.settings.written::<f32>(&self.geometry, is_middle),
            PrecisionArg::F64 => self.settings.written::<f64>(&self.geometry, is_middle),
        }
    }

    /// What the run will take, in a few lines.
    fn plan(&self, needs: &Needs) -> String {
        let (g, s) = (&self.geometry, &self.settings);
        let [x, y, z] = g.shape;
        format!(
            "{} points and {} triangles in {} data sets, {}\n\
             grid {x} x {y} x {z} (x, y, z), {} voxels, spacing {}, origin {}\n\
             about {}; memory up to {}, at least {}; {} of temporary fields, in memory or in {}",
            grouped(self.sets.positions.len() as u64),
            grouped(self.sets.mesh.len() as u64),
            self.sets.count(),
            s.method.name(),
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

    fn evidence(&self) -> Evidence<'_> {
        let middle = self.geometry.shape.map(|n| n / 2);
        Evidence {
            root: if self.settings.timed { Root::Times } else { Root::Distance },
            measure: Measure::Thickness,
            sources: &self.sets,
            centre: self.geometry.position(middle),
            points: "points",
        }
    }

    fn report<'a>(
        &self,
        engine: &Engine,
        rank_reports: &[RankReport],
        found: &'a Found,
    ) -> Report<Settings, &'a Found> {
        let ran = Ran {
            command: if self.middle.is_some() { "middle" } else { "distance" },
            typed: &self.typed,
            resources: &self.resources,
            console: &self.console,
            engine,
            ranks: self.comm.ranks(),
            rank_reports,
            started: self.started,
        };
        Report::new(
            &ran,
            Settings::new(&self.args, self.middle.as_ref(), &self.settings, &self.resources),
            &self.geometry,
            found,
        )
    }
}

/// The settings that the flags mean.
fn settings(args: &DistanceJobArgs) -> Result<DistanceSettings> {
    let field = &args.job.field;
    let sweeps = field.schedule == ScheduleArg::Sweep;
    let settings = DistanceSettings {
        method: field.method,
        schedule: if sweeps { Schedule::Sweep { iterations: field.iterations } } else { Schedule::Front },
        neighbours: field.neighbours,
        init: match field.init {
            InitArg::Cell => Init::Cell,
            InitArg::Contiguous => Init::Contiguous,
            InitArg::Grid => Init::Grid,
        },
        farthest: field.max_distance,
        signed: args.choice.signed,
        labels: args.choice.labels,
        closest_point: args.choice.closest_point,
        brick: args.job.resources.brick.unwrap_or(field.method.solver::<f32>().brick),
        exact: args.choice.exact,
        timed: args.speed.is_some(),
    };
    settings.check()?;
    check_iterations(field.iterations)?;
    Ok(settings)
}
