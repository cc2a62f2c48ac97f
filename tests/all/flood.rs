//! The bottleneck flood against a priority flood with a heap over the whole grid (Barnes, Lehman & Mulla 2014), bit for
//! bit, and its basins against a breadth-first search.

use std::cmp::Ordering;
use std::collections::{BinaryHeap, VecDeque};
use std::sync::Arc;

use proptest::prelude::*;
use strandline::grid::{BrickGrid, BrickSet, Geometry, PointBins};
use strandline::kernel::level_set::initial::persistence::PERSISTENCE;
use strandline::pipeline::distance::{Method, Sources, cloud_distance};
use strandline::pipeline::enclosure::near::Near;
use strandline::pipeline::enclosure::tagging::{Basin, Tagging, tag};

use crate::common::clouds::{grid_around, sphere, sponge};
use crate::common::lab::{Lab, PlainGrid, dense, whole};
use crate::common::random::Random;

/// An entry of the heap: highest level first.
#[derive(PartialEq)]
struct Front(f32, [i64; 3]);

impl Eq for Front {}

impl Ord for Front {
    fn cmp(&self, other: &Self) -> Ordering {
        self.0.total_cmp(&other.0).then(self.1.cmp(&other.1))
    }
}

impl PartialOrd for Front {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// For each voxel the largest threshold at which the flood from the border reaches it.
fn priority_flood(grid: PlainGrid, d: &[f32]) -> Vec<f32> {
    let mut level = vec![f32::NAN; grid.len()];
    let mut heap = BinaryHeap::new();
    for v in grid.voxels().filter(|v| PlainGrid::around(*v).iter().any(|q| !grid.contains(*q))) {
        level[grid.at(v)] = d[grid.at(v)];
        heap.push(Front(d[grid.at(v)], v));
    }
    while let Some(Front(here, v)) = heap.pop() {
        for q in PlainGrid::around(v).into_iter().filter(|q| grid.contains(*q)) {
            if level[grid.at(q)].is_nan() {
                level[grid.at(q)] = here.min(d[grid.at(q)]);
                heap.push(Front(level[grid.at(q)], q));
            }
        }
    }
    level
}

/// A basin, and the voxels through which the flood may enter it: beside it, at the level of its saddle.
struct PlainBasin {
    voxels: u64,
    depth: f32,
    saddle: f32,
    entries: Vec<[i64; 3]>,
}

/// The connected voxels with d > b, those at least twice as deep as their saddle.
fn plain_basins(grid: PlainGrid, d: &[f32], b: &[f32]) -> Vec<PlainBasin> {
    let mut seen = vec![false; grid.len()];
    let mut basins = Vec::new();
    for seed in grid.voxels() {
        if d[grid.at(seed)] <= b[grid.at(seed)] || seen[grid.at(seed)] {
            continue;
        }
        let mut basin = PlainBasin { voxels: 0, depth: 0.0, saddle: b[grid.at(seed)], entries: Vec::new() };
        let mut queue = VecDeque::from([seed]);
        seen[grid.at(seed)] = true;
        while let Some(v) = queue.pop_front() {
            basin.voxels += 1;
            basin.depth = basin.depth.max(d[grid.at(v)]);
            assert_eq!(b[grid.at(v)], basin.saddle);
            for q in PlainGrid::around(v).into_iter().filter(|q| grid.contains(*q)) {
                let at = grid.at(q);
                if d[at] > b[at] && !seen[at] {
                    seen[at] = true;
                    queue.push_back(q);
                } else if d[at] == b[at] && b[at] == basin.saddle {
                    basin.entries.push(q);
                }
            }
        }
        basins.push(basin);
    }
    basins.retain(|basin| basin.depth >= 2.0 * basin.saddle);
    basins
}

/// Floods a given field of distances; the bricks that are not in `set` must be at `farthest` everywhere.
fn flood(lab: &Lab, set: &Arc<BrickSet>, d: &[f32], farthest: f32) -> Tagging {
    let shape = set.grid().shape();
    let geometry = Geometry { shape, spacing: [1.0; 3], origin: [0.0; 3], unit: None };
    let bins = PointBins::new(*set.grid(), &geometry, &[]);
    let sources = Sources::cloud(&geometry, &[], &bins);
    let mut distance = lab.field(set, d);
    (0..set.grid().len()).for_each(|id| distance.set_absent(id, farthest));
    let near = Near { distance: &distance, cells: set };
    tag(&lab.engine.stage("tagging", 0), &lab.engine, &sources, near, PERSISTENCE, |_| true).expect("room in scratch")
}

/// Flood and basins as the plain programs find them; a place is one where the flood may enter.
fn check(shape: [i64; 3], d: &[f32], found: &Tagging) {
    let grid = PlainGrid { shape };
    let expected = priority_flood(grid, d);
    let level = whole(&found.level);
    for v in grid.voxels() {
        let (f, e) = (level[grid.at(v)], expected[grid.at(v)]);
        assert_eq!(f.to_bits(), e.to_bits(), "{v:?}: {f} for {e}");
    }
    let mut basins = plain_basins(grid, d, &expected);
    assert!(found.basins.windows(2).all(|w| w[0].depth >= w[1].depth), "deepest first");
    assert_eq!(found.basins.len(), basins.len());
    for basin in &found.basins {
        let same = |b: &PlainBasin| {
            (b.voxels, b.depth, b.saddle) == (basin.voxels, basin.depth, basin.saddle)
                && b.entries.contains(&basin.place)
        };
        let Some(at) = basins.iter().position(same) else { panic!("{basin:?} is none of the plain basins") };
        basins.swap_remove(at);
    }
}

/// A cloud's distance and its flood on all bricks, or on those within `farthest` of the cloud.
fn flood_of_cloud(lab: &Lab, geometry: &Geometry, cloud: &[[f64; 3]], farthest: Option<f32>) -> (Vec<f32>, Tagging) {
    let grid = BrickGrid::new(geometry.shape, 16);
    let bins = PointBins::new(grid, geometry, cloud);
    let set = match farthest {
        None => dense(geometry.shape, 16),
        Some(f) => {
            let reach = geometry.spacing.map(|h| (f64::from(f) / h).ceil() as i64);
            Arc::new(bins.bricks_within(geometry, cloud, reach))
        }
    };
    let sources = Sources::cloud(geometry, cloud, &bins);
    let stage = lab.engine.stage("start", 0);
    let farthest = farthest.unwrap_or(f32::INFINITY);
    let distance = cloud_distance(&stage, &lab.engine, &sources, &set, Method::FSM, farthest).expect("room in scratch");
    let tagging = tag(&stage, &lab.engine, &sources, Near { distance: &distance, cells: &set }, PERSISTENCE, |_| true)
        .expect("room in scratch");
    (whole(&distance), tagging)
}

#[test]
fn clouds_are_flooded_as_by_a_heap() {
    let lab = Lab::new(2);
    let shell = sphere([3.0, -2.0, 0.5], 1.0, 900, |_| true);
    for (cloud, h) in [(sponge(), 0.06), (shell, 0.08)] {
        let geometry = grid_around(&cloud, h);
        // A basin must be seen to be twice as deep as its saddle.
        for farthest in [None, Some(0.6)] {
            let (d, found) = flood_of_cloud(&lab, &geometry, &cloud, farthest);
            check(geometry.shape, &d, &found);
            assert_eq!(found.basins.len(), 1);
        }
    }
}

/// The cloud of a sphere without a cap: the flood enters through the middle of the hole, half its width from the rim.
#[test]
fn the_saddle_is_half_the_hole() {
    let lab = Lab::new(2);
    let h = 0.05;
    for width in [0.4, 0.7] {
        let cosine = (1.0 - width * width / 4.0_f64).sqrt();
        let cloud = sphere([0.0; 3], 1.0, 20_000, |d| d[1] < cosine);
        let geometry = grid_around(&cloud, h);
        for farthest in [None, Some(0.8)] {
            let (_, found) = flood_of_cloud(&lab, &geometry, &cloud, farthest);
            let [Basin { saddle, place, depth, .. }] = found.basins[..] else { panic!("{:?}", found.basins) };
            assert!((f64::from(saddle) - width / 2.0).abs() < h, "{saddle} for half of {width}");
            let entry = geometry.position(place);
            let off: Vec<f64> = [0.0, cosine, 0.0].iter().zip(entry).map(|(e, p)| (e - p).abs()).collect();
            assert!(off.iter().all(|o| *o <= 2.0 * h), "{entry:?}");
            let deepest = if farthest.is_some() { 0.8 } else { 1.0 };
            assert!((f64::from(depth) - deepest).abs() < 2.0 * h, "{depth}");
        }
    }
}

#[test]
fn a_sheet_encloses_nothing() {
    let lab = Lab::new(2);
    let sheet: Vec<[f64; 3]> =
        (0..900).map(|n| [f64::from(n % 30), f64::from(n / 30), (f64::from(n) * 0.3).sin()].map(|v| 0.1 * v)).collect();
    let mut geometry = grid_around(&sheet, 0.05);
    geometry.shape[2] += 20;
    for farthest in [None, Some(0.4)] {
        assert_eq!(flood_of_cloud(&lab, &geometry, &sheet, farthest).1.basins, []);
    }
}

/// Two equal objects have two equal basins, each with an entry of its own.
#[test]
fn equal_objects_have_entries_of_their_own() {
    let lab = Lab::new(2);
    let left = sphere([0.0; 3], 1.0, 400, |d| d[0] < 0.93);
    let cloud: Vec<[f64; 3]> = left.iter().copied().chain(left.iter().map(|p| [p[0] + 4.0, p[1], p[2]])).collect();
    let geometry = Geometry { shape: [65, 25, 25], spacing: [0.125; 3], origin: [-1.5; 3], unit: None };
    let (d, found) = flood_of_cloud(&lab, &geometry, &cloud, None);
    assert_eq!(found.basins.len(), 2);
    check(geometry.shape, &d, &found);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(80))]

    /// Rough fields have many small basins; absent bricks make far regions, outside and enclosed.
    #[test]
    fn random_fields_are_flooded_as_by_a_heap(
        shape in prop::array::uniform3(1_i64..22),
        edge in prop::sample::select(vec![4, 8, 16]),
        threads in 1_usize..3,
        absent in 0_usize..4,
        seed: u64,
    ) {
        let mut random = Random(seed);
        let grid = BrickGrid::new(shape, edge);
        let set = Arc::new(BrickSet::from_fn(grid, |_| random.below(4) >= absent));
        let plain = PlainGrid { shape };
        // Cubed, so that some voxels are near enough to 0 to close basins that persist.
        let value = |v: [i64; 3]| {
            let stored = grid.brick_of(v).is_some_and(|id| set.slot(id).is_some());
            if stored { (random.unit().powi(3) as f32).max(1e-3) } else { 1.0 }
        };
        let d: Vec<f32> = plain.voxels().map(value).collect();
        check(shape, &d, &flood(&Lab::new(threads), &set, &d, 1.0));
    }
}
