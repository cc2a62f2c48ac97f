//! The builders of the library: each gives what the command line writes, to the byte, and what geometry says.

#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;
use std::path::Path;

use strandline::io::geometry::read::source::Source;
use strandline::io::geometry::read::sources::read_source;
use strandline::{
    Box3, BoxSource, DistanceField, Geometry, LabelledMesh, Method, MiddleSurface, Neighbours, Reconstruction,
    Schedule, Segmentation, TriangleMesh, Volume,
};

use crate::common::ball::{Ball, Bench, HEADER};
use crate::common::clouds::{sphere, sponge};
use crate::common::meshes::{Form, cuboid};
use crate::common::stores::{contents, same, volume};

fn lines(cloud: &[[f64; 3]]) -> String {
    let lines: Vec<String> = cloud.iter().map(|[x, y, z]| format!("{x} {y} {z}")).collect();
    lines.join("\n")
}

fn mesh_of(path: &Path) -> TriangleMesh {
    match read_source(path).unwrap() {
        Source::Mesh(mesh) => mesh,
        Source::Cloud(_) => panic!("a cloud"),
    }
}

/// The store of a builder is that of the program.
fn same_stores(bench: &Bench, what: &str) {
    same(&contents(&bench.path("out/cli.zarr")), &contents(&bench.path("out/job.zarr")), what);
}

#[test]
fn a_distance_is_that_of_the_command_line() {
    let bench = Bench::bare();
    let (ball, cube) = (sponge(), cuboid([-0.5, -0.5, 2.0], [0.5, 0.5, 3.0]));
    bench.write("ball.xyz", &lines(&ball));
    std::fs::write(bench.path("cube.off"), Form::Off.write(&cube)).unwrap();
    for (flags, method, neighbours, schedule) in [
        ("--method vdt --neighbours 26", Method::VDT, Neighbours::All, Schedule::Front),
        (
            "--method fsm --schedule sweep --iterations 2",
            Method::FSM,
            Neighbours::Faces,
            Schedule::Sweep { iterations: 2 },
        ),
    ] {
        bench.succeed(&format!(
            "distance ball.xyz cube.off --spacing 0.1 --labels --closest-point -q --overwrite -o out/cli.zarr {flags}"
        ));
        let job =
            DistanceField::new().points(&ball).mesh(&cube).spacing([0.1; 3]).method(method).neighbours(neighbours);
        let job = job.schedule(schedule).labels().closest_point().scratch(bench.path("scratch")).threads(2);
        let found = job.store(bench.path("out/job.zarr")).overwrite().solve().unwrap();
        same_stores(&bench, flags);
        let store = bench.path("out/cli.zarr");
        let distance: Vec<f64> = found.distance().read().unwrap().into_iter().map(f64::from).collect();
        assert!(distance == volume(&store), "{flags}: distances differ");
        let labels: Vec<f64> = found.labels().unwrap().read().unwrap().into_iter().map(f64::from).collect();
        assert!(labels == volume(&store.join("labels/nearest")), "{flags}: labels differ");
        let closest = found.closest_points(&found.geometry().domain()).unwrap();
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            let stored = volume(&store.join("closest-point").join(name));
            let differs = |(p, v): (&[f64; 3], &f64)| f64::from(p[axis] as f32) != *v;
            assert!(!closest.iter().zip(&stored).any(differs), "{flags}: {name} differs");
        }
        assert!(bench.entries("scratch").is_empty());
    }
}

/// Against the distance to a box, which is known.
#[test]
fn a_signed_distance_is_that_of_the_box() {
    let (low, high) = ([0.0; 3], [2.0, 1.0, 1.0]);
    let job = DistanceField::new().mesh(cuboid(low, high)).spacing([0.1; 3]).padding(0.5).method(Method::DP).signed();
    let found = job.solve_as::<f64>().unwrap();
    let (geometry, values) = (found.geometry().clone(), found.distance().read().unwrap());
    let voxels = geometry.domain().rows().flat_map(|(y, z)| (0..geometry.shape[0]).map(move |x| [x, y, z]));
    for (voxel, value) in voxels.zip(values) {
        let p = geometry.position(voxel);
        let beyond: [f64; 3] = std::array::from_fn(|a| (low[a] - p[a]).max(p[a] - high[a]));
        let outside = beyond.iter().map(|v| v.max(0.0).powi(2)).sum::<f64>().sqrt();
        let exact = outside + beyond.iter().copied().fold(f64::NEG_INFINITY, f64::max).min(0.0);
        assert!((value - exact).abs() < 1e-9, "{p:?}: {value}, not {exact}");
    }
    assert!(found.labels().is_err() && found.closest_points(&Box3::new([0; 3], [1; 3])).is_err());
}

/// By value and by reference, from arrays and from a field of another job.
#[test]
fn labels_of_a_volume_are_sources() {
    let grid = Geometry::new([20, 6, 6], [0.5; 3], [1.0, 0.0, 0.0]);
    let label = |n: i64| if n % 20 < 8 { 1 } else { 4 * u32::from(n % 20 >= 12) };
    let volume = Volume::new(grid.shape, (0..720).map(label).collect::<Vec<u32>>()).unwrap();
    let found = DistanceField::new().label_volume(&volume, grid.clone()).labels().solve().unwrap();
    assert_eq!(found.geometry(), &grid);
    // The border of 1 is at voxel 7, that of 4 at 12; both are equally far from none.
    assert_eq!(found.distance().at([2, 3, 3]).unwrap(), 2.5);
    assert_eq!([9, 10].map(|x| found.labels().unwrap().at([x, 3, 3]).unwrap()), [1, 4]);
    let labels = found.labels().unwrap();
    let again = DistanceField::new().label_volume(labels, grid.clone()).solve().unwrap();
    assert_eq!(again.distance().at([9, 0, 0]).unwrap(), 0.0);
    let voxels: BTreeMap<u32, u64> = found.found().label_voxels.clone();
    assert_eq!(voxels, [(1, 360), (4, 360)].into());
}

/// However little memory there is.
#[test]
fn memory_changes_no_bit() {
    let cloud = sphere([0.0; 3], 1.0, 500, |_| true);
    let job = || DistanceField::new().points(&cloud).spacing([0.02; 3]).closest_point();
    let all = job().threads(1).solve().unwrap();
    let few = job().threads(3).memory(160 << 20).brick(32).solve().unwrap();
    assert!(all.distance().read().unwrap() == few.distance().read().unwrap());
    let part = Box3::new([3, 5, 60], [40, 70, 66]);
    assert_eq!(all.closest_points(&part).unwrap(), few.closest_points(&part).unwrap());
    assert_eq!(all.distance().read_box(&part).unwrap().len(), 37 * 65 * 6);
    assert!(all.distance().read_box(&Box3::new([0; 3], [1, 1, 1000])).is_err());
    assert_eq!(BoxSource::shape(&all.distance()), all.geometry().shape);
}

#[test]
fn a_middle_surface_is_that_of_the_command_line() {
    let bench = Bench::bare();
    let ball = sphere([0.0; 3], 1.0, 200, |_| true);
    // Of a cloud and its mirror image the middle is the mirror.
    let clouds = [ball.clone(), ball.iter().map(|[x, y, z]| [3.0 - x, *y, *z]).collect()];
    bench.write("a.xyz", &lines(&clouds[0]));
    bench.write("b.xyz", &lines(&clouds[1]));
    bench.succeed("middle a.xyz b.xyz --spacing 0.1 -q -o out/cli.zarr");
    let job = || MiddleSurface::new().points(&clouds[0]).points(&clouds[1]).spacing([0.1; 3]);
    let found = job().store(bench.path("out/job.zarr")).solve().unwrap();
    same_stores(&bench, "middle");
    let stored = mesh_of(&bench.path("out/cli.zarr/meshes/surface.ply"));
    assert_eq!(found.mesh.mesh.triangles, stored.triangles);
    assert_eq!(found.mesh.labels, vec![[1, 2]; stored.len()]);
    assert!(found.mesh.mesh.vertices.iter().all(|v| (v[0] - 1.5).abs() < 1e-6));
    assert_eq!((found.pairs.len(), found.pairs[0].triangles), (1, stored.len() as u64));
    assert_eq!(found.distance.labels().unwrap().at([0; 3]).unwrap(), 1);
    let mut streamed = LabelledMesh::default();
    let without = job().solve_into(&mut streamed).unwrap();
    assert!(streamed == found.mesh && without.mesh == LabelledMesh::default());
}

#[test]
fn a_reconstruction_is_that_of_the_command_line() {
    let bench = Bench::bare();
    let cloud = sphere([1.0, 2.0, 3.0], 2.0, 700, |_| true);
    bench.write("ball.xyz", &lines(&cloud));
    bench.succeed("reconstruct ball.xyz -q -o out/cli.zarr");
    let found = Reconstruction::of(&cloud).store(bench.path("out/job.zarr")).solve().unwrap();
    same_stores(&bench, "reconstruct");
    let stored = mesh_of(&bench.path("out/cli.zarr/meshes/surface.ply"));
    assert_eq!(found.mesh.triangles, stored.triangles);
    let level_set: Vec<f64> = found.level_set().read().unwrap().into_iter().map(f64::from).collect();
    assert!(
        level_set == volume(&bench.path("out/cli.zarr")) || level_set == volume(&bench.path("out/cli.zarr/levelset"))
    );
    assert!(found.measures().is_closed() && (found.measures().volume / 33.51 - 1.0).abs() < 0.02);
    assert!(found.hausdorff().unwrap().max < found.geometry().max_spacing() && found.lost_points() == 0);
    // On a grid of one's own the surface is the same, and fields end with the grid.
    let grid = Geometry { shape: [10, 12, 14], ..found.geometry().clone() };
    let laid = Reconstruction::of(&cloud[..]).grid(grid.clone()).solve().unwrap();
    assert_eq!((laid.geometry(), laid.level_set().read().unwrap().len()), (&grid, 10 * 12 * 14));
    let stray = [&cloud[..], &[[30.0; 3]]].concat();
    let kept = Reconstruction::of(stray).drop_isolated(4.0).solve().unwrap();
    assert!(kept.mesh == found.mesh && kept.notes() == ["1 of 701 points stand alone and are left out"]);
    let as_it_is = Reconstruction::of(&cloud[..]).keep_topology().solve().unwrap();
    assert!(as_it_is.mesh == found.mesh && as_it_is.removed().is_none());
    assert_eq!(found.removed().map(|removed| removed.handles + removed.tunnels + removed.crumbs), Some(0));
}

/// The marks of a ball by slice.
fn outlines(ball: &Ball) -> BTreeMap<i64, Vec<[f64; 3]>> {
    let mut outlines: BTreeMap<i64, Vec<[f64; 3]>> = BTreeMap::new();
    for line in ball.marks(1).lines() {
        let numbers: Vec<f64> = line.split(',').map(|v| v.parse().unwrap()).collect();
        outlines.entry(numbers[1] as i64).or_default().push([numbers[2], numbers[3], numbers[4]]);
    }
    outlines
}

#[test]
fn a_segmentation_is_that_of_the_command_line() {
    let ball = Ball::small();
    let bench = Bench::new(&ball);
    // The builder counts outlines, and a store keeps their numbers.
    let row = |n: usize, [x, y, z]: &[f64; 3]| format!("1,{n},{x},{y},{z}\n");
    let counted = (1..).zip(outlines(&ball).into_values());
    let rows = counted.flat_map(|(n, outline)| outline.iter().map(|p| row(n, p)).collect::<Vec<_>>());
    bench.write("marks.csv", &rows.fold(HEADER.to_owned(), |text, row| text + &row));
    bench.succeed("segment image.tif --points marks.csv -q -o out/cli.zarr");
    let image = Volume::new(ball.geometry.shape, ball.voxels()).unwrap();
    let mut job = Segmentation::of(&image, ball.geometry.clone()).store(bench.path("out/job.zarr"));
    for outline in outlines(&ball).into_values() {
        job = job.outline(1, outline);
    }
    let found = job.solve().unwrap();
    same_stores(&bench, "segment");
    let stored = mesh_of(&bench.path("out/cli.zarr/meshes/surface.ply"));
    assert_eq!(found.mesh(1).unwrap().triangles, stored.triangles);
    let labels: Vec<f64> = found.labels().read().unwrap().into_iter().map(f64::from).collect();
    assert!(labels == volume(&bench.path("out/cli.zarr/labels/segmentation")));
    let u: Vec<f64> = found.level_set(1).unwrap().read().unwrap().into_iter().map(f64::from).collect();
    assert!(u == volume(&bench.path("out/cli.zarr/levelset")));
    let object = &found.outcome().objects[0];
    assert!((object.measures.volume / 904.8 - 1.0).abs() < 0.05, "{}", object.measures.volume);
    assert_eq!(found.outcome().label_voxels[&1], labels.iter().filter(|&&v| v == 1.0).count() as u64);
    assert!(found.mesh(2).is_err() && found.level_set(0).is_err());
}

/// A ball that grows, and loose points beside outlines; what cannot be solved is told with the rest.
#[test]
fn objects_are_marked_in_three_ways() {
    let ball = Ball::small();
    let image = Volume::new(ball.geometry.shape, ball.voxels()).unwrap();
    let cloud = sphere(ball.centre, ball.radius, 400, |_| true);
    let (front, back) = cloud.split_at(200);
    let job = Segmentation::of(image, ball.geometry.clone()).points(7, front).points(7, back);
    let found = job.seed(9, ball.centre, 3.0).points(12, vec![[4.0, 4.0, 4.0]; 2]).solve().unwrap();
    let labels: Vec<u32> = found.outcome().objects.iter().map(|object| object.label).collect();
    assert_eq!((labels, found.outcome().refused[0].label), (vec![7, 9], 12));
    let volume = found.outcome().objects[0].measures.volume;
    assert!((volume / 904.8 - 1.0).abs() < 0.1, "{volume}");
}
