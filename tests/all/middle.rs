//! Middle surfaces between labelled data sets: against true surfaces, exact labels and the papers' figures.

#![allow(clippy::unwrap_used)]

use std::collections::{HashMap, HashSet};
use std::f64::consts::PI;
use std::fs;

use strandline::grid::{DataSets, Geometry, TriangleMesh};
use strandline::io::geometry::write::ply::PlyWriter;
use strandline::io::ome_zarr::StoreWriter;
use strandline::kernel::distance::state::neighbours::Neighbours::{All, Faces};
use strandline::pipeline::distance::{DistanceSettings, Init, Method, Schedule};
use strandline::pipeline::middle::{LabelMode, MiddleFound, MiddleSettings, SurfaceKind, middle};
use strandline::store::NoMesh;

use crate::common::ball::Bench;
use crate::common::clouds::{random_cloud, sphere, sphere_by_angles};
use crate::common::lab::{Lab, PlainGrid};
use crate::common::meshes::{self, Form};
use crate::common::stores::volume;
use crate::common::textbook::{position, squared};

/// A cube of voxels from `lo` to `hi` along every axis.
fn cube_grid(lo: f64, hi: f64, h: f64) -> Geometry {
    let count = ((hi - lo) / h).round() as i64 + 1;
    Geometry { shape: [count; 3], spacing: [h; 3], origin: [lo; 3], unit: None }
}

fn settings(method: Method, surface: SurfaceKind, labels: LabelMode, brick: i64) -> MiddleSettings {
    let distance = DistanceSettings {
        method,
        schedule: Schedule::Front,
        neighbours: Faces,
        init: if method == Method::FSM { Init::Contiguous } else { Init::Cell },
        farthest: None,
        signed: false,
        labels: true,
        closest_point: false,
        brick,
        exact: false,
        timed: false,
    };
    MiddleSettings { distance, surface, labels }
}

/// By VDT, the surface where both distances are equal.
fn exact(geometry: &Geometry, sets: &DataSets) -> MiddleFound {
    let settings = settings(Method::VDT, SurfaceKind::Exact, LabelMode::Tracked, 32);
    middle::<f32>(&Lab::new(2).engine, geometry, sets, &settings, None, &mut NoMesh).unwrap()
}

fn cube_and_sphere(steps: u32) -> DataSets {
    let mut sets = DataSets::default();
    sets.add_mesh(&meshes::cuboid([0.0; 3], [1.0; 3]));
    sets.add_mesh(&meshes::sphere([0.5; 3], 0.25, steps, PI));
    sets
}

/// Whether a closed surface has the Euler characteristic of a sphere: each of its edges has two facets.
fn is_sphere(found: &MiddleFound) -> bool {
    2 * found.measures.vertices - found.measures.triangles == 4
}

/// The true surface's volume and area by quadrature: docs/algorithms.md, "Readings and figures". On a grid that no
/// crease has a plane of voxels in common with.
#[test]
fn between_cube_and_sphere_is_the_true_surface() {
    let sets = cube_and_sphere(200);
    let errors = [0.05, 0.025].map(|h| {
        let geometry = Geometry { origin: [-0.413, -0.407, -0.391], ..cube_grid(-0.4, 1.4, h) };
        let found = exact(&geometry, &sets);
        assert!(found.measures.is_closed() && found.measures.components == 1 && is_sphere(&found));
        [found.measures.volume.abs() / 0.293_088_39 - 1.0, found.measures.area / 2.232_466_83 - 1.0].map(f64::abs)
    });
    println!("{errors:?}");
    assert!(errors[1][0] < 7e-4 && errors[1][1] < 4e-4, "{errors:?}");
    assert!(errors[0][0] > 3.0 * errors[1][0] && errors[0][1] > 1.8 * errors[1][1], "{errors:?}");
}

/// A sphere between spheres, both errors of the second order.
#[test]
fn between_concentric_spheres_is_a_sphere() {
    let mut sets = DataSets::default();
    for radius in [0.25, 1.0] {
        sets.add_mesh(&meshes::sphere([0.0; 3], radius, 240, PI));
    }
    let (volume, area) = (4.0 / 3.0 * PI * 0.625_f64.powi(3), 4.0 * PI * 0.625 * 0.625);
    let errors = [0.1, 0.05].map(|h| {
        let found = exact(&cube_grid(-1.2, 1.2, h), &sets);
        assert!(found.measures.is_closed() && found.measures.components == 1 && is_sphere(&found));
        let [pair] = found.pairs.as_slice() else { panic!("one pair") };
        assert!(pair.labels == [1, 2] && (pair.area - found.measures.area).abs() < 1e-9);
        assert!(pair.distance.iter().all(|d| (d - 0.375).abs() < 1e-4), "{pair:?}");
        assert!(pair.extent[0].iter().all(|x| (x + 0.625).abs() < 1e-3), "{pair:?}");
        [found.measures.volume / volume - 1.0, found.measures.area / area - 1.0].map(f64::abs)
    });
    println!("{errors:?}");
    assert!(errors[1][0] < 2e-3 && errors[1][1] < 1e-3, "{errors:?}");
    assert!((0..2).all(|n| errors[0][n] > 3.5 * errors[1][n]), "{errors:?}");
}

/// Six digits are printed.
const DIGITS: [f64; 2] = [5e-7, 5e-6];
/// Where the order in which voxels are visited decides: 0.3 % and 0.2 % (docs/algorithms.md, "Readings and figures").
const ORDER: [f64; 2] = [0.003 * 0.278, 0.002 * 2.34];
/// FMM as printed takes values of voxels on trial too, which lets it find smaller distances along diagonals; ours, like
/// any FMM from frozen values alone (docs/algorithms.md, "Errata"), is 0.5 % and 0.7 % off it from h = 0.025 on.
const CAUSAL: [f64; 2] = [0.005 * 0.2745, 0.0075 * 2.344];

/// Table 11: volume and area of the isosurface of labels as printed, and how near to it they can be had.
const TABLE_11: [(Method, f64, [f64; 2], [f64; 2]); 13] = [
    (Method::VDT, 0.2, [0.418_667, 2.920_08], DIGITS),
    (Method::VDT, 0.05, [0.291_396, 2.409_64], DIGITS),
    (Method::VDT, 0.025, [0.286_294, 2.391_77], DIGITS),
    (Method::VDT, 0.0125, [0.287_682, 2.404_21], DIGITS),
    (Method::DP, 0.2, [0.418_667, 2.920_08], DIGITS),
    (Method::FSM, 0.2, [0.418_667, 2.920_08], DIGITS),
    (Method::FSM, 0.1, [0.244_167, 1.989_98], DIGITS),
    (Method::FSM, 0.05, [0.271_396, 2.294_56], DIGITS),
    (Method::FSM, 0.025, [0.277_992, 2.342_97], ORDER),
    (Method::FMM, 0.2, [0.418_667, 2.920_08], DIGITS),
    (Method::FMM, 0.1, [0.264_500, 2.218_41], DIGITS),
    (Method::FMM, 0.05, [0.273_396, 2.317_99], DIGITS),
    (Method::FMM, 0.025, [0.274_508, 2.344_27], CAUSAL),
];

/// The papers' way to draw it, with the papers' numbers: the cube as 12 triangles, the sphere as 231 points.
#[test]
fn the_isosurface_of_labels_has_the_figures_of_table_11() {
    let mut sets = DataSets::default();
    sets.add_mesh(&meshes::cuboid([0.0; 3], [1.0; 3]));
    sets.add_cloud(&sphere_by_angles([0.5; 3], 0.25));
    let mut wrong = Vec::new();
    for (method, h, printed, limits) in TABLE_11 {
        for schedule in [Schedule::Front, Schedule::Sweep { iterations: 1 }] {
            let settings = settings(method, SurfaceKind::Labels, LabelMode::Tracked, 32);
            let distance = DistanceSettings { schedule, ..settings.distance };
            let settings = MiddleSettings { distance, ..settings };
            let found =
                middle::<f64>(&Lab::new(2).engine, &cube_grid(-0.4, 1.4, h), &sets, &settings, None, &mut NoMesh)
                    .unwrap();
            assert_eq!(found.distance.unlabelled_voxels, 0, "{}", method.name());
            assert!(found.measures.is_closed() && found.measures.components == 1, "{}", method.name());
            let ours = [found.measures.volume.abs(), found.measures.area];
            let what = format!("{}, {schedule:?}, h {h}: {ours:?}, printed {printed:?}", method.name());
            println!("{what}");
            if (0..2).any(|n| (ours[n] - printed[n]).abs() > limits[n]) {
                wrong.push(what);
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Three clouds and two meshes, in no order.
fn mixed(geometry: &Geometry) -> DataSets {
    let mut sets = DataSets::default();
    sets.add_cloud(&sphere([0.3, 0.4, 0.5], 0.2, 300, |_| true));
    sets.add_mesh(&meshes::sphere([1.2, 0.3, 0.6], 0.25, 12, PI));
    sets.add_cloud(&random_cloud(geometry, 12, 5));
    sets.add_mesh(&meshes::cuboid([0.2, 1.0, 0.1], [0.5, 1.4, 0.4]));
    sets.add_cloud(&sphere([1.1, 1.2, 0.3], 0.3, 500, |_| true));
    sets
}

fn mesh_of(
    geometry: &Geometry,
    sets: &DataSets,
    settings: &MiddleSettings,
    threads: usize,
) -> (TriangleMesh, Vec<[u32; 2]>) {
    let folder = tempfile::tempdir().unwrap();
    let store = StoreWriter::create(&folder.path().join("out.zarr"), false).unwrap();
    let path = store.file("meshes/surface.ply").unwrap();
    let mut mesh = PlyWriter::tagged_on_grid(&path, geometry).unwrap();
    middle::<f32>(&Lab::new(threads).engine, geometry, sets, settings, Some(&store), &mut mesh).unwrap();
    mesh.finish().unwrap();
    let bytes = fs::read(path).unwrap();
    tagged(&bytes)
}

/// A mesh whose triangles have two labels, read without the program's own reader.
fn tagged(bytes: &[u8]) -> (TriangleMesh, Vec<[u32; 2]>) {
    let end = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    let header = std::str::from_utf8(&bytes[..end]).unwrap();
    assert!(header.contains("property uint label_low\nproperty uint label_high\n"), "{header}");
    let count = |what: &str| -> usize {
        let line = header.lines().find_map(|line| line.strip_prefix(&format!("element {what} "))).unwrap();
        line.parse().unwrap()
    };
    let word = |at: usize| <[u8; 4]>::try_from(&bytes[at..at + 4]).unwrap();
    let (vertices, triangles) = (count("vertex"), count("face"));
    let faces = end + 12 * vertices;
    let place = |n: usize| std::array::from_fn(|a| f64::from(f32::from_le_bytes(word(end + 12 * n + 4 * a))));
    let mesh = TriangleMesh {
        vertices: (0..vertices).map(place).collect(),
        triangles: (0..triangles)
            .map(|n| std::array::from_fn(|a| u32::from_le_bytes(word(faces + 21 * n + 1 + 4 * a))))
            .collect(),
    };
    let pair = |n: usize| std::array::from_fn(|a| u32::from_le_bytes(word(faces + 21 * n + 13 + 4 * a)));
    assert_eq!(bytes.len(), faces + 21 * triangles);
    (mesh, (0..triangles).map(pair).collect())
}

/// The sides of a triangle, each with the smaller number first.
fn sides([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]].map(|[a, b]| [a.min(b), a.max(b)])
}

/// Every edge has two facets of one pair, or three where three labels meet; only at the domain's end it may have fewer.
#[test]
fn many_labels_meet_without_gaps() {
    let geometry = Geometry { shape: [50, 54, 40], spacing: [0.03, 0.03, 0.025], origin: [0.0; 3], unit: None };
    let sets = mixed(&geometry);
    let (mesh, pairs) = mesh_of(&geometry, &sets, &settings(Method::VDT, SurfaceKind::Exact, LabelMode::Exact, 32), 2);
    let mut edges: HashMap<[u32; 2], Vec<[u32; 2]>> = HashMap::new();
    for (triangle, pair) in mesh.triangles.iter().zip(&pairs) {
        for side in sides(*triangle) {
            edges.entry(side).or_default().push(*pair);
        }
    }
    let end = geometry.position(geometry.shape.map(|n| n - 1));
    let on_end = |vertex: u32| -> [bool; 6] {
        let p = mesh.vertices[vertex as usize];
        std::array::from_fn(|n| (p[n % 3] - if n < 3 { geometry.origin[n] } else { end[n - 3] }).abs() < 1e-6)
    };
    let mut lines = 0;
    for (edge, mut around) in edges {
        let [a, b] = edge.map(on_end);
        if (0..6).any(|n| a[n] && b[n]) {
            continue;
        }
        around.sort_unstable();
        match around.as_slice() {
            [one, other] => assert_eq!(one, other),
            [[a, b], [c, d], [e, f]] => {
                lines += 1;
                assert!(a == c && b == e && d == f && b != d, "{around:?}");
            }
            other => panic!("{edge:?}: {other:?}"),
        }
    }
    assert!(lines > 100, "{lines}");
}

/// The vertices of every facet are as far from one of its sets as from the other, and no other set is nearer: along the
/// line too where three labels meet.
#[test]
fn facets_are_equally_far_from_both_sets() {
    let (geometry, h) = (cube_grid(-1.0, 1.0, 0.05), 0.05);
    let clouds = [
        sphere([-0.5, -0.3, 0.1], 0.3, 2000, |_| true),
        sphere([0.55, -0.2, 0.0], 0.25, 1500, |_| true),
        sphere([0.03, 0.6, -0.05], 0.2, 1500, |_| true),
    ];
    let mut sets = DataSets::default();
    for cloud in &clouds {
        sets.add_cloud(cloud);
    }
    let (mesh, pairs) =
        mesh_of(&geometry, &sets, &settings(Method::VDT, SurfaceKind::Exact, LabelMode::Tracked, 32), 2);
    // Three sheets that meet along one line can be drawn together to a point.
    let edges: HashSet<[u32; 2]> = mesh.triangles.iter().flat_map(|t| sides(*t)).collect();
    let characteristic = mesh.vertices.len() as i64 - edges.len() as i64 + mesh.triangles.len() as i64;
    assert_eq!(characteristic, 1);
    let to = |p: [f64; 3], cloud: &[[f64; 3]]| cloud.iter().map(|q| squared(p, *q)).fold(f64::MAX, f64::min).sqrt();
    let distances: Vec<[f64; 3]> = mesh.vertices.iter().map(|&p| std::array::from_fn(|n| to(p, &clouds[n]))).collect();
    let (mut sum, mut most, mut count) = (0.0, 0.0_f64, 0);
    for (triangle, pair) in mesh.triangles.iter().zip(&pairs) {
        for own in triangle.map(|n| distances[n as usize]) {
            let nearest = own.iter().copied().fold(f64::MAX, f64::min);
            let off = pair.map(|label| (own[label as usize - 1] - nearest) / h);
            let off = off[0].max(off[1]);
            (sum, most, count) = (sum + off, most.max(off), count + 1);
        }
    }
    let mean = sum / f64::from(count);
    println!("{} vertices, off by {mean} h in the mean, {most} h at most", mesh.vertices.len());
    assert!(mean < 0.002 && most < 0.1, "{mean}, {most}");
}

/// No label is wrong, whatever the method left, ties go to the lower one, and distances are those of the new sources.
#[test]
fn exact_labels_have_no_error() {
    let geometry = Geometry { shape: [33, 40, 25], spacing: [0.05, 0.04, 0.06], origin: [-0.1; 3], unit: None };
    let clouds: Vec<Vec<[f64; 3]>> = (0..4).map(|n| random_cloud(&geometry, 30, 40 + n)).collect();
    // Off the grid that some points lie on: rounding would decide between a face and a point that are equally far.
    let (lo, hi) = ([0.303, 0.507, 0.211], [0.891, 0.803, 1.097]);
    let mut sets = DataSets::default();
    for cloud in &clouds {
        sets.add_cloud(cloud);
    }
    sets.add_mesh(&meshes::cuboid(lo, hi));
    let plain = PlainGrid { shape: geometry.shape };
    let nearest = |voxel: [i64; 3]| {
        let here = position(&geometry, voxel);
        let to_cloud = |cloud: &Vec<[f64; 3]>| cloud.iter().map(|p| squared(here, *p)).fold(f64::MAX, f64::min);
        let all = clouds.iter().map(to_cloud).chain([squared_to_cuboid(here, lo, hi)]);
        all.zip(1..).fold((f64::MAX, 0), |a, b| if b < a { b } else { a })
    };
    let wanted: Vec<(f64, u32)> = plain.voxels().map(nearest).collect();
    let mut changed = 0;
    for method in [Method::VDT, Method::FMM] {
        let with = |labels| settings(method, SurfaceKind::Exact, labels, 16);
        let [_, tracked, _] = fields_of(&geometry, &sets, &with(LabelMode::Tracked));
        let [distances, labels, border] = fields_of(&geometry, &sets, &with(LabelMode::Exact));
        for (n, &(squared, label)) in wanted.iter().enumerate() {
            assert_eq!(labels[n], f64::from(label));
            if tracked[n] != labels[n] {
                changed += 1;
                assert!(distances[n] <= squared.sqrt() * (1.0 + 1e-6), "{} and {}", distances[n], squared.sqrt());
            }
        }
        check_border(&geometry, &labels, &border);
    }
    assert!(changed > 0, "no label was wrong");
}

/// Beyond the farthest distance no voxel has a label, however these are told, and within it each has the one that it has
/// without a limit.
#[test]
fn exact_labels_end_at_the_farthest_distance() {
    let geometry = Geometry { shape: [33, 40, 25], spacing: [0.05, 0.04, 0.06], origin: [-0.1; 3], unit: None };
    let mut sets = DataSets::default();
    for n in 0..3 {
        sets.add_cloud(&random_cloud(&geometry, 8, 40 + n));
    }
    sets.add_mesh(&meshes::cuboid([0.303, 0.507, 0.211], [0.491, 0.603, 0.397]));
    let limit = 0.23;
    let with = |labels, farthest| {
        let settings = settings(Method::VDT, SurfaceKind::Exact, labels, 16);
        let distance = DistanceSettings { farthest, ..settings.distance };
        fields_of(&geometry, &sets, &MiddleSettings { distance, ..settings })
    };
    let [distances, all, _] = with(LabelMode::Exact, None);
    let [limited, exact, border] = with(LabelMode::Exact, Some(limit));
    let [_, tracked, _] = with(LabelMode::Tracked, Some(limit));
    let mut beyond = 0;
    for n in 0..all.len() {
        // Where rounding decides whether a voxel lies within it may.
        if (distances[n] - limit).abs() > 1e-6 {
            assert_eq!(exact[n], if distances[n] < limit { all[n] } else { 0.0 }, "{} off", distances[n]);
            assert_eq!(exact[n] == 0.0, tracked[n] == 0.0, "{} off", distances[n]);
            assert!((limited[n] - distances[n].min(limit)).abs() < 1e-6);
            beyond += usize::from(exact[n] == 0.0);
        }
    }
    assert!(beyond > all.len() / 10 && beyond < all.len() * 9 / 10, "{beyond} of {}", all.len());
    check_border(&geometry, &exact, &border);
}

/// Dense points, whose cells are thin needles where labels meet (a corner of Experiment 5): the front's labels are looked
/// up closer and have none wrong, the textbook's sweeps have some.
#[test]
fn tracked_labels_of_dense_points_have_no_error() {
    let geometry = Geometry { shape: [51, 51, 41], spacing: [0.05; 3], origin: [2.5, 2.5, -1.0], unit: None };
    let wave = |lift: f64| -> Vec<[f64; 3]> {
        let at = |n: i32| 2.5 + 0.05 * f64::from(n);
        let point = |n: i32| [at(n % 51), at(n / 51), 0.2 * (at(n % 51) * at(n / 51)).cos() + lift];
        (0..51 * 51).map(point).collect()
    };
    let clouds = [wave(0.5), wave(-0.5)];
    let mut sets = DataSets::default();
    for cloud in &clouds {
        sets.add_cloud(cloud);
    }
    // Elsewhere one wave is nearer by far.
    let is_between = |[x, y, z]: [f64; 3]| (z - 0.2 * (x * y).cos()).abs() < 0.16;
    let voxels = PlainGrid { shape: geometry.shape }.voxels().enumerate();
    let places = voxels.map(|(n, voxel)| (n, position(&geometry, voxel))).filter(|(_, here)| is_between(*here));
    let nearest = |cloud: &Vec<[f64; 3]>, here| cloud.iter().map(|p| squared(here, *p)).fold(f64::MAX, f64::min);
    let wanted: Vec<(usize, [f64; 2])> =
        places.map(|(n, here)| (n, [0, 1].map(|c| nearest(&clouds[c], here)))).collect();
    let wrong = BOTH_SCHEDULES.map(|schedule| {
        let settings = settings(Method::VDT, SurfaceKind::Exact, LabelMode::Tracked, 32);
        let distance = DistanceSettings { schedule, ..settings.distance };
        let [_, labels, _] = fields_of(&geometry, &sets, &MiddleSettings { distance, ..settings });
        // Where rounding decides both labels are right.
        let is_wrong = |&&(n, to): &&(usize, [f64; 2])| {
            let [own, other] = if labels[n] == 1.0 { to } else { [to[1], to[0]] };
            own.sqrt() > other.sqrt() + 1e-9
        };
        wanted.iter().filter(is_wrong).count()
    });
    println!("{wrong:?} of {} wrong, front and sweeps", wanted.len());
    assert!(wrong[0] == 0 && wrong[1] > 0, "{wrong:?}");
}

/// The squared distance to the faces of a cuboid.
fn squared_to_cuboid(here: [f64; 3], lo: [f64; 3], hi: [f64; 3]) -> f64 {
    let inside = (0..3).map(|a| (here[a] - lo[a]).min(hi[a] - here[a])).fold(f64::MAX, f64::min);
    let outside = (0..3).map(|a| (lo[a] - here[a]).max(here[a] - hi[a]).max(0.0).powi(2)).sum();
    if inside > 0.0 { inside * inside } else { outside }
}

/// Neither bricks nor threads change the mesh, nor does the method.
#[test]
fn exact_labels_have_one_mesh() {
    let geometry = Geometry { shape: [33, 40, 25], spacing: [0.05, 0.04, 0.06], origin: [-0.1; 3], unit: None };
    let mut sets = DataSets::default();
    for n in 0..3 {
        sets.add_cloud(&random_cloud(&geometry, 30, 40 + n));
    }
    // One off the grid, one whose corners lie on it.
    sets.add_mesh(&meshes::cuboid([0.303, 0.507, 0.211], [0.891, 0.803, 1.097]));
    sets.add_mesh(&meshes::sphere([1.1, 1.1, 0.7], 0.3, 12, PI));
    let of = |method, brick, threads| {
        let settings = settings(method, SurfaceKind::Exact, LabelMode::Exact, brick);
        mesh_of(&geometry, &sets, &settings, threads).0
    };
    let wanted = of(Method::VDT, 32, 3);
    for method in Method::all() {
        let mesh = of(method, 16, 1);
        let differ = mesh.vertices.iter().zip(&wanted.vertices).position(|(a, b)| a != b);
        assert!(mesh == wanted, "{}: from vertex {differ:?} on", method.name());
    }
}

/// Distances, labels and borders as a store has them.
fn fields_of(geometry: &Geometry, sets: &DataSets, settings: &MiddleSettings) -> [Vec<f64>; 3] {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.zarr");
    let store = StoreWriter::create(&path, false).unwrap();
    middle::<f32>(&Lab::new(2).engine, geometry, sets, settings, Some(&store), &mut NoMesh).unwrap();
    store.finish().unwrap();
    [path.clone(), path.join("labels/nearest"), path.join("labels/border")].map(|path| volume(&path))
}

/// The border holds the label of each voxel that has a face neighbour of another one, and 0 elsewhere.
fn check_border(geometry: &Geometry, labels: &[f64], border: &[f64]) {
    let domain = geometry.domain();
    for (n, voxel) in (PlainGrid { shape: geometry.shape }).voxels().enumerate() {
        let beside = (0..6).filter_map(|side| {
            let mut next = voxel;
            next[side / 2] += if side % 2 == 0 { 1 } else { -1 };
            domain.contains(next).then(|| labels[domain.offset_of(next)])
        });
        let differs = beside.into_iter().any(|label| label != labels[n]);
        assert_eq!(border[n], if differs { labels[n] } else { 0.0 });
    }
}

const BOTH_SCHEDULES: [Schedule; 2] = [Schedule::Front, Schedule::Sweep { iterations: 4 }];

/// Points as far from the plane between them as each other: the lower label wins all of it. The methods whose distances
/// are not those to sources see that where distances are symmetric to the bit: points in the middle of cells, or what they
/// fix would not be.
#[test]
fn ties_go_to_the_lower_label() {
    let everywhere = |_: Method| vec![LabelMode::Tracked, LabelMode::Exact];
    let known = |method: Method| {
        let tracked = [Method::VDT, Method::DP].contains(&method).then_some(LabelMode::Tracked);
        tracked.into_iter().chain([LabelMode::Exact]).collect()
    };
    check_ties(0.1, [0.5, 0.0, 0.0], known);
    check_ties(0.125, [0.4375, 0.0625, 0.0625], everywhere);
}

fn check_ties(h: f64, [x, y, z]: [f64; 3], modes: impl Fn(Method) -> Vec<LabelMode>) {
    let geometry = cube_grid(-1.0, 1.0, h);
    let points = [[[-x, y, z]], [[x, y, z]]];
    // The middle plane is at the same distance.
    let (half, plane) = (geometry.shape[0] as u64 / 2, geometry.shape[0].pow(2) as u64);
    for order in [[0, 1], [1, 0]] {
        let mut sets = DataSets::default();
        for n in order {
            sets.add_cloud(&points[n]);
        }
        for method in Method::all() {
            let modes = modes(method).into_iter();
            for (labels, schedule) in modes.flat_map(|labels| BOTH_SCHEDULES.map(|schedule| (labels, schedule))) {
                let settings = settings(method, SurfaceKind::Exact, labels, 16);
                let distance = DistanceSettings { schedule, init: Init::Cell, ..settings.distance };
                let settings = MiddleSettings { distance, ..settings };
                let found = middle::<f64>(&Lab::new(2).engine, &geometry, &sets, &settings, None, &mut NoMesh).unwrap();
                let counts: Vec<(u32, u64)> = found.distance.label_voxels.into_iter().collect();
                let wanted = [(1, (half + 1) * plane), (2, half * plane)];
                assert_eq!(counts, wanted, "{} {schedule:?} {order:?} {h}", method.name());
                assert!((found.measures.area - 4.0).abs() < 0.02, "{:?}", found.measures);
            }
        }
    }
}

/// Points and faces on a lattice that numbers of the machine hold exactly: most voxels between labels are as far from
/// one as from another.
#[test]
fn tracked_ties_go_to_the_lower_label() {
    let geometry = Geometry { shape: [41, 37, 33], spacing: [0.125; 3], origin: [0.0; 3], unit: None };
    let lattice = |seed| {
        let cloud = random_cloud(&geometry, 12, seed);
        cloud.iter().map(|p| p.map(|v| (2.0 * v).round() / 2.0)).collect::<Vec<_>>()
    };
    // The first set is a mesh, whose sources are numbered after those of clouds; the last has points of others again.
    let (lo, hi) = ([1.0, 1.5, 1.0], [2.0, 2.5, 3.0]);
    let mut clouds: Vec<Vec<[f64; 3]>> = (1..4).map(lattice).collect();
    clouds.push(clouds[0][..4].iter().copied().chain([lo, hi, [4.5, 4.0, 3.5]]).collect());
    let mut sets = DataSets::default();
    sets.add_mesh(&meshes::cuboid(lo, hi));
    for cloud in &clouds {
        sets.add_cloud(cloud);
    }
    let plain = PlainGrid { shape: geometry.shape };
    let wanted = plain.voxels().map(|voxel| {
        let here = position(&geometry, voxel);
        let to_cloud = |cloud: &Vec<[f64; 3]>| cloud.iter().map(|p| squared(here, *p)).fold(f64::MAX, f64::min);
        let all: Vec<f64> = [squared_to_cuboid(here, lo, hi)].into_iter().chain(clouds.iter().map(to_cloud)).collect();
        let least = all.iter().copied().fold(f64::MAX, f64::min);
        let tied = all.iter().filter(|d| **d == least).count() > 1;
        (least, all.iter().position(|d| *d == least).map_or(0.0, |at| (at + 1) as f64), tied)
    });
    let wanted: Vec<(f64, f64, bool)> = wanted.collect();
    for method in [Method::VDT, Method::DP] {
        for (schedule, neighbours) in BOTH_SCHEDULES.into_iter().flat_map(|s| [(s, Faces), (s, All)]) {
            if neighbours == All && method == Method::VDT && schedule != Schedule::Front {
                continue;
            }
            for brick in [16, 32] {
                let settings = settings(method, SurfaceKind::Exact, LabelMode::Tracked, brick);
                let distance = DistanceSettings { schedule, neighbours, ..settings.distance };
                let settings = MiddleSettings { distance, ..settings };
                let [distances, labels, _] = fields_of(&geometry, &sets, &settings);
                let mut ties = 0;
                for (n, &(squared, label, tied)) in wanted.iter().enumerate() {
                    if tied && distances[n] == f64::from(squared.sqrt() as f32) {
                        let what = format!("{} {schedule:?} {neighbours:?} {brick}", method.name());
                        assert_eq!(labels[n], label, "{what} at {:?}", plain.voxels().nth(n));
                        ties += 1;
                    }
                }
                assert!(ties > 2000, "{ties}");
            }
        }
    }
}

/// A cloud and its image in a mirror, a plane across an axis or between two: all voxels on the mirror have the lower
/// label, by the methods whose distances are not those to their sources: they are symmetric.
#[test]
fn mirrors_have_the_lower_label() {
    let geometry = Geometry { shape: [33; 3], spacing: [0.125; 3], origin: [-2.0; 3], unit: None };
    let mirrors: [fn([f64; 3]) -> [f64; 3]; 4] =
        [|[x, y, z]| [-x, y, z], |[x, y, z]| [x, y, -z], |[x, y, z]| [y, x, z], |[x, y, z]| [x, -z, -y]];
    let plain = PlainGrid { shape: geometry.shape };
    for (seed, mirror) in (11..).zip(mirrors) {
        let cloud = random_cloud(&geometry, 9, seed).into_iter().map(|p| p.map(|v| (8.0 * v).round() / 8.0 + 0.0625));
        // All on one side.
        let (side, other): (Vec<_>, Vec<_>) =
            cloud.map(|p| if mirror(p) > p { (p, mirror(p)) } else { (mirror(p), p) }).unzip();
        for pair in [[&side, &other], [&other, &side]] {
            let mut sets = DataSets::default();
            for cloud in pair {
                sets.add_cloud(cloud);
            }
            for (method, schedule) in [Method::FSM, Method::FMM]
                .into_iter()
                .flat_map(|method| BOTH_SCHEDULES.map(|schedule| (method, schedule)))
            {
                let brick = if pair[0] == &side { 16 } else { 64 };
                let settings = settings(method, SurfaceKind::Exact, LabelMode::Tracked, brick);
                let distance = DistanceSettings { schedule, ..settings.distance };
                let [_, labels, _] = fields_of(&geometry, &sets, &MiddleSettings { distance, ..settings });
                let on_mirror = plain.voxels().zip(&labels).filter(|(voxel, _)| {
                    let here = position(&geometry, *voxel);
                    mirror(here) == here
                });
                let wrong: Vec<_> = on_mirror.filter(|(_, label)| **label != 1.0).collect();
                assert!(wrong.is_empty(), "{} {schedule:?} {seed}: {} as {:?}", method.name(), wrong.len(), wrong[0]);
            }
        }
    }
}

#[test]
fn a_run_is_told_and_written() {
    let bench = Bench::bare();
    fs::write(bench.path("cube.off"), Form::Off.write(&meshes::cuboid([0.0; 3], [1.0; 3]))).unwrap();
    fs::write(bench.path("ball.off"), Form::Off.write(&meshes::sphere([0.5; 3], 0.25, 20, PI))).unwrap();
    bench.write("point.xyz", "0.5 0.5 2.5\n0.6 0.5 2.5\n");
    let printed =
        bench.succeed("middle cube.off ball.off --spacing 0.05 -o out/x.zarr --mesh out/x.stl --labels exact");
    assert!(
        printed.contains("labels 1 and 2: area 2.2") && printed.contains("surface: closed, volume 0.29"),
        "{printed}"
    );
    assert_eq!(bench.entries("out"), ["x.stl", "x.zarr"]);
    assert_eq!(bench.entries("out/x.zarr/labels"), ["border", "nearest", "zarr.json"]);
    assert_eq!(bench.entries("out/x.zarr/meshes"), ["labels.csv", "pairs.csv", "precomputed", "surface.ply"]);
    let report = bench.json("out/x.zarr/report.json");
    assert_eq!((&report["command"], &report["settings"]["surface"]), (&"middle".into(), &"exact".into()));
    let pair = &report["result"]["pairs"][0];
    assert_eq!(pair["labels"], serde_json::json!([1, 2]));
    assert_eq!(pair["thickness"]["min"].as_f64(), pair["distance"]["min"].as_f64().map(|d| 2.0 * d));
    let table = fs::read_to_string(bench.path("out/x.zarr/meshes/pairs.csv")).unwrap();
    let row: Vec<&str> = table.lines().nth(1).unwrap().split(',').collect();
    assert_eq!((row.len(), row[2].parse::<f64>().ok()), (15, pair["area"].as_f64()));
    bench.succeed("measure out/x.stl");
    bench.succeed("middle cube.off ball.off point.xyz --spacing 0.1 -o none");
    for (arguments, complaint) in [
        ("middle cube.off -o none", "give two files or more"),
        ("middle cube.off ball.off point.xyz --surface labels --spacing 0.1 -o none", "but 3 were given"),
        ("middle cube.off none.off -o none", "none.off"),
    ] {
        let text = bench.fail(arguments, 2);
        assert!(text.contains(complaint), "{arguments}: {text}");
    }
}
