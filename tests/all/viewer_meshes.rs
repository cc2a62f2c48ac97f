//! What a store has of its surfaces for viewers: copies with fewer triangles, against distances that are computed plainly and the
//! area of a sphere; meshes of neuroglancer, against the PLY beside them; numbers of vertices in VTP, against all points.

#![allow(clippy::unwrap_used)]

use std::collections::{BTreeMap, HashMap};
use std::f64::consts::PI;
use std::fs;
use std::path::Path;

use strandline::exec::{Budget, Cancel, Engine, Silent};
use strandline::grid::{Geometry, TriangleMesh};
use strandline::io::geometry::write::ply::PlyWriter;
use strandline::io::ome_zarr::StoreWriter;
use strandline::kernel::surface::{Clustered, Clustering};
use strandline::pipeline::output::viewer_mesh::{Segments, Simplified, for_viewers};
use strandline::store::{MeshSink, Scratch};

use crate::common::ball::{Ball, Bench};
use crate::common::meshes;
use crate::common::random::Random;

type Corners = [[f64; 3]; 3];

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|n| a[n] - b[n])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|n| a[n] * b[n]).sum()
}

fn cross([a, b, c]: [f64; 3], [x, y, z]: [f64; 3]) -> [f64; 3] {
    [b * z - c * y, c * x - a * z, a * y - b * x]
}

fn area(triangle: Corners) -> f64 {
    let [a, b, c] = triangle;
    let normal = cross(minus(b, a), minus(c, a));
    0.5 * dot(normal, normal).sqrt()
}

/// From a place to a triangle: to its plane where it lies over it, else to its sides.
fn distance(place: [f64; 3], triangle: Corners) -> f64 {
    let [a, b, c] = triangle;
    let normal = cross(minus(b, a), minus(c, a));
    let sides = [(a, b), (b, c), (c, a)];
    let is_over = sides.iter().all(|(from, to)| dot(cross(normal, minus(*to, *from)), minus(place, *from)) >= 0.0);
    if is_over && dot(normal, normal) > 0.0 {
        return dot(normal, minus(place, a)).abs() / dot(normal, normal).sqrt();
    }
    let to_side = |(from, to): &([f64; 3], [f64; 3])| {
        let way = minus(*to, *from);
        let part = (dot(minus(place, *from), way) / dot(way, way).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        let off = minus(place, std::array::from_fn(|n| from[n] + part * way[n]));
        dot(off, off).sqrt()
    };
    sides.iter().map(to_side).fold(f64::INFINITY, f64::min)
}

fn corners_of(copy: &Clustered) -> Vec<Corners> {
    copy.triangles.iter().map(|corners| corners.map(|v| copy.vertices[v as usize])).collect()
}

/// A sphere whose halves have labels of their own, and its copy.
fn clustered(mesh: &TriangleMesh, finest: f64, most: usize) -> Clustered {
    let mut clustering = Clustering::new([-2.0, -2.5, -3.0], finest, most);
    for corners in (0..mesh.len()).map(|n| mesh.corners(n)) {
        let is_high = corners.iter().map(|p| p[2]).sum::<f64>() > 0.0;
        clustering.add(corners, if is_high { [1, 2] } else { [1, 3] });
    }
    clustering.finish()
}

#[test]
fn a_sphere_of_fewer_triangles_is_a_sphere() {
    let mesh = meshes::sphere([0.0; 3], 1.5, 200, PI);
    let copy = clustered(&mesh, 0.01, 12_000);
    let triangles = corners_of(&copy);
    assert!((3_000..=12_000).contains(&triangles.len()), "{} triangles", triangles.len());
    let doubled = (copy.edge / 0.01).log2();
    assert!((doubled - doubled.round()).abs() < 1e-12, "{}", copy.edge);
    // Each side is gone along once each way.
    let mut sides: HashMap<(u32, u32), i32> = HashMap::new();
    for [a, b, c] in &copy.triangles {
        for (from, to) in [(*a, *b), (*b, *c), (*c, *a)] {
            *sides.entry((from.min(to), from.max(to))).or_default() += if from < to { 1 } else { -1 };
        }
    }
    assert!(sides.values().all(|sum| *sum == 0), "closed");
    let volume: f64 = triangles.iter().map(|[a, b, c]| dot(*a, cross(*b, *c)) / 6.0).sum();
    assert!((volume / (4.5 * PI) - 1.0).abs() < 0.01, "volume {volume}");
    let labelled = |label: u32| {
        let with = triangles.iter().zip(&copy.labels).filter(|(_, labels)| labels[1] == label);
        with.map(|(triangle, _)| area(*triangle)).sum::<f64>()
    };
    for label in [2, 3] {
        let found = labelled(label) / (0.5 * 9.0 * PI);
        assert!((found - 1.0).abs() < 0.04, "label {label}: {found}");
    }
    let all = (labelled(2) + labelled(3)) / (9.0 * PI);
    assert!((all - 1.0).abs() < 0.02, "area {all}");
}

#[test]
fn no_place_is_farther_from_the_copy_than_told() {
    let mesh = meshes::sphere([0.0; 3], 1.5, 120, PI);
    let copy = clustered(&mesh, 0.01, 6_000);
    let triangles = corners_of(&copy);
    let away = |place: [f64; 3]| triangles.iter().map(|t| distance(place, *t)).fold(f64::INFINITY, f64::min);
    let mut random = Random(3);
    for _ in 0..150 {
        let corners = mesh.corners(random.below(mesh.len()));
        let told = copy.distance(corners).unwrap();
        let middle = std::array::from_fn(|a| corners.iter().map(|p| p[a]).sum::<f64>() / 3.0);
        let found = corners.into_iter().chain([middle]).map(away).fold(0.0, f64::max);
        assert!(found <= told + 1e-12 && told <= copy.bound(), "{found} {told} {}", copy.bound());
        // A sphere bends by much less than a cube is wide.
        assert!(told < 0.2 * copy.edge, "{told} of {}", copy.edge);
    }
}

/// The corner of a cube is a vertex of the copy, where means of vertices would cut it off.
#[test]
fn sharp_corners_stay() {
    let mut clustering = Clustering::new([0.0; 3], 1.0, 1 << 20);
    let faces = 24_i32;
    let side = |n: i32| 2.3 + f64::from(n) * 0.25;
    for (axis, u, v) in (0..3 * faces * faces).map(|n| ((n % 3) as usize, n / 3 % faces, n / 3 / faces)) {
        let at = |du: i32, dv: i32| {
            let mut place = [2.3; 3];
            place[(axis + 1) % 3] = side(u + du);
            place[(axis + 2) % 3] = side(v + dv);
            place
        };
        clustering.add([at(0, 0), at(1, 0), at(1, 1)], [0; 2]);
        clustering.add([at(0, 0), at(1, 1), at(0, 1)], [0; 2]);
    }
    let copy = clustering.finish();
    let off = |corner: [f64; 3]| {
        let to = copy.vertices.iter().map(|v| dot(minus(*v, corner), minus(*v, corner)).sqrt());
        to.fold(f64::INFINITY, f64::min)
    };
    assert!(off([2.3; 3]) < 1e-9, "{}", off([2.3; 3]));
}

fn engine(bytes: u64, folder: &Path) -> Engine {
    let scratch = Scratch::new(folder, bytes);
    Engine::new(2, scratch, Budget { total: bytes }, Cancel::default(), std::sync::Arc::new(Silent)).unwrap()
}

/// A sphere of 521 284 triangles, written as a run would.
fn large(bytes: u64, folder: &Path) -> (Option<Simplified>, StoreWriter) {
    let store = StoreWriter::create(&folder.join("large.zarr"), true).unwrap();
    let geometry = Geometry { shape: [300; 3], spacing: [0.01; 3], origin: [-1.5; 3], unit: Some("millimeter".into()) };
    let mesh = meshes::sphere([0.0; 3], 1.25, 361, PI);
    let mut file = PlyWriter::on_grid(&store.file("meshes/surface.ply").unwrap(), &geometry).unwrap();
    mesh.vertices.iter().try_for_each(|&vertex| file.vertex(vertex)).unwrap();
    mesh.triangles.iter().try_for_each(|&corners| file.triangle(corners)).unwrap();
    let written = file.finish().unwrap();
    let engine = engine(bytes, folder);
    (for_viewers(&engine, &store, (&written, &geometry), Segments::Object(7)).unwrap(), store)
}

#[test]
fn a_large_surface_has_a_copy_where_memory_has_room() {
    let folder = tempfile::tempdir().unwrap();
    let (found, store) = large(512 << 20, folder.path());
    let found = found.unwrap();
    assert!(found.triangles > 75_000 / 2 && found.triangles <= 300_000, "{found:?}");
    assert!(found.error > 0.0 && found.error < found.bound && found.left_out == 0.0, "{found:?}");
    let copy = read_ply(&store.folder().join("meshes/simplified/surface.ply"));
    assert_eq!(copy.triangles.len() as u64, found.triangles);
    let sum: f64 = copy.triangles.iter().map(|t| area(t.map(|v| copy.vertices[v as usize]))).sum();
    assert!((sum / (4.0 * PI * 1.25 * 1.25) - 1.0).abs() < 0.005, "{sum}");
    assert_eq!(read_fragment(&store.folder().join("meshes/precomputed/7")).1, copy.triangles);
    drop(store);
    let (found, store) = large(96 << 20, folder.path());
    assert_eq!(found, None);
    assert!(!store.folder().join("meshes/simplified").exists() && !store.folder().join("meshes/precomputed").exists());
}

/// A PLY file of ours, read by its words.
#[derive(Default)]
struct Ply {
    vertices: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
    labels: Vec<[u32; 2]>,
}

fn read_ply(path: &Path) -> Ply {
    let bytes = fs::read(path).unwrap();
    let end = bytes.windows(11).position(|at| at == b"end_header\n").unwrap() + 11;
    let head = String::from_utf8_lossy(&bytes[..end]).into_owned();
    let count = |what: &str| {
        let line = head.lines().find_map(|line| line.strip_prefix("element ")?.strip_prefix(what));
        line.unwrap().trim().parse::<usize>().unwrap()
    };
    assert!(!head.contains("double"), "these are small");
    let word = |at: usize| <[u8; 4]>::try_from(&bytes[at..at + 4]).unwrap();
    let mut ply = Ply::default();
    for n in 0..count("vertex") {
        ply.vertices.push(std::array::from_fn(|a| f64::from(f32::from_le_bytes(word(end + 12 * n + 4 * a)))));
    }
    let (faces, each) = (end + 12 * count("vertex"), if head.contains("label_low") { 21 } else { 13 });
    for at in (0..count("face")).map(|n| faces + each * n) {
        assert_eq!(bytes[at], 3);
        let number = |n: usize| u32::from_le_bytes(word(at + 1 + 4 * n));
        ply.triangles.push([number(0), number(1), number(2)]);
        ply.labels.push(if each == 21 { [number(3), number(4)] } else { [0; 2] });
    }
    ply
}

/// A fragment of neuroglancer: positions and triangles.
fn read_fragment(path: &Path) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let bytes = fs::read(path).unwrap();
    let words: Vec<[u8; 4]> = bytes.chunks_exact(4).map(|four| four.try_into().unwrap()).collect();
    let count = u32::from_le_bytes(words[0]) as usize;
    let (positions, corners) = words[1..].split_at(3 * count);
    let positions = positions.chunks_exact(3).map(|p| [0, 1, 2].map(|a| f32::from_le_bytes(p[a]))).collect();
    (positions, corners.chunks_exact(3).map(|t| [0, 1, 2].map(|n| u32::from_le_bytes(t[n]))).collect())
}

#[test]
fn meshes_of_objects_are_those_of_the_store() {
    let bench = Bench::new(&Ball::small());
    bench.succeed("segment image.tif --points marks.csv -q -o out/ball.zarr --max-steps 4");
    let folder = bench.path("out/ball.zarr/meshes/precomputed");
    assert_eq!(bench.entries("out/ball.zarr/meshes/precomputed"), ["1", "1:0", "info"]);
    assert_eq!(fs::read_to_string(folder.join("info")).unwrap(), r#"{"@type":"neuroglancer_legacy_mesh"}"#);
    assert_eq!(fs::read_to_string(folder.join("1:0")).unwrap(), r#"{"fragments":["1"]}"#);
    let ply = read_ply(&bench.path("out/ball.zarr/meshes/surface.ply"));
    let (positions, triangles) = read_fragment(&folder.join("1"));
    assert_eq!(triangles, ply.triangles);
    // Micrometres.
    let expected: Vec<[f32; 3]> = ply.vertices.iter().map(|p| p.map(|v| (v * 1e3) as f32)).collect();
    let is_near = |(a, b): (&[f32; 3], &[f32; 3])| (0..3).all(|n| (a[n] - b[n]).abs() <= 1e-6 * b[n].abs());
    assert!(positions.len() == expected.len() && positions.iter().zip(&expected).all(is_near));
    assert!(bench.json("out/ball.zarr/report.json")["result"]["simplified"].is_null());
}

#[test]
fn each_pair_has_a_mesh_in_the_order_of_the_table() {
    let bench = Bench::bare();
    bench.write("a.xyz", "0 0 0\n0.1 0 0\n");
    bench.write("b.xyz", "1 0 0\n1 0.1 0\n");
    bench.write("c.xyz", "0.5 1 0\n0.5 1 0.1\n");
    bench.succeed("middle a.xyz b.xyz c.xyz --spacing 0.05 --padding 0.4 -q -o out/m.zarr");
    let table = fs::read_to_string(bench.path("out/m.zarr/meshes/pairs.csv")).unwrap();
    let pairs: Vec<[u32; 2]> = table
        .lines()
        .skip(1)
        .map(|line| {
            let mut words = line.split(',').map(|word| word.parse().unwrap_or(0));
            [words.next().unwrap(), words.next().unwrap()]
        })
        .collect();
    assert_eq!(pairs, [[1, 2], [1, 3], [2, 3]]);
    let ply = read_ply(&bench.path("out/m.zarr/meshes/surface.ply"));
    for (number, pair) in (1..).zip(&pairs) {
        let (positions, triangles) = read_fragment(&bench.path(&format!("out/m.zarr/meshes/precomputed/{number}")));
        let found: Vec<[[f32; 3]; 3]> = triangles.iter().map(|t| t.map(|v| positions[v as usize])).collect();
        let of_pair = ply.triangles.iter().zip(&ply.labels).filter(|(_, labels)| *labels == pair);
        // Lengths without a unit are taken as metres.
        let place = |v: u32| ply.vertices[v as usize].map(|x| (x * 1e9) as f32);
        let expected: Vec<[[f32; 3]; 3]> = of_pair.map(|(t, _)| t.map(place)).collect();
        assert!(!found.is_empty() && found == expected, "{pair:?}");
    }
    let properties = bench.json("out/m.zarr/meshes/precomputed/segment_properties/info");
    assert_eq!(properties["inline"]["ids"], serde_json::json!(["1", "2", "3"]));
    let label = &properties["inline"]["properties"][0];
    assert_eq!(label["values"], serde_json::json!(["1 | 2", "1 | 3", "2 | 3"]));
    assert_eq!(bench.json("out/m.zarr/meshes/precomputed/info")["segment_properties"], "segment_properties");
}

/// Points, values of a name, and triangles of a VTP file, by the places that its header tells.
fn read_vtp(path: &Path, name: &str) -> (Vec<[f64; 3]>, Vec<f64>) {
    let bytes = fs::read(path).unwrap();
    let start = bytes.windows(7).position(|at| at == b"raw\">\n_").unwrap() + 7;
    let head = String::from_utf8_lossy(&bytes[..start]).into_owned();
    assert!(head.contains(&format!("<PointData Scalars=\"{name}\">")) && head.contains("type=\"Float32\""), "{head}");
    let offsets: BTreeMap<&str, usize> = head
        .split("<DataArray ")
        .skip(1)
        .map(|part| {
            let called = part.split("Name=\"").nth(1).and_then(|rest| rest.split('"').next()).unwrap_or("points");
            let at = part.split("offset=\"").nth(1).unwrap().split('"').next().unwrap().parse().unwrap();
            (
                if part.contains("Name=") && !part.starts_with("type=\"Float32\" NumberOf") {
                    called
                } else {
                    "points"
                },
                at,
            )
        })
        .collect();
    let floats = |name: &str| -> Vec<f64> {
        let at = start + offsets[name];
        let length = u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap()) as usize;
        let words = bytes[at + 8..at + 8 + length].chunks_exact(4);
        words.map(|word| f64::from(f32::from_le_bytes(word.try_into().unwrap()))).collect()
    };
    let points = floats("points").chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
    (points, floats(name))
}

fn nearest(place: [f64; 3], points: &[[f64; 3]]) -> f64 {
    points.iter().map(|p| dot(minus(*p, place), minus(*p, place)).sqrt()).fold(f64::INFINITY, f64::min)
}

/// Columns of numbers; those that are none are left out.
fn numbers(text: &str, skip: usize) -> Vec<[f64; 3]> {
    let line = |line: &str| {
        let words: Vec<f64> = line.split([',', ' ']).skip(skip).map(str::parse).collect::<Result<_, _>>().ok()?;
        words.try_into().ok()
    };
    text.lines().filter_map(line).collect()
}

/// Points as text.
fn lines(points: &[[f64; 3]]) -> String {
    let line = |[x, y, z]: &[f64; 3]| format!("{x} {y} {z}");
    points.iter().map(line).collect::<Vec<_>>().join("\n")
}

#[test]
fn vertices_know_how_far_the_marks_are() {
    let bench = Bench::new(&Ball::small());
    let marks = fs::read_to_string(bench.path("marks.csv")).unwrap();
    bench.succeed("segment image.tif --points marks.csv -q -o none --mesh out/a.vtp --max-steps 4");
    let marks = numbers(&marks, 2);
    let cloud: Vec<[f64; 3]> = meshes::sphere([1.0; 3], 3.0, 30, PI).vertices;
    bench.write("cloud.xyz", &lines(&cloud));
    bench.succeed("reconstruct cloud.xyz --spacing 0.35 -q -o none --mesh out/b.vtp");
    for (name, marks) in [("out/a.vtp", marks), ("out/b.vtp", cloud)] {
        let (points, values) = read_vtp(&bench.path(name), "distance_to_marks");
        assert!(points.len() > 500 && points.len() == values.len(), "{name}");
        for (point, value) in points.iter().zip(&values) {
            let expected = nearest(*point, &marks);
            assert!((value - expected).abs() < 1e-5, "{name} {point:?}: {value}, not {expected}");
        }
    }
}

#[test]
fn vertices_between_two_sets_know_how_wide_the_gap_is() {
    let bench = Bench::bare();
    let mut random = Random(9);
    let mut set = |x: f64| -> Vec<[f64; 3]> {
        (0..40).map(|_| [x + 0.2 * random.unit(), random.unit(), random.unit()]).collect()
    };
    let sets = [set(0.0), set(0.8)];
    for (name, points) in ["a.xyz", "b.xyz"].iter().zip(&sets) {
        bench.write(name, &lines(points));
    }
    for (surface, off) in [("exact", 2e-6), ("labels", 2e-6)] {
        bench.succeed(&format!(
            "middle a.xyz b.xyz --spacing 0.05 --surface {surface} -q -o none --mesh out/{surface}.vtp"
        ));
        let (points, values) = read_vtp(&bench.path(&format!("out/{surface}.vtp")), "thickness");
        assert!(points.len() > 300 && points.len() == values.len());
        for (point, value) in points.iter().zip(&values) {
            let expected: f64 = sets.iter().map(|set| nearest(*point, set)).sum();
            assert!((value - expected).abs() < off, "{surface} {point:?}: {value}, not {expected}");
        }
    }
}
