//! The `sweep` schedule: ordered passes over all bricks, bit for bit the textbook's triple loops for any brick size and
//! number of threads and ranks (docs/algorithms.md, "The sweep schedule").

use crate::error::Result;
use crate::exec::{Boundary, Exchange, HaloPlan, Reach, Relax, Stage, Waves, Workers, sweep_waves};
use crate::grid::{BrickSet, FACES, Slot};
use crate::kernel::distance::state::method::OrderedSweeps;
use crate::kernel::distance::state::neighbours::SWEEPS;
use crate::store::BrickArray;
use crate::tile::HaloTile;

/// What a visit of a brick left.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Visit {
    /// Whether any voxel fell.
    pub(crate) changed: bool,
    /// Whether the companion has work left in the brick.
    pub(crate) left: bool,
}

/// What goes along with the sweeps of a method.
pub(crate) trait Companion<M: OrderedSweeps>: Sync {
    /// Buffers of one thread.
    type Work: Send + 'static;

    /// Buffers for bricks of `edge`^3 voxels.
    fn work(edge: usize) -> Self::Work;

    /// Sweeps a gathered tile.
    fn sweep(&self, visit: Swept<'_, M, Self::Work>, slot: Slot, upward: [bool; 3]) -> Visit;

    /// Bricks of this rank changed in a wave.
    fn after_wave(&mut self, _changed: &[(Slot, Visit)]) -> Result<()> {
        Ok(())
    }

    /// A sweep is over.
    fn after_sweep(&mut self, _stage: &Stage<'_>, _upward: [bool; 3]) -> Result<()> {
        Ok(())
    }
}

/// A tile, the method that sweeps it, and the buffers that both have.
pub(crate) struct Swept<'t, M: OrderedSweeps, W> {
    pub(crate) method: &'t M,
    pub(crate) tile: &'t mut HaloTile<M::State>,
    pub(crate) work: &'t mut M::Work,
    pub(crate) along: &'t mut W,
}

/// Nothing goes along.
pub(crate) struct NoCompanion<'a>(pub(crate) &'a BrickSet);

impl<M: OrderedSweeps> Companion<M> for NoCompanion<'_> {
    type Work = ();

    fn work(_: usize) {}

    fn sweep(&self, Swept { method, tile, work, .. }: Swept<'_, M, ()>, slot: Slot, upward: [bool; 3]) -> Visit {
        let part = self.0.grid().brick_box(self.0.id(slot));
        Visit { changed: method.sweep(tile, work, &part, upward), left: false }
    }
}

/// Sweeps up to `iterations` times in all eight directions, or until an iteration changes nothing.
///
/// `start` are this rank's bricks that hold fixed voxels. A brick in which a sweep changed nothing is passed over until
/// one beside it changes: no sweep of any direction could change it.
pub(crate) fn sweep_all<M: OrderedSweeps, C: Companion<M>>(
    stage: &Stage<'_>,
    method: &M,
    array: &BrickArray<M::State>,
    companion: &mut C,
    start: &[Slot],
    iterations: u32,
) -> Result<()> {
    let set = array.set();
    let edge = set.grid().edge() as usize;
    let plan = HaloPlan::new(*set.grid(), Reach::Faces);
    let exchange = &Exchange::new(stage.comm(), set, &plan)?;
    let workers = &Workers::new(move || (HaloTile::new(edge), M::work(edge), C::work(edge)));
    let begun_elsewhere = exchange.faces(array, start)?;
    let (quiet, changed) = (vec![true; set.len()], Vec::new());
    let mut sweeps = Sweeps { method, array, companion, plan, upward: SWEEPS[0], quiet, changed };
    for &slot in start.iter().chain(&begun_elsewhere) {
        sweeps.quiet[slot as usize] = false;
        sweeps.receive(slot, &[]);
    }
    for _ in 0..iterations {
        let mut resting = true;
        for upward in SWEEPS {
            sweeps.upward = upward;
            let waves = &sweep_waves(set, upward);
            resting &= !Waves { stage, exchange, workers, waves }.round(&mut sweeps, 0.0)?;
            sweeps.companion.after_sweep(stage, upward)?;
        }
        stage.iterated(1, 0.0);
        if !stage.comm().any(!resting)? {
            break;
        }
    }
    Ok(())
}

struct Sweeps<'a, M: OrderedSweeps, C> {
    method: &'a M,
    array: &'a BrickArray<M::State>,
    companion: &'a mut C,
    plan: HaloPlan,
    upward: [bool; 3],
    /// Bricks that no sweep of any direction could change.
    quiet: Vec<bool>,
    /// Those of this rank that changed in the wave.
    changed: Vec<(Slot, Visit)>,
}

impl<M: OrderedSweeps, C: Companion<M>> Relax for Sweeps<'_, M, C> {
    type State = M::State;
    type Work = (HaloTile<M::State>, M::Work, C::Work);
    type Visit = Visit;
    type Note = [f64; 0];

    fn field(&self) -> &BrickArray<M::State> {
        self.array
    }

    fn priority(&self, slot: Slot) -> f64 {
        if self.quiet[slot as usize] { f64::INFINITY } else { 0.0 }
    }

    fn visit(&self, (tile, work, along): &mut Self::Work, slot: Slot, _wave: usize) -> Result<Visit> {
        self.plan.gather(self.array, slot, Boundary::Constant(M::UNKNOWN), tile);
        let visit = self.companion.sweep(Swept { method: self.method, tile, work, along }, slot, self.upward);
        if visit.changed {
            self.plan.scatter(tile, self.array, slot);
        }
        Ok(visit)
    }

    fn note(&self, _slot: Slot, visit: &Visit) -> Option<[f64; 0]> {
        visit.changed.then_some([])
    }

    fn visited(&mut self, slot: Slot, visit: Visit) {
        self.quiet[slot as usize] = !visit.changed;
        if visit.changed {
            self.changed.push((slot, visit));
        }
    }

    fn receive(&mut self, slot: Slot, _note: &[f64; 0]) {
        let set = self.array.set();
        let beside = FACES.iter().filter_map(|face| set.neighbour(slot, face.offset()));
        beside.for_each(|n| self.quiet[n as usize] = false);
    }

    fn after_wave(&mut self) -> Result<()> {
        let changed = std::mem::take(&mut self.changed);
        self.companion.after_wave(&changed)
    }
}
