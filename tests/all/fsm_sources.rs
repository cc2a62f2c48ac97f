//! Sources of FSM. With `--schedule sweep` those of Alg. 7 (Kósa & Mikula 2023), bit for bit: on clouds in `distance`,
//! on meshes here. With `front` they follow from the finished distances alone, whatever the layout.

use std::collections::BTreeSet;

use half::f16;
use proptest::prelude::*;
use rstar::RTree;
use strandline::grid::NO_SOURCE;
use strandline::grid::{Box3, DataSets, Geometry, PointBins, TriangleBins};
use strandline::pipeline::distance::{Method, Options, Schedule, Solving, Sources};

use crate::common::clouds::{grid_around, random_cloud, sponge_and_sphere};
use crate::common::lab::{Lab, PlainGrid, dense};
use crate::common::meshes;
use crate::common::solve::{everywhere, solve, whole_edge};
use crate::common::textbook::{self, Stored, position, squared};
use crate::distance::{assert_same_bits, grid};

const SWEEP: Schedule = Schedule::Sweep { iterations: 1 };

/// Distances, sources, and how many bricks were computed.
type Found<P> = (Vec<P>, Vec<Option<usize>>, u64);

/// FSM to any data sets.
fn fsm<P: Stored>(
    lab: &Lab,
    geometry: &Geometry,
    sets: &DataSets,
    edge: i64,
    schedule: Schedule,
    options: Options,
) -> Found<P> {
    let set = dense(geometry.shape, edge);
    let bins = PointBins::new(*set.grid(), geometry, &sets.positions);
    let triangles = TriangleBins::new(*set.grid(), geometry, &sets.mesh);
    let sources = Sources {
        mesh: Some((&sets.mesh, &triangles)),
        sets: Some(sets),
        trees: None,
        ..Sources::cloud(geometry, &sets.positions, &bins)
    };
    let stage = lab.engine.stage("distance", 0);
    let solve = Method::FSM.solver::<P>().solve;
    let solved =
        solve(&Solving::new(&stage, &lab.engine, &sources, &set, options), schedule).expect("room for a distance");
    let bricks = stage.finish().bricks;
    let part = Box3::from_shape(geometry.shape);
    let (mut values, mut nearest) = (vec![P::default(); part.len()], vec![0; part.len()]);
    solved.values.read_box(&part, &mut values).expect("memory can be read");
    solved.sources.read_box(&part, &mut nearest).expect("memory can be read");
    (values, nearest.into_iter().map(|s| (s != NO_SOURCE).then_some(s as usize)).collect(), bricks)
}

/// Two overlapping closed meshes and a cloud.
fn meshes_and_points(geometry: &Geometry) -> DataSets {
    let mut sets = DataSets::default();
    sets.add_cloud(&random_cloud(geometry, 15, 1));
    sets.add_mesh(&meshes::cuboid([0.03, 0.6, 30.4], [1.7, 2.0, 31.6]));
    sets.add_mesh(&meshes::sphere([2.0, 2.2, 32.0], 0.8, 9, std::f64::consts::PI));
    sets.add_cloud(&random_cloud(geometry, 5, 2));
    sets
}

#[test]
fn meshes_and_clouds_give_the_bits_of_the_triple_loop() {
    let geometry = grid([45, 38, 41], [0.1, 0.13, 0.11]);
    let sets = meshes_and_points(&geometry);
    let lab = Lab::new(2);
    for iterations in [1, 2] {
        // Without an iteration there are the voxels that sources fix.
        let start = fsm::<f32>(&lab, &geometry, &sets, 64, Schedule::Sweep { iterations: 0 }, everywhere(true));
        let (d, s) = textbook::fsm_from(&geometry, (start.0, start.1), iterations);
        let points = sets.positions.len();
        assert!(s.iter().any(|s| s.is_some_and(|s| s < points)) && s.iter().any(|s| s.is_some_and(|s| s > points)));
        for edge in [8, 16, 32, whole_edge(geometry.shape)] {
            let found = fsm::<f32>(&lab, &geometry, &sets, edge, Schedule::Sweep { iterations }, everywhere(true));
            let what = format!("bricks of {edge}, {iterations} iterations");
            assert_same_bits(&found.0, &d, &what);
            assert!(found.1 == s, "{what}: sources differ");
        }
    }
}

/// What `--schedule sweep` adds to Alg. 7: from the start of Alg. 1 the printed rule leaves voxels without a source. Here
/// all have one, and where the printed rule finds one it is the same.
#[test]
fn no_voxel_is_left_without_a_source_as_the_printed_rule_leaves_some() {
    let lab = Lab::new(2);
    let clouds = sponge_and_sphere();
    let geometry = grid_around(&clouds.concat(), 0.05);
    let mut sets = DataSets::default();
    for cloud in &clouds {
        sets.add_cloud(cloud);
    }
    let edge = whole_edge(geometry.shape);
    let start = fsm::<f32>(&lab, &geometry, &sets, edge, Schedule::Sweep { iterations: 0 }, everywhere(true));
    let (d, s) = textbook::fsm_to_the_letter(&geometry, (start.0, start.1), 1);
    let found = fsm::<f32>(&lab, &geometry, &sets, edge, SWEEP, everywhere(true));
    assert_same_bits(&found.0, &d, "distances");
    let left = s.iter().filter(|s| s.is_none()).count();
    assert!(left > 0, "the printed rule leaves no voxel without a source here");
    assert!(found.1.iter().all(Option::is_some));
    assert!(s.iter().zip(&found.1).all(|(printed, found)| printed.is_none() || printed == found));
}

/// The values of a field are the same whether sources are wanted or not. With sources a sweep has more to do than to
/// visit bricks in their turn: what lies in bricks whose turn is still to come is resolved afterwards.
#[test]
fn sources_change_no_distance() {
    let geometry = grid([45, 38, 41], [0.1, 0.13, 0.11]);
    let sets = meshes_and_points(&geometry);
    let lab = Lab::new(2);
    for schedule in [SWEEP, Schedule::Front] {
        let [without, with] =
            [false, true].map(|sources| fsm::<f32>(&lab, &geometry, &sets, 16, schedule, everywhere(sources)));
        assert_same_bits(&with.0, &without.0, "with sources");
        assert!(with.1.iter().all(Option::is_some) && without.1.iter().all(Option::is_none));
        assert!(with.2 > without.2, "{schedule:?}: {} and {} bricks", with.2, without.2);
    }
}

/// Whatever the layout, the sources of `front` are those that a plain search along its distances finds.
fn check_front<P: Stored>(labs: &[Lab], geometry: &Geometry, cloud: &[[f64; 3]], edges: &[i64]) {
    for (lab, &edge) in labs.iter().flat_map(|lab| edges.iter().map(move |edge| (lab, edge))) {
        let found = solve::<P>(lab, geometry, cloud, edge, Method::FSM, Schedule::Front);
        let expected = textbook::sources_along(geometry, cloud, &found.values);
        let what = format!("{:?}, {geometry:?}, bricks of {edge}", P::TYPE);
        assert!(found.sources == expected, "{what}, {} threads", lab.engine.threads());
        let complete = found.values.iter().zip(&found.sources).all(|(d, s)| d.to_f64().is_finite() == s.is_some());
        assert!(complete, "{what}: a distance without a source");
    }
}

#[test]
fn the_front_has_sources_along_its_distances() {
    let labs = [1, 2, 4].map(Lab::new);
    let shapes = [[33, 29, 21], [1, 40, 17], [70, 1, 1], [18, 66, 1], [16, 16, 16], [1, 1, 1]];
    for (seed, shape) in shapes.into_iter().enumerate() {
        for spacing in [[0.1; 3], [0.3, 0.17, 0.9]] {
            let geometry = grid(shape, spacing);
            let cloud = random_cloud(&geometry, 25, seed as u64);
            check_front::<f64>(&labs[1..2], &geometry, &cloud, &[8, 16, 64]);
            check_front::<f32>(&labs, &geometry, &cloud, &[8, 16, 32, 64, whole_edge(shape)]);
            check_front::<f16>(&labs[1..2], &geometry, &cloud, &[8, 16, 64]);
        }
    }
}

/// In half precision 2048 + 1 is 2048: beyond, all distances are equal, and no neighbour is nearer than another. The
/// lowest source that reaches such a voxel is its source.
#[test]
fn no_voxel_stays_without_a_source_where_distances_are_lost_in_rounding() {
    let geometry = Geometry { shape: [5000, 2, 1], spacing: [1.0; 3], origin: [0.0; 3], unit: None };
    let cloud = [[4980.0, 0.0, 0.0], [20.0, 1.0, 0.0]];
    for edge in [16, 64] {
        let found = solve::<f16>(&Lab::new(2), &geometry, &cloud, edge, Method::FSM, Schedule::Front);
        assert!(found.values.iter().filter(|d| d.to_f64() == 2048.0).count() > 1000);
        let plain = PlainGrid { shape: geometry.shape };
        for (v, (&d, s)) in plain.voxels().zip(found.values.iter().zip(&found.sources)) {
            let beside = PlainGrid::around(v).into_iter().filter(|q| plain.contains(*q));
            let is_lost = d.to_f64() == 2048.0 && beside.into_iter().all(|q| found.values[plain.at(q)] >= d);
            let expected = usize::from(v[0] < 2500 && !is_lost);
            assert_eq!(*s, Some(expected), "{v:?} at {d}, bricks of {edge}");
        }
    }
}

/// The share of voxels whose source is not the nearest one of those that fix voxels, and by how much it is farther at
/// most, in spacings.
fn inexact(geometry: &Geometry, cloud: &[[f64; 3]], sources: &[Option<usize>]) -> (f64, f64) {
    let fixing: BTreeSet<usize> = textbook::fixing_sources(geometry, cloud).into_iter().flatten().collect();
    let tree = RTree::bulk_load(fixing.into_iter().map(|s| cloud[s]).collect());
    let (mut wrong, mut most) = (0, 0.0_f64);
    for (v, s) in (PlainGrid { shape: geometry.shape }).voxels().zip(sources) {
        let here = position(geometry, v);
        let exact = squared(here, *tree.nearest_neighbor(here).expect("a point")).sqrt();
        let excess = squared(here, cloud[s.expect("a source")]).sqrt() - exact;
        wrong += usize::from(excess > 1e-9);
        most = most.max(excess / geometry.min_spacing());
    }
    (wrong as f64 / sources.len() as f64, most)
}

/// Sources are carried along steps to one of 26 neighbours, not along characteristics, so a voxel may get one that is
/// near, not nearest: seldom in a cloud that fills the volume, for half of the voxels far from a dense surface. Both
/// schedules alike; FMM, which takes the shortest way, does better.
#[test]
fn most_sources_are_the_nearest_ones() {
    let lab = Lab::new(2);
    let pair = sponge_and_sphere().concat();
    let mut cases = vec![("Sponge & Sphere".to_string(), grid_around(&pair, 0.05), pair, 0.53)];
    for (seed, spacing, share) in [(0, [0.5; 3], 0.06), (1, [0.4, 0.4, 1.3], 0.135)] {
        let geometry = grid([70, 64, 50], spacing);
        let cloud = random_cloud(&geometry, 100, seed);
        cases.push((format!("100 points, spacing {spacing:?}"), geometry, cloud, share));
    }
    for (name, geometry, cloud, allowed) in &cases {
        let fmm = solve::<f32>(&lab, geometry, cloud, 16, Method::FMM, Schedule::Front);
        let (of_fmm, _) = inexact(geometry, cloud, &fmm.sources);
        for schedule in [SWEEP, Schedule::Front] {
            let found = solve::<f32>(&lab, geometry, cloud, 16, Method::FSM, schedule);
            let (share, most) = inexact(geometry, cloud, &found.sources);
            let what = format!("{name}, {schedule:?}: {share} of the voxels, {of_fmm} by fmm, {most} spacings at most");
            println!("{what}");
            assert!(share < *allowed && of_fmm < share, "{what}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    #[test]
    fn random_clouds_have_sources_along_their_distances(
        shape in prop::array::uniform3(1_i64..40),
        spacing in prop::sample::select(vec![[1.0; 3], [0.1; 3], [0.25, 0.5, 1.0], [0.31, 0.7, 0.113]]),
        count in 1_usize..30,
        edge in prop::sample::select(vec![8, 16, 32]),
        threads in prop::sample::select(vec![1_usize, 2, 4]),
        seed: u64,
    ) {
        let geometry = grid(shape, spacing);
        let cloud = random_cloud(&geometry, count, seed);
        check_front::<f32>(&[Lab::new(threads)], &geometry, &cloud, &[edge]);
    }
}
