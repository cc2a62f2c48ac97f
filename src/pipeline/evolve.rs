//! The time loop of the level set over the cells of the band (algorithms: section 5, "Time loop"; section 10).
//!
//! A step assembles the scheme of each cell from the old values and relaxes it; cells of even and odd parity take
//! turns, and those that needed corrections are taken up again until the corrections are small.

use super::band::{Band, read_mask};
use crate::error::Result;
use crate::exec::{Boundary, Engine, HaloPlan, Reach, Stage, Workers, checkerboard};
use crate::grid::{FACES, Slot};
use crate::kernel::level_set::CELL;
use crate::kernel::level_set::covolume::{CellMask, Fields, Planes, SCHEME_LAYERS, SCHEME_LEN, Velocity, assemble};
use crate::kernel::level_set::sor::{CellSums, motion, relax};
use crate::store::BrickArray;
use crate::tile::HaloTile;

/// When the time loop ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stop {
    /// When the surface moves slower than this (its mean motion per unit of time).
    Surface(f64),
    /// When the discrete L2 norm of a step's change falls under this (Kósa 2015).
    L2(f64),
}

/// Settings of the time loop and its linear solver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeLoop {
    /// What moves the surface.
    pub velocity: Velocity,
    /// When to stop.
    pub stop: Stop,
    /// Steps after which to stop in any case.
    pub max_steps: u32,
    /// Over-relaxation.
    pub omega: f32,
    /// A step is solved when no cell needed corrections above this (root mean square) when it was last taken up; what is
    /// left then is about a tenth.
    pub solver_tolerance: f64,
}

/// How the time loop ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Evolution {
    /// Steps taken.
    pub steps: u32,
    /// Relaxations of a cell, all steps together, mean over the cells.
    pub sor_iterations: u64,
    /// Which rule ended it.
    pub stopped_by: &'static str,
    /// What the rule looked at when it ended.
    pub residual: f64,
}

/// Relaxations of a cell each time it is taken up: enough to shrink its corrections about tenfold.
const LOCAL_ITERATIONS: usize = 3;
/// Visits of a cell in one step at most; the tolerance is reached long before.
const MAX_VISITS: usize = 30;

struct Worker {
    old: HaloTile<f32>,
    u: HaloTile<f32>,
    d: HaloTile<f32>,
    g: HaloTile<f32>,
    mask: CellMask,
    planes: Planes,
    scheme: Vec<f32>,
}

impl Worker {
    fn new() -> Self {
        let tile = || HaloTile::new(CELL);
        Self {
            old: tile(),
            u: tile(),
            d: tile(),
            g: tile(),
            mask: CellMask::new(),
            planes: Planes::new(),
            scheme: vec![0.0; SCHEME_LEN],
        }
    }
}

/// What one visit of a cell tells.
#[derive(Clone, Copy, Debug, Default)]
struct Visit {
    sums: CellSums,
    gradient: f64,
    /// Root mean square of the first corrections: how far from solved the cell was when it was taken up.
    correction: f64,
}

struct Solver<'a> {
    engine: &'a Engine,
    stage: &'a Stage<'a>,
    band: &'a Band,
    edges: Option<&'a BrickArray<f32>>,
    settings: &'a TimeLoop,
    spacing: [f64; 3],
    all: HaloPlan,
    faces: HaloPlan,
    /// The schemes of the step, where the window has room for them; else they are made again at each visit.
    schemes: Option<BrickArray<f32>>,
    workers: Workers<Worker>,
}

/// Moves the surface until it rests. The result is in `band.u[0]`.
///
/// # Errors
/// When the run is interrupted.
pub fn evolve(
    stage: &Stage<'_>,
    engine: &Engine,
    band: &mut Band,
    edges: Option<&BrickArray<f32>>,
    spacing: [f64; 3],
    settings: &TimeLoop,
) -> Result<Evolution> {
    let grid = *band.solved.set().grid();
    let mut done = Evolution { steps: 0, sor_iterations: 0, stopped_by: "max-steps", residual: f64::INFINITY };
    let plans = [HaloPlan::new(grid, Reach::All), HaloPlan::new(grid, Reach::Faces)];
    let mut workers = Workers::new(Worker::new);
    let mut schemes = room_for_schemes(engine, band)?;
    let mut cell_iterations = 0;
    // Cells without a solved voxel never change: both time levels hold their start.
    copy_start(stage, band)?;
    while done.steps < settings.max_steps {
        let [all, faces] = plans.clone();
        let solver = Solver { engine, stage, band, edges, settings, spacing, all, faces, schemes, workers };
        let (step, visits) = solver.step()?;
        (schemes, workers) = (solver.schemes, solver.workers);
        band.u.swap(0, 1);
        done.steps += 1;
        cell_iterations += visits * LOCAL_ITERATIONS as u64;
        let (residual, limit, name) = match settings.stop {
            Stop::Surface(limit) => (step.speed, limit, "surface"),
            Stop::L2(limit) => (step.l2, limit, "l2"),
        };
        done.residual = residual;
        if residual < limit {
            done.stopped_by = name;
            break;
        }
    }
    // Cells are relaxed as often as they need: reported is the mean over all of them.
    done.sor_iterations = cell_iterations.div_ceil(band.solved.set().len().max(1) as u64);
    stage.iterated(done.sor_iterations, done.residual);
    Ok(done)
}

/// Bricks for the schemes of all cells, if they and the band fit the window together: streaming them through the disk
/// would cost more than making them again, which gives the same bits.
fn room_for_schemes(engine: &Engine, band: &Band) -> Result<Option<BrickArray<f32>>> {
    // Of every voxel: two time levels, distance and edges with their faces, flags.
    const BAND_BYTES: u64 = 4 * (4 + 2) + 1;
    let set = band.solved.set();
    let voxels = set.len() as u64 * set.grid().brick_len() as u64;
    let need = voxels * (BAND_BYTES + 4 * SCHEME_LAYERS as u64);
    if need > engine.scratch().window() {
        return Ok(None);
    }
    BrickArray::with_layers(engine.scratch(), set, SCHEME_LAYERS).map(Some)
}

fn copy_start(stage: &Stage<'_>, band: &Band) -> Result<()> {
    let set = band.solved.set();
    stage.run(&crate::exec::one_wave(set), &Workers::none(), |(), &slot| {
        band.u[0].read(slot, |from| band.u[1].write(slot, |to| to.copy_from_slice(from)));
        band.u[1].refresh_faces(slot);
        Ok(())
    })?;
    Ok(())
}

/// What a time step did to the surface.
#[derive(Clone, Copy, Debug)]
struct Step {
    /// Mean motion per unit of time.
    speed: f64,
    /// Discrete L2 norm of the change.
    l2: f64,
}

impl Solver<'_> {
    /// One time step from `band.u[0]` to `band.u[1]`; returns its motion and the number of visits.
    ///
    /// All cells are taken up once; then again those that needed corrections, and their neighbours.
    fn step(&self) -> Result<(Step, u64)> {
        let set = self.band.solved.set();
        let mut visits = vec![Visit::default(); set.len()];
        let mut due = vec![true; set.len()];
        let mut visited = 0;
        for round in 0..MAX_VISITS {
            for (colour, wave) in checkerboard(set, |slot| due[slot as usize]).iter().enumerate() {
                let results = self.stage.run(wave, &self.workers, |worker, &slot| {
                    Ok(self.visit(worker, slot, round, colour, visits[slot as usize]))
                })?;
                self.engine.comm().publish_faces(wave)?;
                wave.iter().zip(results).for_each(|(&slot, visit)| visits[slot as usize] = visit);
                visited += wave.len() as u64;
            }
            let unsolved = |slot: Slot| visits[slot as usize].correction > self.settings.solver_tolerance;
            due = (0..set.len() as Slot).map(|slot| unsolved(slot) || self.beside(slot).any(&unsolved)).collect();
            if !due.contains(&true) {
                break;
            }
        }
        let volume: f64 = self.spacing.iter().product();
        let area = self.sum(&visits, |v| v.gradient)? * volume;
        let swept = self.sum(&visits, |v| v.sums.moved)? * volume;
        let l2 = (self.sum(&visits, |v| v.sums.moved_squared)? * volume).sqrt();
        let speed = swept / (area * f64::from(self.settings.velocity.tau)).max(f64::MIN_POSITIVE);
        Ok((Step { speed, l2 }, visited))
    }

    /// The cells that share a face with one.
    fn beside(&self, slot: Slot) -> impl Iterator<Item = Slot> + '_ {
        FACES.into_iter().filter_map(move |face| self.band.solved.set().neighbour(slot, face.offset()))
    }

    /// Sums over cells in grid order.
    fn sum(&self, visits: &[Visit], of: impl Fn(&Visit) -> f64) -> Result<f64> {
        let partial: Vec<f64> = visits.iter().map(of).collect();
        self.engine.comm().sum(&partial)
    }

    /// Takes up a cell: assembles its scheme unless it was kept, relaxes it, writes it back.
    fn visit(&self, w: &mut Worker, slot: Slot, round: usize, colour: usize, last: Visit) -> Visit {
        let [old, new] = &self.band.u;
        read_mask(&self.band.solved, slot, &mut w.mask);
        if w.mask.count == 0 {
            return Visit::default();
        }
        if round == 0 || self.schemes.is_none() {
            self.all.gather(old, slot, Boundary::Mirror, &mut w.old);
        }
        if round == 0 {
            w.u.clone_from(&w.old);
            // Cells of the first colour start from old ghosts; the second colour's neighbours are already new.
            if colour == 1 {
                self.faces.gather_halo(new, slot, Boundary::Mirror, &mut w.u);
            }
        } else {
            self.faces.gather(new, slot, Boundary::Mirror, &mut w.u);
        }
        let mut scheme = std::mem::take(&mut w.scheme);
        let (gradient, squares) = match &self.schemes {
            None => (self.assemble(w, slot, &mut scheme), self.relax(w, &scheme)),
            Some(kept) if round == 0 => kept.write(slot, |kept| (self.assemble(w, slot, kept), self.relax(w, kept))),
            Some(kept) => (last.gradient, kept.read(slot, |kept| self.relax(w, kept))),
        };
        w.scheme = scheme;
        self.faces.scatter(&w.u, new, slot);
        Visit {
            sums: old.read(slot, |old| motion(w.u.data(), old, &w.mask)),
            gradient,
            correction: (squares / f64::from(w.mask.count)).sqrt(),
        }
    }

    fn relax(&self, w: &mut Worker, scheme: &[f32]) -> f64 {
        relax(w.u.data_mut(), scheme, &w.mask, self.settings.omega, LOCAL_ITERATIONS)
    }

    fn assemble(&self, w: &mut Worker, slot: Slot, scheme: &mut [f32]) -> f64 {
        self.faces.gather(&self.band.distance, slot, Boundary::Mirror, &mut w.d);
        if let Some(edges) = self.edges {
            self.faces.gather(edges, slot, Boundary::Mirror, &mut w.g);
        }
        let fields = Fields { u: w.old.data(), d: w.d.data(), g: w.g.data() };
        assemble(fields, &w.mask, self.spacing, &self.settings.velocity, &mut w.planes, scheme)
    }
}
