//! `strandline reconstruct`: reads the cloud, lays the grid, says what it will take, runs, writes, tells what was
//! found.

mod told;

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use told::describe_found;

use crate::cli::args::grid::GridArgs;
use crate::cli::args::reconstruct::{CloudGridArgs, ReconstructArgs};
use crate::cli::inputs::agreed::check_agreed;
use crate::cli::inputs::grid::asked_grid;
use crate::cli::inputs::noted::read_told;
use crate::cli::inputs::settings;
use crate::cli::outputs::checks::Outputs;
use crate::cli::outputs::drawing::{Drawing, Finished, ForViewers, ToFile, distance_to_marks};
use crate::cli::outputs::files::{mesh_format, note_anchor};
use crate::cli::outputs::store::{begin_store_on_ranks, join_store};
use crate::cli::outputs::survival::{finished_before, survivable, told_of_room};
use crate::cli::print;
use crate::cli::report::page::evidence::{Evidence, Measure, Root};
use crate::cli::report::page::written::{Written, with_page};
use crate::cli::report::ranks::{RankReport, gather_ranks};
use crate::cli::report::reconstruction::{Found, Settings};
use crate::cli::report::run_report::{Ran, Report};
use crate::cli::report::table;
use crate::cli::terminal::console::{Console, Voice};
use crate::cli::terminal::log;
use crate::cli::terminal::signals;
use crate::cli::terminal::text::{bytes, duration, grouped, triple};
use crate::cli::terminal::world;
use crate::error::{Error, Result};
use crate::exec::{Budget, Cancel, Comm, Engine, Progress};
use crate::grid::{DataSets, Geometry};
use crate::io::geometry::read::source::Source;
use crate::job::disk::Disk;
use crate::job::resources::Resources;
use crate::pipeline::output::viewer_mesh::{Segments, Simplified};
use crate::pipeline::reconstruct::{
    Estimate, ReconstructSettings, Reconstruction, estimate, grid_for, plan, reconstruct_shown, refuse_too_fine,
    spacing_memory, typical_spacing, without_isolated,
};

/// Points without three others within so many spacings stand alone, where nothing else is said.
const ISOLATED_SPACINGS: f64 = 4.0;

/// Of so many points one may be off the surface without a word.
const MOST_LOST: u64 = 20;

/// A reconstruction that is ready to start: the cloud is read and checked.
struct Job {
    args: ReconstructArgs,
    typed: Vec<String>,
    settings: ReconstructSettings,
    resources: Resources,
    cloud: Vec<[f64; 3]>,
    grid: Geometry,
    console: Arc<Console>,
    cancel: Cancel,
    started: Instant,
    /// The ranks that run this job, each on its own part.
    comm: Arc<dyn Comm>,
}

/// Runs the command.
pub(crate) fn run(args: &ReconstructArgs, typed: &[String]) -> Result<()> {
    let mut args = args.clone();
    let files = [args.output.report.clone(), args.mesh.clone()];
    if finished_before(&mut args.output, &files, typed)? {
        return Ok(());
    }
    settings::check_ranks(args.ranks)?;
    let cloud = args.cloud.clone();
    world::on_ranks(args.ranks, &[cloud], |comm| run_rank(args.clone(), typed, comm))
}

/// Runs the command on one of the ranks.
fn run_rank(args: ReconstructArgs, typed: &[String], comm: Arc<dyn Comm>) -> Result<()> {
    let job = Job::new(args, typed, comm)?;
    job.check_agreed()?;
    let threads = job.resources.threads as u64;
    let estimate = estimate(&job.grid, &job.cloud, &job.settings, threads, job.writes_fields());
    let plan = job.plan(&estimate);
    let is_dry = job.args.output.dry_run;
    if is_dry && job.comm.rank() == 0 {
        print(&format!("{plan}\n"))?;
        let output = if job.writes_fields() { estimate.output } else { 0 };
        log::plan(Budget::least(estimate.held), estimate.scratch, output, estimate.seconds);
    }
    let most = job.fits(&estimate)?;
    if is_dry {
        return Ok(());
    }
    job.console.say(&plan);
    job.run(estimate.seconds, most)
}

/// Leaves out points that stand alone, if that was asked for, and says how many.
fn drop_isolated(cloud: Vec<[f64; 3]>, spacings: Option<f64>, console: &Console) -> Result<Vec<[f64; 3]>> {
    let Some(spacings) = settings::above_zero("--drop-isolated", spacings)? else { return Ok(cloud) };
    let Some(spacing) = typical_spacing(&cloud) else { return Ok(cloud) };
    let kept = without_isolated(&cloud, spacings * spacing);
    let dropped = (cloud.len() - kept.len()) as u64;
    console.note(&format!(
        "{} of {} points stand alone and are left out",
        grouped(dropped),
        grouped(cloud.len() as u64)
    ));
    Ok(kept)
}

/// The grid that was asked for, if one was, as fine as that around the cloud.
fn laid_grid(
    args: &CloudGridArgs,
    around: &Geometry,
    cloud: &[[f64; 3]],
    console: &Console,
) -> Result<Option<Geometry>> {
    if !args.filled.is_given() {
        return Ok(None);
    }
    let asked = GridArgs { spacing: Some(around.spacing), filled: args.filled.clone(), ..GridArgs::default() };
    let high = |a: usize| cloud.iter().map(|p| p[a]).fold(f64::NEG_INFINITY, f64::max);
    let laid = asked_grid(&asked, (around.origin, [high(0), high(1), high(2)]), &mut Vec::new())?;
    let outside =
        cloud.iter().filter(|&&p| !laid.domain().contains(laid.to_voxels(p).map(|v| v.floor() as i64))).count();
    if outside > 0 {
        console.note(&format!(
            "{} of {} points lie outside of the grid; the surface is that of all points, fields end with the grid",
            grouped(outside as u64),
            grouped(cloud.len() as u64)
        ));
    }
    Ok(Some(laid))
}

impl Job {
    fn new(args: ReconstructArgs, typed: &[String], comm: Arc<dyn Comm>) -> Result<Self> {
        let started = Instant::now();
        let cancel = signals::cancel_on_signals()?;
        let mut settings = settings::reconstruct_settings(&args)?;
        let spacing = settings::spacing("--spacing", args.grid.spacing)?;
        let outputs = Outputs {
            inputs: vec![&args.cloud],
            store: args.output.store(),
            files: [&args.output.report, &args.mesh].into_iter().flatten().map(PathBuf::as_path).collect(),
            overwrite: args.output.overwrite,
        };
        outputs.check()?;
        args.mesh.as_deref().map(mesh_format).transpose()?;
        let resources = settings::resources_of_rank(&args.resources, args.output.store(), args.ranks)?;
        let console = Arc::new(Console::new(Voice::of_rank(comm.as_ref(), &args.output)));
        let cloud = match read_told(&args.cloud, &|text| console.note(text))? {
            Source::Cloud(cloud) => cloud.positions,
            Source::Mesh(mesh) => {
                console.note(&format!("{} is a mesh; its vertices are taken as points", args.cloud.display()));
                mesh.vertices
            }
        };
        if spacing.is_none() || args.grid.drop_isolated.is_some() {
            Budget { total: resources.memory }.admit(spacing_memory(cloud.len()))?;
        }
        let cloud = drop_isolated(cloud, args.grid.drop_isolated, &console)?;
        let grid = grid_for(&cloud, spacing).ok_or_else(|| {
            let what = "all points lie in one place, which tells no spacing and encloses nothing";
            Error::input(what).at(&args.cloud)
        })?;
        let laid = laid_grid(&args.grid, &grid, &cloud, &console)?;
        settings.keeps_grid = laid.is_some();
        let grid = laid.unwrap_or(grid);
        refuse_too_fine(&grid, resources.memory).map_err(|error| {
            let rest = || strays(&cloud, spacing).filter(|(_, grid)| refuse_too_fine(grid, resources.memory).is_ok());
            match args.grid.drop_isolated.map_or_else(rest, |_| None) {
                Some((alone, _)) => far_strays(alone, cloud.len()).at(&args.cloud),
                None => error,
            }
        })?;
        let typed = typed.to_vec();
        Ok(Self { args, typed, settings, resources, cloud, grid, console, cancel, started, comm })
    }

    /// Refuses ranks that were given something else.
    fn check_agreed(&self) -> Result<()> {
        let output = &self.args.output;
        let written = (output.store(), output.live, output.dry_run, output.ome, output.compress);
        let mut sets = DataSets::default();
        if self.comm.ranks() > 1 {
            sets.add_cloud(&self.cloud);
        }
        check_agreed(self.comm.as_ref(), &format!("{:?} {:?} {written:?}", self.grid, self.settings), &sets)
    }

    /// Fields are written out, or needed for the mesh.
    fn writes_fields(&self) -> bool {
        self.args.output.store().is_some()
    }

    /// Refuses a run that cannot fit memory or disk.
    fn fits(&self, estimate: &Estimate) -> Result<u64> {
        let disk = Disk::of_cloud(&self.resources, self.args.output.store(), estimate)?;
        let disk = if self.args.mesh.is_some() { disk.with_mesh_near(estimate.near_voxels) } else { disk };
        disk.check(|text| self.console.note(text))
    }

    /// What the run will take, in a few lines.
    fn plan(&self, estimate: &Estimate) -> String {
        let [x, y, z] = self.grid.shape;
        format!(
            "{}: {} points, spacing {}, {x} x {y} x {z} voxels (x, y, z), {} of them near the points\n\
             about {}; memory up to {}, at least {}; {} of temporary fields, in memory or in {}",
            self.args.cloud.display(),
            grouped(self.cloud.len() as u64),
            triple(self.grid.spacing),
            grouped(estimate.near_voxels),
            duration(estimate.seconds),
            bytes(self.resources.memory),
            bytes(Budget::least(estimate.held)),
            bytes(estimate.scratch),
            self.resources.scratch.display()
        )
    }

    fn run(&self, seconds: f64, most: u64) -> Result<()> {
        let engine = self.resources.engine(&self.cancel, self.console.clone())?.as_rank(self.comm.clone());
        let engine = survivable(engine, (&self.args.output, &self.typed), None, self.console.as_ref())?;
        engine.outlook().expect(with_page(plan(seconds, self.writes_fields()), self.writes_fields()));
        let result = self.solve_and_write(&engine);
        self.console.clear();
        engine.settle_save_points(&result);
        let found = told_of_room(result, most, &self.args.output)?;
        if !self.args.output.quiet && self.comm.rank() == 0 {
            print(&format!("{}\n{}", table::stages(&engine.reports()), describe_found(&found)))?;
        }
        Ok(())
    }

    fn solve_and_write(&self, engine: &Engine) -> Result<Reconstruction> {
        let output = &self.args.output;
        let (store, telling) = begin_store_on_ranks(output, engine)?;
        let (scratch, is_copy) = (self.resources.scratch.as_path(), store.is_some());
        let replace = output.overwrite;
        let points = || self.cloud.clone();
        // The first rank alone draws the surface.
        let is_first = self.comm.rank() == 0;
        let path = self.args.mesh.as_deref().filter(|_| is_first);
        let values = path.map(|path| distance_to_marks(engine, path, points)).transpose()?.flatten();
        let values = values.as_ref();
        let to = path.map(|path| ToFile { path, scratch, is_tagged: false, is_copy, replace, values });
        let mut drawing = Drawing::new(store.as_ref().filter(|_| is_first), to, &self.grid, false)?;
        let found = reconstruct_shown(engine, &self.grid, &self.cloud, &self.settings, (&mut drawing, store.as_ref()))
            .map_err(|error| error.at(&self.args.cloud))?;
        let (geometry, segments) = (&self.grid, Segments::Object(1));
        let viewers = ForViewers { engine, store: store.as_ref(), geometry, segments };
        let (mesh, copy) = if is_first { drawing.finish(&viewers)? } else { (None, None) };
        if let Some(store) = &store {
            found.write(engine, store)?;
        }
        let ranks = gather_ranks(engine)?;
        let store = join_store(store, engine)?;
        if !is_first {
            return Ok(found);
        }
        self.note_lost(&found);
        note_anchor(self.args.mesh.as_deref(), &found.geometry, &self.console);
        if let Some(store) = store {
            // The points once more; pictures go without them where the memory does.
            let (mut sources, taken) = (DataSets::default(), engine.hold(size_of_val(self.cloud.as_slice()) as u64));
            if taken.is_ok() {
                sources.add_cloud(&self.cloud);
            }
            let evidence = Evidence {
                root: Root::LevelSet,
                measure: Measure::ToMarks,
                sources: &sources,
                centre: found.geometry.position(found.geometry.shape.map(|n| n / 2)),
                points: "points",
            };
            let written = Written { store: &store, engine, console: self.console.as_ref() };
            written.write(&evidence, || self.report(engine, &ranks, (&found, copy)))?;
            engine.check()?;
            drop(telling);
            store.finish()?;
        }
        engine.check()?;
        mesh.map_or(Ok(()), Finished::place)?;
        if let Some(path) = &output.report {
            self.report(engine, &ranks, (&found, copy)).write(path, output.overwrite)?;
        }
        Ok(found)
    }

    /// Says where the surface is not that of the points.
    fn note_lost(&self, found: &Reconstruction) {
        let (lost, all) = (found.lost_points, self.cloud.len() as u64);
        if MOST_LOST * lost > all {
            self.console.note(&format!(
                "{} of {} points are farther than a voxel from the surface; where it has shrunk away from them a larger --beta \
                 may hold it, where they are stray points --drop-isolated leaves them out",
                grouped(lost),
                grouped(all)
            ));
        }
    }

    fn report(
        &self,
        engine: &Engine,
        rank_reports: &[RankReport],
        (found, copy): (&Reconstruction, Option<Simplified>),
    ) -> Report<Settings, Found> {
        let ran = Ran {
            command: "reconstruct",
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
            Settings::new(&self.args, &self.settings, &self.resources.scratch, found),
            &found.geometry,
            Found::new(found, self.cloud.len() as u64, copy),
        )
    }
}

/// The points that stand alone, and the grid around the others.
fn strays(cloud: &[[f64; 3]], spacing: Option<[f64; 3]>) -> Option<(usize, Geometry)> {
    let kept = without_isolated(cloud, ISOLATED_SPACINGS * typical_spacing(cloud)?);
    let alone = cloud.len() - kept.len();
    if alone == 0 { None } else { Some((alone, grid_for(&kept, spacing)?)) }
}

fn far_strays(alone: usize, all: usize) -> Error {
    Error::usage(format!(
        "{} of {} points stand alone, and a grid that holds them and the others does not fit the memory; give \
         --drop-isolated to leave them out",
        grouped(alone as u64),
        grouped(all as u64)
    ))
}
