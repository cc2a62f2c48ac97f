//! FSM, the fast sweeping method for `|grad d| = 1` (Zhao 2005; Kósa & Mikula 2023, Alg. 2; algorithms: section 3).
//!
//! Godunov update: with `a_s` the smaller neighbour along axis s, the new value is the x with
//! `sum (((x - a_s)^+) / h_s)^2 = 1`, taken with one, two, then three axes in order of a. It is kept only when it
//! lowers the value. In and out: a grown tile of distances (physical units, infinity where nothing is known); fixed
//! voxels carry the sign bit and are never changed. Halo 1, faces. Tiles are swept along diagonals (`diagonals`).

use std::marker::PhantomData;

use super::diagonals::{Diagonals, has_wide_vectors};
use super::directions::{CHANGED, Swept, sweep_until_quiet};
use super::method::{DistanceMethod, OrderedSweeps};
use super::precision::{Precision, Real};
use crate::grid::Box3;
use crate::tile::HaloTile;

/// FSM stored as `P`, computed in `A`.
#[derive(Clone, Copy, Debug)]
pub struct FastSweeping<P, A> {
    axes: Axes<A>,
    stored: PhantomData<P>,
}

impl<P: Precision, A: Real> FastSweeping<P, A> {
    /// For a grid of that spacing.
    #[must_use]
    pub fn new(spacing: [f64; 3]) -> Self {
        Self { axes: Axes::new(spacing), stored: PhantomData }
    }
}

/// What the update needs of the spacing.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Axes<A> {
    spacing: [A; 3],
    /// `1 / h^2`.
    weight: [A; 3],
    /// One over the sum of the other two weights.
    without: [A; 3],
    /// The sum of all weights, and one over it.
    total: [A; 2],
    one: A,
    pub(crate) isotropic: bool,
}

impl<A: Real> Axes<A> {
    pub(crate) fn new(spacing: [f64; 3]) -> Self {
        let weight = spacing.map(|h| 1.0 / (h * h));
        let total: f64 = weight.iter().sum();
        let without = [weight[1] + weight[2], weight[0] + weight[2], weight[0] + weight[1]];
        Self {
            spacing: spacing.map(A::of),
            weight: weight.map(A::of),
            without: without.map(|sum| A::of(1.0 / sum)),
            total: [A::of(total), A::of(1.0 / total)],
            one: A::of(1.0),
            isotropic: spacing.iter().all(|&h| h == spacing[0]),
        }
    }
}

/// One axis of an update: the smaller neighbour, the spacing, its weight, one over the others' weights.
type Axis<A> = (A, A, A, A);

#[inline(always)]
fn order<A: Real, const ISOTROPIC: bool>(axes: &mut [Axis<A>; 3], i: usize, j: usize) {
    let (p, q) = (axes[i], axes[j]);
    let swap = q.0 < p.0;
    let pick = |a: A, b: A| if swap { b } else { a };
    if ISOTROPIC {
        (axes[i].0, axes[j].0) = (pick(p.0, q.0), pick(q.0, p.0));
    } else {
        axes[i] = (pick(p.0, q.0), pick(p.1, q.1), pick(p.2, q.2), pick(p.3, q.3));
        axes[j] = (pick(q.0, p.0), pick(q.1, p.1), pick(q.2, p.2), pick(q.3, p.3));
    }
}

/// The upwind solution for the smaller neighbours `near` along the three axes; infinity when all of them are.
///
/// Values are counted from the smallest neighbour, so that nothing cancels. Without branches: every lane of a vector
/// computes all three solutions and keeps the one that holds.
#[inline(always)]
pub(crate) fn godunov<A: Real, const ISOTROPIC: bool>(near: [A; 3], k: &Axes<A>) -> A {
    let axis = |a: usize| (near[a], k.spacing[a], k.weight[a], k.without[a]);
    let mut axes = [axis(0), axis(1), axis(2)];
    order::<A, ISOTROPIC>(&mut axes, 0, 1);
    order::<A, ISOTROPIC>(&mut axes, 1, 2);
    order::<A, ISOTROPIC>(&mut axes, 0, 1);
    let [(first, h, w1, _), (second, _, w2, _), (third, _, w3, without_third)] = axes;
    let (b, c) = (second - first, third - first);
    let zero = A::default();
    // The larger root of sum w (x - a)^2 = 1 over two axes, then over three.
    let mean = w2 * b;
    let discriminant = mean * mean - (w1 + w2) * (mean * b - k.one);
    let of_two = (mean + discriminant.larger(zero).root()) * without_third;
    let mean3 = mean + w3 * c;
    let discriminant = mean3 * mean3 - k.total[0] * (mean * b + w3 * c * c - k.one);
    let of_three = (mean3 + discriminant.larger(zero).root()) * k.total[1];
    let x = if h > b { of_two } else { h };
    let x = if x > c { of_three } else { x };
    first + x
}

/// One ordered pass over a tile laid out along diagonals, `N` voxels at a time.
#[inline(always)]
fn pass<P: Precision, A: Real, const N: usize, const ISOTROPIC: bool>(
    data: &mut [P::Lane],
    layout: &Diagonals,
    upward: [bool; 2],
    k: &Axes<A>,
) -> Swept {
    let depth = layout.valid[2];
    let passed = Diagonals::passed(upward);
    let mut swept = 0;
    for n in 0..depth {
        let z = if upward[1] { n + 1 } else { depth - n };
        for (start, count) in layout.diagonals(upward[0]) {
            let count = count.next_multiple_of(N);
            let run = layout.run(data, z * layout.plane + start, count);
            for at in (0..count).step_by(N) {
                let here = run.here[at..].first_chunk_mut::<N>();
                let beside = run.beside.map(|side| side[at..].first_chunk::<N>());
                if let (Some(here), [Some(xl), Some(xu), Some(yl), Some(yu), Some(zl), Some(zu)]) = (here, beside) {
                    swept |= lower::<P, A, N, ISOTROPIC>(here, [xl, xu, yl, yu, zl, zu], passed, k);
                }
            }
        }
    }
    swept
}

/// Lowers the voxels of one vector. Something is to be carried back to a side that was passed before and is larger.
#[inline(always)]
fn lower<P: Precision, A: Real, const N: usize, const ISOTROPIC: bool>(
    here: &mut [P::Lane; N],
    beside: [&[P::Lane; N]; 6],
    passed: [usize; 3],
    k: &Axes<A>,
) -> Swept {
    let mut value = [P::Lane::default(); N];
    let mut falls = [0_u32; N];
    for i in 0..N {
        let near = |a: usize| A::of_lane(beside[2 * a][i].magnitude().smaller(beside[2 * a + 1][i].magnitude()));
        let x = P::round(godunov::<A, ISOTROPIC>([near(0), near(1), near(2)], k));
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
    swept
}

/// A pass, compiled for each vector unit.
struct Pass<'a, P: Precision, A, const N: usize> {
    data: &'a mut [P::Lane],
    layout: &'a Diagonals,
    upward: [bool; 2],
    axes: &'a Axes<A>,
}

impl<P: Precision, A: Real, const N: usize> pulp::NullaryFnOnce for Pass<'_, P, A, N> {
    type Output = Swept;

    #[inline(always)]
    fn call(self) -> Swept {
        if self.axes.isotropic {
            pass::<P, A, N, true>(self.data, self.layout, self.upward, self.axes)
        } else {
            pass::<P, A, N, false>(self.data, self.layout, self.upward, self.axes)
        }
    }
}

/// A tile along diagonals.
#[derive(Debug)]
pub struct Work<L> {
    data: Vec<L>,
    layout: Diagonals,
}

impl<P: Precision, A: Real> FastSweeping<P, A> {
    /// Brings the tile into the layout that sweeps of direction `upward` want.
    fn lay_out(work: &mut Work<P::Lane>, tile: &HaloTile<P>, upward: [bool; 3]) {
        let turned = upward[0] != upward[1];
        if work.layout.valid != tile.valid() {
            // Places of no voxel count as fixed, so that no lane of a vector changes them.
            work.data.fill(P::Lane::default().marked());
        }
        work.layout = Diagonals { valid: tile.valid(), turned, ..work.layout };
        work.layout.load(tile, &mut work.data, |v, ghost| if ghost { v.lane().marked() } else { v.lane() });
    }

    /// Sweeps the tile as it is laid out.
    fn sweep_layout(&self, work: &mut Work<P::Lane>, upward: [bool; 3]) -> Swept {
        let Work { data, layout } = work;
        let (upward, axes) = ([upward[0], upward[2]], &self.axes);
        if has_wide_vectors() {
            pulp::Arch::new().dispatch(Pass::<P, A, 16> { data, layout, upward, axes })
        } else {
            pulp::Arch::new().dispatch(Pass::<P, A, 8> { data, layout, upward, axes })
        }
    }
}

impl<P: Precision, A: Real> DistanceMethod for FastSweeping<P, A> {
    type State = P;
    type Work = Work<P::Lane>;
    const UNKNOWN: P = P::UNKNOWN;

    fn fixed(squared: f64, _: u32) -> P {
        P::of_lane(P::round(squared.sqrt()).marked())
    }

    fn is_fixed(state: P) -> bool {
        state.lane().is_marked()
    }

    fn work(edge: usize) -> Self::Work {
        Work { data: vec![P::Lane::default().marked(); Diagonals::len(edge)], layout: Diagonals::new(edge) }
    }

    fn settle(&self, tile: &mut HaloTile<P>, work: &mut Self::Work, _: &Box3) -> bool {
        let first = downhill(tile);
        Self::lay_out(work, tile, first);
        let changed = sweep_until_quiet(first, |upward| {
            if (upward[0] != upward[1]) != work.layout.turned {
                work.layout.store(&work.data, tile, P::of_lane);
                Self::lay_out(work, tile, upward);
            }
            self.sweep_layout(work, upward)
        });
        if changed {
            work.layout.store(&work.data, tile, P::of_lane);
        }
        changed
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

impl<P: Precision, A: Real> OrderedSweeps for FastSweeping<P, A> {
    fn sweep(&self, tile: &mut HaloTile<P>, work: &mut Self::Work, _: &Box3, upward: [bool; 3]) -> bool {
        Self::lay_out(work, tile, upward);
        let changed = self.sweep_layout(work, upward) & CHANGED != 0;
        if changed {
            work.layout.store(&work.data, tile, P::of_lane);
        }
        changed
    }
}

/// The direction away from the smallest value in or around the tile: where most of what enters it goes.
fn downhill<P: Precision>(tile: &HaloTile<P>) -> [bool; 3] {
    let valid = tile.valid().map(|n| n as isize);
    let middle = valid.map(|n| n / 2);
    let mut least = (P::Lane::INFINITY, middle);
    let mut look = |at: [isize; 3]| {
        let value = tile.data()[tile.at(at[0], at[1], at[2])].lane().magnitude();
        if value < least.0 {
            least = (value, at);
        }
    };
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        for layer in [-1, valid[axis]] {
            for i in (0..valid[u]).step_by(4).chain([valid[u] - 1]) {
                for j in (0..valid[v]).step_by(4).chain([valid[v] - 1]) {
                    let mut at = [layer; 3];
                    (at[u], at[v]) = (i, j);
                    look(at);
                }
            }
        }
    }
    std::array::from_fn(|a| least.1[a] <= middle[a])
}
