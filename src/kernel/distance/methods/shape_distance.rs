//! VDT to points and triangles together (Kósa & Mikula 2023, Alg. 3 with Alg. 6; docs/algorithms.md, "Vector distance
//! transform").
//!
//! The state and its sweeps are those of `vector_distance`; only the distance to a source is another: exact
//! point–triangle distance (Eberly 1999), f64. It costs tens of additions, so a source is asked for its distance only
//! where a neighbour's differs from the kept one and from those just asked. Triangles are numbered after points; so of
//! equal distances the one to the lower label counts, and among those of one label the one kept.

use super::tracked::{CarriesSources, TrackedSource};
use crate::grid::{Box3, DataSets, Geometry, NO_SOURCE, SourceState};
use crate::kernel::distance::features::labelled_shapes::LabelledShapes;
use crate::kernel::distance::state::method::{DistanceMethod, OrderedSweeps};
use crate::kernel::distance::tile_order::directions::{CHANGED, Swept, downhill, sweep_until_quiet};
use crate::tile::{HaloTile, TileCost};

/// VDT to points and triangles.
#[derive(Clone, Debug)]
pub struct ShapeDistance<'a> {
    geometry: &'a Geometry,
    shapes: LabelledShapes<'a>,
}

impl<'a> ShapeDistance<'a> {
    /// For sources in the world and a grid.
    #[must_use]
    pub fn new(geometry: &'a Geometry, sets: &'a DataSets) -> Self {
        Self { geometry, shapes: LabelledShapes::new(sets) }
    }

    /// Whether the first of two sources has a lower label than the second.
    pub(crate) fn has_lower_label(&self, source: u32, than: u32) -> bool {
        source != NO_SOURCE && self.shapes.label(source) < self.shapes.label(than)
    }

    /// The nearest of the kept source and of those beside that were not asked yet.
    fn nearest(
        &self,
        state: &[SourceState],
        asked: &mut Asked,
        at: usize,
        strides: [usize; 3],
        here: [f64; 3],
    ) -> SourceState {
        let dirty = std::mem::take(&mut asked.dirty[at]);
        let (mut best, mut now) = (state[at].source(), [NO_SOURCE; 6]);
        for side in (0..6).filter(|side| dirty >> side & 1 == 1) {
            let source = state[beside(at, side, strides)].source();
            if source == NO_SOURCE || source == best || now.contains(&source) {
                continue;
            }
            now[side] = source;
            let kept = asked.squared(at, || self.squared(here, best));
            let squared = self.squared(here, source);
            if self.is_nearer((squared, source), (kept, best)) {
                (best, asked.squared[at]) = (source, squared);
            }
        }
        SourceState::trial(best)
    }

    fn pass(&self, tile: &mut HaloTile<SourceState>, asked: &mut Asked, part: &Box3, upward: [bool; 3]) -> Swept {
        let (valid, pitch) = (tile.valid(), tile.pitch());
        let strides = [1, pitch, pitch * pitch];
        let ordered = |axis: usize| {
            let count = valid[axis];
            (0..count).map(move |i| if upward[axis] { i } else { count - 1 - i })
        };
        let mut swept = 0;
        for z in ordered(2) {
            for y in ordered(1) {
                let row = tile.at(0, y as isize, z as isize);
                for x in ordered(0) {
                    let (at, state) = (row + x, tile.data_mut());
                    let kept = state[at];
                    if kept.is_frozen() || asked.dirty[at] == 0 {
                        continue;
                    }
                    let voxel = [part.lo[0] + x as i64, part.lo[1] + y as i64, part.lo[2] + z as i64];
                    state[at] = self.nearest(state, asked, at, strides, self.geometry.position(voxel));
                    if state[at] != kept {
                        (0..6).for_each(|side| asked.dirty[beside(at, side, strides)] |= 1 << (side ^ 1));
                        let first = [x, y, z].map(|n| n == 0);
                        let last: [bool; 3] = std::array::from_fn(|a| [x, y, z][a] + 1 == valid[a]);
                        let inside = std::array::from_fn(|a| if upward[a] { !first[a] } else { !last[a] });
                        swept |= CHANGED | self.carried_back(state, asked, (at, voxel), strides, upward, inside);
                    }
                }
            }
        }
        swept
    }

    /// The axes along which the voxel that was passed before, `inside` the tile, is nearer to the source at place `at`
    /// than to its own.
    fn carried_back(
        &self,
        state: &[SourceState],
        asked: &mut Asked,
        (at, voxel): (usize, [i64; 3]),
        strides: [usize; 3],
        upward: [bool; 3],
        inside: [bool; 3],
    ) -> Swept {
        let mut is_nearer = |axis: usize| {
            let before = if upward[axis] { at - strides[axis] } else { at + strides[axis] };
            if !inside[axis] || state[before].is_frozen() || state[before] == state[at] {
                return false;
            }
            let mut there = voxel;
            there[axis] += if upward[axis] { -1 } else { 1 };
            let there = self.geometry.position(there);
            let [carried, kept] = [state[at].source(), state[before].source()];
            let own = asked.squared(before, || self.squared(there, kept));
            self.is_nearer((self.squared(there, carried), carried), (own, kept))
        };
        (0..3).map(|axis| u32::from(is_nearer(axis)) << axis).sum()
    }
}

/// What is known about the voxels of a tile while it is swept, so that no source is asked twice.
#[derive(Debug)]
pub struct Asked {
    /// Squared distances to the kept sources; NaN where nobody asked yet.
    squared: Vec<f64>,
    /// The sides, a bit each, whose sources changed since a voxel asked them. Its own only comes nearer: whoever was
    /// not nearer before need not be asked again.
    dirty: Vec<u8>,
}

impl Asked {
    fn new(edge: usize) -> Self {
        let len = (edge + 2).pow(3);
        Self { squared: vec![f64::NAN; len], dirty: vec![ALL_SIDES; len] }
    }

    fn forget(&mut self) {
        self.squared.fill(f64::NAN);
        self.dirty.fill(ALL_SIDES);
    }

    /// The squared distance of the voxel at `place` to its source, found by `ask` if need be.
    fn squared(&mut self, place: usize, ask: impl FnOnce() -> f64) -> f64 {
        if self.squared[place].is_nan() {
            self.squared[place] = ask();
        }
        self.squared[place]
    }
}

const ALL_SIDES: u8 = 0b11_1111;

/// The place across a side, in the order -x, +x, -y, +y, -z, +z.
fn beside(at: usize, side: usize, strides: [usize; 3]) -> usize {
    let stride = strides[side / 2];
    if side.is_multiple_of(2) { at - stride } else { at + stride }
}

impl CarriesSources for ShapeDistance<'_> {
    type Sources = Self;

    fn sources(&self) -> &Self {
        self
    }
}

impl DistanceMethod for ShapeDistance<'_> {
    type Work = Asked;

    fn work(edge: usize) -> Asked {
        Asked::new(edge)
    }

    fn cost(edge: usize) -> TileCost {
        TileCost::grown(edge, (size_of::<f64>() + size_of::<u8>()) as u64)
    }

    fn settle(&self, tile: &mut HaloTile<SourceState>, asked: &mut Asked, part: &Box3) -> bool {
        asked.forget();
        let first = downhill(tile, |at, state| {
            self.squared_of_voxel(state.source(), std::array::from_fn(|a| part.lo[a] + at[a] as i64))
        });
        sweep_until_quiet(first, |upward| self.pass(tile, asked, part, upward))
    }
}

impl OrderedSweeps for ShapeDistance<'_> {
    fn sweep(&self, tile: &mut HaloTile<SourceState>, asked: &mut Asked, part: &Box3, upward: [bool; 3]) -> bool {
        asked.forget();
        self.pass(tile, asked, part, upward) & CHANGED != 0
    }
}

impl TrackedSource for ShapeDistance<'_> {
    type Number = f64;

    fn coordinate(&self, axis: usize, index: i64) -> f64 {
        self.geometry.origin[axis] + index as f64 * self.geometry.spacing[axis]
    }

    fn squared(&self, here: [f64; 3], source: u32) -> f64 {
        self.shapes.distance_squared(here, source)
    }

    fn squared_of_voxel(&self, source: u32, voxel: [i64; 3]) -> f64 {
        self.squared(self.geometry.position(voxel), source)
    }

    #[inline]
    fn is_nearer(&self, a: (f64, u32), b: (f64, u32)) -> bool {
        a.0 < b.0 || (a.0 == b.0 && self.has_lower_label(a.1, b.1))
    }
}
