//! FSM, the fast sweeping method for `|grad d| = 1` (Zhao 2005; Kósa & Mikula 2023, Alg. 2; docs/algorithms.md, "Fast
//! sweeping").
//!
//! Each voxel takes the upwind solution (`upwind`) when that lowers its value. In and out: a grown tile of distances
//! (physical units, infinity where nothing is known); fixed voxels carry the sign bit and are never changed. Halo 1,
//! faces. Tiles are swept along diagonals (`diagonals`). Where sources are wanted, a sweep also tells which voxels fell
//! and from which neighbours (Alg. 7); `sweep_sources` makes sources of that.
//!
//! `UNEVEN`, it is the same for `|grad T| = 1/F` (docs/algorithms.md, "Travel times"): values are times, and a tile comes
//! with the speed F of each of its voxels (length by time, 0 where nothing passes).

use std::marker::PhantomData;

use super::sweep_sources::Fell;
use super::upwind::{Axes, Upwind, solve_at};
use crate::grid::Box3;
use crate::kernel::distance::state::method::{DistanceMethod, DistanceState, OrderedSweeps, TakesSpeeds};
use crate::kernel::distance::state::precision::{Precision, Real};
use crate::kernel::distance::tile_order::diagonals::{Diagonals, MOST_LANES, has_wide_vectors};
use crate::kernel::distance::tile_order::directions::{CHANGED, Swept, downhill, sweep_until_quiet};
use crate::tile::{HaloTile, TileCost};

/// FSM stored as `P`, computed in `A`; `UNEVEN` where each voxel has a speed of its own.
#[derive(Clone, Copy, Debug)]
pub struct FastSweeping<P, A, const UNEVEN: bool = false> {
    axes: Axes<A>,
    stored: PhantomData<P>,
}

impl<P: Precision, A: Real, const UNEVEN: bool> FastSweeping<P, A, UNEVEN> {
    /// For a grid of that spacing.
    #[must_use]
    pub fn new(spacing: [f64; 3]) -> Self {
        Self { axes: Axes::new(spacing), stored: PhantomData }
    }
}

/// What is kept of the voxels that fall in a pass.
trait Record {
    /// Whether voxels of a diagonal are taken in the order of the sweep too.
    const ORDERED: bool;

    /// Those of a vector whose bits are 1 in `falls` fell, from those beside them; `more` axes entered beside the
    /// first.
    fn fell<L: Real, const N: usize>(
        &mut self,
        falls: &[u32; N],
        more: &[u32; N],
        beside: [&[L; N]; 6],
        place: Place<'_>,
    );
}

/// Where a vector of voxels lies in a tile.
#[derive(Clone, Copy)]
struct Place<'a> {
    layout: &'a Diagonals,
    z: usize,
    /// The first voxel's place in the plane.
    at: usize,
}

/// Nothing is kept.
struct Forget;

impl Record for Forget {
    const ORDERED: bool = false;

    #[inline(always)]
    fn fell<L: Real, const N: usize>(&mut self, _: &[u32; N], _: &[u32; N], _: [&[L; N]; 6], _: Place<'_>) {}
}

impl Record for Vec<Fell> {
    const ORDERED: bool = true;

    #[inline(always)]
    fn fell<L: Real, const N: usize>(
        &mut self,
        falls: &[u32; N],
        more: &[u32; N],
        beside: [&[L; N]; 6],
        Place { layout, z, at }: Place<'_>,
    ) {
        let (lower_y, upper_y) = if layout.turned { (3, 2) } else { (2, 3) };
        let mut from = [Upwind::default(); MOST_LANES];
        let mut which = 0;
        for i in 0..N {
            let value = |side: usize| beside[side][i].magnitude();
            let beside = [value(0), value(1), value(lower_y), value(upper_y), value(4), value(5)];
            from[i] = Upwind::new(beside, more[i]);
            which |= falls[i] << i;
        }
        let (s, y) = (at / layout.row, at % layout.row);
        let (x, y) = (s - y, if layout.turned { layout.valid[1] + 1 - y } else { y });
        self.push(Fell { first: [x, y, z].map(|n| n as i16 - 1), which: which as u16, from });
    }
}

/// One ordered pass over a tile laid out along diagonals, `N` voxels at a time; `speeds` are laid out alike.
#[inline(always)]
fn pass<P: Precision, A: Real, R: Record, const N: usize, const ISOTROPIC: bool, const UNEVEN: bool>(
    (data, speeds): (&mut [P::Lane], &[f32]),
    layout: &Diagonals,
    upward: [bool; 2],
    k: &Axes<A>,
    record: &mut R,
) -> Swept {
    let depth = layout.valid[2];
    let passed = Diagonals::passed(upward);
    let mut swept = 0;
    for n in 0..depth {
        let z = if upward[1] { n + 1 } else { depth - n };
        for (start, count) in layout.diagonals(upward[0]) {
            let count = count.next_multiple_of(N);
            let run = layout.run(data, z * layout.plane + start, count);
            for n in (0..count).step_by(N) {
                let at = if R::ORDERED && !upward[0] { count - N - n } else { n };
                let here = run.here[at..].first_chunk_mut::<N>();
                let beside = run.beside.map(|side| side[at..].first_chunk::<N>());
                let from = z * layout.plane + start + at;
                let speeds = if UNEVEN { speeds[from..].first_chunk::<N>() } else { Some(&[1.0; N]) };
                if let (Some(here), [Some(xl), Some(xu), Some(yl), Some(yu), Some(zl), Some(zu)], Some(speeds)) =
                    (here, beside, speeds)
                {
                    let place = Place { layout, z, at: start + at };
                    let voxels = (here, [xl, xu, yl, yu, zl, zu], speeds);
                    swept |= lower::<P, A, R, N, ISOTROPIC, UNEVEN>(voxels, passed, k, (place, record));
                }
            }
        }
    }
    swept
}

/// The voxels of one vector, those beside them, and their speeds.
type Vector<'v, L, const N: usize> = (&'v mut [L; N], [&'v [L; N]; 6], &'v [f32; N]);

/// Lowers the voxels of one vector. Something is to be carried back to a side that was passed before and is larger.
#[inline(always)]
fn lower<P: Precision, A: Real, R: Record, const N: usize, const ISOTROPIC: bool, const UNEVEN: bool>(
    (here, beside, speeds): Vector<'_, P::Lane, N>,
    passed: [usize; 3],
    k: &Axes<A>,
    (place, record): (Place<'_>, &mut R),
) -> Swept {
    let mut value = [P::Lane::default(); N];
    let (mut falls, mut more) = ([0_u32; N], [0_u32; N]);
    for i in 0..N {
        let near = |a: usize| A::of_lane(beside[2 * a][i].magnitude().smaller(beside[2 * a + 1][i].magnitude()));
        let solution = solve_at::<A, ISOTROPIC, UNEVEN>([near(0), near(1), near(2)], k, A::of_lane(speeds[i]));
        let x = P::round(solution.value);
        more[i] = solution.more::<P>();
        // A fixed voxel is below zero and so below anything.
        falls[i] = u32::from(x < here[i]);
        value[i] = if x < here[i] { x } else { here[i] };
    }
    if falls.iter().fold(0, |any, f| any | f) == 0 {
        return 0;
    }
    let mut swept = CHANGED;
    for (axis, side) in passed.into_iter().enumerate() {
        let before = beside[side];
        let mut back = 0;
        for i in 0..N {
            back |= falls[i] & u32::from(value[i] < before[i]);
        }
        swept |= back << axis;
    }
    *here = value;
    record.fell(&falls, &more, beside, place);
    swept
}

/// A pass, compiled for each vector unit.
struct Pass<'a, P: Precision, A, R, const N: usize, const UNEVEN: bool> {
    data: &'a mut [P::Lane],
    speeds: &'a [f32],
    layout: &'a Diagonals,
    upward: [bool; 2],
    axes: &'a Axes<A>,
    record: &'a mut R,
}

impl<P: Precision, A: Real, R: Record, const N: usize, const UNEVEN: bool> pulp::NullaryFnOnce
    for Pass<'_, P, A, R, N, UNEVEN>
{
    type Output = Swept;

    #[inline(always)]
    fn call(self) -> Swept {
        let Self { data, speeds, layout, upward, axes, record } = self;
        if axes.isotropic {
            pass::<P, A, R, N, true, UNEVEN>((data, speeds), layout, upward, axes, record)
        } else {
            pass::<P, A, R, N, false, UNEVEN>((data, speeds), layout, upward, axes, record)
        }
    }
}

/// A tile along diagonals.
#[derive(Debug)]
pub struct Work<L> {
    data: Vec<L>,
    layout: Diagonals,
    /// Where voxels have speeds, these as they were told, and laid out alike.
    told: HaloTile<f32>,
    speeds: Vec<f32>,
}

impl<P: Precision, A: Real, const UNEVEN: bool> FastSweeping<P, A, UNEVEN> {
    /// Brings the tile into the layout that sweeps of direction `upward` want.
    fn lay_out(work: &mut Work<P::Lane>, tile: &HaloTile<P>, upward: [bool; 3]) {
        let turned = upward[0] != upward[1];
        if work.layout.valid != tile.valid() {
            // Places of no voxel count as fixed, so that no lane of a vector changes them.
            work.data.fill(P::Lane::default().marked());
        }
        work.layout = Diagonals { valid: tile.valid(), turned, ..work.layout };
        work.layout.load(tile, &mut work.data, |v, ghost| if ghost { v.lane().marked() } else { v.lane() });
        if UNEVEN {
            work.layout.load(&work.told, &mut work.speeds, |speed, _| speed);
        }
    }

    /// Sweeps the tile as it is laid out.
    fn sweep_layout<R: Record>(&self, work: &mut Work<P::Lane>, upward: [bool; 3], record: &mut R) -> Swept {
        let Work { data, layout, speeds, .. } = work;
        let (upward, axes) = ([upward[0], upward[2]], &self.axes);
        if has_wide_vectors() {
            pulp::Arch::new().dispatch(Pass::<P, A, R, 16, UNEVEN> { data, speeds, layout, upward, axes, record })
        } else {
            pulp::Arch::new().dispatch(Pass::<P, A, R, 8, UNEVEN> { data, speeds, layout, upward, axes, record })
        }
    }

    fn sweep_tile<R: Record>(
        &self,
        tile: &mut HaloTile<P>,
        work: &mut Work<P::Lane>,
        upward: [bool; 3],
        record: &mut R,
    ) -> bool {
        Self::lay_out(work, tile, upward);
        let changed = self.sweep_layout(work, upward, record) & CHANGED != 0;
        if changed {
            work.layout.store(&work.data, tile, P::of_lane);
        }
        changed
    }

    /// As [`OrderedSweeps::sweep`]; `fell` becomes the voxels that fell, those whose sources others take before these,
    /// as in the triple loop.
    pub fn sweep_recording(
        &self,
        tile: &mut HaloTile<P>,
        work: &mut Work<P::Lane>,
        upward: [bool; 3],
        fell: &mut Vec<Fell>,
    ) -> bool {
        fell.clear();
        self.sweep_tile(tile, work, upward, fell)
    }
}

impl<P: Precision, A: Real, const UNEVEN: bool> DistanceState for FastSweeping<P, A, UNEVEN> {
    type State = P;
    const UNKNOWN: P = P::UNKNOWN;

    fn fixed(squared: f64, _: u32) -> P {
        P::of_lane(P::round(squared.sqrt()).marked())
    }

    fn is_fixed(state: P) -> bool {
        state.lane().is_marked()
    }

    fn entering(&self, beside: P, state: P, _: [i64; 3]) -> Option<f64> {
        let value = beside.lane().magnitude();
        (value < state.lane()).then(|| value.f64())
    }

    fn distance(&self, state: P, _: [i64; 3]) -> f64 {
        state.lane().magnitude().f64()
    }

    fn source(_: P) -> Option<u32> {
        None
    }
}

impl<P: Precision, A: Real, const UNEVEN: bool> DistanceMethod for FastSweeping<P, A, UNEVEN> {
    type Work = Work<P::Lane>;

    fn work(edge: usize) -> Self::Work {
        let (told, places) = if UNEVEN { (HaloTile::new(edge), Diagonals::len(edge)) } else { (HaloTile::new(0), 0) };
        let data = vec![P::Lane::default().marked(); Diagonals::len(edge)];
        Work { data, layout: Diagonals::new(edge), told, speeds: vec![0.0; places] }
    }

    fn cost(edge: usize) -> TileCost {
        let places = Diagonals::len(edge);
        let speeds = if UNEVEN { (places + (edge + 2).pow(3)) * size_of::<f32>() } else { 0 };
        TileCost { halo: 1, scratch: (places * size_of::<P::Lane>() + speeds) as u64 }
    }

    fn settle(&self, tile: &mut HaloTile<P>, work: &mut Self::Work, _: &Box3) -> bool {
        let first = downhill(tile, |_, value| value.lane().magnitude().f64());
        Self::lay_out(work, tile, first);
        let changed = sweep_until_quiet(first, |upward| {
            if (upward[0] != upward[1]) != work.layout.turned {
                work.layout.store(&work.data, tile, P::of_lane);
                Self::lay_out(work, tile, upward);
            }
            self.sweep_layout(work, upward, &mut Forget)
        });
        if changed {
            work.layout.store(&work.data, tile, P::of_lane);
        }
        changed
    }
}

impl<P: Precision, A: Real> TakesSpeeds for FastSweeping<P, A, true> {
    fn speeds(work: &mut Self::Work) -> &mut HaloTile<f32> {
        &mut work.told
    }
}

impl<P: Precision, A: Real, const UNEVEN: bool> OrderedSweeps for FastSweeping<P, A, UNEVEN> {
    fn sweep(&self, tile: &mut HaloTile<P>, work: &mut Self::Work, _: &Box3, upward: [bool; 3]) -> bool {
        self.sweep_tile(tile, work, upward, &mut Forget)
    }
}
