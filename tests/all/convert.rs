//! `strandline convert`: every type through every format and back, read by other programs, refused where it cannot be.

#![allow(clippy::unwrap_used)]

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use crate::common::ball::{Ball, Bench};
use crate::common::python;
use crate::common::random::Random;
use crate::common::stores::contents;

/// Voxels along x, y, z: several chunks, none of them whole along y.
const SHAPE: [usize; 3] = [131, 40, 19];
const SPACING: [f64; 3] = [0.25, 0.3, 1.5];
const ORIGIN: [f64; 3] = [10.5, -20.25, 7.0];

/// Types as NRRD and as numpy names them, and their bytes.
const TYPES: [(&str, &str, usize); 8] = [
    ("uint8", "uint8", 1),
    ("int8", "int8", 1),
    ("uint16", "uint16", 2),
    ("int16", "int16", 2),
    ("uint32", "uint32", 4),
    ("int32", "int32", 4),
    ("float", "float32", 4),
    ("double", "float64", 8),
];

/// What is written, and how it is asked for.
const FORMATS: [(&str, &str); 5] =
    [("v5.zarr", "--ome 0.5"), ("v4.zarr", "--ome 0.4"), ("a.tif", ""), ("a.nrrd", ""), ("a.vti", "")];

/// Voxels of a type: of floating-point numbers some are none.
fn voxels(name: &str, size: usize, random: &mut Random) -> Vec<u8> {
    let count: usize = SHAPE.iter().product();
    let special =
        |n: usize, value: f64| [f64::NAN, f64::INFINITY, -0.0, f64::MIN_POSITIVE].get(n).copied().unwrap_or(value);
    match name {
        "float" => (0..count).flat_map(|n| (special(n, random.unit() - 0.5) as f32).to_le_bytes()).collect(),
        "double" => (0..count).flat_map(|n| special(n, random.unit() - 0.5).to_le_bytes()).collect(),
        _ => (0..count * size).map(|_| (256.0 * random.unit()) as u8).collect(),
    }
}

fn nrrd(name: &str, voxels: &[u8]) -> Vec<u8> {
    let ([nx, ny, nz], [hx, hy, hz], [x, y, z]) = (SHAPE, SPACING, ORIGIN);
    let mut header = format!("NRRD0004\ntype: {name}\ndimension: 3\nspace dimension: 3\nsizes: {nx} {ny} {nz}\n");
    writeln!(header, "space directions: ({hx},0,0) (0,{hy},0) (0,0,{hz})\nspace origin: ({x},{y},{z})").unwrap();
    header.push_str("space units: \"um\" \"um\" \"um\"\nendian: little\nencoding: raw\n\n");
    [header.as_bytes(), voxels].concat()
}

/// The fields of a raw NRRD file, and its voxels.
fn parts(path: &Path) -> (String, Vec<u8>) {
    let bytes = fs::read(path).unwrap();
    let end = bytes.windows(2).position(|pair| pair == b"\n\n").unwrap();
    (String::from_utf8(bytes[..end].to_vec()).unwrap(), bytes[end + 2..].to_vec())
}

/// Writes what other programs must find in the files of a type.
fn expect(bench: &Bench, dtype: &str, voxels: &[u8]) -> PathBuf {
    fs::write(bench.path(&format!("{dtype}.raw")), voxels).unwrap();
    let ([x, y, z], path) = (SHAPE, bench.path(&format!("{dtype}.json")));
    let document = json!({
        "dtype": dtype, "shape": [z, y, x], "values": format!("{dtype}.raw"), "spacing": SPACING, "origin": ORIGIN,
        "unit": "micrometer"
    });
    fs::write(&path, document.to_string()).unwrap();
    path
}

#[test]
fn volumes_go_through_every_format_and_back() {
    let (bench, random, mut files) = (Bench::bare(), &mut Random(7), Vec::new());
    for (n, (name, dtype, size)) in TYPES.into_iter().enumerate() {
        let voxels = voxels(name, size, random);
        fs::write(bench.path("in.nrrd"), nrrd(name, &voxels)).unwrap();
        files.push(expect(&bench, dtype, &voxels));
        for (m, (output, flags)) in FORMATS.into_iter().enumerate() {
            // Each type in some way, and each format in every way.
            let packed = if output == "a.vti" { "none" } else { ["none", "fast", "small"][(n + m) % 3] };
            let output = format!("out/{dtype}-{output}");
            bench.succeed(&format!("convert in.nrrd {output} {flags} --compress {packed}"));
            bench.succeed(&format!("convert {output} back.nrrd --compress none --overwrite"));
            let (header, back) = parts(&bench.path("back.nrrd"));
            assert!(back == voxels, "{output}, {packed}");
            let origin = if output.contains(".tif") { "(0,0,0)" } else { "(10.5,-20.25,7)" };
            for field in [
                format!("type: {name}\n"),
                "sizes: 131 40 19\n".into(),
                "space directions: (0.25,0,0) (0,0.3,0) (0,0,1.5)\n".into(),
                "space units: \"um\" \"um\" \"um\"\n".into(),
                format!("space origin: {origin}\n"),
            ] {
                assert!(header.contains(&field), "{output}: {field:?} in {header}");
            }
            files.push(bench.path(&output));
        }
    }
    let Some(interpreter) = python::interpreter() else { return };
    let files: Vec<&Path> = files.iter().map(PathBuf::as_path).collect();
    let printed = python::run_script(interpreter, "check_volume.py", &files).unwrap_or_else(|text| panic!("{text}"));
    // VTK is not among the readers of the tests: scripts/check_formats has it.
    assert!(printed.lines().count() >= TYPES.len() * (FORMATS.len() - 1), "{printed}");
}

#[test]
fn half_precision_stays_where_there_is_some() {
    let bench = Bench::new(&Ball::small());
    bench.succeed("distance marks.csv --like image.tif --precision f16 -q -o out/d.zarr");
    bench.succeed("convert out/d.zarr out/e.zarr --ome 0.4");
    bench.succeed("convert out/e.zarr out/f.zarr");
    let level = |name: &str| contents(&bench.path(&format!("out/{name}.zarr/0")));
    assert_eq!(bench.json("out/e.zarr/0/.zarray")["dtype"], "<f2");
    assert_eq!(bench.json("out/f.zarr/0/zarr.json")["data_type"], "float16");
    let shard = |name: &str| level(name).into_iter().find(|(path, _)| path.ends_with("c/0/0/0")).unwrap().1.len();
    assert!(shard("f") > 1000 && shard("d") > 1000);
    for name in ["h.tif", "h.vti", "h.nrrd"] {
        let output = bench.run(&format!("convert out/d.zarr out/{name}"));
        assert!(String::from_utf8_lossy(&output.stderr).contains("voxels are written as float32"), "{name}");
    }
}

#[test]
fn any_number_of_threads_writes_the_same() {
    let bench = Bench::new(&Ball::large());
    for (name, flags) in [("a.tif", ""), ("a.nrrd", ""), ("a.vti", ""), ("a.zarr", "--ome 0.4"), ("b.zarr", "")] {
        let written = ["1", "3"].map(|threads| {
            bench.succeed(&format!("convert image.tif out/{name} --overwrite --threads {threads} {flags}"));
            let path = bench.path(&format!("out/{name}"));
            if path.is_dir() { contents(&path) } else { vec![(name.to_owned(), fs::read(path).unwrap())] }
        });
        assert!(written[0] == written[1], "{name}");
    }
}

#[test]
fn labels_keep_their_numbers_and_colours() {
    let bench = Bench::new(&Ball::small());
    bench.succeed("segment image.tif --points marks.csv -q --ome 0.4 -o out/s.zarr");
    bench.succeed("convert out/s.zarr/labels/segmentation out/l.zarr");
    bench.succeed("convert out/s.zarr/levelset out/u.zarr --ome 0.4");
    let labels = bench.json("out/l.zarr/zarr.json");
    let ome = &labels["attributes"]["ome"];
    let colors = |ome: &Value| ome["image-label"]["colors"].clone();
    assert_eq!(colors(ome), colors(&bench.json("out/s.zarr/labels/segmentation/.zattrs")));
    assert_eq!((&ome["multiscales"][0]["type"], ome.get("omero")), (&json!("mode"), None));
    let field = bench.json("out/u.zarr/.zattrs");
    assert_eq!((&field["multiscales"][0]["type"], field.get("image-label")), (&json!("mean"), None));
    assert!(field["omero"]["channels"][0]["window"]["max"].as_f64().unwrap() <= 1.0);
    bench.succeed("convert image.tif out/m.zarr --labels");
    assert!(bench.json("out/m.zarr/zarr.json")["attributes"]["ome"]["image-label"].is_object());
    let complaint = bench.fail("convert out/u.zarr out/n.zarr --labels", 2);
    assert!(complaint.contains("--labels is for whole ones") && !bench.path("out/n.zarr").exists(), "{complaint}");
}

#[test]
fn meshes_keep_their_vertices() {
    let bench = Bench::new(&Ball::small());
    bench.succeed("segment image.tif --points marks.csv -q -o none --mesh out/a.ply");
    let measured = |name: &str| {
        let found: Value = serde_json::from_str(&bench.succeed(&format!("measure {name} --json"))).unwrap();
        ["volume", "area", "closed", "triangles"].map(|key| found[key].clone())
    };
    let first = measured("out/a.ply");
    for (from, to) in [("a.ply", "b.obj"), ("b.obj", "c.stl"), ("c.stl", "d.ply"), ("d.ply", "e.vtp")] {
        bench.succeed(&format!("convert out/{from} out/{to}"));
    }
    for name in ["out/b.obj", "out/c.stl", "out/d.ply"] {
        let found = measured(name);
        assert_eq!(found[2..], first[2..], "{name}");
        for (found, first) in found[..2].iter().zip(&first[..2]) {
            let (found, first) = (found.as_f64().unwrap(), first.as_f64().unwrap());
            assert!((found / first - 1.0).abs() < 1e-9, "{name}: {found}, not {first}");
        }
    }
    // Numbers that single precision does not hold stay as they are.
    bench.write("far.obj", "v 4000000.1 0.3 0\nv 4000001.2 0 0\nv 4000000.1 1 0.7\nf 1 2 3\n");
    bench.succeed("convert far.obj out/far.ply");
    bench.succeed("convert out/far.ply out/far.obj");
    assert_eq!(
        fs::read_to_string(bench.path("out/far.obj")).unwrap(),
        fs::read_to_string(bench.path("far.obj")).unwrap()
    );
    let output = bench.run("convert far.obj out/far.stl");
    assert!(String::from_utf8_lossy(&output.stderr).contains("STL holds single precision alone"));
}

#[test]
fn what_cannot_be_is_told_and_leaves_nothing() {
    let bench = Bench::new(&Ball::small());
    bench.write(
        "long.nrrd",
        "NRRD0004\ntype: int64\ndimension: 3\nsizes: 1 1 1\nendian: little\nencoding: raw\n\n12345678",
    );
    bench.write("short.nrrd", "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 9 9 9\nencoding: raw\n\n12345678");
    bench.write("bad.nrrd", "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 9 9 9\nencoding: gzip\n\n12345678");
    bench.write("mesh.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    bench.write("there.tif", "there");
    for (arguments, reason) in [
        ("image.tif out/a.jpg", "ends in one of .zarr, .tif"),
        ("image.tif out/a", "ends like no format"),
        ("missing.tif out/a.zarr", "no such file"),
        ("image.tif no/a.zarr", "does not exist"),
        ("image.tif there.tif", "exists already"),
        ("image.tif image.tif --overwrite", "is an input of this run"),
        ("image.tif out/a.ply", "is a volume"),
        ("mesh.obj out/a.zarr", "is no volume"),
        ("marks.csv out/a.ply", "no triangle"),
        ("image.tif out/a.tif --ome 0.4", "--ome is for"),
        ("image.tif out/a.vti --compress small", "is not packed"),
        ("image.tif out/a.zarr --ome 0.3", "--ome"),
        ("image.tif out/a.zarr --channel 3", "channel 3"),
        ("image.tif out/a.zarr --image-spacing 0", "--image-spacing"),
        ("image.tif out/a.zarr --memory 1MiB", "--memory"),
        ("long.nrrd out/a.tif", "int64"),
        ("short.nrrd out/a.tif", "ends early"),
        ("bad.nrrd out/a.tif", "cannot be unpacked"),
    ] {
        let complaint = bench.fail(&format!("convert {arguments}"), 2);
        assert!(complaint.contains(reason), "{arguments}: {complaint}");
        assert!(bench.entries("out").is_empty(), "{arguments}: {:?}", bench.entries("out"));
    }
    assert_eq!(fs::read_to_string(bench.path("there.tif")).unwrap(), "there");
}
