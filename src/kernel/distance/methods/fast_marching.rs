//! FMM, the fast marching method for `|grad d| = 1` (Sethian 1996; Kósa & Mikula 2023, Alg. 4; docs/algorithms.md,
//! "Fast marching") inside a tile.
//!
//! The update, its arithmetic and the state are those of `fast_sweeping`; only the order is another. What enters a
//! tile, from ghosts and fixed voxels, is marched through it in order of value: all voxels of a bucket hand their
//! values on together (a group, Kim 2001, doi:10.1137/S1064827500367130), so that the neighbours to be updated can be
//! taken by whole vectors and each only once. Where a group was not causal a voxel falls again: the march ends when
//! none can, in the fixed point of the update, which FSM swept to convergence has too, but for rounding. For f32
//! fields, computed in f32, that is within 8 units in the last place of the textbook's heap (`marching_heap`, f64) with
//! equal spacing, and within 64 with spacings of 6 : 1, over random clouds (tests: `wavefront`). In and out: a grown
//! tile of distances (physical units, infinity where nothing is known), the sign bit set on fixed voxels. Halo 1,
//! faces. Scratch: about 12 bytes a voxel. Each voxel costs about two updates, whatever the shape of the front.
//!
//! `UNEVEN`, it is the same for `|grad T| = 1/F` (docs/algorithms.md, "Travel times"), as `fast_sweeping` has it. A bucket
//! is then as wide as the tile's mean slowness makes it; a front that is not causal within one costs some updates more.

use super::fast_sweeping::FastSweeping;
use super::upwind::{Axes, godunov_at};
use crate::grid::Box3;
use crate::kernel::distance::state::method::{DistanceMethod, DistanceState, TakesSpeeds};
use crate::kernel::distance::state::precision::{Precision, Real};
use crate::kernel::distance::tile_order::buckets::{Buckets, LISTED_BYTES, QUEUE_BYTES};
use crate::tile::{HaloTile, TileCost};

/// Voxels updated at a time.
const LANES: usize = 8;

/// Width of a bucket, in the smallest spacing.
const WIDTH: f64 = 0.5;

/// FMM stored as `P`, computed in `A`; `UNEVEN` where each voxel has a speed of its own.
#[derive(Clone, Copy, Debug)]
pub struct FastMarching<P, A, const UNEVEN: bool = false> {
    /// The same equation: what a state means and when it may fall.
    sweeping: FastSweeping<P, A>,
    axes: Axes<A>,
    spacing: [f64; 3],
}

impl<P: Precision, A: Real, const UNEVEN: bool> FastMarching<P, A, UNEVEN> {
    /// For a grid of that spacing.
    #[must_use]
    pub fn new(spacing: [f64; 3]) -> Self {
        Self { sweeping: FastSweeping::new(spacing), axes: Axes::new(spacing), spacing }
    }
}

/// A tile and its queue.
#[derive(Debug)]
pub struct Work<L> {
    /// The grown tile; ghosts count as fixed and carry the sign bit.
    data: Vec<L>,
    queue: Buckets<L>,
    /// Voxels to update, and whether a voxel is among them.
    listed: Vec<u32>,
    is_listed: Vec<bool>,
    /// Voxels that fell.
    fallen: Vec<u32>,
    taken: Vec<u32>,
    /// Of the voxels, where these have any.
    speeds: HaloTile<f32>,
}

impl<L: Real> Work<L> {
    fn new(edge: usize, has_speeds: bool) -> Self {
        let len = (edge + 2).pow(3);
        Self {
            data: vec![L::default().marked(); len],
            queue: Buckets::new(len),
            listed: Vec::new(),
            is_listed: vec![false; len],
            fallen: Vec::new(),
            taken: Vec::new(),
            speeds: HaloTile::new(if has_speeds { edge } else { 0 }),
        }
    }

    /// Lists the neighbours of a voxel that its value may lower. A fixed one is below zero and so below anything.
    #[inline(always)]
    fn list_beside(&mut self, place: usize, value: L, strides: [usize; 3]) {
        for stride in strides {
            for beside in [place - stride, place + stride] {
                if value < self.data[beside] && !self.is_listed[beside] {
                    self.is_listed[beside] = true;
                    self.listed.push(beside as u32);
                }
            }
        }
    }

    /// Lists what ghosts and fixed voxels may lower.
    fn list_beside_fixed(&mut self, tile: &HaloTile<impl Copy + Default>) {
        let (valid, pitch) = (tile.valid(), tile.pitch());
        let strides = [1, pitch, pitch * pitch];
        for z in 1..=valid[2] {
            for y in 1..=valid[1] {
                let row = (z * pitch + y) * pitch;
                for place in row + 1..=row + valid[0] {
                    if self.data[place].is_marked() {
                        self.list_beside(place, self.data[place].magnitude(), strides);
                    }
                }
            }
        }
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            for (layer, inner) in [(0, 1), (valid[axis] + 1, valid[axis])] {
                for j in 1..=valid[v] {
                    for i in 1..=valid[u] {
                        let line = i * strides[u] + j * strides[v];
                        let (ghost, place) = (line + layer * strides[axis], line + inner * strides[axis]);
                        if self.data[ghost].magnitude() < self.data[place] && !self.is_listed[place] {
                            self.is_listed[place] = true;
                            self.listed.push(place as u32);
                        }
                    }
                }
            }
        }
    }
}

/// Updates the listed voxels, a vector at a time; leaves those that fell.
#[inline(always)]
fn update<P: Precision, A: Real, const ISOTROPIC: bool, const UNEVEN: bool>(
    work: &mut Work<P::Lane>,
    strides: [usize; 3],
    k: &Axes<A>,
) {
    let Work { data, listed, is_listed, fallen, speeds, .. } = work;
    fallen.clear();
    for group in listed.chunks(LANES) {
        let mut places = [group[0]; LANES];
        places[..group.len()].copy_from_slice(group);
        let mut near = [[A::default(); LANES]; 3];
        let mut speed = [A::default(); LANES];
        for i in 0..LANES {
            let place = places[i] as usize;
            if UNEVEN {
                speed[i] = A::of_lane(speeds.data()[place]);
            }
            for a in 0..3 {
                let (lower, upper) = (data[place - strides[a]], data[place + strides[a]]);
                near[a][i] = A::of_lane(lower.magnitude().smaller(upper.magnitude()));
            }
        }
        let mut value = [P::Lane::default(); LANES];
        for i in 0..LANES {
            let near = [near[0][i], near[1][i], near[2][i]];
            value[i] = P::round(godunov_at::<A, ISOTROPIC, UNEVEN>(near, k, speed[i]));
        }
        for (&place, &value) in group.iter().zip(&value) {
            is_listed[place as usize] = false;
            let here = &mut data[place as usize];
            if value < *here {
                *here = value;
                fallen.push(place);
            }
        }
    }
    listed.clear();
}

/// Marches until nothing falls; returns whether anything did.
#[inline(always)]
fn march<P: Precision, A: Real, const ISOTROPIC: bool, const UNEVEN: bool>(
    work: &mut Work<P::Lane>,
    strides: [usize; 3],
    k: &Axes<A>,
    [width, range]: [f64; 2],
) -> bool {
    update::<P, A, ISOTROPIC, UNEVEN>(work, strides, k);
    if work.fallen.is_empty() {
        return false;
    }
    let least = work.fallen.iter().fold(P::Lane::INFINITY, |least, &place| least.smaller(work.data[place as usize]));
    work.queue.start(least, width, range);
    loop {
        for &place in &work.fallen {
            work.queue.push(place, work.data[place as usize]);
        }
        if !work.queue.take(&mut work.taken) {
            return true;
        }
        for n in 0..work.taken.len() {
            let place = work.taken[n] as usize;
            work.list_beside(place, work.data[place], strides);
        }
        update::<P, A, ISOTROPIC, UNEVEN>(work, strides, k);
    }
}

/// A march, compiled for each vector unit.
struct March<'a, P: Precision, A, const UNEVEN: bool> {
    work: &'a mut Work<P::Lane>,
    strides: [usize; 3],
    axes: &'a Axes<A>,
    reach: [f64; 2],
}

impl<P: Precision, A: Real, const UNEVEN: bool> pulp::NullaryFnOnce for March<'_, P, A, UNEVEN> {
    type Output = bool;

    #[inline(always)]
    fn call(self) -> bool {
        if self.axes.isotropic {
            march::<P, A, true, UNEVEN>(self.work, self.strides, self.axes, self.reach)
        } else {
            march::<P, A, false, UNEVEN>(self.work, self.strides, self.axes, self.reach)
        }
    }
}

impl<P: Precision, A: Real, const UNEVEN: bool> DistanceState for FastMarching<P, A, UNEVEN> {
    type State = P;
    const UNKNOWN: P = P::UNKNOWN;

    fn fixed(squared: f64, source: u32) -> P {
        FastSweeping::<P, A>::fixed(squared, source)
    }

    fn is_fixed(state: P) -> bool {
        FastSweeping::<P, A>::is_fixed(state)
    }

    fn entering(&self, beside: P, state: P, voxel: [i64; 3]) -> Option<f64> {
        self.sweeping.entering(beside, state, voxel)
    }

    fn distance(&self, state: P, voxel: [i64; 3]) -> f64 {
        self.sweeping.distance(state, voxel)
    }

    fn source(_: P) -> Option<u32> {
        None
    }
}

impl<P: Precision, A: Real, const UNEVEN: bool> DistanceMethod for FastMarching<P, A, UNEVEN> {
    type Work = Work<P::Lane>;

    fn work(edge: usize) -> Self::Work {
        Work::new(edge, UNEVEN)
    }

    fn cost(edge: usize) -> TileCost {
        // Values and what is listed; the places that are listed, that fell and that are taken.
        let lists = 3 * LISTED_BYTES;
        let speed = if UNEVEN { size_of::<f32>() } else { 0 };
        TileCost::grown(edge, (size_of::<P::Lane>() + size_of::<bool>() + speed) as u64 + QUEUE_BYTES + lists)
    }

    fn settle(&self, tile: &mut HaloTile<P>, work: &mut Self::Work, _: &Box3) -> bool {
        let (valid, pitch) = (tile.valid(), tile.pitch());
        let strides = [1, pitch, pitch * pitch];
        load(tile, &mut work.data);
        work.list_beside_fixed(tile);
        let mut width = WIDTH * self.spacing.iter().copied().fold(f64::INFINITY, f64::min);
        let mut range = (0..3).map(|a| self.spacing[a] * valid[a] as f64).sum::<f64>();
        if UNEVEN {
            let [mean, most] = slowness(&work.speeds, valid);
            (width, range) = (width * mean, range * most);
        }
        let reach = [width, range];
        let changed = pulp::Arch::new().dispatch(March::<P, A, UNEVEN> { work, strides, axes: &self.axes, reach });
        if changed {
            store(&work.data, tile);
        }
        changed
    }
}

impl<P: Precision, A: Real> TakesSpeeds for FastMarching<P, A, true> {
    fn speeds(work: &mut Self::Work) -> &mut HaloTile<f32> {
        &mut work.speeds
    }
}

/// The mean and the largest slowness of the voxels of a tile that can be passed; 1 where none can.
fn slowness(speeds: &HaloTile<f32>, [nx, ny, nz]: [usize; 3]) -> [f64; 2] {
    let pitch = speeds.pitch();
    let (mut sum, mut count, mut least) = (0.0, 0_u32, f32::INFINITY);
    for row in (1..=nz).flat_map(|z| (1..=ny).map(move |y| (z * pitch + y) * pitch + 1)) {
        for &speed in speeds.data()[row..][..nx].iter().filter(|speed| **speed > 0.0) {
            (sum, count, least) = (sum + 1.0 / f64::from(speed), count + 1, least.min(speed));
        }
    }
    if count == 0 { [1.0; 2] } else { [sum / f64::from(count), 1.0 / f64::from(least)] }
}

/// Copies a grown tile in; ghosts get the sign bit.
fn load<P: Precision>(tile: &HaloTile<P>, data: &mut [P::Lane]) {
    let ([nx, ny, nz], pitch) = (tile.valid(), tile.pitch());
    for z in 0..nz + 2 {
        for y in 0..ny + 2 {
            let row = (z * pitch + y) * pitch;
            let (from, to) = (&tile.data()[row..][..nx + 2], &mut data[row..][..nx + 2]);
            let beyond = y == 0 || z == 0 || y > ny || z > nz;
            to.iter_mut()
                .zip(from)
                .for_each(|(to, from)| *to = if beyond { from.lane().marked() } else { from.lane() });
            (to[0], to[nx + 1]) = (to[0].marked(), to[nx + 1].marked());
        }
    }
}

/// Copies the voxels back.
fn store<P: Precision>(data: &[P::Lane], tile: &mut HaloTile<P>) {
    let ([nx, ny, nz], pitch) = (tile.valid(), tile.pitch());
    for z in 1..=nz {
        for y in 1..=ny {
            let row = (z * pitch + y) * pitch + 1;
            let to = &mut tile.data_mut()[row..][..nx];
            to.iter_mut().zip(&data[row..]).for_each(|(to, &from)| *to = P::of_lane(from));
        }
    }
}
