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
    fn coordinate(&self, axis: usize, index: i64) -> A {
        let step = index as f64 * self.geometry.spacing[axis];
        A::of(if A::KEEPS_WORLD { self.geometry.origin[axis] + step } else { step })
    }

    fn point(&self, state: u32) -> [A; 3] {
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

/// The lanes of one vector.
struct Lanes<'a, A> {
    source: &'a mut [u32; LANES],
    point: [&'a mut [A; LANES]; 3],
    beside_source: [&'a [u32; LANES]; 6],
    beside_point: [[&'a [A; LANES]; 6]; 3],
    x: &'a [A; LANES],
    y: &'a [A; LANES],
    z: A,
}

/// Takes the nearest of the kept source and the six beside; returns the sides it came through.
#[inline(always)]
fn nearest<A: Real>(lanes: Lanes<'_, A>, turned: bool) -> Sides {
    let Lanes { source, point, beside_source, beside_point, x, y, z } = lanes;
    let squared = |p: [A; 3], i: usize| {
        let (dx, dy, dz) = (x[i] - p[0], y[i] - p[1], z - p[2]);
        dx * dx + dy * dy + dz * dz
    };
    let mut best = [A::default(); LANES];
    let mut kept = *source;
    let [mut px, mut py, mut pz] = [*point[0], *point[1], *point[2]];
    let mut from = [0_u32; LANES];
    for i in 0..LANES {
        best[i] = squared([px[i], py[i], pz[i]], i);
    }
    // Turned round, the neighbour at y - 1 stands where y + 1 does.
    let sides: [usize; 6] = if turned { [0, 1, 3, 2, 4, 5] } else { [0, 1, 2, 3, 4, 5] };
    for (bit, side) in sides.into_iter().enumerate() {
        let (s, [qx, qy, qz]) = (beside_source[side], beside_point.map(|sides| sides[side]));
        for i in 0..LANES {
            let d = squared([qx[i], qy[i], qz[i]], i);
            // The sign bit of a fixed voxel's source.
            let nearer = d < best[i] && (source[i] as i32) >= 0;
            best[i] = if nearer { d } else { best[i] };
            kept[i] = if nearer { s[i] & !FIXED } else { kept[i] };
            px[i] = if nearer { qx[i] } else { px[i] };
            py[i] = if nearer { qy[i] } else { py[i] };
            pz[i] = if nearer { qz[i] } else { pz[i] };
            from[i] = if nearer { 1 << bit } else { from[i] };
        }
    }
    let sides = from.iter().fold(0, |any, f| any | f);
    if sides != 0 {
        *source = kept;
        (*point[0], *point[1], *point[2]) = (px, py, pz);
    }
    sides
}

/// One ordered pass; returns the sides through which nearer sources came.
#[inline(always)]
fn pass<A: Real>(work: &mut Work<A>, upward: [bool; 2]) -> Sides {
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
            let [rx, ry, rz] = [&mut *px, &mut *py, &mut *pz].map(|data| layout.run(data, place, count));
            let (x, y) = (&at_x[last_x + y - s..][..count], &at_y[y..][..count]);
            for at in (0..count).step_by(LANES) {
                let lanes = Lanes {
                    beside_source: run.beside.map(|side| chunk(side, at)),
                    beside_point: [rx.beside, ry.beside, rz.beside].map(|beside| beside.map(|side| chunk(side, at))),
                    source: chunk_mut(run.here, at),
                    point: [chunk_mut(rx.here, at), chunk_mut(ry.here, at), chunk_mut(rz.here, at)],
                    x: chunk(x, at),
                    y: chunk(y, at),
                    z: at_z[z],
                };
                sides |= nearest(lanes, layout.turned);
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
        pass(self.work, self.upward)
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
            at[1][n] = if !layout.turned { index(1, n) } else { index(1, (valid[1] + 1).saturating_sub(n)) };
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
