//! The time loop of the level set over the cells of the band (algorithms: section 5, "Time loop"; section 10).
//!
//! A step assembles the scheme of each cell from the old values and relaxes it; cells of even and odd parity take
//! turns until the corrections are small. Coefficients are made anew at each visit: that costs less than moving
//! them through memory, and a cell's whole work stays in cache.

use super::band::{Band, read_mask};
use crate::error::Result;
use crate::exec::{Boundary, Engine, HaloPlan, Reach, Stage, Workers, checkerboard};
use crate::grid::Slot;
use crate::kernel::level_set::CELL;
use crate::kernel::level_set::covolume::{CellMask, Coefficients, Fields, Planes, Velocity, assemble};
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
    /// A step is solved when the root mean square of the corrections is below this.
    pub solver_tolerance: f64,
}

/// How the time loop ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Evolution {
    /// Steps taken.
    pub steps: u32,
    /// Relaxations of each cell, all steps together.
    pub sor_iterations: u64,
    /// Which rule ended it.
    pub stopped_by: &'static str,
    /// What the rule looked at when it ended.
    pub residual: f64,
}

/// Relaxations of a cell each time it is taken up.
const LOCAL_ITERATIONS: usize = 2;
/// Visits of a cell in one step at most; the tolerance is reached long before.
const MAX_VISITS: usize = 30;

struct Worker {
    old: HaloTile<f32>,
    u: HaloTile<f32>,
    d: HaloTile<f32>,
    g: HaloTile<f32>,
    mask: CellMask,
    planes: Planes,
    scheme: Coefficients,
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
            scheme: Coefficients::new(),
        }
    }
}

/// What one visit of a cell tells.
#[derive(Clone, Copy, Debug, Default)]
struct Visit {
    sums: CellSums,
    gradient: f64,
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
    // Cells without a solved voxel never change: both time levels hold their start.
    copy_start(stage, band)?;
    while done.steps < settings.max_steps {
        let [all, faces] = plans.clone();
        let solver = Solver { engine, stage, band, edges, settings, spacing, all, faces, workers };
        let (step, visits) = solver.step()?;
        workers = solver.workers;
        band.u.swap(0, 1);
        done.steps += 1;
        done.sor_iterations += visits * LOCAL_ITERATIONS as u64;
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
    stage.iterated(done.sor_iterations, done.residual);
    Ok(done)
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
    /// One time step from `band.u[0]` to `band.u[1]`; returns its motion and how often each cell was visited.
    fn step(&self) -> Result<(Step, u64)> {
        let set = self.band.solved.set();
        let waves = checkerboard(set, |_| true);
        let mut visits = vec![Visit::default(); set.len()];
        let mut rounds = 0;
        loop {
            for (colour, wave) in waves.iter().enumerate() {
                let results = self
                    .stage
                    .run(wave, &self.workers, |worker, &slot| Ok(self.visit(worker, slot, rounds, colour)))?;
                self.engine.comm().publish_faces(wave)?;
                wave.iter().zip(results).for_each(|(&slot, visit)| visits[slot as usize] = visit);
            }
            rounds += 1;
            let correction = self.sum(&visits, |v| v.sums.correction_squared)? / self.band.voxels.max(1) as f64;
            if correction.sqrt() < self.settings.solver_tolerance || rounds >= MAX_VISITS {
                break;
            }
        }
        let volume: f64 = self.spacing.iter().product();
        let area = self.sum(&visits, |v| v.gradient)? * volume;
        let swept = self.sum(&visits, |v| v.sums.moved)? * volume;
        let l2 = (self.sum(&visits, |v| v.sums.moved_squared)? * volume).sqrt();
        let speed = swept / (area * f64::from(self.settings.velocity.tau)).max(f64::MIN_POSITIVE);
        Ok((Step { speed, l2 }, rounds as u64))
    }

    /// Sums over cells in grid order.
    fn sum(&self, visits: &[Visit], of: impl Fn(&Visit) -> f64) -> Result<f64> {
        let partial: Vec<f64> = visits.iter().map(of).collect();
        self.engine.comm().sum(&partial)
    }

    /// Assembles a cell's scheme, relaxes it, writes it back.
    fn visit(&self, w: &mut Worker, slot: Slot, round: usize, colour: usize) -> Visit {
        let [old, new] = &self.band.u;
        read_mask(&self.band.solved, slot, &mut w.mask);
        if w.mask.count == 0 {
            return Visit::default();
        }
        self.all.gather(old, slot, Boundary::Mirror, &mut w.old);
        self.faces.gather(&self.band.distance, slot, Boundary::Mirror, &mut w.d);
        if let Some(edges) = self.edges {
            self.faces.gather(edges, slot, Boundary::Mirror, &mut w.g);
        }
        let fields = Fields { u: w.old.data(), d: w.d.data(), g: w.g.data() };
        assemble(fields, &w.mask, self.spacing, &self.settings.velocity, &mut w.planes, &mut w.scheme);
        if round == 0 {
            w.u.clone_from(&w.old);
            // Cells of the first colour start from old ghosts; the second colour's neighbours are already new.
            if colour == 1 {
                self.faces.gather_halo(new, slot, Boundary::Mirror, &mut w.u);
            }
        } else {
            self.faces.gather(new, slot, Boundary::Mirror, &mut w.u);
        }
        let correction = relax(w.u.data_mut(), &w.scheme, &w.mask, self.settings.omega, LOCAL_ITERATIONS);
        self.faces.scatter(&w.u, new, slot);
        Visit { sums: motion(w.u.data(), w.old.data(), &w.mask, correction), gradient: w.scheme.gradient_sum }
    }
}
