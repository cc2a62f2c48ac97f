//! FMM and DP against the printed wavefront algorithms over the whole volume (Kósa & Mikula 2023, Alg. 4, 5 and 8, as
//! mended in the errata: frozen upwind neighbours; fixed voxels take part), against the exact distance to every point,
//! and against Table 2.

use std::collections::BTreeSet;

use proptest::prelude::*;
use strandline::grid::{Box3, DataSets, Geometry, PointBins, TriangleBins};
use strandline::kernel::distance::seeding::initialise::Cube;
use strandline::kernel::distance::state::neighbours::Neighbours;
use strandline::kernel::distance::state::precision::Precision;
use strandline::pipeline::distance::{Method, Options, Schedule, Solving, Sources};

use crate::common::clouds::{grid_around, random_cloud, sponge};
use crate::common::lab::{Lab, PlainGrid, dense};
use crate::common::meshes;
use crate::common::textbook::{fixing_sources, godunov, position, squared};
use crate::distance::{assert_same_bits, grid, scattered};

const TEXTBOOK: Schedule = Schedule::Sweep { iterations: 1 };

/// Distances and the sources they are measured to.
type Field<P> = (Vec<P>, Vec<Option<usize>>);

fn steps(neighbours: Neighbours) -> Vec<[i64; 3]> {
    let all = (PlainGrid { shape: [3; 3] }).voxels().map(|v| v.map(|n| n - 1)).filter(|o| *o != [0; 3]);
    match neighbours {
        Neighbours::Faces => PlainGrid::around([0; 3]).to_vec(),
        Neighbours::All => all.collect(),
    }
}

/// The neighbours of a voxel in the domain, each with the length of the step to it.
fn beside(geometry: &Geometry, v: [i64; 3], neighbours: Neighbours) -> Vec<(usize, f64)> {
    let plain = PlainGrid { shape: geometry.shape };
    let at = |o: [i64; 3]| {
        let q = std::array::from_fn(|a| v[a] + o[a]);
        let way = o.iter().zip(geometry.spacing).map(|(&o, h)| (o as f64 * h).powi(2)).sum::<f64>().sqrt();
        plain.contains(q).then(|| (plain.at(q), way))
    };
    steps(neighbours).into_iter().filter_map(at).collect()
}

/// Alg. 8: the source of the frozen one of the 26 neighbours with the smallest distance and way.
fn source_beside(geometry: &Geometry, v: [i64; 3], d: &[f32], frozen: &[bool], s: &[Option<usize>]) -> Option<usize> {
    let mut best = (f64::INFINITY, None);
    for (q, way) in beside(geometry, v, Neighbours::All) {
        if frozen[q] && f64::from(d[q]) + way < best.0 {
            best = (f64::from(d[q]) + way, s[q]);
        }
    }
    best.1
}

/// Alg. 4 and 8, stored in f32; of equal voxels the lower place leaves the heap first.
fn textbook_fmm(geometry: &Geometry, cloud: &[[f64; 3]]) -> Field<f32> {
    let plain = PlainGrid { shape: geometry.shape };
    let voxels: Vec<[i64; 3]> = plain.voxels().collect();
    let fixing = fixing_sources(geometry, cloud);
    let start = |(v, s): (&[i64; 3], &Option<usize>)| {
        s.map_or(f32::INFINITY, |s| squared(position(geometry, *v), cloud[s]).sqrt() as f32)
    };
    let mut d: Vec<f32> = voxels.iter().zip(&fixing).map(start).collect();
    let mut s = fixing.clone();
    let mut frozen = vec![false; plain.len()];
    let mut heap: BTreeSet<(u32, usize)> =
        (0..plain.len()).filter(|&at| fixing[at].is_some()).map(|at| (d[at].to_bits(), at)).collect();
    while let Some((_, at)) = heap.pop_first() {
        if fixing[at].is_none() {
            s[at] = source_beside(geometry, voxels[at], &d, &frozen, &s);
        }
        frozen[at] = true;
        for (q, _) in beside(geometry, voxels[at], Neighbours::Faces) {
            if frozen[q] || fixing[q].is_some() {
                continue;
            }
            let known = |r: [i64; 3]| plain.contains(r) && frozen[plain.at(r)];
            let value = |r| if known(r) { f64::from(d[plain.at(r)]) } else { f64::INFINITY };
            let n = PlainGrid::around(voxels[q]).map(value);
            let near = std::array::from_fn(|a| n[2 * a].min(n[2 * a + 1]));
            let lower = godunov(near, geometry.spacing) as f32;
            if lower < d[q] {
                heap.remove(&(d[q].to_bits(), q));
                d[q] = lower;
                heap.insert((lower.to_bits(), q));
            }
        }
    }
    (d, s)
}

/// Alg. 5: the distances are those to the sources kept, in f64; the heap is ordered by Dijkstra's bound.
fn textbook_dp(geometry: &Geometry, cloud: &[[f64; 3]], neighbours: Neighbours) -> Field<f32> {
    let plain = PlainGrid { shape: geometry.shape };
    let voxels: Vec<[i64; 3]> = plain.voxels().collect();
    let fixing = fixing_sources(geometry, cloud);
    let exact = |at: usize, s: usize| squared(position(geometry, voxels[at]), cloud[s]);
    let mut s = fixing.clone();
    let mut d: Vec<f64> = (0..s.len()).map(|at| s[at].map_or(f64::INFINITY, |s| exact(at, s).sqrt())).collect();
    let mut frozen = vec![false; plain.len()];
    let mut heap: BTreeSet<(u64, usize)> =
        (0..plain.len()).filter(|&at| fixing[at].is_some()).map(|at| (d[at].to_bits(), at)).collect();
    while let Some((_, at)) = heap.pop_first() {
        let around = beside(geometry, voxels[at], neighbours);
        if fixing[at].is_none() {
            let mut best = (f64::INFINITY, None);
            for source in around.iter().filter(|(q, _)| frozen[*q]).filter_map(|(q, _)| s[*q]) {
                if exact(at, source) < best.0 {
                    best = (exact(at, source), Some(source));
                }
            }
            (d[at], s[at]) = (best.0.sqrt(), best.1);
        }
        frozen[at] = true;
        for (q, way) in around {
            if !frozen[q] && fixing[q].is_none() && d[at] + way < d[q] {
                heap.remove(&(d[q].to_bits(), q));
                d[q] = d[at] + way;
                heap.insert((d[q].to_bits(), q));
            }
        }
    }
    (d.iter().map(|d| *d as f32).collect(), s)
}

/// Ours, everywhere, with sources.
fn ours<P: Precision>(
    lab: &Lab,
    geometry: &Geometry,
    cloud: &[[f64; 3]],
    edge: i64,
    (method, schedule, neighbours): (Method, Schedule, Neighbours),
    cube: Cube,
) -> Field<P> {
    let set = dense(geometry.shape, edge);
    let bins = PointBins::new(*set.grid(), geometry, cloud);
    let cubes = [(cloud.len() as u32, cube)];
    let sources = Sources { cubes: &cubes, ..Sources::cloud(geometry, cloud, &bins) };
    let stage = lab.engine.stage("distance", 0);
    let options = Options { farthest: f64::INFINITY, neighbours, sources: true, labels: false };
    let solve = method.solver::<P>().solve;
    let solved =
        solve(&Solving::new(&stage, &lab.engine, &sources, &set, options), schedule).expect("room for a distance");
    let part = Box3::from_shape(geometry.shape);
    let (mut values, mut nearest) = (vec![P::default(); part.len()], vec![0; part.len()]);
    solved.values.read_box(&part, &mut values).expect("memory can be read");
    solved.sources.read_box(&part, &mut nearest).expect("memory can be read");
    (values, nearest.into_iter().map(|s| Some(s as usize).filter(|s| *s < cloud.len())).collect())
}

/// A domain with a cloud.
fn cases() -> impl Iterator<Item = (Geometry, Vec<[f64; 3]>)> {
    let shapes = [[33, 29, 21], [1, 40, 17], [50, 1, 1], [18, 23, 1], [16, 16, 16], [1, 1, 1]];
    shapes.into_iter().enumerate().flat_map(|(seed, shape)| {
        [[0.1; 3], [0.3, 0.17, 0.9]].into_iter().map(move |spacing| {
            let geometry = grid(shape, spacing);
            let cloud = random_cloud(&geometry, 25, seed as u64);
            (geometry, cloud)
        })
    })
}

/// The largest difference, in units of the last place of the expected value.
fn most_ulps(found: &[f32], expected: &[f32]) -> u32 {
    let apart = |(f, e): (&f32, &f32)| f.to_bits().abs_diff(e.to_bits());
    found.iter().zip(expected).map(apart).max().unwrap_or(0)
}

/// What the front of bricks may be off the textbook's heap, in units of the last place of f32: its arithmetic is f32,
/// and a step along the widest spacing is as much worse conditioned as the narrowest is narrower.
fn allowed(geometry: &Geometry) -> u32 {
    if geometry.spacing.iter().all(|h| *h == geometry.spacing[0]) { 8 } else { 64 }
}

#[test]
fn the_heap_gives_the_bits_of_the_printed_algorithms() {
    let lab = Lab::new(2);
    let sponge = (grid_around(&sponge(), 0.1), sponge());
    for (geometry, cloud) in cases().chain([sponge]) {
        let what = format!("{geometry:?}");
        let fmm = (Method::FMM, TEXTBOOK, Neighbours::Faces);
        let (d, s) = ours::<f32>(&lab, &geometry, &cloud, 8, fmm, Cube::CELL);
        let expected = textbook_fmm(&geometry, &cloud);
        assert_same_bits(&d, &expected.0, &what);
        assert_eq!(s, expected.1, "{what}");
        for neighbours in [Neighbours::Faces, Neighbours::All] {
            let dp = (Method::DP, TEXTBOOK, neighbours);
            let (d, s) = ours::<f32>(&lab, &geometry, &cloud, 16, dp, Cube::CELL);
            let expected = textbook_dp(&geometry, &cloud, neighbours);
            assert_same_bits(&d, &expected.0, &what);
            assert_eq!(s, expected.1, "{what}");
        }
    }
}

/// The order of Alg. 8, taken from finished distances: smallest first, of equal ones the lower place.
fn sources_of(geometry: &Geometry, cloud: &[[f64; 3]], d: &[f32]) -> Vec<Option<usize>> {
    let voxels: Vec<[i64; 3]> = (PlainGrid { shape: geometry.shape }).voxels().collect();
    let fixing = fixing_sources(geometry, cloud);
    let (mut s, mut frozen) = (fixing.clone(), vec![false; d.len()]);
    let mut order: Vec<usize> = (0..d.len()).filter(|&at| d[at].is_finite()).collect();
    order.sort_by_key(|&at| (d[at].to_bits(), at));
    for at in order {
        if fixing[at].is_none() {
            s[at] = source_beside(geometry, voxels[at], d, &frozen, &s);
        }
        frozen[at] = true;
    }
    s
}

fn check_front_fmm(labs: &[Lab], geometry: &Geometry, cloud: &[[f64; 3]], edges: &[i64]) {
    let (expected, _) = textbook_fmm(geometry, cloud);
    for &edge in edges {
        let mut first: Option<Field<f32>> = None;
        for lab in labs {
            let what = format!("{geometry:?}, bricks of {edge}, {} threads", lab.engine.threads());
            let fmm = (Method::FMM, Schedule::Front, Neighbours::Faces);
            let found = ours::<f32>(lab, geometry, cloud, edge, fmm, Cube::CELL);
            let (apart, allowed) = (most_ulps(&found.0, &expected), allowed(geometry));
            println!("{what}: {apart}");
            assert!(apart <= allowed, "{what}: {apart} units of the last place");
            assert_eq!(found.1, sources_of(geometry, cloud, &found.0), "{what}");
            if let Some(first) = &first {
                assert_same_bits(&found.0, &first.0, &what);
            }
            first.get_or_insert(found);
        }
    }
}

/// How many voxels are farther than the nearest point by more than rounding, and by how much at most.
fn excess(geometry: &Geometry, cloud: &[[f64; 3]], d: &[f32]) -> (usize, f64) {
    let voxels = (PlainGrid { shape: geometry.shape }).voxels();
    voxels.zip(d).fold((0, 0.0), |(count, most), (v, &d)| {
        let here = position(geometry, v);
        let exact = cloud.iter().map(|p| squared(here, *p)).fold(f64::INFINITY, f64::min).sqrt();
        let more = f64::from(d) - exact;
        assert!(more > -1e-5 * exact.max(1.0), "{v:?}: {d} is nearer than {exact}");
        (count + usize::from(more > 1e-5 * exact.max(1.0)), f64::max(most, more))
    })
}

#[test]
fn the_front_is_the_heap_within_rounding() {
    let labs = [Lab::new(1), Lab::new(2), Lab::new(4)];
    for (geometry, cloud) in cases() {
        check_front_fmm(&labs, &geometry, &cloud, &[8, 16, 32]);
    }
    let cloud = sponge();
    check_front_fmm(&labs[1..2], &grid_around(&cloud, 0.05), &cloud, &[16, 32]);
}

#[test]
fn every_order_of_dp_is_nearly_everywhere_exact() {
    let labs = [Lab::new(1), Lab::new(2), Lab::new(4)];
    let orders = [Schedule::Front, TEXTBOOK];
    for (seed, spacing) in [[0.5; 3], [0.4, 0.4, 1.3]].into_iter().enumerate() {
        let geometry = grid([60, 57, 40], spacing);
        let cloud = scattered(&geometry, 120, seed as u64);
        for (schedule, edge) in [(orders[0], 8), (orders[0], 16), (orders[0], 32), (orders[1], 16)] {
            let dp = (Method::DP, schedule, Neighbours::Faces);
            let found = labs.each_ref().map(|lab| ours::<f32>(lab, &geometry, &cloud, edge, dp, Cube::CELL));
            assert!(found[1] == found[0] && found[2] == found[0], "{schedule:?}, bricks of {edge}");
            let (count, most) = excess(&geometry, &cloud, &found[0].0);
            println!("{schedule:?}, bricks of {edge}: {count} voxels, by {most} at most");
            // The heap never looks at a frozen voxel again.
            let allowed = if schedule == Schedule::Front { 0.1 } else { 0.25 };
            assert!(most < allowed * spacing[0], "{schedule:?}, bricks of {edge}: {most}");
            assert!(count * 1000 < found[0].0.len(), "{schedule:?}, bricks of {edge}: {count} voxels");
        }
    }
}

/// The end of VDT and DP in the front: no voxel has a neighbour with a nearer source, but for the rounding of f32.
#[test]
fn no_neighbour_knows_a_nearer_source() {
    let labs = [Lab::new(1), Lab::new(2), Lab::new(4)];
    for (seed, spacing) in [[0.5; 3], [0.4, 0.4, 1.3]].into_iter().enumerate() {
        let geometry = grid([45, 37, 30], spacing);
        let cloud = random_cloud(&geometry, 120, 90 + seed as u64);
        let fixing = fixing_sources(&geometry, &cloud);
        let voxels: Vec<[i64; 3]> = (PlainGrid { shape: geometry.shape }).voxels().collect();
        for (method, neighbours) in [
            (Method::VDT, Neighbours::Faces),
            (Method::VDT, Neighbours::All),
            (Method::DP, Neighbours::Faces),
            (Method::DP, Neighbours::All),
        ] {
            for edge in [8, 16, 32] {
                let what = format!("{method:?}, {neighbours:?}, {spacing:?}, bricks of {edge}");
                let order = (method, Schedule::Front, neighbours);
                let found = labs.each_ref().map(|lab| ours::<f32>(lab, &geometry, &cloud, edge, order, Cube::CELL));
                assert!(found[1] == found[0] && found[2] == found[0], "{what}: threads");
                let s = &found[0].1;
                for at in (0..s.len()).filter(|&at| fixing[at].is_none()) {
                    let distance = |s: Option<usize>| squared(position(&geometry, voxels[at]), cloud[s.expect("all")]);
                    let kept = distance(s[at]);
                    for (q, _) in beside(&geometry, voxels[at], neighbours) {
                        assert!(distance(s[q]) > kept * (1.0 - 1e-5) - 1e-12, "{what}: {:?}", voxels[at]);
                    }
                }
                println!("{what}: {:?} beyond the nearest point", excess(&geometry, &cloud, &found[0].0));
            }
        }
    }
}

/// Triangles instead of points: a box, whose distance is a formula.
#[test]
fn a_box_of_triangles_has_its_distance() {
    let lab = Lab::new(2);
    let geometry = Geometry { shape: [40, 33, 37], spacing: [0.1, 0.13, 0.11], origin: [-1.0; 3], unit: None };
    let (low, high) = ([0.03, -0.21, 0.4], [1.72, 2.05, 1.61]);
    let mut sets = DataSets::default();
    sets.add_mesh(&meshes::cuboid(low, high));
    let exact = |v: [i64; 3]| {
        let p = position(&geometry, v);
        let beyond: [f64; 3] = std::array::from_fn(|a| (low[a] - p[a]).max(p[a] - high[a]));
        let most = beyond.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        if most <= 0.0 { -most } else { beyond.iter().map(|b| b.max(0.0).powi(2)).sum::<f64>().sqrt() }
    };
    for (schedule, neighbours) in
        [(Schedule::Front, Neighbours::Faces), (Schedule::Front, Neighbours::All), (TEXTBOOK, Neighbours::Faces)]
    {
        let set = dense(geometry.shape, 16);
        let (bins, triangles) =
            (PointBins::new(*set.grid(), &geometry, &[]), TriangleBins::new(*set.grid(), &geometry, &sets.mesh));
        let sources = Sources {
            mesh: Some((&sets.mesh, &triangles)),
            sets: Some(&sets),
            trees: None,
            ..Sources::cloud(&geometry, &[], &bins)
        };
        let stage = lab.engine.stage("distance", 0);
        let options = Options { farthest: f64::INFINITY, neighbours, sources: true, labels: false };
        let solve = Method::DP.solver::<f32>().solve;
        let solved =
            solve(&Solving::new(&stage, &lab.engine, &sources, &set, options), schedule).expect("room for a distance");
        let part = Box3::from_shape(geometry.shape);
        let mut values = vec![0.0_f32; part.len()];
        solved.values.read_box(&part, &mut values).expect("memory can be read");
        for (v, d) in (PlainGrid { shape: geometry.shape }).voxels().zip(&values) {
            assert!((f64::from(*d) - exact(v)).abs() < 1e-5, "{schedule:?}, {neighbours:?}: {v:?} has {d}");
        }
    }
}

/// The cube of side 1 in [-0.4, 1.4]^3 with n grid points along an edge: mean squared error.
fn cube_error(lab: &Lab, n: i64, method: Method, schedule: Schedule) -> f64 {
    let h = 1.8 / (n - 1) as f64;
    let geometry = Geometry { shape: [n; 3], spacing: [h; 3], origin: [-0.4; 3], unit: None };
    let plain = PlainGrid { shape: geometry.shape };
    let (low, high) = ((0.4 / h).round() as i64, (1.4 / h).round() as i64);
    let on = |v: &[i64; 3]| v.iter().all(|i| (low..=high).contains(i)) && v.iter().any(|&i| i == low || i == high);
    let cloud: Vec<[f64; 3]> = plain.voxels().filter(on).map(|v| position(&geometry, v)).collect();
    let cube = Cube { snaps: true, ..Cube::CELL };
    let (d, _) = ours::<f64>(lab, &geometry, &cloud, 16, (method, schedule, Neighbours::Faces), cube);
    let exact = |v: [i64; 3]| {
        let beyond = v.map(|i| (low - i).max(i - high) as f64 * h);
        let inside = beyond.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        if inside <= 0.0 { -inside } else { beyond.iter().map(|b| b.max(0.0).powi(2)).sum::<f64>().sqrt() }
    };
    plain.voxels().zip(&d).map(|(v, d)| (d - exact(v)).powi(2)).sum::<f64>() / plain.len() as f64
}

/// Table 2; the causal update's seven digits (the printed one differs in a digit at 19^3).
#[test]
fn the_cube_has_the_printed_errors() {
    let lab = Lab::new(2);
    for (n, printed) in [(10, 2.569_283e-3), (19, 9.790_186e-4), (37, 3.769_754e-4)] {
        for schedule in [Schedule::Front, TEXTBOOK] {
            let error = cube_error(&lab, n, Method::FMM, schedule);
            assert!((error / printed - 1.0).abs() < 5e-7, "fmm, {n}^3, {schedule:?}: {error:e} for {printed:e}");
            let error = cube_error(&lab, n, Method::DP, schedule);
            assert!(error < 1e-30, "dp, {n}^3, {schedule:?}: {error:e}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn random_clouds_give_the_heap_within_rounding(
        shape in prop::array::uniform3(1_i64..24),
        spacing in prop::sample::select(vec![[1.0; 3], [0.1; 3], [0.25, 0.5, 1.0], [0.31, 0.7, 0.113]]),
        count in 1_usize..30,
        edge in prop::sample::select(vec![8, 16, 32]),
        seed: u64,
    ) {
        let geometry = grid(shape, spacing);
        let cloud = random_cloud(&geometry, count, seed);
        check_front_fmm(&[Lab::new(2)], &geometry, &cloud, &[edge]);
    }
}
