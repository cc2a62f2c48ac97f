//! Bodies of polygons in the dialects that programs write: read back equal, with the volume and area they were made with.

#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::Path;

use serde_json::Value;
use strandline::grid::TriangleMesh;
use strandline::io::geometry::read::source::Source;
use strandline::io::geometry::read::sources::describe;
use strandline::kernel::geometry::solid::Solid;
use strandline::kernel::surface::Measures;

use crate::common::meshes::{self, Form};
use crate::common::polyhedra::{Polyhedron, notched};
use crate::common::python;
use crate::common::random::Random;

fn read(bytes: &[u8]) -> (Source, Vec<String>) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("source");
    fs::write(&path, bytes).unwrap();
    let shown = String::from_utf8_lossy(&bytes[..bytes.len().min(300)]).into_owned();
    let (source, _, notes) = describe(&path).unwrap_or_else(|error| panic!("{error}: {shown:?}"));
    (source, notes)
}

fn mesh(bytes: &[u8]) -> (TriangleMesh, Vec<String>) {
    match read(bytes) {
        (Source::Mesh(mesh), notes) => (mesh, notes),
        (other, _) => panic!("{other:?}"),
    }
}

fn measures(solid: &Solid) -> Measures {
    solid.measures(|v| solid.mesh.vertices[v as usize])
}

/// How far volume and area of a body may be from those it was made with, in a file of single or double precision.
///
/// Rounding moves each vertex by no more than `moved`: half of a unit in the last place along each axis where the file is
/// single, ten roundings of a double for turning, shifting and writing. A surface that no point of moves farther encloses
/// a volume that differs by `area * moved` at most, to first order; a triangle's area changes by half its perimeter times
/// that. Each of the n terms of a sum, products of three and of two lengths, is rounded 16 times at most, and their sum n
/// times.
fn allowed(body: &Polyhedron, found: &TriangleMesh, is_single: bool) -> [f64; 2] {
    let far = 3.0_f64.sqrt() * body.vertices.iter().flatten().fold(0.0_f64, |far, x| far.max(x.abs()));
    let unit = f64::EPSILON / 2.0;
    let moved = far * if is_single { f64::from(f32::EPSILON) / 2.0 + 10.0 * unit } else { 10.0 * unit };
    let length = |a: [f64; 3], b: [f64; 3]| (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt();
    let perimeters: f64 =
        (0..found.len()).map(|n| found.corners(n)).map(|[a, b, c]| length(a, b) + length(b, c) + length(c, a)).sum();
    let rounded = unit * found.len() as f64;
    [
        body.area * moved + rounded * (16.0 * far.powi(3) + far * body.area),
        0.5 * perimeters * moved + rounded * (16.0 * (2.0 * far).powi(2) + body.area),
    ]
}

fn assert_is(body: &Polyhedron, found: &TriangleMesh, is_single: bool, how: &str) {
    let rounded = |x: f64| if is_single { f64::from(x as f32) } else { x };
    let expected: Vec<[f64; 3]> = body.vertices.iter().map(|v| v.map(rounded)).collect();
    assert_eq!(found.vertices, expected, "{how}");
    assert_eq!(found.len(), body.faces.iter().map(|face| face.len() - 2).sum::<usize>(), "{how}");
    let solid = Solid::new(found.clone());
    assert!(
        solid.edges.is_closed() && solid.edges.is_oriented() && solid.found.turned == 0,
        "{how}: {:?}",
        solid.found
    );
    let [volume, area] = allowed(body, found, is_single);
    let found = measures(&solid);
    assert!((found.volume - body.volume).abs() <= volume, "{how}: {} for {}", found.volume, body.volume);
    assert!((found.area - body.area).abs() <= area, "{how}: {} for {}", found.area, body.area);
}

#[test]
fn random_bodies_are_read_back_equal_from_any_dialect() {
    let seed = 0xd1a1 ^ u64::from(std::process::id());
    println!("seed {seed}");
    let mut random = Random(seed);
    for n in 0..150 {
        let body = Polyhedron::random(&mut random);
        let is_inverted = random.below(2) == 0;
        let written = if is_inverted { body.clone().inverted() } else { body.clone() };
        let (bytes, is_single) = match random.below(3) {
            0 => (written.obj(&mut random), false),
            1 => (written.off(&mut random), false),
            _ => written.ply(&mut random),
        };
        let (found, notes) = mesh(&bytes);
        let how = format!("body {n}, {:?}", String::from_utf8_lossy(&bytes[..bytes.len().min(200)]));
        // The PLY writer puts some bytes after the last element at times, and normals that are no numbers before.
        let has_normals = how.contains(" nx\\n");
        let odd = |words: &str| notes.iter().filter(|note| note.contains(words)).count();
        assert_eq!(odd("bytes after the elements"), usize::from(bytes.ends_with(b"trailing")), "{how}: {notes:?}");
        assert_eq!(odd("properties that are no numbers, as nx"), usize::from(has_normals), "{how}: {notes:?}");
        assert_eq!(
            notes.len(),
            usize::from(bytes.ends_with(b"trailing")) + usize::from(has_normals),
            "{how}: {notes:?}"
        );
        assert_is(&body, &found, is_single, &how);
        assert_eq!(Solid::new(found).found.inverted, u64::from(is_inverted), "{how}");
    }
}

/// Another program's files, of every form that it writes.
#[test]
fn meshes_of_trimesh_are_read_back_equal() {
    let Some(interpreter) = python::interpreter() else { return };
    let folder = tempfile::tempdir().unwrap();
    let seed = u64::from(std::process::id());
    println!("seed {seed}");
    let seed = seed.to_string();
    python::run_script(interpreter, "write_meshes.py", &[folder.path(), Path::new(&seed)])
        .unwrap_or_else(|text| panic!("{text}"));
    let written: Vec<Value> = serde_json::from_slice(&fs::read(folder.path().join("meshes.json")).unwrap()).unwrap();
    assert_eq!(written.len(), 32);
    for expected in &written {
        let name = expected["file"].as_str().unwrap();
        let (source, _, notes) = describe(&folder.path().join(name)).unwrap();
        let Source::Mesh(found) = source else { panic!("{name}: {source:?}") };
        assert!(notes.is_empty(), "{name}: {notes:?}");
        let corners: Vec<[[f64; 3]; 3]> = serde_json::from_value(expected["corners"].clone()).unwrap();
        assert_eq!(found.len(), corners.len(), "{name}");
        // Text has as many decimals as trimesh gives it.
        for (n, corner) in corners.iter().enumerate() {
            let off = |i: usize| (found.corners(n)[i / 3][i % 3] - corner[i / 3][i % 3]).abs();
            assert!((0..9).all(|i| off(i) < 2e-7), "{name}: triangle {n}");
        }
        let solid = Solid::new(found);
        assert!(solid.edges.is_closed() && solid.edges.is_oriented() && solid.found.turned == 0, "{name}");
        assert_eq!(solid.found.inverted, u64::from(expected["inverted"] == true), "{name}");
        let found = measures(&solid);
        for (ours, theirs) in [(found.volume, &expected["volume"]), (found.area, &expected["area"])] {
            assert!((ours / theirs.as_f64().unwrap() - 1.0).abs() < 1e-5, "{name}: {ours} for {theirs}");
        }
    }
}

/// Triangles are read back as they were, in every form, whichever way they are wound.
#[test]
fn random_windings_are_kept_by_the_readers() {
    let seed = 0x71d1 ^ u64::from(std::process::id());
    println!("seed {seed}");
    let mut random = Random(seed);
    for _ in 0..6 {
        let mut model = meshes::sphere([0.5, -0.25, 2.0], 1.5, 4, std::f64::consts::PI);
        model.vertices.iter_mut().flatten().for_each(|x| *x = f64::from(*x as f32));
        for triangle in &mut model.triangles {
            triangle.rotate_left(random.below(3));
            if random.below(2) == 0 {
                triangle.swap(0, 1);
            }
        }
        let corners = |mesh: &TriangleMesh| (0..mesh.len()).map(|n| mesh.corners(n)).collect::<Vec<_>>();
        for form in Form::ALL {
            assert_eq!(corners(&mesh(&form.write(&model)).0), corners(&model), "{form:?}");
        }
    }
}

#[test]
fn a_notched_block_is_no_fan_in_any_format() {
    let body = notched();
    let mut random = Random(1);
    for (bytes, name) in
        [(body.obj(&mut random), "OBJ"), (body.off(&mut random), "OFF"), (body.ply(&mut random).0, "PLY")]
    {
        let (found, _) = mesh(&bytes);
        assert!((body.volume, body.area) == (204.0, 304.0));
        assert_is(&body, &found, false, name);
    }
}

#[test]
fn faces_of_two_corners_are_left_out_with_a_note() {
    let v = "0 0 0\n1 0 0\n0 1 0\n";
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
               element face 2\nproperty list uchar int vertex_indices\nend_header\n";
    for (text, place) in [
        (format!("OFF\n3 2 0\n{v}2 0 1\n3 0 1 2\n"), "line 6"),
        (format!("{ply}{v}3 0 1 2\n1 0\n"), "line 14"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 2 3\n".into(), "line 5"),
    ] {
        let (found, notes) = mesh(text.as_bytes());
        assert_eq!((found.len(), notes.len()), (1, 1), "{text}");
        assert!(notes[0].contains("fewer than three corners") && notes[0].contains(place), "{notes:?}");
    }
    // Where nothing else is there, the vertices are a cloud.
    let (source, notes) = read(format!("OFF\n3 1 0\n{v}2 0 1\n").as_bytes());
    assert!(matches!(source, Source::Cloud(cloud) if cloud.len() == 3) && notes.len() == 1);
}

#[test]
fn what_follows_the_last_face_is_told() {
    let (found, notes) = mesh(b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n\n3 2 1 0\n");
    assert!(found.len() == 1 && notes[0].contains("bytes after the 1 faces that it declares"), "{notes:?}");
}

#[test]
fn polygons_that_cross_themselves_are_told() {
    // A pentagram, whose middle is wound around twice.
    let text = "v 0 3 0\nv 2 -2 0\nv -3 1 0\nv 3 1 0\nv -2 -2 0\nf 1 2 3 4 5\n";
    let (found, notes) = mesh(text.as_bytes());
    assert!(found.len() == 3 && notes[0].contains("cross themselves") && notes[0].contains("5 corners"), "{notes:?}");
}

#[test]
fn strips_of_ply_are_triangles() {
    let v = "0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 2 0\n1 2 0\n";
    let head = "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\n";
    let strips = "element tristrips 1\nproperty list int int vertex_indices\nend_header\n";
    // A strip of three triangles, one that a repeated vertex leads on to, and one of its own.
    let (found, _) = mesh(format!("{head}{strips}{v}13 0 1 2 3 4 -1 4 5 5 2 3 -1 1\n").as_bytes());
    assert_eq!(found.triangles, [[0, 1, 2], [2, 1, 3], [2, 3, 4], [5, 2, 3]]);
    let bytes = |items: &[i32]| items.iter().flat_map(|n| n.to_be_bytes()).collect::<Vec<_>>();
    let mut binary = format!("{head}{strips}").replace("ascii", "binary_big_endian").into_bytes();
    for number in v.split_whitespace() {
        binary.extend(number.parse::<f32>().unwrap().to_be_bytes());
    }
    binary.extend(bytes(&[5, 0, 1, 2, 3, 4]));
    assert_eq!(mesh(&binary).0.triangles, [[0, 1, 2], [2, 1, 3], [2, 3, 4]]);
    // Both sides of a strip lie the same way.
    let solid = Solid::new(found);
    assert!(solid.edges.is_oriented() && solid.found.turned == 0);
}

#[test]
fn binary_stl_is_told_by_its_length() {
    let model = meshes::sphere([0.0; 3], 5.0, 30, std::f64::consts::PI);
    let plain = Form::StlBinary.write(&model);
    assert!(plain.len() > 1 << 16);
    let expected = mesh(&plain).0;
    // Noise for zero, a header like text, and no byte in sight that text would not have.
    let mut noisy = plain.clone();
    noisy[..6].copy_from_slice(b"solid ");
    noisy[84 + 12..][..4].copy_from_slice(&(-6.1e-33_f32).to_le_bytes());
    assert_eq!(mesh(&noisy).0.vertices[1..], expected.vertices[1..]);
    let letters = [&b"solid a\n"[..], &[b' '; 72], &1_u32.to_le_bytes(), &[b'0'; 50]].concat();
    assert_eq!(mesh(&letters).0.len(), 1);
    // Bytes after the triangles, and counts that were never filled in.
    let (found, notes) = mesh(&[&noisy[..], &[0; 7]].concat());
    assert!(found.len() == expected.len() && notes[0].contains("7 bytes after"), "{notes:?}");
    for count in [0, u32::MAX] {
        let mut file = noisy.clone();
        file[80..84].copy_from_slice(&count.to_le_bytes());
        file[84 + 12..][..4].copy_from_slice(&1_f32.to_le_bytes());
        let (found, notes) = mesh(&file);
        assert!(found.len() == expected.len() && notes[0].contains("has the length of"), "{notes:?}");
    }
}

#[test]
fn text_stl_with_odd_ends() {
    let facet = "facet normal -nan(ind) -nan(ind) -nan(ind)\nouter loop\nvertex 0 0 1\nvertex 1e0F 0 0\nvertex 0 1D0 0\nendloop\nendfacet\n";
    let (found, notes) = mesh(format!("solid a\0\x01\n{facet}").as_bytes());
    assert_eq!(found.vertices, [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    assert!(notes[0].contains("without endsolid"), "{notes:?}");
}
