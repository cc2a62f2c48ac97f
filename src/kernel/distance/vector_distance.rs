//! VDT, the vector distance transform (Danielsson 1980; Kósa & Mikula 2023, Alg. 3; algorithms: section 3).
//!
//! Each voxel carries the index of its nearest known source. In the eight ordered passes it looks at the sources of
//! its six face neighbours and keeps the one nearest by Euclidean distance; the distance follows from the source. Of
//! equal distances the one already kept stays, then the first of -x, +x, -y, +y, -z, +z. In and out: a grown tile of
//! source indices, the top bit set on voxels that a source fixed. Halo 1, faces. While a tile is worked on every voxel
//! holds its source's position beside the index, so that sweeps look nothing up.

use super::diagonals::{Diagonals, LANES};
use super::directions::{Sides, sweep_until_quiet};
use super::initialise::{NO_SOURCE, squared_distance};
use super::method::{DistanceMethod, OrderedSweeps};
use super::precision::Real;
use crate::grid::{Box3, Geometry};
use crate::tile::HaloTile;

/// Set on the source index of a fixed voxel.
pub const FIXED: u32 = 1 << 31;

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

    /// The coordinate of a voxel's centre along an axis.
    pub(super) fn coordinate(&self, axis: usize, index: i64) -> A {
        let step = index as f64 * self.geometry.spacing[axis];
        A::of(if A::KEEPS_WORLD { self.geometry.origin[axis] + step } else { step })
    }

    pub(super) fn point(&self, state: u32) -> [A; 3] {
        self.points.get((state & !FIXED) as usize).copied().unwrap_or([A::INFINITY; 3])
    }
}

/// A tile along diagonals: sources and their coordinates, and the coordinates of its voxels.
#[derive(Debug)]
pub struct Work<A> {
    layout: Diagonals,
    source: Vec<u32>,
    point: [Vec<A>; 3],
    /// Coordinates of voxels along x (from the upper end on), y and z, by index from the lower ghost.
    at: [Vec<A>; 3],
}

/// The nearest source so far of one voxel, and the side that it came through.
#[derive(Clone, Copy)]
struct Nearest<A> {
    squared: A,
    source: u32,
    point: [A; 3],
    side: u32,
}

#[inline(always)]
pub(super) fn squared<A: Real>(here: [A; 3], point: [A; 3]) -> A {
    let (dx, dy, dz) = (here[0] - point[0], here[1] - point[1], here[2] - point[2]);
    dx * dx + dy * dy + dz * dz
}

impl<A: Real> Nearest<A> {
    /// Looks at the source beside the voxel on the side `SIDE`; without branches, so that lanes stay together.
    #[inline(always)]
    fn look<const SIDE: u32>(self, here: [A; 3], free: bool, source: u32, point: [A; 3]) -> Self {
        let squared = squared(here, point);
        let nearer = (squared < self.squared) & free;
        let pick = |a: A, b: A| if nearer { a } else { b };
        Self {
            squared: pick(squared, self.squared),
            source: if nearer { source & !FIXED } else { self.source },
            point: [pick(point[0], self.point[0]), pick(point[1], self.point[1]), pick(point[2], self.point[2])],
            side: if nearer { 1 << SIDE } else { self.side },
        }
    }
}

/// Eight values of a run from its place `at` on, and those beside them; y sides as the layout has them.
struct Beside<'a, T>([&'a [T; LANES]; 6]);

#[inline(always)]
fn beside<T>(sides: [&[T]; 6], at: usize) -> Beside<'_, T> {
    let [xl, xu, yl, yu, zl, zu] = sides;
    Beside([chunk(xl, at), chunk(xu, at), chunk(yl, at), chunk(yu, at), chunk(zl, at), chunk(zu, at)])
}

/// Takes the nearest of the kept source and the six beside for each voxel of a vector; returns the sides they came
/// through. Where y is turned round (`TURNED`), the neighbour at y - 1 stands where y + 1 does.
#[inline(always)]
fn nearest<A: Real, const TURNED: bool>(
    (source, sources): (&mut [u32; LANES], Beside<'_, u32>),
    [(px, pxs), (py, pys), (pz, pzs)]: [(&mut [A; LANES], Beside<'_, A>); 3],
    (x, y, z): (&[A; LANES], &[A; LANES], A),
) -> Sides {
    let (yl, yu) = if TURNED { (3, 2) } else { (2, 3) };
    let mut kept = [0_u32; LANES];
    let mut points = [[A::default(); LANES]; 3];
    let mut came = [0_u32; LANES];
    for i in 0..LANES {
        let here = [x[i], y[i], z];
        let point = [px[i], py[i], pz[i]];
        let free = (source[i] as i32) >= 0;
        let at = |side: usize| (sources.0[side][i], [pxs.0[side][i], pys.0[side][i], pzs.0[side][i]]);
        let start = Nearest { squared: squared(here, point), source: source[i], point, side: 0 };
        let [(s0, p0), (s1, p1), (s2, p2)] = [at(0), at(1), at(yl)];
        let [(s3, p3), (s4, p4), (s5, p5)] = [at(yu), at(4), at(5)];
        let found = start.look::<0>(here, free, s0, p0).look::<1>(here, free, s1, p1);
        let found = found.look::<2>(here, free, s2, p2).look::<3>(here, free, s3, p3);
        let found = found.look::<4>(here, free, s4, p4).look::<5>(here, free, s5, p5);
        (kept[i], came[i]) = (found.source, found.side);
        (points[0][i], points[1][i], points[2][i]) = (found.point[0], found.point[1], found.point[2]);
    }
    let sides = came.iter().fold(0, |any, side| any | side);
    if sides != 0 {
        *source = kept;
        (*px, *py, *pz) = (points[0], points[1], points[2]);
    }
    sides
}

/// One ordered pass; returns the sides through which nearer sources came.
#[inline(always)]
fn pass<A: Real, const TURNED: bool>(work: &mut Work<A>, upward: [bool; 2]) -> Sides {
    let Work { layout, source, point: [px, py, pz], at: [at_x, at_y, at_z] } = work;
    let (depth, last_x) = (layout.valid[2], at_x.len() - 1 - LANES);
    let mut sides = 0;
    for n in 0..depth {
        let z = if upward[1] { n + 1 } else { depth - n };
        for (start, count) in layout.diagonals(upward[0]) {
            let count = count.next_multiple_of(LANES);
            let place = z * layout.plane + start;
            let (s, y) = (start / layout.row, start % layout.row);
            let run = layout.run(source, place, count);
            let (rx, ry, rz) =
                (layout.run(px, place, count), layout.run(py, place, count), layout.run(pz, place, count));
            let (x, y) = (&at_x[last_x + y - s..][..count], &at_y[y..][..count]);
            for at in (0..count).step_by(LANES) {
                sides |= nearest::<A, TURNED>(
                    (chunk_mut(run.here, at), beside(run.beside, at)),
                    [
                        (chunk_mut(rx.here, at), beside(rx.beside, at)),
                        (chunk_mut(ry.here, at), beside(ry.beside, at)),
                        (chunk_mut(rz.here, at), beside(rz.beside, at)),
                    ],
                    (chunk(x, at), chunk(y, at), at_z[z]),
                );
            }
        }
    }
    sides
}

#[inline(always)]
fn chunk<T>(run: &[T], at: usize) -> &[T; LANES] {
    run[at..].first_chunk().expect("runs are whole vectors")
}

#[inline(always)]
fn chunk_mut<T>(run: &mut [T], at: usize) -> &mut [T; LANES] {
    run[at..].first_chunk_mut().expect("runs are whole vectors")
}

/// A pass, compiled for each vector unit.
struct Pass<'a, A> {
    work: &'a mut Work<A>,
    upward: [bool; 2],
}

impl<A: Real> pulp::NullaryFnOnce for Pass<'_, A> {
    type Output = Sides;

    #[inline(always)]
    fn call(self) -> Sides {
        if self.work.layout.turned {
            pass::<A, true>(self.work, self.upward)
        } else {
            pass::<A, false>(self.work, self.upward)
        }
    }
}

impl<A: Real> Work<A> {
    fn new(edge: usize) -> Self {
        let len = Diagonals::len(edge);
        Self {
            layout: Diagonals::new(edge),
            source: vec![FIXED | NO_SOURCE; len],
            point: std::array::from_fn(|_| vec![A::INFINITY; len]),
            at: std::array::from_fn(|_| vec![A::default(); edge + 2 + LANES]),
        }
    }

    fn sweep(&mut self, upward: [bool; 3]) -> Sides {
        pulp::Arch::new().dispatch(Pass { work: self, upward: [upward[0], upward[2]] })
    }
}

impl<A: Real> VectorDistance<'_, A> {
    /// Brings the tile into the layout that sweeps of direction `upward` want. Ghosts count as fixed.
    fn lay_out(&self, work: &mut Work<A>, tile: &HaloTile<u32>, part: &Box3, upward: [bool; 3]) {
        let valid = tile.valid();
        if work.layout.valid != valid {
            work.source.fill(FIXED | NO_SOURCE);
            work.point.iter_mut().for_each(|p| p.fill(A::INFINITY));
        }
        work.layout = Diagonals { valid, turned: upward[0] != upward[1], ..work.layout };
        work.layout.load(tile, &mut work.source, |state, ghost| if ghost { state | FIXED } else { state });
        let Work { layout, source, point: [px, py, pz], at } = work;
        layout.each_voxel(|place| [px[place], py[place], pz[place]] = self.point(source[place]));
        let last = tile.edge() + 1;
        for n in 0..=last {
            let index = |axis: usize, n: usize| self.coordinate(axis, part.lo[axis] + n as i64 - 1);
            at[0][last - n] = index(0, n);
            at[1][n] = index(1, if layout.turned { (valid[1] + 1).saturating_sub(n) } else { n });
            at[2][n] = index(2, n);
        }
    }
}

impl<A: Real> DistanceMethod for VectorDistance<'_, A> {
    type State = u32;
    type Work = Work<A>;
    const UNKNOWN: u32 = NO_SOURCE;

    fn fixed(_: f64, source: u32) -> u32 {
        source | FIXED
    }

    fn is_fixed(state: u32) -> bool {
        state & FIXED != 0
    }

    fn work(edge: usize) -> Work<A> {
        Work::new(edge)
    }

    fn settle(&self, tile: &mut HaloTile<u32>, work: &mut Work<A>, part: &Box3) -> bool {
        let first = [true; 3];
        self.lay_out(work, tile, part, first);
        let changed = sweep_until_quiet(first, |upward| {
            if (upward[0] != upward[1]) != work.layout.turned {
                work.layout.store(&work.source, tile, |s| s);
                self.lay_out(work, tile, part, upward);
            }
            work.sweep(upward)
        });
        if changed {
            work.layout.store(&work.source, tile, |s| s);
        }
        changed
    }

    fn entering(&self, beside: u32, state: u32, voxel: [i64; 3]) -> Option<f64> {
        if Self::is_fixed(state) || beside & !FIXED == state {
            return None;
        }
        // Judged as a sweep judges it, so that nobody is called for nothing.
        let here: [A; 3] = std::array::from_fn(|a| self.coordinate(a, voxel[a]));
        let squared = |state| {
            let p = self.point(state);
            let (dx, dy, dz) = (here[0] - p[0], here[1] - p[1], here[2] - p[2]);
            dx * dx + dy * dy + dz * dz
        };
        let entering = squared(beside);
        (entering < squared(state)).then(|| entering.f64().sqrt())
    }

    fn distance(&self, state: u32, voxel: [i64; 3]) -> f64 {
        let position = self.positions.get((state & !FIXED) as usize);
        position.map_or(f64::INFINITY, |&p| squared_distance(self.geometry.position(voxel), p).sqrt())
    }

    fn source(state: u32) -> Option<u32> {
        Some(state & !FIXED).filter(|&s| s != NO_SOURCE)
    }
}

impl<A: Real> OrderedSweeps for VectorDistance<'_, A> {
    fn sweep(&self, tile: &mut HaloTile<u32>, work: &mut Work<A>, part: &Box3, upward: [bool; 3]) -> bool {
        self.lay_out(work, tile, part, upward);
        let changed = work.sweep(upward) != 0;
        if changed {
            work.layout.store(&work.source, tile, |s| s);
        }
        changed
    }
}
