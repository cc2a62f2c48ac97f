//! FMM over a whole volume in memory, in the textbook's order (Kósa & Mikula 2023, Alg. 4; with sources Alg. 8;
//! docs/algorithms.md, "Fast marching").
//!
//! One heap: the smallest voxel is frozen and its six neighbours are updated from frozen ones by the upwind solution.
//! Fixed voxels are on trial from the beginning. With sources, a voxel that freezes takes that of the frozen one of its
//! 26 neighbours with the smallest sum of its distance and the way to it; of equal sums the one of the lowest label, where
//! labels are wanted, else the first, z slowest. In and
//! out: dense `[z][y][x]` arrays, distances in physical units, the sign bit set on fixed voxels. Computed in f64,
//! rounded to `P` at every update. `fast_marching`, in a front of bricks, computes f32 fields in f32 and takes what a
//! voxel's neighbours end with: the two differ by rounding alone. With speeds, values are times (docs/algorithms.md,
//! "Travel times").

use super::wavefront::Wavefront;
use crate::grid::{DataSets, FACES, Geometry, NEIGHBOURS_26, NO_SOURCE, SourceState};
use crate::kernel::distance::methods::upwind::{Axes, godunov, godunov_at};
use crate::kernel::distance::state::precision::{Precision, Real};

/// Bytes of a voxel beside its distance and source: whether it is frozen, and its entries in the heap.
pub const SCRATCH_BYTES: u64 = 25;

/// A march under way.
#[derive(Debug)]
pub struct MarchingHeap<'a, P> {
    front: Wavefront,
    axes: Axes<f64>,
    values: &'a mut [P],
    sources: Option<&'a mut [SourceState]>,
    /// Of each voxel, where a front is not equally fast everywhere.
    speeds: Option<&'a [f32]>,
    /// What tells which label is lower.
    sets: Option<&'a DataSets>,
    /// Lengths of the 26 steps.
    steps: [f64; 26],
}

impl<'a, P: Precision> MarchingHeap<'a, P> {
    /// Ready to start from the fixed voxels among `values`; everything else is infinite. With the data sets, where
    /// their labels are wanted.
    #[must_use]
    pub fn new(
        geometry: &Geometry,
        values: &'a mut [P],
        sources: Option<&'a mut [SourceState]>,
        sets: Option<&'a DataSets>,
    ) -> Self {
        let mut front = Wavefront::new(geometry.shape);
        for (place, value) in values.iter().map(|value| value.lane()).enumerate().filter(|(_, v)| v.is_marked()) {
            front.push(place, value.f64());
        }
        let steps = NEIGHBOURS_26.map(|offset| geometry.length(offset));
        Self { front, axes: Axes::new(geometry.spacing), values, sources, speeds: None, sets, steps }
    }

    /// The same where voxels have speeds; sources are not followed there.
    #[must_use]
    pub fn through(self, speeds: Option<&'a [f32]>) -> Self {
        Self { speeds, ..self }
    }

    /// Freezes up to `count` voxels; false when all that can be reached are frozen.
    pub fn advance(&mut self, count: usize) -> bool {
        for _ in 0..count {
            let Some(place) = self.front.freeze() else { return false };
            let voxel = self.front.voxel(place);
            for face in FACES {
                if let Some(beside) = self.front.beside(voxel, face.offset()) {
                    self.update(beside);
                }
            }
            self.take_source(place, voxel);
        }
        true
    }

    /// The distance of a frozen voxel; infinite for any other.
    fn frozen(&self, place: Option<usize>) -> f64 {
        let value = |place: usize| self.values[place].lane().magnitude().f64();
        place.filter(|&place| self.front.is_frozen(place)).map_or(f64::INFINITY, value)
    }

    fn update(&mut self, place: usize) {
        let kept = self.values[place].lane();
        if kept.is_marked() || self.front.is_frozen(place) {
            return;
        }
        let voxel = self.front.voxel(place);
        let near = std::array::from_fn(|a| {
            let side = |upper: usize| self.frozen(self.front.beside(voxel, FACES[2 * a + upper].offset()));
            side(0).min(side(1))
        });
        let value = P::round(match self.speeds {
            Some(speeds) => godunov_at::<f64, false, true>(near, &self.axes, f64::from(speeds[place])),
            None => godunov::<f64, false>(near, &self.axes),
        });
        if value < kept {
            self.values[place] = P::of_lane(value);
            self.front.push(place, value.f64());
        }
    }

    fn take_source(&mut self, place: usize, voxel: [i64; 3]) {
        if self.values[place].lane().is_marked() {
            return;
        }
        let Some(sources) = &self.sources else { return };
        let mut best = (f64::INFINITY, NO_SOURCE);
        for (offset, step) in NEIGHBOURS_26.iter().zip(self.steps) {
            let beside = self.front.beside(voxel, *offset);
            let way = self.frozen(beside) + step;
            let Some(beside) = beside.filter(|_| way <= best.0 && way < f64::INFINITY) else { continue };
            let source = sources[beside].source();
            let is_lower = || self.sets.is_some_and(|sets| sets.label(source) < sets.label(best.1));
            if way < best.0 || is_lower() {
                best = (way, source);
            }
        }
        if let Some(sources) = &mut self.sources {
            sources[place] = SourceState::trial(best.1);
        }
    }
}
