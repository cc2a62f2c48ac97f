//! VDT, the vector distance transform (Danielsson 1980; Kósa & Mikula 2023, Alg. 3; docs/algorithms.md, "Vector
//! distance transform").
//!
//! Each voxel carries the index of its nearest known source. In the eight ordered passes it looks at the sources of
//! its six face neighbours and keeps the one nearest by Euclidean distance; the distance follows from the source. Of
//! equal distances the one already kept stays, then the first of -x, +x, -y, +y, -z, +z. In and out: a grown tile of
//! source indices, the top bit set on voxels that a source fixed. Halo 1, faces. While a tile is worked on every voxel
//! holds its source's position beside the index, so that sweeps look nothing up.

use super::tracked::{CarriesSources, TrackedSource};
use crate::grid::{Box3, Geometry, SourceState};
use crate::kernel::distance::state::method::{DistanceMethod, OrderedSweeps};
use crate::kernel::distance::state::precision::Real;
use crate::kernel::distance::state::source::squared_distance;
use crate::kernel::distance::tile_order::diagonals::{Diagonals, MOST_LANES, Run, has_wide_vectors};
use crate::kernel::distance::tile_order::directions::{CHANGED, Swept, downhill, sweep_until_quiet};
use crate::kernel::distance::tile_order::dirty::Dirty;
use crate::tile::{HaloTile, TileCost};

/// VDT to points, compared in `A`.
#[derive(Clone, Debug)]
pub struct VectorDistance<'a, A> {
    geometry: &'a Geometry,
    positions: &'a [[f64; 3]],
    /// The positions as they are compared: in f64 in the world, else from the grid's origin.
    points: Vec<[A; 3]>,
}

impl<'a, A: Real> VectorDistance<'a, A> {
    /// For points in the world and a grid.
    #[must_use]
    pub fn new(geometry: &'a Geometry, positions: &'a [[f64; 3]]) -> Self {
        let from = if A::KEEPS_WORLD { [0.0; 3] } else { geometry.origin };
        let points = positions.iter().map(|p| std::array::from_fn(|a| A::of(p[a] - from[a]))).collect();
        Self { geometry, positions, points }
    }

    pub(crate) fn point(&self, source: u32) -> [A; 3] {
        self.points.get(source as usize).copied().unwrap_or([A::INFINITY; 3])
    }
}

/// A tile along diagonals: sources and their coordinates, and the coordinates of its voxels.
#[derive(Debug)]
pub struct Work<A> {
    layout: Diagonals,
    dirty: Dirty,
    source: Vec<SourceState>,
    point: [Vec<A>; 3],
    /// Coordinates of voxels along x (from the upper end on), y and z, by index from the lower ghost.
    at: [Vec<A>; 3],
}

/// The nearest source so far of one voxel.
#[derive(Clone, Copy)]
struct Nearest<A> {
    squared: A,
    source: SourceState,
    point: [A; 3],
}

#[inline(always)]
pub(crate) fn squared<A: Real>(here: [A; 3], point: [A; 3]) -> A {
    let (dx, dy, dz) = (here[0] - point[0], here[1] - point[1], here[2] - point[2]);
    dx * dx + dy * dy + dz * dz
}

impl<A: Real> Nearest<A> {
    /// Looks at a source beside the voxel; without branches, so that lanes stay together.
    #[inline(always)]
    fn offered(self, here: [A; 3], free: bool, source: SourceState, point: [A; 3]) -> Self {
        let squared = squared(here, point);
        let nearer = (squared < self.squared) & free;
        let pick = |a: A, b: A| if nearer { a } else { b };
        Self {
            squared: pick(squared, self.squared),
            source: if nearer { source.thaw() } else { self.source },
            point: [pick(point[0], self.point[0]), pick(point[1], self.point[1]), pick(point[2], self.point[2])],
        }
    }
}

/// `N` voxels of a run and those beside them; y sides as the layout has them.
struct Lanes<'a, T, const N: usize> {
    here: &'a mut [T; N],
    beside: [&'a [T; N]; 6],
}

impl<'a, T, const N: usize> Lanes<'a, T, N> {
    #[inline(always)]
    fn new(run: &'a mut Run<'_, T>, at: usize) -> Self {
        let here = run.here[at..].first_chunk_mut().expect("runs are whole vectors");
        let [xl, xu, yl, yu, zl, zu] = run.beside;
        // Written out: a map over the six would be a call.
        let beside = [chunk(xl, at), chunk(xu, at), chunk(yl, at), chunk(yu, at), chunk(zl, at), chunk(zu, at)];
        Self { here, beside }
    }
}

#[inline(always)]
fn chunk<T, const N: usize>(run: &[T], at: usize) -> &[T; N] {
    run[at..].first_chunk().expect("runs are whole vectors")
}

/// Coordinates of the voxels of a vector, and of those that were passed before them along x, y and z.
struct Places<'a, A, const N: usize> {
    x: [&'a [A; N]; 2],
    y: [&'a [A; N]; 2],
    z: [A; 2],
}

/// Takes the nearest of the kept source and the six beside for each voxel of a vector. Where y is turned round
/// (`TURNED`), the neighbour at y - 1 stands where y + 1 does. Something is to be carried back to a side that was
/// passed before and is nearer to the source taken than to its own.
#[inline(always)]
fn nearest<A: Real, const N: usize, const TURNED: bool>(
    Lanes { here: source, beside: sources }: Lanes<'_, SourceState, N>,
    point: [Lanes<'_, A, N>; 3],
    places: &Places<'_, A, N>,
    passed: [usize; 3],
) -> Swept {
    let (yl, yu) = if TURNED { (3, 2) } else { (2, 3) };
    let [px, py, pz] = point;
    let mut kept = [SourceState::default(); N];
    let mut points = [[A::default(); N]; 3];
    let mut falls = [0_u32; N];
    for i in 0..N {
        let here = [places.x[0][i], places.y[0][i], places.z[0]];
        let point = [px.here[i], py.here[i], pz.here[i]];
        let free = !source[i].is_frozen();
        let at = |side: usize| (sources[side][i], [px.beside[side][i], py.beside[side][i], pz.beside[side][i]]);
        let start = Nearest { squared: squared(here, point), source: source[i], point };
        let [(s0, p0), (s1, p1), (s2, p2)] = [at(0), at(1), at(yl)];
        let [(s3, p3), (s4, p4), (s5, p5)] = [at(yu), at(4), at(5)];
        let found = start.offered(here, free, s0, p0).offered(here, free, s1, p1).offered(here, free, s2, p2);
        let found = found.offered(here, free, s3, p3).offered(here, free, s4, p4).offered(here, free, s5, p5);
        kept[i] = found.source;
        falls[i] = u32::from(found.squared < start.squared);
        (points[0][i], points[1][i], points[2][i]) = (found.point[0], found.point[1], found.point[2]);
    }
    if falls.iter().fold(0, |any, f| any | f) == 0 {
        return 0;
    }
    let mut swept = CHANGED;
    for (axis, side) in passed.into_iter().enumerate() {
        let step = |a: usize| usize::from(a == axis);
        let mut back = 0;
        for i in 0..N {
            let there = [places.x[step(0)][i], places.y[step(1)][i], places.z[step(2)]];
            let own = squared(there, [px.beside[side][i], py.beside[side][i], pz.beside[side][i]]);
            let free = u32::from(!sources[side][i].is_frozen());
            back |= falls[i] & free & u32::from(squared(there, [points[0][i], points[1][i], points[2][i]]) < own);
        }
        swept |= back << axis;
    }
    *source = kept;
    (*px.here, *py.here, *pz.here) = (points[0], points[1], points[2]);
    swept
}

/// One ordered pass, `N` voxels at a time.
#[inline(always)]
fn pass<A: Real, const N: usize, const TURNED: bool>(work: &mut Work<A>, upward: [bool; 2]) -> Swept {
    let Work { layout, dirty, source, point: [px, py, pz], at: [at_x, at_y, at_z] } = work;
    let (depth, last_x) = (layout.valid[2], layout.edge() + 1);
    let passed = Diagonals::passed(upward);
    // Coordinates along x are kept from the upper end on.
    let before = |at: usize, up: bool| if up { at - 1 } else { at + 1 };
    let mut swept = 0;
    for n in 0..depth {
        let z = if upward[1] { n + 1 } else { depth - n };
        let z_places = [at_z[z], at_z[before(z, upward[1])]];
        for (start, count) in layout.diagonals(upward[0]) {
            let (s, y) = (start / layout.row, start % layout.row);
            if !dirty.take(z, s) {
                continue;
            }
            let count = count.next_multiple_of(N);
            let place = z * layout.plane + start;
            let mut fell = 0;
            let x = last_x + y - s;
            let mut sources = layout.run(source, place, count);
            let [mut run_x, mut run_y, mut run_z] =
                [layout.run(px, place, count), layout.run(py, place, count), layout.run(pz, place, count)];
            for at in (0..count).step_by(N) {
                let places = Places {
                    x: [chunk(at_x, x + at), chunk(at_x, before(x + at, !upward[0]))],
                    y: [chunk(at_y, y + at), chunk(at_y, before(y + at, upward[0]))],
                    z: z_places,
                };
                let points = [Lanes::new(&mut run_x, at), Lanes::new(&mut run_y, at), Lanes::new(&mut run_z, at)];
                fell |= nearest::<A, N, TURNED>(Lanes::new(&mut sources, at), points, &places, passed);
            }
            dirty.mark(z, s, fell, upward);
            swept |= fell;
        }
    }
    swept
}

/// A pass, compiled for each vector unit.
struct Pass<'a, A, const N: usize> {
    work: &'a mut Work<A>,
    upward: [bool; 2],
}

impl<A: Real, const N: usize> pulp::NullaryFnOnce for Pass<'_, A, N> {
    type Output = Swept;

    #[inline(always)]
    fn call(self) -> Swept {
        if self.work.layout.turned {
            pass::<A, N, true>(self.work, self.upward)
        } else {
            pass::<A, N, false>(self.work, self.upward)
        }
    }
}

impl<A: Real> Work<A> {
    fn new(edge: usize) -> Self {
        let len = Diagonals::len(edge);
        Self {
            layout: Diagonals::new(edge),
            dirty: Dirty::new(edge),
            source: vec![SourceState::FAR.freeze(); len],
            point: std::array::from_fn(|_| vec![A::INFINITY; len]),
            at: std::array::from_fn(|_| vec![A::default(); edge + 3 + MOST_LANES]),
        }
    }

    fn sweep(&mut self, upward: [bool; 3]) -> Swept {
        let upward = [upward[0], upward[2]];
        if has_wide_vectors() {
            pulp::Arch::new().dispatch(Pass::<A, 16> { work: self, upward })
        } else {
            pulp::Arch::new().dispatch(Pass::<A, 8> { work: self, upward })
        }
    }
}

impl<A: Real> VectorDistance<'_, A> {
    /// Brings the tile into the layout that sweeps of direction `upward` want. Ghosts count as fixed.
    fn lay_out(&self, work: &mut Work<A>, tile: &HaloTile<SourceState>, part: &Box3, upward: [bool; 3]) {
        let valid = tile.valid();
        if work.layout.valid != valid {
            work.source.fill(SourceState::FAR.freeze());
            work.point.iter_mut().for_each(|p| p.fill(A::INFINITY));
        }
        work.layout = Diagonals { valid, turned: upward[0] != upward[1], ..work.layout };
        work.layout.load(tile, &mut work.source, |state, ghost| if ghost { state.freeze() } else { state });
        let Work { layout, source, point: [px, py, pz], at, .. } = work;
        for run in layout.whole_diagonals() {
            let (px, py, pz) = (&mut px[run.clone()], &mut py[run.clone()], &mut pz[run.clone()]);
            for (((x, y), z), &state) in px.iter_mut().zip(py).zip(pz).zip(&source[run]) {
                [*x, *y, *z] = self.point(state.source());
            }
        }
        let last = tile.edge() + 1;
        for n in 0..=last {
            let index = |axis: usize, n: usize| self.coordinate(axis, part.lo[axis] + n as i64 - 1);
            at[0][last - n] = index(0, n);
            at[1][n] = index(1, if layout.turned { (valid[1] + 1).saturating_sub(n) } else { n });
            at[2][n] = index(2, n);
        }
    }
}

impl<A: Real> CarriesSources for VectorDistance<'_, A> {
    type Sources = Self;

    fn sources(&self) -> &Self {
        self
    }
}

impl<A: Real> DistanceMethod for VectorDistance<'_, A> {
    type Work = Work<A>;

    fn work(edge: usize) -> Work<A> {
        Work::new(edge)
    }

    fn cost(edge: usize) -> TileCost {
        // Sources and their three coordinates along diagonals; a flag for each of these.
        let laid_out = Diagonals::len(edge) * (size_of::<SourceState>() + 3 * size_of::<A>());
        TileCost { halo: 1, scratch: (laid_out + Dirty::len(edge)) as u64 }
    }

    fn settle(&self, tile: &mut HaloTile<SourceState>, work: &mut Work<A>, part: &Box3) -> bool {
        let first = downhill(tile, |at, state| {
            let here = std::array::from_fn(|a| self.coordinate(a, part.lo[a] + at[a] as i64));
            squared(here, self.point(state.source())).f64()
        });
        self.lay_out(work, tile, part, first);
        work.dirty.all(tile.valid());
        let changed = sweep_until_quiet(first, |upward| {
            if (upward[0] != upward[1]) != work.layout.turned {
                work.layout.store(&work.source, tile, |s| s);
                self.lay_out(work, tile, part, upward);
                work.dirty.turn();
            }
            work.sweep(upward)
        });
        if changed {
            work.layout.store(&work.source, tile, |s| s);
        }
        changed
    }
}

impl<A: Real> OrderedSweeps for VectorDistance<'_, A> {
    fn sweep(&self, tile: &mut HaloTile<SourceState>, work: &mut Work<A>, part: &Box3, upward: [bool; 3]) -> bool {
        self.lay_out(work, tile, part, upward);
        work.dirty.all(tile.valid());
        let changed = work.sweep(upward) & CHANGED != 0;
        if changed {
            work.layout.store(&work.source, tile, |s| s);
        }
        changed
    }
}

impl<A: Real> TrackedSource for VectorDistance<'_, A> {
    type Number = A;

    fn coordinate(&self, axis: usize, index: i64) -> A {
        let step = index as f64 * self.geometry.spacing[axis];
        A::of(if A::KEEPS_WORLD { self.geometry.origin[axis] + step } else { step })
    }

    #[inline(always)]
    fn squared(&self, here: [A; 3], source: u32) -> A {
        squared(here, self.point(source))
    }

    #[inline]
    fn squared_of_voxel(&self, source: u32, voxel: [i64; 3]) -> f64 {
        let position = self.positions.get(source as usize);
        position.map_or(f64::INFINITY, |&p| squared_distance(self.geometry.position(voxel), p))
    }

    /// The same bits as one by one.
    fn squared_row(&self, sources: &[u32], start: [i64; 3], out: &mut [f64]) {
        // Looked up first and computed afterwards: lookups come one by one, sums a vector at a time.
        const AT_A_TIME: usize = 16;
        let [_, y, z] = self.geometry.position(start);
        let chunks = sources.chunks(AT_A_TIME).zip(out.chunks_mut(AT_A_TIME));
        for (n, (sources, out)) in chunks.enumerate() {
            let mut from = [[f64::INFINITY; AT_A_TIME]; 3];
            let mut here = [0.0; AT_A_TIME];
            for (i, &source) in sources.iter().enumerate() {
                if let Some(p) = self.positions.get(source as usize) {
                    (from[0][i], from[1][i], from[2][i]) = (p[0], p[1], p[2]);
                }
                here[i] = self.geometry.position([start[0] + (n * AT_A_TIME + i) as i64, 0, 0])[0];
            }
            for (i, out) in out.iter_mut().enumerate() {
                let (dx, dy, dz) = (here[i] - from[0][i], y - from[1][i], z - from[2][i]);
                *out = dx * dx + dy * dy + dz * dz;
            }
        }
    }
}
