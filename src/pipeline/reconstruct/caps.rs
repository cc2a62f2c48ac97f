//! Caps over the holes of a cloud: points where the surface is to pass though none were measured (docs/algorithms.md,
//! "Holes").
//!
//! Normals are fitted and turned to one side, and each point stands for a small facet. The winding number of these facets is 1
//! inside, 0 outside and 1/2 where as much of one side is seen as of the other, as on a disc in its rim: there, on a lattice as
//! fine as the points, new points are put. They are looked for beside rims, and followed from there.

use std::collections::{BTreeMap, HashMap, HashSet};

use glam::DVec3;
use rstar::RTree;
use rstar::primitives::GeomWithData;

use super::bridges::{BESIDE, rims};
use super::normals::oriented::{AT_ONCE, Numbered, OrientedCloud};
use super::normals::sided::Sided;
use crate::error::Result;
use crate::exec::{Engine, Hold, Stage, Workers};
use crate::grid::{Box3, TriangleMesh};
use crate::kernel::geometry::winding_number::WindingTree;
use crate::kernel::topology::union_find::Forest;

/// Between bridges a cap is farther than so many from all points and theirs.
const BETWEEN: f64 = 0.9;
/// Caps of more than so many new points for each of the cloud's are no caps.
const MOST_NEW: usize = 3;
/// The border between inside and outside.
const HALF: f64 = 0.5;
/// Bytes a point takes: its facet and the place of that in the winding number's tree, and its share of nodes and caps.
const BYTES: u64 = 800;
/// So many of the points tell whether these have an inside, beside which the winding number is more than that.
const SAMPLE: usize = 400;
const INSIDE: f64 = 0.55;

/// Bridges are of use where so many of their points have an inside.
const BRIDGED: f64 = 0.9;

/// A hole that was closed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cap {
    /// Its middle.
    pub place: [f64; 3],
    /// Twice the largest distance from any point.
    pub width: f64,
    /// Its area, about.
    pub area: f64,
}

/// What closes a cloud.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Closing {
    /// New points.
    pub(super) points: Vec<[f64; 3]>,
    /// The holes they close, the widest first.
    pub(super) caps: Vec<Cap>,
}

/// A place on a cap.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Place {
    at: DVec3,
    /// From the nearest point.
    away: f64,
    area: f64,
}

/// The winding number of a cloud, and what it says of its holes.
pub(super) struct Holes<'a> {
    points: &'a [[f64; 3]],
    sided: &'a Sided,
    winding: WindingTree,
    /// The cloud without bridges, if the last of the points are such.
    before: Option<&'a Sided>,
    _held: Hold,
}

impl<'a> Holes<'a> {
    /// Of a cloud with its normals.
    ///
    /// # Errors
    /// When the memory is too little.
    pub(super) fn new(engine: &Engine, points: &'a [[f64; 3]], sided: &'a Sided) -> Result<Self> {
        let held = engine.hold(points.len() as u64 * BYTES)?;
        Ok(Self { points, sided, winding: WindingTree::new(&facets(points, &sided.cloud)), before: None, _held: held })
    }

    /// What part of some points have an inside on one side of them alone, as those of a body with holes have and those of a sheet, or
    /// of thin parts whose normals do not tell their sides, have not. Told from a sample of them.
    pub(super) fn share_of_body(&self, of: impl ExactSizeIterator<Item = usize>) -> f64 {
        let every = of.len().div_ceil(SAMPLE).max(1);
        let sample: Vec<usize> = of.step_by(every).collect();
        let is_body = |&&n: &&usize| {
            let (at, step) = (DVec3::from(self.points[n]), self.sided.cloud.normals[n] * self.sided.cloud.apart);
            self.is_inside((at - step).to_array(), INSIDE) && !self.is_inside((at + step).to_array(), HALF)
        };
        sample.iter().filter(is_body).count() as f64 / sample.len().max(1) as f64
    }

    /// Whether the winding number is more than that.
    fn is_inside(&self, at: [f64; 3], most: f64) -> bool {
        self.winding.winding_number(at) > most
    }

    /// Places over the holes; none where there are none.
    fn places(&self, engine: &Engine) -> Result<Vec<Place>> {
        let stage = engine.stage("holes", self.points.len() as u64);
        let (first, step) = (DVec3::from(self.points.first().copied().unwrap_or_default()), self.sided.cloud.apart);
        let mut lattice = Lattice { holes: self, first, step, known: HashMap::new() };
        let rims = rims(&stage, self.points, self.sided)?;
        let bridges = self.before.map_or(&[][..], |before| &self.points[before.surfels.len()..]);
        let from = rims.into_iter().map(|(_, at)| at).chain(bridges.iter().map(|&at| at.into()));
        let cubes = from.flat_map(|at| corners(lattice.cube_of(at).map(|v| v - 1), 3)).collect();
        let places = lattice.places(&stage, cubes, MOST_NEW * self.points.len())?;
        stage.finish();
        Ok(places)
    }
}

impl Closing {
    /// Puts points over the holes of a cloud, some of which have been bridged by others; none where there are none, or where bridges have no
    /// inside.
    ///
    /// # Errors
    /// When the memory is too little, or the run is interrupted.
    pub(super) fn of(engine: &Engine, (holes, bridges): (&Holes<'_>, &[[f64; 3]])) -> Result<Self> {
        let (cloud, step) = (holes.sided, holes.sided.cloud.apart);
        let places = if bridges.is_empty() {
            holes.places(engine)?
        } else {
            let points = [holes.points, bridges].concat();
            let sided = Sided::new(engine, &points)?;
            let bridged = |n: usize| Place { at: points[n].into(), away: 0.0, area: sided.cloud.areas[n] };
            let mut places: Vec<Place> = (holes.points.len()..points.len()).map(bridged).collect();
            let between = Holes { before: Some(cloud), ..Holes::new(engine, &points, &sided)? };
            if between.share_of_body(holes.points.len()..points.len()) < BRIDGED {
                return Ok(Self::default());
            }
            places.extend(between.places(engine)?);
            for place in &mut places {
                place.away = cloud.away(place.at);
            }
            places
        };
        Ok(Self { points: places.iter().map(|place| place.at.to_array()).collect(), caps: caps(&places, step) })
    }
}

/// A facet for each point: a triangle of its area, across its normal.
fn facets(points: &[[f64; 3]], around: &OrientedCloud) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    for ((point, normal), area) in points.iter().zip(&around.normals).zip(&around.areas) {
        if normal.length_squared() < 0.5 {
            continue;
        }
        let (u, v) = normal.any_orthonormal_pair();
        // The area of an equilateral triangle is 3/4 sqrt 3 of its outer radius squared.
        let radius = (area / (0.75 * 3f64.sqrt())).sqrt();
        let first = mesh.vertices.len() as u32;
        let turned = if u.cross(v).dot(*normal) > 0.0 { v } else { -v };
        for (cosine, sine) in [(1.0, 0.0), (-0.5, 0.75f64.sqrt()), (-0.5, -(0.75f64.sqrt()))] {
            mesh.vertices.push((DVec3::from(*point) + (u * cosine + turned * sine) * radius).to_array());
        }
        mesh.triangles.push([first, first + 1, first + 2]);
    }
    mesh
}

/// Where the winding number is asked: at the nodes of a lattice, from rims on along the border between the sides.
struct Lattice<'a> {
    holes: &'a Holes<'a>,
    first: DVec3,
    step: f64,
    /// How far from 1/2 it is where it was asked.
    known: HashMap<[i64; 3], f64>,
}

impl Lattice<'_> {
    fn place(&self, node: [i64; 3]) -> DVec3 {
        self.first + DVec3::from(node.map(|n| n as f64)) * self.step
    }

    fn cube_of(&self, at: DVec3) -> [i64; 3] {
        ((at - self.first) / self.step).to_array().map(|v| v.floor() as i64)
    }

    fn side(&self, at: DVec3) -> f64 {
        self.holes.winding.winding_number(at.to_array()) - HALF
    }

    /// Asks at those nodes of cubes that are not known yet.
    fn ask(&mut self, stage: &Stage<'_>, cubes: &[[i64; 3]]) -> Result<()> {
        let mut nodes: Vec<[i64; 3]> = cubes.iter().flat_map(|&cube| corners(cube, 2)).collect();
        nodes.retain(|node| !self.known.contains_key(node));
        nodes.sort_unstable();
        nodes.dedup();
        let parts: Vec<&[[i64; 3]]> = nodes.chunks(AT_ONCE).collect();
        let ask = |part: &&[[i64; 3]]| part.iter().map(|&node| self.side(self.place(node))).collect::<Vec<_>>();
        let sides = stage.run(&parts, &Workers::none(), |(), part| Ok(ask(part)))?;
        self.known.extend(nodes.into_iter().zip(sides.concat()));
        Ok(())
    }

    /// Places on all caps: where the border crosses the lattice's lines away from points, followed from cube to cube.
    fn places(&mut self, stage: &Stage<'_>, mut due: Vec<[i64; 3]>, most: usize) -> Result<Vec<Place>> {
        let mut seen = HashSet::new();
        let mut found = BTreeMap::new();
        while !due.is_empty() && found.len() < most {
            due.retain(|cube| seen.insert(*cube));
            self.ask(stage, &due)?;
            let parts: Vec<&[[i64; 3]]> = due.chunks(AT_ONCE).collect();
            let crossed = stage.run(&parts, &Workers::none(), |(), part| {
                Ok(part
                    .iter()
                    .map(|&cube| (cube, self.crossings(cube)))
                    .filter(|(_, of)| !of.is_empty())
                    .collect::<Vec<_>>())
            })?;
            let mut next = Vec::new();
            for (cube, crossings) in crossed.into_iter().flatten() {
                next.extend(corners(cube.map(|v| v - 1), 3));
                found.extend(crossings);
            }
            due = next;
        }
        Ok(found.into_values().collect())
    }

    /// Where the border crosses the edges of a cube that are not beside points, by node and axis.
    fn crossings(&self, cube: [i64; 3]) -> Vec<(([i64; 3], usize), Place)> {
        let mut found = Vec::new();
        for node in corners(cube, 2) {
            for axis in (0..3).filter(|&axis| node[axis] == cube[axis]) {
                let mut beside = node;
                beside[axis] += 1;
                let [from, to] = [node, beside].map(|node| self.known.get(&node).copied().unwrap_or(f64::NAN));
                if from * to < 0.0 {
                    let (a, b) = (self.place(node), self.place(beside));
                    let at = a + (b - a) * (from / (from - to));
                    let away = self.holes.sided.away(at);
                    if self.is_in_hole(at, away) {
                        let area = self.area(at);
                        found.push(((node, axis), Place { at, away, area }));
                    }
                }
            }
        }
        found
    }

    /// Whether a place is so far from the points, and from bridges, that it is one of a cap.
    fn is_in_hole(&self, at: DVec3, away: f64) -> bool {
        self.holes.before.map_or(away > BESIDE * self.step, |before| {
            away > BETWEEN * self.step && before.away(at) > BESIDE * self.step
        })
    }

    /// The area that one crossing of the border with the lattice's lines stands for: a border with the unit normal n has
    /// |n| of each axis over the step squared of them.
    fn area(&self, at: DVec3) -> f64 {
        let step = 0.5 * self.step;
        let slope = DVec3::AXES.map(|axis| self.side(at + axis * step) - self.side(at - axis * step));
        let normal = DVec3::from(slope).normalize_or(DVec3::ONE.normalize());
        self.step.powi(2) / normal.abs().element_sum()
    }
}

/// So many nodes along each axis from one on.
fn corners(first: [i64; 3], number: i64) -> impl Iterator<Item = [i64; 3]> {
    let part = Box3::new(first, first.map(|v| v + number));
    (0..part.len()).map(move |n| part.voxel_at(n))
}

/// Places that are connected are one cap.
fn caps(places: &[Place], step: f64) -> Vec<Cap> {
    let tree = RTree::<Numbered>::bulk_load(
        places.iter().zip(0..).map(|(place, n)| GeomWithData::new(place.at.to_array(), n)).collect(),
    );
    let mut forest = Forest::of_singles(places.len());
    for (place, n) in places.iter().zip(0..) {
        for beside in tree.locate_within_distance(place.at.to_array(), 4.0 * step * step) {
            forest.join(n, beside.data);
        }
    }
    let mut sums = BTreeMap::<u32, (DVec3, f64, f64)>::new();
    for (place, n) in places.iter().zip(0..) {
        let (middle, away, area) = sums.entry(forest.root(n)).or_default();
        *middle += place.at * place.area;
        *away = away.max(place.away);
        *area += place.area;
    }
    let mut caps: Vec<Cap> = sums
        .into_values()
        .map(|(middle, away, area)| Cap { place: (middle / area).to_array(), width: 2.0 * away, area })
        .collect();
    caps.sort_by(|a, b| b.width.total_cmp(&a.width));
    caps
}
