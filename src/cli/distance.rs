//! `strandline distance`: reads the sources, lays the grid, says what it will take, runs, writes, tells what was found.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

use half::f16;
use serde::Serialize;

use super::config::{self, Resources};
use super::console::{Console, Voice};
use super::distance_args::{DistanceJobArgs, InitArg, PrecisionArg, ScheduleArg};
use super::grid::grid;
use super::report::{Ran, Report};
use super::text::{bytes, duration, grouped, number, triple};
use super::{print, signals, table};
use crate::error::{Error, Result};
use crate::exec::{Budget, Cancel, Engine, Progress};
use crate::grid::{BrickGrid, DataSets, Geometry, Slot};
use crate::io::ome_zarr::StoreWriter;
use crate::io::sources::{Source, read_source};
use crate::kernel::distance::Neighbours;
use crate::kernel::distance::precision::Precision;
use crate::pipeline::distance::{DistanceFound, DistanceSettings, Init, Needs, Schedule, Textbook, distance};
use crate::store::free_space;

/// A distance that is ready to be computed: all inputs are read and checked.
struct Job {
    args: DistanceJobArgs,
    typed: Vec<String>,
    settings: DistanceSettings,
    resources: Resources,
    sets: DataSets,
    geometry: Geometry,
    console: Arc<Console>,
    cancel: Cancel,
    started: Instant,
}

/// Runs the command.
pub(super) fn run(args: &DistanceJobArgs, typed: &[String]) -> Result<()> {
    let job = Job::new(args.clone(), typed)?;
    match args.field.precision {
        PrecisionArg::F16 => job.run::<f16>(),
        PrecisionArg::F32 => job.run::<f32>(),
        PrecisionArg::F64 => job.run::<f64>(),
    }
}

impl Job {
    fn new(args: DistanceJobArgs, typed: &[String]) -> Result<Self> {
        let started = Instant::now();
        let cancel = signals::cancel_on_signals()?;
        let mut settings = settings(&args)?;
        config::check_outputs(&args.output.output, &[&args.output.report], args.output.overwrite)?;
        let resources = config::resources(&args.resources, args.output.output.path())?;
        let console = Arc::new(Console::new(Voice::of(args.output.quiet, args.output.verbose)));
        let sets = read_sets(&args, &console)?;
        let bounds = sets.bounds().ok_or_else(|| Error::input("the files hold no source"))?;
        let mut notes = Vec::new();
        let geometry = grid(&args.grid, bounds, &mut notes)?;
        for note in &notes {
            console.note(note);
        }
        if args.resources.brick.is_none() {
            settings.brick = settings.method.solver::<f32>().brick_for(geometry.shape);
        }
        let typed = typed.to_vec();
        Ok(Self { args, typed, settings, resources, sets, geometry, console, cancel, started })
    }

    fn run<P: Precision>(&self) -> Result<()> {
        check_range::<P>(&self.geometry)?;
        let needs = self.settings.needs::<P>(&self.geometry, &self.sets, self.resources.threads, self.args.ranks);
        let plan = self.plan(&needs);
        if self.args.output.dry_run {
            print(&format!("{plan}\n"));
        }
        let window = self.fits(&needs)?;
        if self.args.output.dry_run {
            return Ok(());
        }
        self.console.say(&plan);
        let engine = self.resources.engine(window, &self.cancel, &self.console)?;
        let engine = engine.with_ranks(self.args.ranks);
        let result = self.solve_and_write::<P>(&engine);
        self.console.clear();
        let found = result?;
        if !self.args.output.quiet {
            print(&format!("{}\n{}", table::stages(&engine.reports()), describe_found(&found)));
        }
        Ok(())
    }

    fn solve_and_write<P: Precision>(&self, engine: &Engine) -> Result<DistanceFound> {
        let output = &self.args.output;
        let store = output.output.path().map(|path| StoreWriter::create(path, output.overwrite)).transpose()?;
        let found = distance::<P>(engine, &self.geometry, &self.sets, &self.settings, store.as_ref())?;
        if let Some(store) = store {
            self.report(engine, &found).write(&store.file("report.json")?)?;
            engine.check()?;
            store.finish()?;
        }
        match &output.report {
            Some(path) => self.report(engine, &found).write(path)?,
            None => engine.check()?,
        }
        Ok(found)
    }

    /// Refuses a run that cannot fit memory or disk.
    fn fits(&self, needs: &Needs) -> Result<u64> {
        self.refuse_too_many_bricks()?;
        let window = Budget { total: self.resources.memory }.window(needs.held).map_err(|error| {
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
        let on_disk = needs.scratch.saturating_sub(window / 2);
        match free_space(&self.resources.scratch) {
            Some(free) if free < on_disk => Err(Error::failed(format!(
                "a grid of {} voxels needs {} of temporary fields, but {} are free and {} of memory are allowed; give \
                 a larger --spacing, or another folder with --scratch",
                grouped(self.geometry.domain().volume()),
                bytes(needs.scratch),
                bytes(free),
                bytes(self.resources.memory)
            ))
            .at(&self.resources.scratch)),
            _ => Ok(window),
        }
    }

    /// Refuses more bricks than there are numbers for.
    fn refuse_too_many_bricks(&self) -> Result<()> {
        let bricks = BrickGrid::new(self.geometry.shape, self.settings.brick).len();
        if bricks < u64::from(Slot::MAX) {
            return Ok(());
        }
        Err(Error::usage(format!(
            "a grid of {} voxels falls into {} bricks, more than can be numbered; give a larger --brick or a coarser \
             grid",
            grouped(self.geometry.domain().volume()),
            grouped(bricks)
        )))
    }

    /// What the run will take, in a few lines.
    fn plan(&self, needs: &Needs) -> String {
        let (g, s) = (&self.geometry, &self.settings);
        let [x, y, z] = g.shape;
        format!(
            "{} points and {} triangles in {} data sets, {}\n\
             grid {x} x {y} x {z} (x, y, z), {} voxels, spacing {}, origin {}\n\
             about {}; memory up to {}, of which {} must be held; {} of temporary fields, in memory or in {}",
            grouped(self.sets.positions.len() as u64),
            grouped(self.sets.mesh.len() as u64),
            self.sets.count(),
            s.method.name(),
            grouped(g.domain().volume()),
            triple(g.spacing),
            triple(g.origin),
            duration(needs.seconds),
            bytes(self.resources.memory),
            bytes(needs.held),
            bytes(needs.scratch),
            self.resources.scratch.display()
        )
    }

    fn report(&self, engine: &Engine, found: &DistanceFound) -> Report<Settings, Found> {
        let ran = Ran {
            command: "distance",
            typed: &self.typed,
            resources: &self.resources,
            console: &self.console,
            engine,
            ranks: engine.ranks(),
            started: self.started,
        };
        Report::new(&ran, Settings::new(&self.args, &self.settings, &self.resources), &self.geometry, Found::new(found))
    }
}

/// The settings that the flags mean.
fn settings(args: &DistanceJobArgs) -> Result<DistanceSettings> {
    let field = &args.field;
    let row = field.method.solver::<f32>();
    let sweeps = field.schedule == ScheduleArg::Sweep;
    if field.neighbours == Neighbours::All && !row.takes_all_neighbours {
        return Err(Error::usage(format!("--method {} looks at 6 neighbours; leave --neighbours out", row.name)));
    }
    if sweeps && field.neighbours == Neighbours::All && row.textbook == Textbook::Sweeps {
        return Err(Error::usage("sweeps by bricks cannot keep the order of 26 neighbours; leave --schedule out"));
    }
    if sweeps && field.max_distance.is_some() {
        return Err(Error::usage("--max-distance needs --schedule front; leave one of the two out"));
    }
    config::check_ranks(args.ranks)?;
    if field.iterations == 0 {
        return Err(Error::usage("--iterations is 0; give 1 or more"));
    }
    if let Some(far) = field.max_distance.filter(|d| !(d.is_finite() && *d > 0.0)) {
        return Err(Error::usage(format!("--max-distance is {far}; give a length, more than 0")));
    }
    Ok(DistanceSettings {
        method: field.method,
        schedule: if sweeps { Schedule::Sweep { iterations: field.iterations } } else { Schedule::Front },
        neighbours: field.neighbours,
        init: match field.init {
            InitArg::Cell => Init::Cell,
            InitArg::Contiguous => Init::Contiguous,
            InitArg::Grid => Init::Grid,
        },
        farthest: field.max_distance,
        signed: field.signed,
        labels: field.labels,
        closest_point: field.closest_point,
        brick: config::brick(args.resources.brick.unwrap_or(row.brick))?,
    })
}

/// Reads all sources; the n-th file is data set n.
fn read_sets(args: &DistanceJobArgs, console: &Console) -> Result<DataSets> {
    let mut sets = DataSets::default();
    for path in &args.sources {
        match read_source(path)? {
            Source::Cloud(_) if args.field.signed => {
                let what = "holds points, which have no inside; --signed needs triangle meshes";
                return Err(Error::input(what).at(path));
            }
            Source::Cloud(cloud) => sets.add_cloud(&cloud.positions),
            Source::Mesh(mesh) => {
                let edges = mesh.boundary_edges();
                let name = path.display();
                if args.field.signed && !edges.is_closed() {
                    console.note(&format!(
                        "{name} is open: {} boundary edges; inside is where it winds around more than half",
                        grouped(edges.open)
                    ));
                }
                if args.field.signed && !edges.is_oriented() {
                    console.note(&format!(
                        "{name} has {} edges whose triangles disagree on what is outside; signs there may be wrong",
                        grouped(edges.flipped)
                    ));
                }
                sets.add_mesh(&mesh);
            }
        }
        crate::grid::refuse_too_many("sources", sets.len() as u64).map_err(|error| error.at(path))?;
    }
    Ok(sets)
}

/// Refuses distances that the type cannot hold.
fn check_range<P: Precision>(geometry: &Geometry) -> Result<()> {
    let diagonal = (0..3).map(|a| (geometry.shape[a] as f64 * geometry.spacing[a]).powi(2)).sum::<f64>().sqrt();
    let smallest = geometry.min_spacing();
    // Below 2^-14 half precision loses digits.
    if diagonal < P::MAX && smallest > P::LEAST {
        return Ok(());
    }
    Err(Error::usage(format!(
        "distances from {} to {} do not fit --precision {}; choose a wider one, or another unit of length",
        number(smallest),
        number(diagonal),
        P::TYPE.name()
    )))
}

fn describe_found(found: &DistanceFound) -> String {
    let mut lines = vec![format!(
        "largest distance {}; {} voxels fixed by sources, {} not reached",
        number(found.max),
        grouped(found.fixed_voxels),
        grouped(found.unlabelled_voxels)
    )];
    let triangles = found.triangle_distances;
    lines.extend(triangles.map(|n| format!("{} distances to triangles were computed to fix voxels", grouped(n))));
    lines.extend(found.label_voxels.iter().map(|(label, n)| format!("label {label}: {} voxels", grouped(*n))));
    lines.join("\n") + "\n"
}

/// Every setting, also those that nobody gave; lengths physical.
#[derive(Debug, Serialize)]
struct Settings {
    sources: Vec<String>,
    output: Option<String>,
    method: &'static str,
    schedule: &'static str,
    neighbours: u32,
    iterations: Option<u32>,
    init: &'static str,
    precision: &'static str,
    max_distance: Option<f64>,
    signed: bool,
    labels: bool,
    closest_point: bool,
    brick: i64,
    scratch: String,
}

impl Settings {
    fn new(args: &DistanceJobArgs, settings: &DistanceSettings, resources: &Resources) -> Self {
        let (schedule, iterations) = match settings.schedule {
            Schedule::Front => ("front", None),
            Schedule::Sweep { iterations } => ("sweep", Some(iterations)),
        };
        Self {
            sources: args.sources.iter().map(|path| path.display().to_string()).collect(),
            output: args.output.output.path().map(|path| path.display().to_string()),
            method: settings.method.name(),
            schedule,
            neighbours: match settings.neighbours {
                Neighbours::Faces => 6,
                Neighbours::All => 26,
            },
            iterations,
            init: match settings.init {
                Init::Cell => "cell",
                Init::Contiguous => "contiguous",
                Init::Grid => "grid",
            },
            precision: match args.field.precision {
                PrecisionArg::F16 => "f16",
                PrecisionArg::F32 => "f32",
                PrecisionArg::F64 => "f64",
            },
            max_distance: settings.farthest,
            signed: settings.signed,
            labels: settings.labels,
            closest_point: settings.closest_point,
            brick: settings.brick,
            scratch: resources.scratch.display().to_string(),
        }
    }
}

/// What was found.
#[derive(Debug, Serialize)]
struct Found {
    max: f64,
    fixed_voxels: u64,
    unlabelled_voxels: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    triangle_distances: Option<u64>,
    label_voxels: BTreeMap<String, u64>,
}

impl Found {
    fn new(found: &DistanceFound) -> Self {
        Self {
            max: found.max,
            fixed_voxels: found.fixed_voxels,
            unlabelled_voxels: found.unlabelled_voxels,
            triangle_distances: found.triangle_distances,
            label_voxels: found.label_voxels.iter().map(|(label, n)| (label.to_string(), *n)).collect(),
        }
    }
}
