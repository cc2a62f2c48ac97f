//! The time loop of the level set over the cells of the band (docs/algorithms.md, "Time loop").
//!
//! A step assembles the scheme of each cell from the old values and relaxes it, from where the last two steps point to;
//! cells of even and odd parity take turns, and those that needed corrections, or stand beside one that did, are taken
//! up again until the corrections are small. A scheme is made again at each visit: most cells are visited once a step,
//! and writing it to memory and reading it back would cost as much.

use super::band::{Band, read_mask};
use super::growing::Growing;
use super::time_loop::{Evolution, Stop, Taken, TimeLoop};
use crate::error::Result;
use crate::exec::{Boundary, Engine, Exchange, HaloPlan, Place, Reach, Relax, Stage, Waves, Workers};
use crate::exec::{checkerboard, one_wave};
use crate::grid::{BrickSet, FACES, Slot};
use crate::kernel::level_set::cell::{CELL, CELL_LEN, GROWN_LEN};
use crate::kernel::level_set::scheme::border::Border;
use crate::kernel::level_set::scheme::covolume::{Planes, assemble};
use crate::kernel::level_set::scheme::mask::CellMask;
use crate::kernel::level_set::scheme::sor::{CellSums, Halves, Relaxation, extrapolate, motion, relax};
use crate::kernel::level_set::scheme::system::SCHEME_LEN;
use crate::kernel::level_set::scheme::velocity::Fields;
use crate::store::BrickArray;
use crate::tile::HaloTile;

/// Relaxations of a cell each time it is taken up: enough to shrink its corrections about tenfold.
const LOCAL_ITERATIONS: usize = 4;
/// Visits of a cell in one step at most; only steps far longer than a spacing need more than a few.
const MAX_VISITS: usize = 1000;

/// Rounds of a step after which nothing is over-relaxed any more. Over-relaxation converges for most systems, but not
/// for all that are unsymmetric: without curvature, in steps of many spacings, it can go round in circles. Gauss-Seidel
/// relaxation always ends at the solution, for the matrix is an M-matrix.
const OVER_RELAXED_ROUNDS: usize = 50;

/// The weight with which a ghost enters the voxel beside it: its coefficient over the diagonal, for steps of up to a
/// spacing.
const GHOST_WEIGHT: f64 = 0.5;

struct Worker {
    u: HaloTile<f32>,
    older: HaloTile<f32>,
    border: Border,
    mask: CellMask,
    planes: Planes,
    halves: Halves,
    scheme: Vec<f32>,
    /// Distance and edges, where there is no room to keep them.
    passing: Vec<f32>,
}

impl Worker {
    fn new() -> Self {
        let tile = || HaloTile::new(CELL);
        Self {
            u: tile(),
            older: tile(),
            border: Border::new(),
            mask: CellMask::new(),
            planes: Planes::new(),
            halves: Halves::new(),
            scheme: vec![0.0; SCHEME_LEN],
            passing: vec![0.0; FIXED_LEN],
        }
    }
}

/// What one visit of a cell tells.
#[derive(Clone, Copy, Debug, Default)]
struct Visit {
    sums: CellSums,
    gradient: f64,
    /// Solved voxels.
    count: u32,
    /// Sum of squares of the last corrections.
    left: f64,
    /// Roots of the sums of squared changes beside the six faces.
    border: [f64; 6],
}

/// Which cell is taken up, and by cells of which colour: the second one's neighbours are done.
#[derive(Clone, Copy, Debug)]
struct Turn {
    slot: Slot,
    colour: usize,
}

/// The order of the cells, made once.
struct Cells {
    /// Cells of even and of odd parity.
    colours: Vec<Vec<Slot>>,
    /// The cells across the six faces of each; `Slot::MAX` where there is none.
    beside: Vec<[Slot; 6]>,
}

impl Cells {
    fn new(set: &BrickSet) -> Self {
        let across = |slot| FACES.map(|face| set.neighbour(slot, face.offset()).unwrap_or(Slot::MAX));
        Self { colours: checkerboard(set), beside: (0..set.len() as Slot).map(across).collect() }
    }
}

/// One time step from `band.u` to `next`.
struct Solver<'a> {
    engine: &'a Engine,
    band: &'a Band,
    /// Where the next time level goes.
    next: &'a BrickArray<f32>,
    edges: Option<&'a BrickArray<f32>>,
    settings: &'a TimeLoop,
    spacing: [f64; 3],
    all: &'a HaloPlan,
    faces: &'a HaloPlan,
    /// What is kept of the cells, where the window has room for it; else it is made again at each visit.
    kept: Option<&'a BrickArray<f32>>,
    /// True in the first step, which fills the fixed part of what is kept.
    first: bool,
    cells: &'a Cells,
    round: usize,
    /// The last visit of each cell in this step.
    visits: Vec<Visit>,
    /// Beside each face of a cell what moved there since the cell was visited.
    unknown: Vec<[f64; 6]>,
    /// How many visits there were.
    visited: u64,
}

/// Moves the surface until it rests. The result is in `band.u`; `growing` shows what it is on the way. A stage that can be gone on
/// with puts by the last two time levels, which are all that further steps depend on.
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
    growing: Option<&mut Growing<'_>>,
) -> Result<Evolution> {
    let mut growing = growing;
    let grid = *band.solved.set().grid();
    let [all, faces] = &[HaloPlan::new(grid, Reach::All), HaloPlan::new(grid, Reach::Faces)];
    let workers = &Workers::new(Worker::new);
    let kept = room_to_keep(engine, band)?;
    let cells = &Cells::new(band.solved.set());
    let exchange = &Exchange::new(engine.comm(), band.solved.set(), all)?;
    let waves = Waves { stage, exchange, workers, waves: &cells.colours };
    let owned = one_wave(band.solved.set());
    exchange.faces(&band.distance, &owned)?;
    exchange.faces(&band.u, &owned)?;
    edges.map_or(Ok(Vec::new()), |edges| exchange.faces(edges, &owned))?;
    let mut next = second_level(stage, engine, &band.u)?;
    exchange.faces(&next, &owned)?;
    let mut save_point = stage.save_point();
    let mut taken = Taken::resume(save_point.as_ref(), engine.comm().rank() == 0, [&band.u, &next])?;
    if taken.steps > 0 {
        exchange.faces(&band.u, &owned)?;
        exchange.faces(&next, &owned)?;
    }
    let mut first = true;
    while !taken.ended && taken.steps < settings.max_steps {
        let solver = Solver {
            engine,
            band,
            next: &next,
            edges,
            settings,
            spacing,
            all,
            faces,
            kept: kept.as_ref(),
            first,
            cells,
            round: 0,
            visits: vec![Visit::default(); cells.beside.len()],
            unknown: vec![[0.0; 6]; cells.beside.len()],
            visited: 0,
        };
        let (step, visits) = solver.step(&waves)?;
        std::mem::swap(&mut band.u, &mut next);
        first = false;
        if let Some(growing) = &mut growing {
            growing.show(engine, &band.u)?;
        }
        taken.step(step.judged_by(settings.stop), visits * LOCAL_ITERATIONS as u64);
        if let Some(save_point) = &mut save_point {
            save_point.reached(taken.ended, || taken.clone(), &[&band.u, &next])?;
        }
    }
    // Cells are relaxed as often as they need: reported is the mean over all of them.
    let all = |count: f64| engine.comm().sum(&[count]);
    let mean = (all(taken.cell_iterations as f64)? / all(owned.len() as f64)?.max(1.0)).ceil() as u64;
    let done = taken.evolution(settings.stop, mean);
    stage.iterated(done.sor_iterations, done.residual);
    Ok(done)
}

/// What is kept of a cell: its distance and its edges with their halos, which never change.
const FIXED_LEN: usize = 2 * GROWN_LEN;
pub(crate) const KEPT_LAYERS: usize = FIXED_LEN.div_ceil(CELL_LEN);

/// Bricks to keep all cells' distance and edges in, halos included, if they and the band fit the window together:
/// streaming them through the disk would cost more than gathering them again, which gives the same bits.
fn room_to_keep(engine: &Engine, band: &Band) -> Result<Option<BrickArray<f32>>> {
    // Of every voxel: two time levels, distance and edges with their faces, flags.
    const BAND_BYTES: u64 = 4 * (4 + 2) + 1;
    let set = band.solved.set();
    let voxels = set.len() as u64 * set.grid().brick_len() as u64;
    let need = voxels * (BAND_BYTES + 4 * KEPT_LAYERS as u64);
    if need > engine.scratch().window() {
        return Ok(None);
    }
    BrickArray::with_layers(engine.scratch(), set, KEPT_LAYERS).map(Some)
}

/// A second time level, equal to the start: cells without a solved voxel never change.
fn second_level(stage: &Stage<'_>, engine: &Engine, u: &BrickArray<f32>) -> Result<BrickArray<f32>> {
    let set = u.set();
    let mut next = BrickArray::with_faces(engine.scratch(), set)?;
    for id in (0..set.grid().len()).filter(|&id| set.slot(id).is_none()) {
        next.set_absent(id, u.absent(id));
    }
    stage.run(&one_wave(set), &Workers::none(), |(), &slot| {
        u.read(slot, |from| next.write(slot, |to| to.copy_from_slice(from)));
        next.refresh_faces(slot);
        Ok(())
    })?;
    Ok(next)
}

/// What a time step did to the surface.
#[derive(Clone, Copy, Debug)]
struct Step {
    /// Mean motion per unit of time.
    speed: f64,
    /// Discrete L2 norm of the change.
    l2: f64,
}

impl Step {
    /// What a rule looks at, and its limit.
    fn judged_by(self, stop: Stop) -> (f64, f64) {
        match stop {
            Stop::Surface(limit) => (self.speed, limit),
            Stop::L2(limit) => (self.l2, limit),
        }
    }
}

impl Solver<'_> {
    /// Takes the step; returns its motion and the number of visits.
    ///
    /// All cells are taken up once; then again those that were left unsolved or whose neighbours were stirred since.
    fn step(mut self, waves: &Waves<'_, '_, Worker>) -> Result<(Step, u64)> {
        while self.round < MAX_VISITS && waves.nearest(&self)?.is_some() {
            waves.round(&mut self, Place::before(0.0))?;
            self.round += 1;
        }
        let volume: f64 = self.spacing.iter().product();
        let area = self.sum(|v| v.gradient)? * volume;
        let swept = self.sum(|v| v.sums.moved)? * volume;
        let l2 = (self.sum(|v| v.sums.moved_squared)? * volume).sqrt();
        let speed = swept / (area * f64::from(self.settings.velocity.tau)).max(f64::MIN_POSITIVE);
        Ok((Step { speed, l2 }, self.visited))
    }

    /// True when the corrections that a cell was left with, and those for what moved beside it since, which is unknown
    /// to it, may exceed the tolerance (root mean square).
    fn is_unsolved(&self, slot: Slot) -> bool {
        let here = &self.visits[slot as usize];
        let corrections = here.left.sqrt() + GHOST_WEIGHT * self.unknown[slot as usize].iter().sum::<f64>();
        corrections > self.settings.solver_tolerance * f64::from(here.count).sqrt()
    }

    /// Sums over cells in grid order.
    fn sum(&self, of: impl Fn(&Visit) -> f64) -> Result<f64> {
        let owned = self.band.solved.set().owned();
        let partial: Vec<f64> = self.visits[owned.start as usize..owned.end as usize].iter().map(of).collect();
        self.engine.comm().sum(&partial)
    }

    /// Makes a cell's scheme and relaxes the cell. Returns the sum of gradient norms and of the squares of the
    /// last corrections.
    fn solve(&self, w: &mut Worker, turn: Turn, fixed: &[f32]) -> (f64, f64) {
        let (Turn { slot, colour }, round) = (turn, self.round);
        let (old, new) = (&self.band.u, self.next);
        let (d, g) = fixed[..FIXED_LEN].split_at(GROWN_LEN);
        self.all.gather(old, slot, Boundary::Mirror, &mut w.u);
        let fields = Fields { u: w.u.data(), d, g };
        let gradient = assemble(fields, &w.mask, self.spacing, &self.settings.velocity, &mut w.planes, &mut w.scheme);
        if round > 0 {
            self.faces.gather(new, slot, Boundary::Mirror, &mut w.u);
        } else {
            // The new field still holds the values before the old ones, save where the first colour is done.
            self.faces.gather(new, slot, Boundary::Mirror, &mut w.older);
            extrapolate(w.u.data_mut(), w.older.data());
            if colour == 1 {
                self.faces.gather_halo(new, slot, Boundary::Mirror, &mut w.u);
            }
        }
        let omega = if round < OVER_RELAXED_ROUNDS { self.settings.omega } else { self.settings.omega.min(1.0) };
        let iterations = LOCAL_ITERATIONS;
        let by = Relaxation { scheme: &w.scheme, mask: &w.mask, omega, iterations };
        w.border.keep(w.u.data());
        (gradient, relax(w.u.data_mut(), &mut w.halves, by).last)
    }

    /// Reads distance and edges with the halo across the faces: what the forces are made of.
    fn gather_fixed(&self, tile: &mut HaloTile<f32>, slot: Slot, fixed: &mut [f32]) {
        let (d, g) = fixed[..FIXED_LEN].split_at_mut(GROWN_LEN);
        self.faces.gather(&self.band.distance, slot, Boundary::Mirror, tile);
        d.copy_from_slice(tile.data());
        if let Some(edges) = self.edges {
            self.faces.gather(edges, slot, Boundary::Mirror, tile);
            g.copy_from_slice(tile.data());
        }
    }
}

impl Relax for Solver<'_> {
    type State = f32;
    type Work = Worker;
    type Visit = Visit;
    type Note = [f64; 6];

    fn field(&self) -> &BrickArray<f32> {
        self.next
    }

    fn priority(&self, slot: Slot) -> f64 {
        if self.round == 0 || self.is_unsolved(slot) { 0.0 } else { f64::INFINITY }
    }

    /// Takes up a cell: makes its scheme, relaxes it, writes it back.
    fn visit(&self, w: &mut Worker, slot: Slot, colour: usize) -> Result<Visit> {
        let (old, new) = (&self.band.u, self.next);
        read_mask(&self.band.solved, slot, &mut w.mask);
        if w.mask.count == 0 {
            return Ok(Visit::default());
        }
        let turn = Turn { slot, colour };
        let (gradient, left) = match self.kept {
            Some(kept) if self.first && self.round == 0 => kept.write(slot, |fixed| {
                self.gather_fixed(&mut w.older, slot, fixed);
                self.solve(w, turn, fixed)
            }),
            Some(kept) => kept.read(slot, |fixed| self.solve(w, turn, fixed)),
            None => {
                let mut passing = std::mem::take(&mut w.passing);
                self.gather_fixed(&mut w.older, slot, &mut passing);
                let done = self.solve(w, turn, &passing);
                w.passing = passing;
                done
            }
        };
        self.faces.scatter(&w.u, new, slot);
        Ok(Visit {
            sums: old.read(slot, |old| motion(w.u.data(), old, &w.mask)),
            gradient,
            count: w.mask.count,
            left,
            border: w.border.moved(w.u.data()),
        })
    }

    fn note(&self, _slot: Slot, visit: &Visit) -> Option<[f64; 6]> {
        (visit.count > 0).then_some(visit.border)
    }

    fn visited(&mut self, slot: Slot, visit: Visit) {
        self.visits[slot as usize] = visit;
        self.unknown[slot as usize] = [0.0; 6];
        self.visited += 1;
    }

    fn receive(&mut self, slot: Slot, border: &[f64; 6]) {
        for (face, &beside) in FACES.iter().zip(&self.cells.beside[slot as usize]) {
            if beside != Slot::MAX {
                self.unknown[beside as usize][face.opposite().index()] += border[face.index()];
            }
        }
    }
}
