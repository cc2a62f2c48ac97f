//! PLY meshes as another library reads them back.

use std::fs::{self, File};
use std::io::BufReader;
use std::path::Path;

use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{DefaultElement, Ply, Property};
use strandline::io::geometry::write::ply::PlyWriter;
use strandline::store::MeshSink;

use crate::common::mesh_buffer::MeshBuffer;
use crate::common::read_cloud;

fn tetrahedron() -> MeshBuffer {
    MeshBuffer {
        vertices: vec![[0.5, -1.0, 2.0], [1.5, 0.0, 2.25], [0.1, 3.0, f32::MAX], [1e-30, 0.0, -7.0]],
        triangles: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
    }
}

fn write(mesh: &MeshBuffer, path: &Path, unit: Option<&str>) {
    let mut writer = PlyWriter::create(path, unit).expect("a new file");
    // Vertices and triangles come mixed, as the patches bring them.
    let mut vertices = mesh.vertices.iter();
    let mut given = 0;
    for &triangle in &mesh.triangles {
        while given <= triangle.into_iter().max().unwrap_or(0) {
            writer.vertex(vertices.next().expect("vertices enough").map(f64::from)).expect("room for a vertex");
            given += 1;
        }
        writer.triangle(triangle).expect("room for a triangle");
    }
    writer.finish().expect("a whole file");
}

fn parse(path: &Path) -> (Ply<DefaultElement>, MeshBuffer) {
    let file = File::open(path).expect("the file that was written");
    let ply = Parser::<DefaultElement>::new().read_ply(&mut BufReader::new(file)).expect("valid PLY");
    let coordinate = |vertex: &DefaultElement, name: &str| match vertex[name] {
        Property::Float(value) => value,
        ref other => panic!("{other:?}"),
    };
    let vertices = ply.payload["vertex"].iter().map(|v| ["x", "y", "z"].map(|name| coordinate(v, name))).collect();
    let corners = |face: &DefaultElement| match &face["vertex_indices"] {
        Property::ListInt(corners) => [0, 1, 2].map(|i| u32::try_from(corners[i]).expect("a positive index")),
        other => panic!("{other:?}"),
    };
    let triangles = ply.payload["face"].iter().map(corners).collect();
    (ply, MeshBuffer { vertices, triangles })
}

#[test]
fn another_reader_finds_the_same_mesh() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.ply");
    write(&tetrahedron(), &path, Some("micrometer"));
    let (ply, mesh) = parse(&path);
    assert_eq!(mesh, tetrahedron());
    assert!(ply.header.comments.iter().any(|c| c.trim() == "unit micrometer"), "{:?}", ply.header.comments);
    let cloud = read_cloud(&path).unwrap();
    assert_eq!(cloud.positions, tetrahedron().vertices.iter().map(|v| v.map(f64::from)).collect::<Vec<_>>());
}

#[test]
fn an_empty_mesh_is_a_valid_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.ply");
    PlyWriter::create(&path, None).unwrap().finish().unwrap();
    let text = String::from_utf8(fs::read(&path).unwrap()).unwrap();
    assert!(text.contains("element vertex 0\n") && text.ends_with("end_header\n"), "{text}");
}

#[test]
fn nothing_is_left_of_an_unfinished_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.ply");
    fs::write(&path, "the former file").unwrap();
    let mut writer = PlyWriter::create(&path, None).unwrap();
    writer.vertex([1.0; 3]).unwrap();
    drop(writer);
    assert_eq!(fs::read_to_string(&path).unwrap(), "the former file");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    write(&tetrahedron(), &path, None);
    assert_eq!(parse(&path).1, tetrahedron());
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[cfg(unix)]
#[test]
fn the_file_has_the_permissions_of_any_new_file() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let [mesh, other] = ["mesh.ply", "other"].map(|name| folder.path().join(name));
    write(&tetrahedron(), &mesh, None);
    File::create(&other).unwrap();
    let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode();
    assert_eq!(mode(&mesh), mode(&other));
}

#[test]
fn an_unwritable_place_is_named() {
    let error = PlyWriter::create(Path::new("/nowhere/at/all/mesh.ply"), None).unwrap_err();
    assert!(error.to_string().starts_with("/nowhere/at/all/mesh.ply: the mesh cannot be written"), "{error}");
    assert_eq!(error.exit_code(), 1);
}

#[test]
fn a_mesh_larger_than_any_buffer() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.ply");
    let strip = MeshBuffer {
        vertices: (0..60_000_u16).map(|i| [f32::from(i), f32::from(i % 2), 0.0]).collect(),
        triangles: (0..59_998).map(|i| [i, i + 1, i + 2]).collect(),
    };
    write(&strip, &path, Some("a unit\nwith a line end"));
    assert_eq!(parse(&path).1, strip);
}
