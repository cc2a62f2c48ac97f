//! From which neighbour a voxel takes its source once all distances are finished: the *parent* rules of the Eikonal
//! methods (algorithms: section 4). A parent has a smaller distance, so chains of parents end at fixed voxels; `trace`
//! follows them.

use super::precision::{Precision, Real};
use super::upwind::{Axes, Upwind, solve};
use crate::grid::{Geometry, NEIGHBOURS_26};
use crate::tile::HaloTile;

/// A rule that gives each voxel a parent, from finished distances alone.
pub trait Parents: Clone + Send + Sync + 'static {
    /// The rule for tiles of `edge`^3 voxels of a grid.
    fn new(geometry: &Geometry, edge: usize) -> Self;

    /// Looks at the rows of a grown tile of distances, halo 1, all 26 directions, that start at these places; sign bit
    /// on fixed voxels.
    fn look<P: Precision>(&mut self, _distance: &HaloTile<P>, _rows: &[usize]) {}

    /// The place of the parent of the voxel at a place of that tile.
    fn parent<P: Precision>(&self, distance: &[P], place: usize) -> Option<usize>;
}

/// Distance between a place of a grown tile and the one at an offset.
fn step([x, y, z]: [i64; 3], edge: usize) -> isize {
    let pitch = edge as isize + 2;
    (z as isize * pitch + y as isize) * pitch + x as isize
}

/// FMM (Kósa & Mikula 2023, Alg. 8): when a voxel freezes, the frozen one of its 26 neighbours with the smallest sum of
/// its distance and the way to it. Voxels freeze in order of distance, of equal ones in order of their places.
#[derive(Clone, Debug)]
pub struct ShortestWay {
    /// Steps to the 26 neighbours in the buffer, and their lengths.
    steps: Vec<(isize, f64)>,
}

impl Parents for ShortestWay {
    fn new(geometry: &Geometry, edge: usize) -> Self {
        let step = |&offset: &[i64; 3]| (step(offset, edge), geometry.length(offset));
        Self { steps: NEIGHBOURS_26.iter().map(step).collect() }
    }

    fn parent<P: Precision>(&self, distance: &[P], place: usize) -> Option<usize> {
        let here = distance[place].lane();
        let mut best = (f64::INFINITY, None);
        for (n, &(step, length)) in self.steps.iter().enumerate() {
            let beside = place.wrapping_add_signed(step);
            let value = distance[beside].lane().magnitude();
            // Of equal distances the lower place freezes first: those are the first 13 steps.
            if value < here || (value == here && n < 13) {
                let way = value.f64() + length;
                if way < best.0 {
                    best = (way, Some(beside));
                }
            }
        }
        best.1
    }
}

/// FSM (Kósa & Mikula 2023, Alg. 7, on finished distances): the voxel at the sum of the offsets of those neighbours
/// that enter the update, where its distance is smaller; else the first of these neighbours.
#[derive(Clone, Debug)]
pub struct UpwindSum {
    axes: Axes<f64>,
    /// For each voxel of the tile, which neighbours enter.
    from: Vec<Upwind>,
    /// Steps to the sum of their offsets and to the first, by their code.
    steps: Vec<[isize; 2]>,
}

impl Parents for UpwindSum {
    fn new(geometry: &Geometry, edge: usize) -> Self {
        let step = |offset: [i8; 3]| step(offset.map(i64::from), edge);
        let steps = |code: u8| [step(Upwind(code).sum()), step(Upwind(code).first())];
        Self {
            axes: Axes::new(geometry.spacing),
            from: vec![Upwind::default(); (edge + 2).pow(3)],
            steps: (0..=u8::MAX).map(steps).collect(),
        }
    }

    fn look<P: Precision>(&mut self, distance: &HaloTile<P>, rows: &[usize]) {
        pulp::Arch::new().dispatch(Look { distance, rows, axes: &self.axes, from: &mut self.from });
    }

    #[inline]
    fn parent<P: Precision>(&self, distance: &[P], place: usize) -> Option<usize> {
        let here = distance[place].lane();
        let beside = self.steps[usize::from(self.from[place].0)].map(|step| place.wrapping_add_signed(step));
        beside.into_iter().find(|&beside| distance[beside].lane().magnitude() < here)
    }
}

/// Which neighbours enter the update of each voxel, compiled for each vector unit.
struct Look<'a, P> {
    distance: &'a HaloTile<P>,
    rows: &'a [usize],
    axes: &'a Axes<f64>,
    from: &'a mut [Upwind],
}

impl<P: Precision> pulp::NullaryFnOnce for Look<'_, P> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        if self.axes.isotropic { self.all::<true>() } else { self.all::<false>() }
    }
}

impl<P: Precision> Look<'_, P> {
    #[inline(always)]
    fn all<const ISOTROPIC: bool>(self) {
        let (width, pitch) = (self.distance.valid()[0], self.distance.pitch());
        for &row in self.rows {
            let side = |place: usize| &self.distance.data()[place..][..width];
            let [xl, xu] = [side(row - 1), side(row + 1)];
            let [yl, yu] = [side(row - pitch), side(row + pitch)];
            let [zl, zu] = [side(row - pitch * pitch), side(row + pitch * pitch)];
            for (x, from) in self.from[row..][..width].iter_mut().enumerate() {
                let value = |side: &[P]| side[x].lane().magnitude();
                let beside = [value(xl), value(xu), value(yl), value(yu), value(zl), value(zu)];
                let near = |a: usize| beside[2 * a].smaller(beside[2 * a + 1]).f64();
                let solution = solve::<f64, ISOTROPIC>([near(0), near(1), near(2)], self.axes);
                *from = Upwind::new(beside, solution.more::<P>());
            }
        }
    }
}
