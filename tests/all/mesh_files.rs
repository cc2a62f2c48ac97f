//! Mesh files as they are written while a surface is found: what is read back is what was drawn, and nothing stands there before it
//! is whole.

#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::Path;

use strandline::grid::{Geometry, TriangleMesh};
use strandline::io::geometry::read::source::Source;
use strandline::io::geometry::read::sources::read_source;
use strandline::io::geometry::write::formats::{Format, MeshFile};
use strandline::store::MeshSink;

use crate::common::ball::{Ball, Bench};
use crate::common::random::Random;

/// A grid at a place.
fn grid(origin: [f64; 3]) -> Geometry {
    Geometry { shape: [40; 3], spacing: [0.25; 3], origin, unit: None }
}

/// A surface as it comes: each triangle soon after its vertices, some with a vertex from far before.
fn stream(origin: [f64; 3], mut vertex: impl FnMut([f64; 3]), mut triangle: impl FnMut([u32; 3], [u32; 2])) {
    let mut random = Random(5);
    for n in 0..3000_u32 {
        let place: [f64; 3] = std::array::from_fn(|a| origin[a] + (random.unit() * 640.0).round() / 64.0);
        vertex(place);
        if n >= 2 {
            triangle([n - 2, n - 1, n], [1 + n % 2, 3]);
        }
        if n % 7 == 6 {
            triangle([n / 3, n, n - 3], [1, 2]);
        }
    }
}

fn begin(path: &Path, origin: [f64; 3], is_tagged: bool) -> MeshFile {
    let format = Format::of(path).unwrap();
    MeshFile::create(format, path, &grid(origin), is_tagged, &std::env::temp_dir()).unwrap()
}

/// Writes the stream into a file.
fn write(path: &Path, origin: [f64; 3], is_tagged: bool) {
    let _ = fs::remove_file(path);
    let file = std::cell::RefCell::new(begin(path, origin, is_tagged));
    let facet = |corners, labels| {
        let mut file = file.borrow_mut();
        if is_tagged { file.facet(corners, labels).unwrap() } else { file.triangle(corners).unwrap() }
    };
    stream(origin, |place| file.borrow_mut().vertex(place).unwrap(), facet);
    let whole = file.into_inner().complete().unwrap();
    assert!(!path.exists(), "it has no name before it is given one");
    whole.place(false).unwrap();
}

/// The triangles of the stream, and their labels.
fn expected(origin: [f64; 3]) -> (Vec<[[f64; 3]; 3]>, Vec<[u32; 2]>) {
    let (mesh, mut labels) = (std::cell::RefCell::new(TriangleMesh::default()), Vec::new());
    stream(
        origin,
        |place| mesh.borrow_mut().vertices.push(place),
        |corners, pair| {
            mesh.borrow_mut().triangles.push(corners);
            labels.push(pair);
        },
    );
    (corners(&mesh.into_inner()), labels)
}

fn corners(mesh: &TriangleMesh) -> Vec<[[f64; 3]; 3]> {
    (0..mesh.len()).map(|n| mesh.corners(n)).collect()
}

/// What a VTP file holds: its arrays by the places that its header tells.
fn read_vtp(path: &Path) -> (Vec<[[f64; 3]; 3]>, Vec<[u32; 2]>) {
    let bytes = fs::read(path).unwrap();
    let start = bytes.windows(7).position(|at| at == b"raw\">\n_").unwrap() + 7;
    let head = String::from_utf8_lossy(&bytes[..start]).into_owned();
    let array = |name: &str| {
        let line = head.split("<DataArray ").find(|part| part.contains(name))?;
        let at = start + line.split("offset=\"").nth(1)?.split('"').next()?.parse::<usize>().ok()?;
        let length = u64::from_le_bytes(bytes[at..at + 8].try_into().ok()?) as usize;
        Some(bytes[at + 8..at + 8 + length].to_vec())
    };
    let numbers = |name: &str| -> Vec<u64> {
        array(name).unwrap().chunks_exact(8).map(|word| u64::from_le_bytes(word.try_into().unwrap())).collect()
    };
    let (points, is_double) = (array("NumberOfComponents=\"3\"").unwrap(), head.contains("Float64"));
    let number = |word: &[u8]| {
        if is_double {
            f64::from_le_bytes(word.try_into().unwrap())
        } else {
            f64::from(f32::from_le_bytes(word.try_into().unwrap()))
        }
    };
    let values: Vec<f64> = points.chunks_exact(if is_double { 8 } else { 4 }).map(number).collect();
    let corner = |n: &u64| std::array::from_fn(|a| values[3 * *n as usize + a]);
    let connectivity = numbers("connectivity");
    let triangles: Vec<[[f64; 3]; 3]> =
        connectivity.chunks_exact(3).map(|t| [corner(&t[0]), corner(&t[1]), corner(&t[2])]).collect();
    let ends: Vec<u64> = (1..=triangles.len() as u64).map(|n| 3 * n).collect();
    assert_eq!(numbers("offsets"), ends);
    let words: Vec<u32> = array("\"labels\"")
        .map(|bytes| bytes.chunks_exact(4).map(|word| u32::from_le_bytes(word.try_into().unwrap())).collect())
        .unwrap_or_default();
    (triangles, words.chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect())
}

#[test]
fn what_is_read_back_is_what_was_drawn() {
    let folder = tempfile::tempdir().unwrap();
    for (origin, anchor) in [([0.0; 3], [0.0; 3]), ([500_000.0, 4_000_000.0, 100.0], [500_000.0, 4_000_000.0, 100.0])] {
        let (triangles, labels) = expected(origin);
        for name in ["m.ply", "m.obj", "m.stl"] {
            let path = folder.path().join(name);
            write(&path, origin, false);
            let Source::Mesh(found) = read_source(&path).unwrap() else { panic!("{name} is no mesh") };
            // Coordinates are multiples of a 64th, which f32 keeps near zero and f64 there.
            let beyond = if name == "m.stl" { anchor } else { [0.0; 3] };
            let moved = |t: [[f64; 3]; 3]| t.map(|p| std::array::from_fn(|a| p[a] + beyond[a]));
            let found: Vec<[[f64; 3]; 3]> = corners(&found).into_iter().map(moved).collect();
            assert!(found == triangles, "{name} at {origin:?}: {} of {} triangles", found.len(), triangles.len());
        }
        let path = folder.path().join("m.vtp");
        for is_tagged in [false, true] {
            write(&path, origin, is_tagged);
            let (found, pairs) = read_vtp(&path);
            assert!(found == triangles, "VTP at {origin:?}");
            assert!(pairs == if is_tagged { labels.clone() } else { Vec::new() });
        }
    }
}

#[test]
fn nothing_stays_of_what_is_not_finished() {
    let folder = tempfile::tempdir().unwrap();
    let names = || fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect::<Vec<_>>();
    for name in ["m.ply", "m.obj", "m.stl", "m.vtp"] {
        let path = folder.path().join(name);
        let mut file = begin(&path, [0.0; 3], false);
        file.vertex([1.0; 3]).unwrap();
        assert!(names().len() == 1 && !path.exists(), "{:?}", names());
        drop(file);
        assert!(names().is_empty(), "{:?}", names());
        drop(begin(&path, [0.0; 3], false).complete().unwrap());
        assert!(names().is_empty(), "{:?}", names());
    }
    let mut file = begin(&folder.path().join("m.stl"), [0.0; 3], false);
    let error = file.triangle([0, 1, 2]).unwrap_err().to_string();
    assert!(error.contains("m.stl: the mesh cannot be written: a triangle names vertex 0"), "{error}");
    let missing = folder.path().join("missing/m.stl");
    let error = MeshFile::create(Format::of(&missing).unwrap(), &missing, &grid([0.0; 3]), false, folder.path());
    assert!(error.err().unwrap().to_string().contains("m.stl: the mesh cannot be written"));
}

/// Meshes alone need no field to be written, and an object that cannot be solved has none.
#[test]
fn surfaces_go_to_their_files_without_a_store() {
    let bench = Bench::new(&Ball::small());
    let line = "2,1,1.0,1.0,1.0\n2,1,1.5,1.0,1.0\n2,1,1.0,1.5,1.0\n";
    let both = fs::read_to_string(bench.path("marks.csv")).unwrap() + line;
    bench.write("both.csv", &both);
    for ending in ["ply", "obj", "stl", "vtp"] {
        let out = format!("-o none --mesh out/m.{ending} --report out/r.json --overwrite -q --max-steps 4");
        bench.succeed(&format!("segment image.tif --points marks.csv {out}"));
        let report = bench.json("out/r.json");
        let stages = report["stages"].as_array().unwrap();
        let written: Vec<&str> =
            stages.iter().filter_map(|stage| stage["name"].as_str()).filter(|name| name.contains("write ")).collect();
        assert_eq!(written, ["write labels"], "labels are counted there, and nothing is written");
        bench.fail(&format!("segment image.tif --points both.csv --start flood {out}"), 3);
        let names: Vec<String> = bench.entries("out").into_iter().filter(|name| name.ends_with(ending)).collect();
        assert_eq!(names, [format!("m-1.{ending}"), format!("m.{ending}")]);
        assert!(bench.entries("scratch").is_empty());
    }
}
