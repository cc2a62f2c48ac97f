//! The `front` schedule: what it leaves does not depend on threads or memory, is the fixed point that sweeping comes
//! to, and has nearly always the truly nearest source.

use half::f16;
use proptest::prelude::*;
use rstar::RTree;
use strandline::grid::Geometry;
use strandline::kernel::distance::state::neighbours::Neighbours;
use strandline::pipeline::distance::{Method, Options, Schedule};

use crate::common::clouds::{grid_around, random_cloud, sponge_and_sphere};
use crate::common::lab::{Lab, PlainGrid};
use crate::common::solve::{Equation, Field, everywhere, methods_of, solve, solve_with};
use crate::common::textbook::{self, Stored, position};

fn grid(shape: [i64; 3], spacing: [f64; 3]) -> Geometry {
    Geometry { shape, spacing, origin: [-1.25, 0.5, 30.1], unit: None }
}

fn front<P: Stored>(lab: &Lab, geometry: &Geometry, cloud: &[[f64; 3]], edge: i64, method: Method) -> Field<P> {
    solve(lab, geometry, cloud, edge, method, Schedule::Front)
}

fn ranks<P: Stored>(values: &[P]) -> Vec<u64> {
    values.iter().map(|v| v.rank()).collect()
}

/// With a window of 512 KiB the bricks of these fields are dropped and loaded again and again.
#[test]
fn threads_and_memory_change_no_bit() {
    let geometry = grid([99, 83, 91], [0.5, 0.4, 0.7]);
    let bricks = geometry.shape.map(|n| n.unsigned_abs().div_ceil(16)).iter().product::<u64>();
    let cloud = random_cloud(&geometry, 40, 3);
    for method in Method::all() {
        let first = front::<f32>(&Lab::new(1), &geometry, &cloud, 16, method);
        for (threads, window) in [(1, 64 << 10), (2, 64 << 10), (2, 1 << 30), (4, 1 << 30), (4, 64 << 10)] {
            let found = front::<f32>(&Lab::with_window(threads, window), &geometry, &cloud, 16, method);
            let what = format!("{}, {threads} threads, a window of {window} bytes", method.name());
            assert!(ranks(&found.values) == ranks(&first.values), "{what}: values differ");
            assert!(found.sources == first.sources, "{what}: sources differ");
            if window < 1 << 30 {
                assert!(found.loads > bricks, "{what}: {} loads of {bricks} bricks: nothing was dropped", found.loads);
            }
        }
    }
}

/// How far the schedule may be from sweeps to convergence, in units of the last place: the more the spacings differ,
/// the more digits of an update cancel (the head of `pipeline::distance::schedule::front` says the same). Over 420 random clouds
/// the largest were 3 for equal spacings, 10 at a ratio of 4, 32 at a ratio of 6.2, all in f32.
fn bound(geometry: &Geometry) -> u64 {
    (10.0 * geometry.max_spacing() / geometry.min_spacing()) as u64
}

/// The largest difference between the Eikonal methods and the printed loops swept until nothing changes.
fn largest_difference<P: Stored>(geometry: &Geometry, cloud: &[[f64; 3]], edges: &[i64]) -> u64 {
    let lab = Lab::new(2);
    let expected = textbook::fsm::<P>(geometry, cloud, u32::MAX);
    let mut largest = 0;
    for method in methods_of(Equation::Eikonal) {
        for &edge in edges {
            let found = front::<P>(&lab, geometry, cloud, edge, method);
            let apart = found.values.iter().zip(&expected).map(|(f, e)| f.rank().abs_diff(e.rank()));
            largest = largest.max(apart.max().unwrap_or(0));
        }
    }
    largest
}

#[test]
#[ignore = "long; .ci/run has it"]
fn eikonal_methods_come_to_rest_where_sweeps_do() {
    for (seed, shape, spacing) in [
        (1, [66, 52, 37], [0.1; 3]),
        (2, [37, 43, 50], [0.3, 0.17, 0.9]),
        (3, [90, 1, 70], [1.0; 3]),
        (4, [200, 1, 1], [0.7; 3]),
    ] {
        let geometry = grid(shape, spacing);
        for count in [1, 100] {
            let cloud = random_cloud(&geometry, count, seed);
            let wide = largest_difference::<f64>(&geometry, &cloud, &[8, 16, 32]);
            let single = largest_difference::<f32>(&geometry, &cloud, &[8, 16, 32]);
            let half = largest_difference::<f16>(&geometry, &cloud, &[16]);
            println!("{shape:?}, {count} points: {wide}, {single}, {half} ulp in f64, f32, f16");
            assert!(
                wide.max(single).max(half) <= bound(&geometry),
                "{shape:?}, {count} points: {wide}, {single}, {half}"
            );
        }
    }
}

/// How much of a field is not exact.
#[derive(Clone, Copy, Debug)]
struct Inexact {
    /// The share of voxels whose distance is not the least over all points.
    share: f64,
    /// By how much it is larger at most, in the smallest spacing.
    most: f64,
}

/// For each voxel the least distance over all points, and whether a point fixes it.
fn exactly(geometry: &Geometry, cloud: &[[f64; 3]]) -> Vec<(f64, bool)> {
    let tree = RTree::bulk_load(cloud.to_vec());
    let fixing = textbook::fixing_sources(geometry, cloud);
    let voxels = (PlainGrid { shape: geometry.shape }).voxels().zip(fixing);
    let least = |(v, fixing): ([i64; 3], Option<usize>)| {
        let here = position(geometry, v);
        let nearest = tree.nearest_neighbor(here).expect("a point");
        (textbook::squared(here, *nearest).sqrt(), fixing.is_some())
    };
    voxels.map(least).collect()
}

/// Distances against the least over all points: those of fixed voxels, and all.
fn inexact(geometry: &Geometry, exact: &[(f64, bool)], values: &[f32]) -> [Inexact; 2] {
    let mut found = [Inexact { share: 0.0, most: 0.0 }; 2];
    for ((v, &value), &(exact, is_fixed)) in (PlainGrid { shape: geometry.shape }).voxels().zip(values).zip(exact) {
        let excess = f64::from(value) - exact;
        let rounding = 1e-6 * exact + 1e-9;
        assert!(excess > -rounding, "{v:?}: {value} is nearer than {exact}");
        for found in &mut found[usize::from(!is_fixed)..] {
            found.share += f64::from(u8::from(excess > rounding)) / values.len() as f64;
            found.most = found.most.max(excess / geometry.min_spacing());
        }
    }
    found
}

/// The points whose cell lies in the grid: others fix no voxel, or not all around.
fn inside(geometry: &Geometry, mut cloud: Vec<[f64; 3]>) -> Vec<[f64; 3]> {
    let fits = |at: f64, count: i64| at >= 0.0 && at < count as f64;
    cloud.retain(|p| (0..3).all(|a| fits((p[a] - geometry.origin[a]) / geometry.spacing[a], geometry.shape[a])));
    cloud
}

/// Nearly every voxel has its nearest source: all but 1 in 1000, none farther off than a tenth of the smallest spacing;
/// voxels that points fix have it without exception. On Sponge & Sphere one
/// point of the sphere is walled in by the voxels that its neighbours fix; the front tells voxels around of it.
#[test]
#[ignore = "long; .ci/run has it"]
fn euclidean_methods_find_nearly_every_nearest_source() {
    let lab = Lab::new(2);
    let pair = sponge_and_sphere().concat();
    let mut cases = Vec::new();
    for h in [0.05, 0.025] {
        cases.push((format!("Sponge & Sphere, h = {h}"), grid_around(&pair, h), pair.clone()));
    }
    for (seed, (count, spacing)) in
        [(200, [0.5; 3]), (2000, [0.5; 3]), (200, [0.4, 0.4, 1.3]), (2000, [0.4, 0.4, 1.3])].into_iter().enumerate()
    {
        let geometry = grid([70, 64, 50], spacing);
        let cloud = inside(&geometry, random_cloud(&geometry, count, seed as u64));
        cases.push((format!("{count} points, spacing {spacing:?}"), geometry, cloud));
    }
    for (name, geometry, cloud) in &cases {
        let exact = exactly(geometry, cloud);
        for method in methods_of(Equation::Euclidean) {
            for (edge, neighbours) in [(16, Neighbours::Faces), (32, Neighbours::Faces), (16, Neighbours::All)] {
                let options = Options { neighbours, ..everywhere(true) };
                let found = solve_with::<f32>(&lab, geometry, cloud, edge, method, Schedule::Front, options);
                let [fixed, all] = inexact(geometry, &exact, &found.values);
                let what =
                    format!("{name}, {}, {neighbours:?}, bricks of {edge}: {all:?}, fixed {fixed:?}", method.name());
                println!("{what}");
                assert!(fixed.share == 0.0 && all.share < 1e-3 && all.most < 0.1, "{what}");
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn random_clouds_come_to_rest_where_sweeps_do(
        shape in prop::array::uniform3(1_i64..48),
        spacing in prop::sample::select(vec![[1.0; 3], [0.1; 3], [0.25, 0.5, 1.0], [0.31, 0.7, 0.113]]),
        count in 1_usize..60,
        edge in prop::sample::select(vec![8, 16, 32]),
        seed: u64,
    ) {
        let geometry = grid(shape, spacing);
        let cloud = random_cloud(&geometry, count, seed);
        let apart = [
            largest_difference::<f64>(&geometry, &cloud, &[edge]),
            largest_difference::<f32>(&geometry, &cloud, &[edge]),
            largest_difference::<f16>(&geometry, &cloud, &[edge]),
        ];
        prop_assert!(apart.iter().all(|&ulps| ulps <= bound(&geometry)), "{:?} ulp in f64, f32, f16", apart);
    }

    /// A Euclidean method never tells less than the exact distance, and each voxel's value is that to its source.
    #[test]
    fn values_are_those_of_the_sources(
        shape in prop::array::uniform3(1_i64..40),
        spacing in prop::sample::select(vec![[1.0; 3], [0.25, 0.5, 1.0]]),
        count in 1_usize..40,
        edge in prop::sample::select(vec![8, 16, 32]),
        seed: u64,
    ) {
        let geometry = grid(shape, spacing);
        let cloud = random_cloud(&geometry, count, seed);
        let lab = Lab::new(2);
        for method in methods_of(Equation::Euclidean) {
            let found = front::<f32>(&lab, &geometry, &cloud, edge, method);
            let expected = textbook::distances::<f32>(&geometry, &cloud, &found.sources);
            prop_assert!(ranks(&found.values) == ranks(&expected), "{}", method.name());
            // A fixed voxel has a point that is no farther than the one that fixes it, and keeps it to itself.
            let fixing = textbook::fixing_sources(&geometry, &cloud);
            for ((v, fixing), found) in (PlainGrid { shape }).voxels().zip(&fixing).zip(&found.sources) {
                let [fixing, found] = [fixing, found].map(|s| s.map(|s| textbook::squared(position(&geometry, v), cloud[s])));
                prop_assert!(fixing.is_none() || found <= fixing, "{}, {v:?}: {found:?}, fixed at {fixing:?}", method.name());
            }
        }
    }
}
