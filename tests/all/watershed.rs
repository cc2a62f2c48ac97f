//! The sides of a cloud against a plain watershed over the whole grid, voxel by voxel and face by face; and bodies with
//! holes, hollows and lobes whose sides are known.

use std::collections::BTreeMap;
use std::sync::Arc;

use proptest::prelude::*;
use strandline::grid::{BrickGrid, BrickSet, Geometry, PointBins};
use strandline::pipeline::distance::{Method, Sources, cloud_distance};
use strandline::pipeline::enclosure::near::Near;
use strandline::pipeline::enclosure::watershed::{Sides, watershed};

use crate::common::clouds::{grid_around, sphere};
use crate::common::lab::{Lab, PlainGrid, whole};
use crate::common::random::Random;

/// The outside of the domain, and all that is one with it.
const OUTSIDE: usize = usize::MAX;

/// A voxel's maximum: up the steepest way, voxel by voxel; where several voxels are the maximum, any of them.
fn maximum(grid: PlainGrid, d: &[f32], start: [i64; 3]) -> usize {
    let mut v = start;
    loop {
        let beside = PlainGrid::around(v);
        if beside.iter().any(|q| !grid.contains(*q)) {
            return OUTSIDE;
        }
        let mut best = v;
        for q in beside {
            if d[grid.at(q)] > d[grid.at(best)] {
                best = q;
            }
        }
        if best == v {
            return grid.at(v);
        }
        v = best;
    }
}

/// Spaces by name; merged ones have the name that comes first in `rank`.
struct Plain<'a> {
    name: BTreeMap<usize, usize>,
    depth: BTreeMap<usize, f32>,
    rank: &'a dyn Fn(usize) -> (bool, u64, usize),
}

impl Plain<'_> {
    fn merge(&mut self, a: usize, b: usize) {
        let (kept, gone) = if (self.rank)(a) <= (self.rank)(b) { (a, b) } else { (b, a) };
        let depth = self.depth[&a].max(self.depth[&b]);
        self.depth.insert(kept, depth);
        self.name.values_mut().filter(|name| **name == gone).for_each(|name| *name = kept);
    }
}

/// 1 for voxels inside.
fn plain_sides(grid: PlainGrid, d: &[f32], rank: &dyn Fn(usize) -> (bool, u64, usize), least: f32) -> Vec<u8> {
    let of: Vec<usize> = grid.voxels().map(|v| maximum(grid, d, v)).collect();
    let mut plain = Plain { name: BTreeMap::new(), depth: BTreeMap::new(), rank };
    for &m in &of {
        plain.name.insert(m, m);
        plain.depth.insert(m, if m == OUTSIDE { f32::INFINITY } else { d[m] });
    }
    plain.name.insert(OUTSIDE, OUTSIDE);
    plain.depth.insert(OUTSIDE, f32::INFINITY);
    let mut faces: Vec<(f32, usize, usize)> = Vec::new();
    for v in grid.voxels() {
        for (n, q) in PlainGrid::around(v).into_iter().enumerate() {
            if !grid.contains(q) {
                faces.push((d[grid.at(v)], of[grid.at(v)], OUTSIDE));
            } else if n % 2 == 1 {
                faces.push((d[grid.at(v)].min(d[grid.at(q)]), of[grid.at(v)], of[grid.at(q)]));
            }
        }
    }
    // One voxel may be the pass to several regions: those that come first are joined first.
    let pair = |a: usize, b: usize| [rank(a).min(rank(b)), rank(a).max(rank(b))];
    faces.sort_by(|a, b| b.0.total_cmp(&a.0).then_with(|| pair(a.1, a.2).cmp(&pair(b.1, b.2))));
    for &(pass, a, b) in &faces {
        let (a, b) = (plain.name[&a], plain.name[&b]);
        if a != b && plain.depth[&a].min(plain.depth[&b]) < (2.0 * pass).max(least) {
            plain.merge(a, b);
        }
    }
    let mut side: BTreeMap<usize, bool> = BTreeMap::from([(OUTSIDE, false)]);
    loop {
        let mut votes: BTreeMap<usize, i64> = BTreeMap::new();
        for &(_, a, b) in &faces {
            let (a, b) = (plain.name[&a], plain.name[&b]);
            for (unknown, known) in [(a, b), (b, a)] {
                if let (None, Some(inside)) = (side.get(&unknown), side.get(&known)) {
                    *votes.entry(unknown).or_default() += if *inside { -1 } else { 1 };
                }
            }
        }
        let Some((&next, &vote)) = votes.iter().min_by_key(|(space, vote)| (-vote.abs(), rank(**space))) else { break };
        side.insert(next, vote > 0);
    }
    of.iter().map(|m| u8::from(side.get(&plain.name[m]).copied().unwrap_or(false))).collect()
}

fn sides_of(lab: &Lab, set: &Arc<BrickSet>, d: &[f32], farthest: f32) -> Sides {
    let geometry = Geometry { shape: set.grid().shape(), spacing: [1.0; 3], origin: [0.0; 3], unit: None };
    let bins = PointBins::new(*set.grid(), &geometry, &[]);
    let sources = Sources::cloud(&geometry, &[], &bins);
    let mut distance = lab.field(set, d);
    (0..set.grid().len()).for_each(|id| distance.set_absent(id, farthest));
    let near = Near { distance: &distance, cells: set };
    watershed(&lab.engine.stage("tagging", 0), &lab.engine, &sources, near, None).expect("room in scratch")
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    /// Rough fields have many small spaces, walls and hollows.
    #[test]
    fn random_fields_have_the_sides_of_a_plain_watershed(
        shape in prop::array::uniform3(3_i64..18),
        edge in prop::sample::select(vec![4, 8, 16]),
        threads in 1_usize..3,
        seed: u64,
    ) {
        let mut random = Random(seed);
        let set = Arc::new(BrickSet::dense(BrickGrid::new(shape, edge)));
        let plain = PlainGrid { shape };
        // Walls near 0 and rooms of all depths between them.
        let room = 2 + random.below(4) as i64;
        let mut value = |v: [i64; 3]| {
            let wall = v.iter().any(|x| x % room == 0);
            let d = random.unit() as f32;
            if wall { 0.3 * d + 1e-3 } else { 1.0 + 3.0 * d }
        };
        let d: Vec<f32> = plain.voxels().map(&mut value).collect();
        let voxels: Vec<[i64; 3]> = plain.voxels().collect();
        let rank = |m: usize| match m {
            OUTSIDE => (false, 0, 0),
            m => {
                let id = set.grid().brick_of(voxels[m]).expect("of the grid");
                (true, id, set.grid().brick_box(id).offset_of(voxels[m]))
            }
        };
        let found = whole(&sides_of(&Lab::new(threads), &set, &d, 9.0).inside);
        prop_assert!(found == plain_sides(plain, &d, &rank, 1.0));
    }
}

/// The sides of a cloud on the cells within `farthest` of it.
fn sides_of_cloud(cloud: &[[f64; 3]], h: f64, farthest: f64) -> (Geometry, Sides) {
    let lab = Lab::new(2);
    let geometry = grid_around(cloud, h);
    let grid = BrickGrid::new(geometry.shape, 16);
    let bins = PointBins::new(grid, &geometry, cloud);
    let reach = geometry.spacing.map(|h| (farthest / h).ceil() as i64);
    let set = Arc::new(bins.bricks_within(&geometry, cloud, reach));
    let sources = Sources::cloud(&geometry, cloud, &bins);
    let stage = lab.engine.stage("start", 0);
    let distance =
        cloud_distance(&stage, &lab.engine, &sources, &set, Method::VDT, farthest as f32).expect("room in scratch");
    let sides = watershed(&stage, &lab.engine, &sources, Near { distance: &distance, cells: distance.set() }, None)
        .expect("room in scratch");
    (geometry, sides)
}

/// A sphere without a cap: inside all but behind the hole, which closes at the rim's plane or near it.
#[test]
fn a_hole_is_closed_where_it_is_narrowest() {
    let (h, width) = (0.05, 0.6);
    let cosine = (1.0 - width * width / 4.0_f64).sqrt();
    let cloud = sphere([0.0; 3], 1.0, 12_000, |d| d[1] < cosine);
    let (geometry, sides) = sides_of_cloud(&cloud, h, 0.7);
    let [hole] = sides.basins[..] else { panic!("{:?}", sides.basins) };
    assert!((2.0 * f64::from(hole.saddle) - width).abs() < 2.0 * h, "{hole:?}");
    let grid = PlainGrid { shape: geometry.shape };
    let inside = whole(&sides.inside);
    for v in grid.voxels() {
        let p = geometry.position(v);
        let radius = p.iter().map(|x| x * x).sum::<f64>().sqrt();
        let beyond = (radius - 1.0).max(p[1] - cosine);
        if beyond.abs() > 3.0 * h {
            assert_eq!(inside[grid.at(v)] == 1, beyond < 0.0, "{p:?}");
        }
    }
    assert_eq!(sides.lost, [] as [u32; 0]);
}

/// A shell of two spheres, and a ball in its hollow: inside, outside, inside.
#[test]
fn hollows_are_outside_and_bodies_in_them_inside() {
    let h = 0.05;
    let radii = [2.0, 1.4, 0.6];
    let cloud: Vec<[f64; 3]> =
        radii.iter().flat_map(|&r| sphere([0.0; 3], r, (6000.0 * r * r) as usize, |_| true)).collect();
    let (geometry, sides) = sides_of_cloud(&cloud, h, 0.5);
    let (grid, inside) = (PlainGrid { shape: geometry.shape }, whole(&sides.inside));
    for v in grid.voxels() {
        let radius = geometry.position(v).iter().map(|x| x * x).sum::<f64>().sqrt();
        if radii.iter().all(|r| (radius - r).abs() > 2.0 * h) {
            let wanted = radius < 0.6 || (1.4..2.0).contains(&radius);
            assert_eq!(inside[grid.at(v)] == 1, wanted, "at radius {radius}");
        }
    }
    assert_eq!(sides.basins.len(), 2);
}

/// Two balls that a narrow neck joins are one body, though the neck is deep in neither.
#[test]
fn lobes_on_both_sides_of_a_neck_are_inside() {
    let h = 0.05;
    let on_neck = |p: &[f64; 3]| p[1].hypot(p[2]) >= 0.2;
    let balls = [-1.5, 1.5]
        .into_iter()
        .flat_map(|x| sphere([x, 0.0, 0.0], 1.0, 9000, |_| true))
        .filter(|p| p[0].abs() > 1.5 || on_neck(p));
    let neck = (0..1500).map(|n| {
        let (x, turn) = (-0.52 + 1.04 * f64::from(n) / 1500.0, 2.4 * f64::from(n));
        [x, 0.2 * turn.cos(), 0.2 * turn.sin()]
    });
    let cloud: Vec<[f64; 3]> = balls.chain(neck).collect();
    let (geometry, sides) = sides_of_cloud(&cloud, h, 0.6);
    let (grid, inside) = (PlainGrid { shape: geometry.shape }, whole(&sides.inside));
    let at = |p: [f64; 3]| inside[grid.at(geometry.to_voxels(p).map(|v| v.round() as i64))];
    assert_eq!([[-1.5, 0.0, 0.0], [0.0, 0.0, 0.0], [1.5, 0.0, 0.0], [0.0, 0.6, 0.0]].map(at), [1, 1, 1, 0]);
}
