//! Distances to real meshes against libigl, through `scripts/check_mesh_distance.py`: exact beside the surface, nearly
//! so elsewhere, signs right.

#![allow(clippy::unwrap_used)]

use std::path::Path;

use crate::common::ball::Bench;
use crate::common::{meshes, python, shared_data, shipped};

// Spacings give about 120 voxels along the longest side.

#[test]
fn real_meshes_have_the_distances_of_libigl() {
    check_mesh(&shipped("meshes/pilot-whale-cranium-10k.ply"), "--spacing 0.0055 --signed");
    check_mesh(&shipped("meshes/demosthenes-low-res.obj"), "--spacing 0.03");
}

#[test]
fn more_real_meshes_have_the_distances_of_libigl() {
    for (name, flags) in [
        ("meshes/teddy-cgal-bear.off", "--spacing 0.018 --signed"),
        ("meshes/pilot-whale-cranium.ply", "--spacing 0.0055 --signed"),
    ] {
        let Some(path) = shared_data(name) else { return };
        check_mesh(&path, flags);
    }
}

fn check_mesh(mesh: &Path, flags: &str) {
    let Some(interpreter) = python::interpreter() else { return };
    let (bench, name) = (Bench::bare(), mesh.display());
    let flags = format!("{flags} -q -o out/d.zarr");
    let output = bench.command("distance").arg(mesh).args(flags.split_whitespace()).output().unwrap();
    assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
    let checked = python::run_script(interpreter, "check_mesh_distance.py", &[&bench.path("out/d.zarr"), mesh]);
    println!("{name}\n{}", checked.unwrap_or_else(|text| panic!("{name}: {text}")));
}

/// The check itself works on what is at hand everywhere, and notices a distance to another mesh.
#[test]
fn a_sphere_has_the_distances_of_libigl() {
    let Some(interpreter) = python::interpreter() else { return };
    let bench = Bench::bare();
    for (name, radius) in [("sphere.stl", 1.0), ("larger.stl", 1.02)] {
        let sphere = meshes::sphere([0.3, -2.0, 0.1], radius, 24, std::f64::consts::PI);
        std::fs::write(bench.path(name), meshes::Form::StlBinary.write(&sphere)).unwrap();
    }
    bench.succeed("distance sphere.stl --spacing 0.06,0.05,0.07 --signed -q -o out/d.zarr");
    let check = |mesh: &str| {
        let arguments = [bench.path("out/d.zarr"), bench.path(mesh)];
        python::run_script(interpreter, "check_mesh_distance.py", &[&arguments[0], &arguments[1]])
    };
    println!("{}", check("sphere.stl").unwrap_or_else(|text| panic!("{text}")));
    assert!(check("larger.stl").unwrap_err().contains("not exact"));
}
