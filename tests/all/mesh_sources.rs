//! Meshes and points from files: one mesh in every format gives the same triangles, and nothing broken passes.

use std::fs;
use std::path::Path;

use strandline::error::{ErrorKind, Result};
use strandline::grid::TriangleMesh;
use strandline::io::geometry::read::source::Source;
use strandline::io::geometry::read::sources::{FORMATS, read_source};

use crate::common::damage::damaged;
use crate::common::meshes::{self, Form};
use crate::common::random::Random;
use crate::common::{shared_data, shipped};

fn read_bytes(bytes: &[u8]) -> Result<Source> {
    let folder = tempfile::tempdir().expect("a scratch folder");
    let path = folder.path().join("source");
    fs::write(&path, bytes).expect("a scratch file");
    read_source(&path)
}

fn mesh(bytes: &[u8]) -> TriangleMesh {
    match read_bytes(bytes) {
        Ok(Source::Mesh(mesh)) => mesh,
        other => panic!("{:?} gave {other:?}", String::from_utf8_lossy(bytes)),
    }
}

fn cloud(bytes: &[u8]) -> Vec<[f64; 3]> {
    match read_bytes(bytes) {
        Ok(Source::Cloud(cloud)) => cloud.positions,
        other => panic!("{:?} gave {other:?}", String::from_utf8_lossy(bytes)),
    }
}

fn corners(mesh: &TriangleMesh) -> Vec<[[f64; 3]; 3]> {
    (0..mesh.len()).map(|n| mesh.corners(n)).collect()
}

/// The message for an unusable file: one short sentence that names the file and leads to exit code 2.
fn refusal(bytes: &[u8]) -> String {
    let shown = String::from_utf8_lossy(&bytes[..bytes.len().min(300)]).into_owned();
    let error = read_bytes(bytes).expect_err(&shown);
    assert_eq!((error.kind(), error.exit_code()), (ErrorKind::Input, 2), "{error}");
    assert!(error.path().is_some_and(|p| p.ends_with("source")), "{error}");
    let message = error.to_string();
    assert!(message.chars().count() < 400 && !message.contains(['\n', '\0']), "{message}");
    message
}

fn assert_refused(cases: &[(&str, &[&str])]) {
    for (text, reasons) in cases {
        let message = refusal(text.as_bytes());
        for reason in *reasons {
            assert!(message.contains(reason), "{text:?}: {message} lacks {reason:?}");
        }
    }
}

/// A mesh whose coordinates are the same in f32, so that formats of either width must agree.
fn model() -> TriangleMesh {
    meshes::cuboid([-1.5, 0.25, 2.0], [3.0, 1024.5, 2.125])
}

#[test]
fn every_format_gives_the_same_triangles() {
    let model = model();
    for form in Form::ALL {
        let found = mesh(&form.write(&model));
        assert_eq!(corners(&found), corners(&model), "{form:?}");
        assert!(found.boundary_edges().is_closed() && found.boundary_edges().is_oriented(), "{form:?}");
    }
}

#[test]
fn every_row_of_the_table_claims_its_files_alone() {
    let model = model();
    let mut claimed: Vec<&str> = Vec::new();
    let tables = [
        ("CSV", &b"x,y,z\n1,2,3\n"[..]),
        ("XYZ", b"1 2 3\n"),
        ("XYZ", b"s x y z\n1 2 3 4\n"),
        ("ROI", b"Iout\0\xe3"),
        ("ROI set", b"PK\x03\x04"),
    ];
    let files = Form::ALL.map(|form| (form.format(), form.write(&model)));
    for (name, file) in files.into_iter().chain(tables.map(|(name, text)| (name, text.to_vec()))) {
        let names: Vec<_> = FORMATS.iter().filter(|f| (f.sniff)(&file)).map(|f| f.name).collect();
        assert_eq!(names, [name], "{:?}", String::from_utf8_lossy(&file));
        claimed.push(name);
    }
    for format in FORMATS {
        assert!(claimed.contains(&format.name), "no file of {}", format.name);
        assert!(!(format.sniff)(b"") && !(format.sniff)(b"\0") && !(format.sniff)(&[0xff; 200]), "{}", format.name);
    }
}

#[test]
fn text_keeps_f64() {
    let third = [1.0 / 3.0, -1e-7 / 3.0, 1e9 / 3.0];
    let mut model = model();
    model.vertices[0] = third;
    for form in Form::ALL.into_iter().filter(|form| form.keeps_f64()) {
        assert_eq!(corners(&mesh(&form.write(&model))), corners(&model), "{form:?}");
    }
}

#[test]
fn dialects_of_obj() {
    let square = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    let expected = [[square[0], square[1], square[2]], [square[0], square[2], square[3]]];
    let v = "v 0 0 0\nv 1 0 0 1.0\nv 1 1 0 0.5 0.5 0.5 # red\r\n\tv  0\t1 0\n";
    for text in [
        format!("{v}f 1 2 3 4\n"),
        format!(
            "# by hand\n\nmtllib a.mtl\no a\n{v}vn 0 0 1\nvt 0 0\ng a b\nusemtl c\ns off\nf 1/1/1 2/1/1 3/1/1 4/1/1"
        ),
        format!("{v}f 1//1 2//1 3//1 4//1\nl 1 2\np 3\n"),
        format!("{v}f -4 -3/1 -2 -1\n"),
        format!("{v}f 1 2 \\\n 3 4\n"),
        format!("\u{feff}{v}f 1 2 3\nf 1/ 3/ 4/\n"),
        format!("f 1 2 3 4\n{v}"),
    ] {
        assert_eq!(corners(&mesh(text.as_bytes())), expected, "{text:?}");
    }
    assert_eq!(cloud(v.as_bytes()), square);
}

#[test]
fn dialects_of_off() {
    let v = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";
    let expected = corners(&mesh(format!("OFF\n4 1 0\n{v}4 0 1 2 3\n").as_bytes()));
    assert_eq!(expected.len(), 2);
    for text in [
        format!("OFF 4 2\n{v}3 0 1 2\n3 0 2 3"),
        format!("# by hand\nOFF # cube\r\n\n4 1 0\r\n\n# vertices\n{v}\n4 0 1 2 3 0.5 0.5 0.5\n"),
        format!("COFF\n4 1 4\n{}4 0 1 2 3\n", v.replace('\n', " 255 0 0 255\n")),
        format!("NOFF 4 1 4\n{}4  0 1 2 3 3\n", v.replace('\n', " 0 0 1\n")),
        format!("STCNOFF\n4 1 4\n{}4 0 1 2 3\n\n", v.replace('\n', " 0 0 1 0 0 0 1 0 0\n")),
    ] {
        assert_eq!(corners(&mesh(text.as_bytes())), expected, "{text:?}");
    }
    assert_eq!(cloud(format!("OFF\n4 0 0\n{v}").as_bytes()).len(), 4);
}

#[test]
fn dialects_of_ply_faces() {
    let head = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n";
    let v = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";
    let face =
        "element face 1\nproperty uchar red\nproperty list uchar float uv\nproperty list uint uint vertex_index\n";
    let text = format!("{head}{face}property short q\nend_header\n{v}9 2 0.5 0.5 4 0 1 2 3 -7\n");
    assert_eq!(mesh(text.as_bytes()).triangles, [[0, 1, 2], [0, 2, 3]]);
    let between = "element edge 1\nproperty int a\nelement face 1\nproperty list int8 int8 vertex_indices\n";
    let text = format!("{head}{between}end_header\n{v}\n5\n3 3 1 2\n");
    assert_eq!(mesh(text.as_bytes()).triangles, [[3, 1, 2]]);
    // Faces before vertices.
    let (start, vertices) = head.split_at(head.find("element").unwrap());
    let text = format!(
        "{start}{}{vertices}end_header\n3 3 1 2\n{v}",
        between.split_at(between.find("element face").unwrap()).1
    );
    assert_eq!(mesh(text.as_bytes()).triangles, [[3, 1, 2]]);
    assert_eq!(cloud(format!("{head}end_header\n{v}").as_bytes()).len(), 4);
    let none = "element face 0\nproperty list uchar int vertex_indices\n";
    assert_eq!(cloud(format!("{head}{none}end_header\n{v}").as_bytes()).len(), 4);
}

#[test]
fn dialects_of_stl() {
    let facet = |normal: &str| {
        format!(
            "  FACET NORMAL {normal}\n outer loop\nvertex 0 0 1e0\r\n\tvertex 1 0 0\nVertex 0 .5 0\nendloop\n\nendfacet\n"
        )
    };
    let expected = [[[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 0.5, 0.0]]];
    assert_eq!(corners(&mesh(format!("solid\n{}endsolid", facet("0 0 1")).as_bytes())), expected);
    let two = format!("Solid a # 1\n{0}endsolid a # 1\nsolid b\n{0}endsolid b\n", facet("nan nan nan"));
    assert_eq!(corners(&mesh(two.as_bytes())), [expected[0], expected[0]]);
    // A binary file may start like a text.
    let mut binary = Form::StlBinary.write(&model());
    binary[..6].copy_from_slice(b"solid ");
    assert_eq!(corners(&mesh(&binary)), corners(&model()));
}

#[test]
fn unusable_text_is_refused_with_line_and_reason() {
    assert_refused(&[
        ("", &["is empty", "PLY, OFF, STL, OBJ, CSV, XYZ"]),
        (
            "nothing but words\n",
            &["neither a point cloud nor a mesh", "line 1", "'nothing but words'", "x, y, z", "OBJ, CSV"],
        ),
        ("# settings\n\n[package]\nname = \"a\"\n", &["neither a point cloud nor a mesh", "line 3, '[package]'"]),
        ("name,age\nx,7\n", &["neither a point cloud nor a mesh", "line 1, 'name,age'"]),
        // One that names a coordinate means to be a table.
        ("x,y\n1,2\n", &["line 1", "not z"]),
        ("v 1 2\n", &["line 1", "no z"]),
        ("v 1 2 3\nv 1 b 3\n", &["line 2", "y is 'b'"]),
        ("v 1 2 nan\n", &["line 1", "z is 'nan'", "not finite"]),
        ("v 1 2 1e999\n", &["line 1", "not finite"]),
        ("o name\n", &["holds no point"]),
        ("v 0 0 0\nf 1 1 1\nf 1 2 1\n", &["line 3", "vertex '2'", "1 to 1"]),
        ("v 0 0 0\nf 1 0 1\n", &["line 2", "vertex '0'"]),
        ("v 0 0 0\nf 1 -2 1\n", &["line 2", "vertex '-2'"]),
        ("v 0 0 0\nf 1 a 1\n", &["line 2", "'a'"]),
        ("v 0 0 0\nf 1 99999999999 1\n", &["line 2", "'99999999999'"]),
        ("v 0 0 0\n7 8 9\n", &["line 2", "'7 8 9'"]),
        ("v 0 0 0\nf 1 1 1 \\", &["line 2", "cut off"]),
        ("v 0 0 0\nv 1 0 0\rv 2 0 0\n", &["line 2", "carriage return"]),
        ("OFF\n", &["without counts"]),
        ("OFF BINARY\n\0\0\0\u{8}", &["binary OFF"]),
        ("4OFF\n1 0 0\n1 2 3 4\n", &["'4OFF'"]),
        ("OFF\n-3 1 0\n", &["line 2", "'-3 1 0'"]),
        ("OFF\n3 1 0\n0 0 0\n1 0 0\n0 0 1\n", &["1 faces but ends after 0"]),
        ("OFF\n3 0 0\n0 0 0\n1 0 0 0 0 0\n", &["3 vertices but ends after 2"]),
        ("OFF\n1000000000 1000000000 0\n0 0 0\n", &["1000000000 vertices", "too few"]),
        ("OFF\n18446744073709551615 18446744073709551615 0\n", &["can be numbered"]),
        ("OFF\n3 1 0\n0 0 0\n1 0 inf\n0 1 0\n3 0 1 2\n", &["line 4", "z is 'inf'"]),
        ("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n", &["line 6", "vertex 3 of 3"]),
        ("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n", &["line 6", "vertex -1 of 3"]),
        ("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1.5 1\n", &["line 6", "vertex 1.5"]),
        ("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n4000000000 0 1 2\n", &["line 6", "no face"]),
        ("OFF\n0 0 0\n", &["holds no point"]),
        ("solid a\nendsolid a\n", &["without a triangle"]),
        ("solid a\n", &["line 1", "without endsolid"]),
        ("solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n", &["inside a facet", "line 4"]),
        ("solid a\nfacet\nouter loop\nvertex 0 0 0\nvertex 0 0 1\nendloop\n", &["line 6", "needs vertex"]),
        ("solid a\nfacet\nouter loop\nvertex 0 0 nan\n", &["line 4", "not finite"]),
        ("solid a\nfacet\nouter loop\nvertex 0 0\n", &["line 4", "no z"]),
        ("solid a\nvertex 0 0 0\n", &["line 2", "facet or endsolid"]),
        ("solid a\nendsolid\nfacet\n", &["line 3", "needs solid"]),
    ]);
}

#[test]
fn text_without_line_ends_is_refused() {
    for start in ["v 1 2 3\nv ", "OFF\n3 1 0\n", "solid a\n"] {
        let message = refusal(&[start.as_bytes(), &vec![b'7'; 2_000_000]].concat());
        assert!(message.contains("is longer"), "{message}");
    }
    // Each line is short, but they go on in one another for ever.
    assert!(refusal(&[&b"v 1 2 3\n"[..], &b"f 1 1 1 \\\n".repeat(300_000)].concat()).contains("goes on for more"));
}

#[test]
fn ply_faces_that_lie_are_refused() {
    let file = |faces: &str, rest: &str| {
        format!(
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n{faces}\
             end_header\n0 0 0\n1 0 0\n0 1 0\n{rest}"
        )
    };
    let one = "element face 1\nproperty list uchar int vertex_indices\n";
    for (faces, rest, reasons) in [
        (one, "3 0 1 3\n", &["line 13", "vertex 3 of 3"][..]),
        (one, "3 0 1 -1\n", &["line 13", "vertex -1"]),
        (one, "3 0 1\n", &["line 13", "'3 0 1'"]),
        (one, "3 0 1 2 7\n", &["line 13", "as declared"]),
        (one, "-3 0 1\n", &["line 13", "length"]),
        (one, "1e18 0 1\n", &["line 13", "as declared"]),
        (one, "nan 0 1\n", &["line 13", "length"]),
        (one, "  \n", &["1 faces but ends after 0"]),
        ("element face 1\nproperty int a\n", "3\n", &["no list vertex_indices"]),
        ("element face 1\nproperty int vertex_indices\n", "3\n", &["no list vertex_indices"]),
        (
            "element face 1000000000\nproperty list uchar int vertex_indices\n",
            "3 0 1 2\n",
            &["1000000000 faces", "too few"],
        ),
    ] {
        let message = refusal(file(faces, rest).as_bytes());
        assert!(reasons.iter().all(|reason| message.contains(reason)), "{rest:?}: {message}");
    }
    let mut binary = Form::PlyLittle.write(&model());
    let end = binary.len();
    assert!(refusal(&binary[..end - 1]).contains("face 11"));
    binary[end - 4..].copy_from_slice(&(-7_i32).to_le_bytes());
    let message = refusal(&binary);
    assert!(message.contains("face 11") && message.contains("vertex -7 of 8"), "{message}");
    binary[end - 13] = 255;
    assert!(refusal(&binary).contains("face 11"));
}

#[test]
fn binary_stl_that_lies_is_refused() {
    let file = Form::StlBinary.write(&model());
    for bytes in [&file[..file.len() - 1], &file[..file.len() - 50], &file[..100]] {
        let message = refusal(bytes);
        assert!(message.contains("12 triangles") && message.contains(&format!("has {}", bytes.len())), "{message}");
    }
    let mut billion = file[..134].to_vec();
    billion[80..84].copy_from_slice(&1_000_000_000_u32.to_le_bytes());
    assert!(refusal(&billion).contains("declares 1000000000 triangles"));
    assert!(refusal(&[&file[..80], &[0; 4]].concat()).contains("without a triangle"));
    for bad in [f32::NAN, f32::INFINITY] {
        let mut file = file.clone();
        file[84 + 50 + 12..][..4].copy_from_slice(&bad.to_le_bytes());
        let message = refusal(&file);
        assert!(message.contains("triangle 1 ") && message.contains("byte 134"), "{message}");
    }
    assert!(refusal(&[0xb5; 5000]).contains("line 1"));
    assert!(refusal(&[5; 5000]).contains("binary data"));
    assert!(refusal(&vec![0; 100_000]).contains("binary data"));
    assert!(refusal(b"II*\0\x08\0\0\0").contains("is a TIFF file, and no points or mesh"));
    assert!(refusal(b"\xff\xfev\0 \0").contains("line 1"));
}

/// Flat and repeated triangles are sources like any other.
#[test]
fn triangles_without_area_are_kept() {
    let flat = TriangleMesh::new(vec![[1.0; 3], [2.0; 3]], vec![[0, 0, 0], [0, 1, 0], [0, 1, 0]]).unwrap();
    for form in Form::ALL {
        assert_eq!(corners(&mesh(&form.write(&flat))), corners(&flat), "{form:?}");
    }
}

/// Damaged files give sources or a refusal: no panic, nothing that is not finite, no index out of range.
#[test]
fn damaged_bytes_never_panic() {
    let seed = 0x5eed ^ u64::from(std::process::id());
    println!("seed {seed}");
    let mut random = Random(seed);
    let files = Form::ALL.map(|form| form.write(&model()));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("source");
    for _ in 0..4000 {
        let file = damaged(&mut random, &files, b"\n\r\t /-0123456789#\\\xff\0");
        fs::write(&path, &file).unwrap();
        match read_source(&path) {
            Ok(Source::Mesh(mesh)) => {
                assert!(!mesh.is_empty() && mesh.len() <= file.len() && mesh.vertices.len() <= file.len());
                assert!(TriangleMesh::new(mesh.vertices, mesh.triangles).is_ok());
            }
            Ok(Source::Cloud(cloud)) => {
                assert!(!cloud.is_empty() && cloud.positions.iter().flatten().all(|x| x.is_finite()));
            }
            Err(error) => assert_eq!(error.kind(), ErrorKind::Input, "{error}"),
        }
    }
}

#[test]
fn real_files_have_their_triangles() {
    check_mesh(&shipped("meshes/pilot-whale-cranium-10k.ply"), 5000, 10_000, true);
    check_mesh(&shipped("meshes/demosthenes-low-res.obj"), 8394, 16_719, false);
    check_mesh(&shipped("meshes/gastruloid.ply"), 3324, 6643, false);
    check_cloud(&shipped("points/pilot-whale-cranium-5k.xyz"), 5000);
}

#[test]
fn more_real_files_have_their_triangles() {
    for (name, vertices, triangles) in
        [("meshes/pilot-whale-cranium.ply", 50_000, 100_000), ("meshes/teddy-cgal-bear.off", 13_826, 27_648)]
    {
        let Some(path) = shared_data(name) else { return };
        check_mesh(&path, vertices, triangles, true);
    }
    for (name, count) in [("points/kitten.xyz", 5210), ("points/whale-cranium-vertices.xyz", 50_000)] {
        let Some(path) = shared_data(name) else { return };
        check_cloud(&path, count);
    }
}

fn check_mesh(path: &Path, vertices: usize, triangles: usize, is_closed: bool) {
    let name = path.display();
    let Source::Mesh(mesh) = read_source(path).expect("it is read") else { panic!("{name} is no mesh") };
    assert_eq!((mesh.vertices.len(), mesh.len()), (vertices, triangles), "{name}");
    let edges = mesh.boundary_edges();
    assert_eq!((edges.is_closed(), edges.is_oriented()), (is_closed, true), "{name}: {edges:?}");
    println!("{name}: {edges:?}, bounds {:?}", mesh.bounds());
}

fn check_cloud(path: &Path, count: usize) {
    let name = path.display();
    let Source::Cloud(cloud) = read_source(path).expect("it is read") else { panic!("{name} is no cloud") };
    assert_eq!(cloud.len(), count, "{name}");
}
