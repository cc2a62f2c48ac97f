//! Distances to real meshes against libigl, through `scripts/check_mesh_distance.py`: exact beside the surface, nearly
//! so elsewhere, signs right.

#![allow(clippy::unwrap_used)]

use crate::common::ball::Bench;
use crate::common::{meshes, python, shared_data};

/// File, `--spacing` (about 120 voxels along the longest side), whether it is closed.
const MESHES: [(&str, &str, bool); 3] = [
    ("teddy-cgal-bear.off", "0.018", true),
    ("pilot-whale-cranium.ply", "0.0055", true),
    ("demosthenes-low-res.obj", "0.03", false),
];

#[test]
fn real_meshes_have_the_distances_of_libigl() {
    let Some(data) = shared_data("meshes") else { return };
    let Some(interpreter) = python::interpreter() else { return };
    let bench = Bench::bare();
    for (name, spacing, closed) in MESHES {
        let (mesh, store) = (data.join(name), bench.path("out/d.zarr"));
        let signed = if closed { "--signed" } else { "" };
        let flags = format!("--spacing {spacing} {signed} -q --overwrite -o out/d.zarr");
        let output = bench.command("distance").arg(&mesh).args(flags.split_whitespace()).output().unwrap();
        assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
        let checked = python::run_script(interpreter, "check_mesh_distance.py", &[&store, &mesh]);
        println!("{name}\n{}", checked.unwrap_or_else(|text| panic!("{name}: {text}")));
    }
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
