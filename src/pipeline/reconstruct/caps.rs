//! Caps over the holes of a cloud: points where the surface is to pass though none were measured (docs/algorithms.md,
//! "Holes").
//!
//! Normals are fitted and turned to one side, and each point stands for a small facet. The winding number of these facets is 1
//! inside, 0 outside and 1/2 where the rims of a hole see as much of one side as of the other: there, on a lattice as fine as
//! the points, new points are put. They are looked for near points, and where blocks of the lattice see both sides.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use glam::DVec3;
use rstar::RTree;
use rstar::primitives::GeomWithData;

use crate::error::Result;
use crate::exec::{Engine, Stage, Workers};
use crate::grid::{Box3, TriangleMesh};
use crate::kernel::geometry::winding_number::WindingTree;
use crate::kernel::points::height_field::plane_normal;
use crate::kernel::points::orientation::{Link, orient};
use crate::kernel::topology::union_find::Forest;

/// Neighbours that tell a normal, and those that are linked.
const NEIGHBOURS: usize = 12;
/// A cap is farther than so many edges of the square that a point has of the surface from all points.
const BESIDE: f64 = 1.6;
/// Steps of the lattice along a block.
const BLOCK: i64 = 8;
/// Blocks at most along all axes together: a few hundred along each.
const MOST_BLOCKS: f64 = 2e6;
/// The border between inside and outside.
const HALF: f64 = 0.5;
/// Bytes a point takes: its place, twice, node, normal, links, facet and its place in the winding number's tree.
const BYTES: u64 = 1200;

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

type Numbered = GeomWithData<[f64; 3], u32>;

/// Puts points over the holes of a cloud; none where it has no holes, or no sides.
///
/// # Errors
/// When the memory is too little, or the run is interrupted.
pub(super) fn close(engine: &Engine, points: &[[f64; 3]]) -> Result<Closing> {
    let _held = engine.hold(points.len() as u64 * BYTES)?;
    let stage = engine.stage("holes", points.len() as u64);
    let numbered = points.iter().zip(0..).map(|(&p, n)| GeomWithData::new(p, n)).collect();
    let tree = RTree::<Numbered>::bulk_load(numbered);
    let around = Around::new(&stage, points, &tree)?;
    let facets = facets(points, &around);
    let Some(lattice) = Lattice::new(points, around.apart) else { return Ok(Closing::default()) };
    let known = Known { tree: &tree, winding: WindingTree::new(&facets), lattice };
    let places = known.places(&stage, points)?;
    stage.finish();
    Ok(Closing { points: places.iter().map(|place| place.at.to_array()).collect(), caps: caps(&places, lattice.step) })
}

/// Normals of the points, turned to one side, and what part of the surface each has.
struct Around {
    normals: Vec<DVec3>,
    areas: Vec<f64>,
    /// The edge of the square that a point has of the surface, the median.
    apart: f64,
}

impl Around {
    fn new(stage: &Stage<'_>, points: &[[f64; 3]], tree: &RTree<Numbered>) -> Result<Self> {
        let parts: Vec<&[[f64; 3]]> = points.chunks(512).collect();
        let found = stage.run(&parts, &Workers::none(), |(), part| {
            let told = |p: &[f64; 3]| {
                let near: Vec<_> = tree.nearest_neighbor_iter(*p).take(NEIGHBOURS).collect();
                let places: Vec<DVec3> = near.iter().map(|n| DVec3::from(*n.geom())).collect();
                let radius = places.last().map_or(0.0, |last| last.distance(places[0]));
                let numbers: Vec<u32> = near.iter().map(|n| n.data).collect();
                (plane_normal(&places, &[1.0; NEIGHBOURS][..places.len()]), radius, numbers)
            };
            Ok(part.iter().map(told).collect::<Vec<_>>())
        })?;
        let found: Vec<_> = found.into_iter().flatten().collect();
        let places: Vec<DVec3> = points.iter().map(|&p| DVec3::from(p)).collect();
        let mut normals: Vec<DVec3> = found.iter().map(|(normal, ..)| *normal).collect();
        let of = |a: u32, b: u32| {
            let ends = [a.min(b), a.max(b)];
            Link::between(ends, ends.map(|n| places[n as usize]), ends.map(|n| normals[n as usize]))
        };
        let links =
            (0..).zip(&found).flat_map(|(a, (.., near))| near.iter().filter(move |&&b| a != b).map(move |&b| (a, b)));
        let links: Vec<Link> = links.map(|(a, b)| of(a, b)).collect();
        orient(&places, &mut normals, links);
        let areas: Vec<f64> = found.iter().map(|(_, radius, _)| PI * radius * radius / NEIGHBOURS as f64).collect();
        let mut sorted = areas.clone();
        sorted.sort_by(f64::total_cmp);
        Ok(Self { normals, areas, apart: sorted.get(sorted.len() / 2).map_or(0.0, |area| area.sqrt()) })
    }
}

/// A facet for each point: a triangle of its area, across its normal.
fn facets(points: &[[f64; 3]], around: &Around) -> TriangleMesh {
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

/// Where the winding number is asked.
#[derive(Clone, Copy, Debug)]
struct Lattice {
    first: DVec3,
    step: f64,
    /// Along each axis.
    blocks: [i64; 3],
}

impl Lattice {
    /// Around all points; none where it would have too many blocks.
    fn new(points: &[[f64; 3]], step: f64) -> Option<Self> {
        let bound = |pick: fn(DVec3, DVec3) -> DVec3| points.iter().map(|&p| DVec3::from(p)).reduce(pick);
        let (low, high) = (bound(DVec3::min)?, bound(DVec3::max)?);
        let edge = BLOCK as f64 * step;
        let blocks = ((high - low) / edge).to_array().map(|n| n.floor() + 3.0);
        let fits = step > 0.0 && blocks.iter().product::<f64>() < MOST_BLOCKS;
        fits.then(|| Self { first: low - DVec3::splat(edge), step, blocks: blocks.map(|n| n as i64) })
    }

    fn place(&self, node: [i64; 3]) -> DVec3 {
        self.first + DVec3::from(node.map(|n| n as f64)) * self.step
    }

    fn number(&self, [x, y, z]: [i64; 3]) -> usize {
        ((z * self.blocks[1] + y) * self.blocks[0] + x) as usize
    }

    fn all(&self) -> Vec<[i64; 3]> {
        let [nx, ny, nz] = self.blocks;
        (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| [x, y, z]))).collect()
    }
}

struct Known<'a> {
    tree: &'a RTree<Numbered>,
    winding: WindingTree,
    lattice: Lattice,
}

impl Known<'_> {
    fn away(&self, at: DVec3) -> f64 {
        let nearest = self.tree.nearest_neighbor(at.to_array());
        nearest.map_or(f64::INFINITY, |point| DVec3::from(*point.geom()).distance(at))
    }

    fn side(&self, at: DVec3) -> f64 {
        self.winding.winding_number(at.to_array()) - HALF
    }

    /// Places on all caps, in the order of the blocks.
    fn places(&self, stage: &Stage<'_>, points: &[[f64; 3]]) -> Result<Vec<Place>> {
        let due = self.due(stage, points)?;
        let found = stage.run(&due, &Workers::none(), |(), block| Ok(self.of_block(*block)))?;
        Ok(found.concat())
    }

    /// The blocks that hold points or stand beside such, and those whose corners are on different sides.
    fn due(&self, stage: &Stage<'_>, points: &[[f64; 3]]) -> Result<Vec<[i64; 3]>> {
        let lattice = &self.lattice;
        let mut near = vec![false; lattice.blocks.iter().product::<i64>() as usize];
        for point in points {
            let at = (DVec3::from(*point) - lattice.first) / (lattice.step * BLOCK as f64);
            let at = at.to_array().map(|v| v.floor() as i64);
            for beside in voxels(Box3::new(at.map(|v| v - 1), at.map(|v| v + 2))) {
                if (0..3).all(|a| (0..lattice.blocks[a]).contains(&beside[a])) {
                    near[lattice.number(beside)] = true;
                }
            }
        }
        let all = lattice.all();
        let parts: Vec<&[[i64; 3]]> = all.chunks(512).collect();
        let corner = |block: &[i64; 3]| self.side(lattice.place(block.map(|n| n * BLOCK))) > 0.0;
        let corners =
            stage.run(&parts, &Workers::none(), |(), part| Ok(part.iter().map(corner).collect::<Vec<_>>()))?;
        let inside = corners.concat();
        let both = |block: &[i64; 3]| {
            let own = inside[lattice.number(*block)];
            voxels(Box3::new(*block, block.map(|v| v + 2)))
                .any(|at| (0..3).all(|a| at[a] < lattice.blocks[a]) && inside[lattice.number(at)] != own)
        };
        Ok(all.into_iter().filter(|block| near[lattice.number(*block)] || both(block)).collect())
    }

    /// Where the border passes between nodes of the lattice that are not beside points.
    fn of_block(&self, block: [i64; 3]) -> Vec<Place> {
        let lattice = &self.lattice;
        let beside = BESIDE * lattice.step;
        let lo = block.map(|n| n * BLOCK);
        let nodes = Box3::new(lo, lo.map(|v| v + BLOCK + 1));
        let places: Vec<DVec3> = voxels(nodes).map(|node| lattice.place(node)).collect();
        let away: Vec<f64> = places.iter().map(|&at| self.away(at)).collect();
        let side = |n: usize| if away[n] > beside - lattice.step { self.side(places[n]) } else { f64::NAN };
        let sides: Vec<f64> = (0..places.len()).map(side).collect();
        let edge = (BLOCK + 1) as usize;
        let mut found = Vec::new();
        for (n, node) in voxels(nodes).enumerate() {
            for stride in [1, edge, edge * edge] {
                let is_own = (0..3).all(|a| node[a] < lo[a] + BLOCK);
                if !is_own || !(sides[n] * sides[n + stride] < 0.0) {
                    continue;
                }
                let part = sides[n] / (sides[n] - sides[n + stride]);
                let at = places[n] + (places[n + stride] - places[n]) * part;
                let far = self.away(at);
                if far > beside {
                    found.push(Place { at, away: far, area: self.area(at) });
                }
            }
        }
        found
    }

    /// The area that one crossing of the border with the lattice's lines stands for: a border with the unit normal n has
    /// |n| of each axis over the step squared of them.
    fn area(&self, at: DVec3) -> f64 {
        let step = 0.5 * self.lattice.step;
        let slope = DVec3::AXES.map(|axis| self.side(at + axis * step) - self.side(at - axis * step));
        let normal = DVec3::from(slope).normalize_or(DVec3::ONE.normalize());
        self.lattice.step.powi(2) / normal.abs().element_sum()
    }
}

/// The voxels of a box, in its order.
fn voxels(part: Box3) -> impl Iterator<Item = [i64; 3]> {
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
