//! From which neighbour a voxel takes its source once all distances are finished: the *parent* rules of the Eikonal
//! methods (docs/algorithms.md, "Source tracking"). A parent has a smaller distance, so chains of parents end at fixed
//! voxels; `trace` follows them. A voxel in the middle between two sources may have several that are as good; of these
//! the rules name the first, and say that there are others.
//!
//! Where voxels have speeds (docs/algorithms.md, "Travel times") there may be some that nothing passes, and a step to an
//! edge or a corner may lead through where they touch: `UpwindSum` then takes only steps that faces lead to.

use crate::grid::{Geometry, NEIGHBOURS_26};
use crate::kernel::distance::methods::upwind::{Axes, Upwind, solve_at};
use crate::kernel::distance::state::precision::{Precision, Real};
use crate::tile::HaloTile;

/// The neighbour that a voxel takes its source from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parent {
    /// Where it lies in a grown tile.
    pub place: usize,
    /// Whether there may be others that are as good.
    pub is_tied: bool,
}

/// A rule that gives each voxel a parent, from finished distances alone.
pub trait Parents: Clone + Send + Sync + 'static {
    /// The rule for tiles of `edge`^3 voxels of a grid.
    fn new(geometry: &Geometry, edge: usize) -> Self;

    /// Looks at the rows of a grown tile of distances, halo 1, all 26 directions, that start at these places; sign bit
    /// on fixed voxels. With speeds these are times; ghosts have none.
    fn find<P: Precision>(&mut self, _distance: &HaloTile<P>, _speeds: Option<&HaloTile<f32>>, _rows: &[usize]) {}

    /// The parent of the voxel at a place of that tile.
    fn parent<P: Precision>(&self, distance: &[P], place: usize) -> Option<Parent>;

    /// Lists the places of all that are as good as its parent.
    fn equals<P: Precision>(&self, distance: &[P], place: usize, list: &mut Vec<usize>);
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

    fn parent<P: Precision>(&self, distance: &[P], place: usize) -> Option<Parent> {
        let mut shortest = f64::INFINITY;
        let mut parent = Parent { place, is_tied: false };
        for (beside, way) in self.ways(distance, place) {
            if way < shortest {
                (shortest, parent) = (way, Parent { place: beside, is_tied: false });
            } else {
                parent.is_tied |= way == shortest;
            }
        }
        (shortest < f64::INFINITY).then_some(parent)
    }

    fn equals<P: Precision>(&self, distance: &[P], place: usize, list: &mut Vec<usize>) {
        let shortest = self.ways(distance, place).fold(f64::INFINITY, |least, (_, way)| least.min(way));
        list.clear();
        list.extend(self.ways(distance, place).filter(|(_, way)| *way == shortest).map(|(beside, _)| beside));
    }
}

impl ShortestWay {
    /// The neighbours that froze before the voxel at a place, and how far it is from the sources by way of each.
    fn ways<P: Precision>(&self, distance: &[P], place: usize) -> impl Iterator<Item = (usize, f64)> {
        let here = distance[place].lane();
        self.steps.iter().enumerate().filter_map(move |(n, &(step, length))| {
            let beside = place.wrapping_add_signed(step);
            let value = distance[beside].lane().magnitude();
            // Of equal distances the lower place freezes first: those are the first 13 steps.
            let is_frozen = value < here || (value == here && n < 13);
            is_frozen.then(|| (beside, value.f64() + length))
        })
    }
}

/// FSM (Kósa & Mikula 2023, Alg. 7, on finished distances): the voxel at the sum of the offsets of those neighbours
/// that enter the update, where its distance is smaller; else the first of these neighbours. Neighbours on opposite
/// sides with equal distances may enter the one for the other, and of smallest ones each may be the first.
#[derive(Clone, Debug)]
pub struct UpwindSum {
    axes: Axes<f64>,
    /// Whether there are speeds.
    is_uneven: bool,
    /// For each voxel of the tile, which neighbours enter; and 1 where others might for them.
    from: Vec<Upwind>,
    tied: Vec<u8>,
    /// Steps along the axes.
    along: [isize; 3],
    /// Steps to the sum of their offsets and to the first, by their code.
    steps: Vec<[isize; 2]>,
}

impl Parents for UpwindSum {
    fn new(geometry: &Geometry, edge: usize) -> Self {
        let step = |offset: [i64; 3]| step(offset, edge);
        let steps = |code: u8| [Upwind(code).sum(), Upwind(code).first()].map(|offset| step(offset.map(i64::from)));
        Self {
            axes: Axes::new(geometry.spacing),
            is_uneven: false,
            from: vec![Upwind::default(); (edge + 2).pow(3)],
            tied: vec![0; (edge + 2).pow(3)],
            along: [[1, 0, 0], [0, 1, 0], [0, 0, 1]].map(step),
            steps: (0..=u8::MAX).map(steps).collect(),
        }
    }

    fn find<P: Precision>(&mut self, distance: &HaloTile<P>, speeds: Option<&HaloTile<f32>>, rows: &[usize]) {
        let Self { axes, from, tied, is_uneven, .. } = self;
        *is_uneven = speeds.is_some();
        pulp::Arch::new().dispatch(FindParents { distance, speeds, rows, axes, from, tied });
    }

    #[inline]
    fn parent<P: Precision>(&self, distance: &[P], place: usize) -> Option<Parent> {
        let here = distance[place].lane();
        let [sum, first] = self.steps[usize::from(self.from[place].0)].map(|step| place.wrapping_add_signed(step));
        let is_nearer = |beside: &usize| distance[*beside].lane().magnitude() < here;
        let along = self.from[place].sum();
        let steps = std::array::from_fn(|a| self.along[a] * isize::from(along[a]));
        let sum = Some(sum).filter(|sum| is_nearer(sum) && self.leads_by_faces(distance, place, steps));
        let nearer = sum.or(Some(first).filter(is_nearer))?;
        Some(Parent { place: nearer, is_tied: self.tied[place] != 0 })
    }

    fn equals<P: Precision>(&self, distance: &[P], place: usize, list: &mut Vec<usize>) {
        let value = |step: isize| distance[place.wrapping_add_signed(step)].lane().magnitude();
        let here = distance[place].lane();
        let entered = self.from[place].sum();
        // For each axis the steps that may be taken: none where it did not enter.
        let sides = [0, 1, 2].map(|a| {
            let step = self.along[a] * isize::from(entered[a]);
            if step != 0 && value(step) == value(-step) { [step, -step] } else { [step; 2] }
        });
        list.clear();
        for n in 0..8 {
            let steps: [isize; 3] = std::array::from_fn(|a| sides[a][n >> a & 1]);
            let step = steps.iter().sum();
            let at = place.wrapping_add_signed(step);
            if value(step) < here && !list.contains(&at) && self.leads_by_faces(distance, place, steps) {
                list.push(at);
            }
        }
        if list.is_empty() {
            let steps = || sides.into_iter().flatten().filter(|&step| step != 0);
            let least = steps().map(value).fold(P::Lane::INFINITY, Real::smaller);
            let mut add = |step: isize| list.push(place.wrapping_add_signed(step));
            steps().filter(|&step| value(step) == least).for_each(&mut add);
        }
    }
}

impl UpwindSum {
    /// Whether steps along the axes to neighbours that entered lead, one after the other in some order, only through voxels that
    /// have a value. Two do, by way of either of these neighbours; three need one that shares an edge with the voxel.
    #[inline]
    fn leads_by_faces<P: Precision>(&self, distance: &[P], place: usize, steps: [isize; 3]) -> bool {
        if !self.is_uneven || steps.contains(&0) {
            return true;
        }
        let sum: isize = steps.iter().sum();
        steps.iter().any(|step| distance[place.wrapping_add_signed(sum - step)].lane().magnitude() < P::Lane::INFINITY)
    }
}

/// Which neighbours enter the update of each voxel, compiled for each vector unit.
struct FindParents<'a, P> {
    distance: &'a HaloTile<P>,
    speeds: Option<&'a HaloTile<f32>>,
    rows: &'a [usize],
    axes: &'a Axes<f64>,
    from: &'a mut [Upwind],
    tied: &'a mut [u8],
}

impl<P: Precision> pulp::NullaryFnOnce for FindParents<'_, P> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        match (self.speeds, self.axes.isotropic) {
            (None, true) => self.all::<true, false>(&[]),
            (None, false) => self.all::<false, false>(&[]),
            (Some(speeds), true) => self.all::<true, true>(speeds.data()),
            (Some(speeds), false) => self.all::<false, true>(speeds.data()),
        }
    }
}

impl<P: Precision> FindParents<'_, P> {
    #[inline(always)]
    fn all<const ISOTROPIC: bool, const UNEVEN: bool>(self, speeds: &[f32]) {
        let (width, pitch) = (self.distance.valid()[0], self.distance.pitch());
        for &row in self.rows {
            let side = |place: usize| &self.distance.data()[place..][..width];
            let [xl, xu] = [side(row - 1), side(row + 1)];
            let [yl, yu] = [side(row - pitch), side(row + pitch)];
            let [zl, zu] = [side(row - pitch * pitch), side(row + pitch * pitch)];
            let out = self.from[row..][..width].iter_mut().zip(&mut self.tied[row..][..width]);
            for (x, (from, tied)) in out.enumerate() {
                let value = |side: &[P]| side[x].lane().magnitude();
                let beside = [value(xl), value(xu), value(yl), value(yu), value(zl), value(zu)];
                let near = |a: usize| beside[2 * a].smaller(beside[2 * a + 1]).f64();
                let speed = if UNEVEN { f64::from(speeds[row + x]) } else { 1.0 };
                let solution = solve_at::<f64, ISOTROPIC, UNEVEN>([near(0), near(1), near(2)], self.axes, speed);
                *from = Upwind::new(beside, solution.more::<P>());
                *tied = is_tied(beside, *from);
            }
        }
    }
}

/// 1 where neighbours that entered on one axis have an equal on the other side or on another such axis.
#[inline(always)]
fn is_tied<L: Real>([xl, xu, yl, yu, zl, zu]: [L; 6], from: Upwind) -> u8 {
    let is = u8::from;
    let [x, y, z] = [xl.smaller(xu), yl.smaller(yu), zl.smaller(zu)];
    let sides = is(xl == xu) | is(yl == yu) << 1 | is(zl == zu) << 2;
    let [in_x, in_y, in_z] = [0, 1, 2].map(|axis| from.0 >> (3 + axis) & 1);
    let axes = (is(x == y) & in_x & in_y) | (is(y == z) & in_y & in_z) | (is(z == x) & in_z & in_x);
    axes | is(sides & (from.0 >> 3) & 0b111 != 0)
}
