//! The program on meshes with faults that people's files have: right measures and signs, and a note for each.

#![allow(clippy::unwrap_used)]

use std::f64::consts::PI;
use std::fs;

use serde_json::Value;
use strandline::grid::TriangleMesh;

use crate::common::ball::Bench;
use crate::common::meshes::{self, Form, joined};
use crate::common::polyhedra::notched;
use crate::common::random::Random;
use crate::common::stores::volume;

/// What `measure` prints as JSON of a file with these bytes, and its notes.
fn measured(bytes: &[u8]) -> (Value, String) {
    let bench = Bench::bare();
    fs::write(bench.path("in"), bytes).unwrap();
    let output = bench.run("measure in --json");
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{said}");
    (serde_json::from_slice(&output.stdout).unwrap(), said)
}

fn assert_measures(found: &Value, volume: f64, area: f64) {
    let is = |name: &str, value: f64| (found[name].as_f64().unwrap() / value - 1.0).abs() < 1e-5;
    assert!(is("volume", volume) && is("area", area), "{found}");
    assert_eq!(found["closed"], true, "{found}");
}

fn turned(mut mesh: TriangleMesh) -> TriangleMesh {
    mesh.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
    mesh
}

/// The signed distances of a mesh on a grid of this corner, shape and spacing, and what was said.
fn signed(mesh: &[u8], origin: &str, shape: &str, spacing: &str) -> (Vec<f64>, String) {
    let bench = Bench::bare();
    fs::write(bench.path("in"), mesh).unwrap();
    let flags = format!("--origin {origin} --shape {shape} --spacing {spacing} --signed --precision f64 -o out/d.zarr");
    let output = bench.run(&format!("distance in {flags}"));
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{said}");
    (volume(&bench.path("out/d.zarr")), said)
}

#[test]
fn the_notch_of_a_concave_face_is_empty() {
    let block = notched().obj(&mut Random(3));
    let (found, said) = measured(&block);
    assert_measures(&found, 204.0, 304.0);
    assert!(said.is_empty(), "{said}");
    let (values, _) = signed(&block, "0,0,-2", "21,21,15", "0.5");
    let at = |x: f64, y: f64, z: f64| values[((((z + 2.0) * 2.0) * 21.0 + y * 2.0) * 21.0 + x * 2.0) as usize];
    // The middle of the notch is two from either wall, the block's middle two from its floor's two faces.
    for (x, y, z, expected) in [(5.0, 8.0, 0.0, 2.0), (5.0, 8.0, 1.5, 2.0), (5.0, 5.0, 3.0, 2.0), (1.5, 5.0, 1.5, -1.5)]
    {
        assert!((at(x, y, z) - expected).abs() < 1e-9, "{x} {y} {z}: {}", at(x, y, z));
    }
}

#[test]
fn meshes_that_are_inside_out_are_turned_and_told() {
    let ball = meshes::sphere([0.0; 3], 5.0, 24, PI);
    let (right, said) = measured(&Form::PlyText.write(&ball));
    assert!(said.is_empty() && right["volume"].as_f64().unwrap() > 500.0, "{said}");
    let (found, said) = measured(&Form::PlyText.write(&turned(ball.clone())));
    assert!(said.contains("all of it winds inwards"), "{said}");
    assert_measures(&found, right["volume"].as_f64().unwrap(), right["area"].as_f64().unwrap());
    let inward = Form::StlBinary.write(&turned(ball.clone()));
    let (values, said) = signed(&inward, "-6,-6,-6", "13,13,13", "1");
    assert!(said.contains("winds inwards"), "{said}");
    assert_eq!(values, signed(&Form::StlBinary.write(&ball), "-6,-6,-6", "13,13,13", "1").0);
    assert!((values[values.len() / 2] + 5.0).abs() < 0.05 && values[0] > 5.0);
}

#[test]
fn cavities_stay_and_inverted_pieces_do_not() {
    let cube = |half: f64, at: f64| meshes::cuboid([at - half; 3], [at + half; 3]);
    for (parts, inverted) in [
        ([cube(3.0, 0.0), turned(cube(1.0, 0.0)), cube(1.0, 9.0)], 0),
        ([turned(cube(3.0, 0.0)), cube(1.0, 0.0), cube(1.0, 9.0)], 2),
        ([cube(3.0, 0.0), turned(cube(1.0, 0.0)), turned(cube(1.0, 9.0))], 1),
    ] {
        let bytes = Form::StlText.write(&joined(&parts));
        let (found, said) = measured(&bytes);
        assert_measures(&found, 216.0 - 8.0 + 8.0, 216.0 + 24.0 + 24.0);
        assert_eq!((&found["inverted_pieces"], &found["components"]), (&inverted.into(), &3.into()));
        assert_eq!(said.contains("closed pieces wind the wrong way round"), inverted > 0, "{said}");
        let (values, _) = signed(&bytes, "-4,0,0", "15,1,1", "1");
        let signs: Vec<i32> = values.iter().map(|v| if *v < -1e-9 { -1 } else { i32::from(*v > 1e-9) }).collect();
        assert_eq!(signs, [1, 0, -1, 0, 1, 0, -1, 0, 1, 1, 1, 1, 1, 1, 1], "{values:?}");
    }
}

#[test]
fn doubled_faces_and_faces_that_disagree_are_told() {
    let cube = meshes::cuboid([0.0; 3], [2.0; 3]);
    let mut doubled = cube.clone();
    doubled.triangles.extend_from_slice(&cube.triangles[..3]);
    let (found, said) = measured(&Form::StlBinary.write(&doubled));
    assert_measures(&found, 8.0, 24.0);
    assert!(said.contains("3 triangles are there more than once"), "{said}");
    let (found, said) = measured(&Form::Obj.write(&joined(&[cube.clone(), turned(cube.clone())])));
    assert_measures(&found, 8.0, 24.0);
    assert!(said.contains("both sides outside"), "{said}");
    let mut mixed = cube;
    mixed.triangles[7].swap(0, 1);
    mixed.triangles[2].swap(0, 1);
    let (found, said) = measured(&Form::Off.write(&mixed));
    assert_measures(&found, 8.0, 24.0);
    assert!(said.contains("disagree on what is outside; 2 triangles are turned"), "{said}");
    assert!(found["flipped_edges"].as_u64().unwrap() > 0);
}

/// A CAD program's noise where zero is meant.
#[test]
fn noise_of_coordinates_does_not_open_a_body() {
    let mut block = meshes::cuboid([-1.0, -1.5, 0.0], [1.0, 1.5, 4.0]);
    let mut soup = TriangleMesh::default();
    for n in 0..block.len() {
        soup.vertices.extend(block.corners(n));
        soup.triangles.push([3 * n as u32, 3 * n as u32 + 1, 3 * n as u32 + 2]);
    }
    for (n, vertex) in soup.vertices.iter_mut().enumerate() {
        for x in vertex.iter_mut().filter(|x| **x == 0.0) {
            *x = [0.0, 2.7e-16, -6.1e-33][n % 3];
        }
    }
    let (found, said) = measured(&Form::StlBinary.write(&soup));
    assert_measures(&found, 24.0, 52.0);
    assert_eq!((&found["components"], &found["vertices"]), (&1.into(), &8.into()));
    assert!(said.contains("differ by rounding"), "{said}");
    // A hole is still a hole, and a thin plate still a plate.
    soup.triangles.pop();
    assert_eq!(measured(&Form::StlBinary.write(&soup)).0["boundary_edges"], 3);
    block.vertices.iter_mut().for_each(|v| v[2] *= 1e-6);
    assert_measures(&measured(&Form::Obj.write(&block)).0, 2.0 * 3.0 * 4e-6, 12.0 + 10.0 * 4e-6);
    block.triangles.pop();
    assert_eq!(measured(&Form::Obj.write(&block)).0["boundary_edges"], 3);
}

#[test]
fn headers_and_normals_as_programs_write_them() {
    let block = meshes::cuboid([-1.0, -1.5, -2.0], [1.0, 1.5, 2.0]);
    let off = String::from_utf8(Form::Off.write(&block)).unwrap();
    for header in ["OFF", "\t  OFF", "NCOFF"] {
        let glued = off.replacen("OFF\n", header, 1).replacen(" 0\n", " 0 # or nah\n", 1);
        assert_measures(&measured(glued.as_bytes()).0, 24.0, 52.0);
    }
    let mut ply = String::from("ply\nformat ascii 1.0\nelement vertex 8\n");
    ply.extend(["x", "y", "z", "nx", "ny"].map(|name| format!("property float {name}\n")));
    ply += "element face 12\nproperty list uchar int vertex_indices\nend_header\n";
    ply.extend(block.vertices.iter().map(|[x, y, z]| format!("{x} {y} {z} -nan(ind) -1.#IND\n")));
    ply.extend(block.triangles.iter().map(|[a, b, c]| format!("3 {a} {b} {c}\n")));
    let (found, said) = measured(ply.as_bytes());
    assert_measures(&found, 24.0, 52.0);
    assert!(said.contains("8 of 8 vertices have properties that are no numbers, as nx"), "{said}");
    let (_, silent) = measured(ply.replace("-nan(ind)", "0").replace("-1.#IND", "-1.5e-3").as_bytes());
    assert!(silent.is_empty(), "{silent}");
}
