//! Distances to real meshes against libigl, through `scripts/check_mesh_distance.py`: exact beside the surface, nearly
//! so elsewhere, everywhere with `--exact`; signs right.

#![allow(clippy::unwrap_used)]

use std::path::Path;

use glam::DVec3;

use crate::common::ball::Bench;
use crate::common::lab::PlainGrid;
use crate::common::stores::{contents, same, volume};
use crate::common::{meshes, python, shared_data, shipped};

// Spacings give about 120 voxels along the longest side.

#[test]
fn real_meshes_have_the_distances_of_libigl() {
    check_mesh(&shipped("meshes/pilot-whale-cranium-10k.ply"), "--spacing 0.0055 --signed");
    check_mesh(&shipped("meshes/demosthenes-low-res.obj"), "--spacing 0.03");
    check_mesh(&shipped("meshes/pilot-whale-cranium-10k.ply"), "--spacing 0.0055 --signed --exact");
    check_mesh(&shipped("meshes/demosthenes-low-res.obj"), "--spacing 0.04 --exact --labels");
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

/// Exact distances of points and a mesh: those of a look at all sources, with their labels, as far as asked; no bit depends on the layout.
#[test]
fn exact_distances_are_those_of_all_sources_in_any_layout() {
    let bench = Bench::bare();
    let sphere = meshes::sphere([0.3, -2.0, 0.1], 1.0, 24, std::f64::consts::PI);
    std::fs::write(bench.path("sphere.stl"), meshes::Form::StlBinary.write(&sphere)).unwrap();
    let points: Vec<[f64; 3]> =
        (0..60).map(|n| [2.0_f64, 3.0, 5.0].map(|root| 4.0 * (f64::from(n) * root.sqrt()).fract() - 2.0)).collect();
    let lines: Vec<String> = points.iter().map(|[x, y, z]| format!("{x} {y} {z}")).collect();
    std::fs::write(bench.path("cloud.xyz"), lines.join("\n")).unwrap();
    let run = "distance cloud.xyz sphere.stl --origin=-2,-3,-1 --spacing 0.11,0.1,0.13 --shape 37,41,30 --exact --labels --closest-point";
    let limit = " --max-distance 0.7";
    for (name, flags) in [("a", ""), ("b", " --brick 16 --threads 1"), ("c", " --ranks 3"), ("far", limit)] {
        bench.succeed(&format!("{run}{flags} -q -o {name}.zarr"));
    }
    let read = |name: &str, part: &str| volume(&bench.path(name).join(part));
    let of_a = contents(&bench.path("a.zarr"));
    for other in ["b.zarr", "c.zarr"] {
        same(&of_a, &contents(&bench.path(other)), other);
    }
    let (distances, labels) = (read("a.zarr", ""), read("a.zarr", "labels/nearest"));
    let (limited, limited_labels) = (read("far.zarr", ""), read("far.zarr", "labels/nearest"));
    let grid = PlainGrid { shape: [37, 41, 30] };
    for (at, [x, y, z]) in grid.voxels().enumerate() {
        let here = DVec3::new(-2.0 + 0.11 * x as f64, -3.0 + 0.1 * y as f64, -1.0 + 0.13 * z as f64);
        let to_cloud = points.iter().map(|p| here.distance(DVec3::from(*p))).fold(f64::INFINITY, f64::min);
        // The facets of the sphere lie within it, by 1 - cos of half the angle between its corners.
        let to_sphere = ((here - DVec3::new(0.3, -2.0, 0.1)).length() - 1.0).abs();
        let (found, label) = (distances[at], labels[at]);
        if label == 1.0 {
            assert!((found - to_cloud).abs() < 1e-6, "{here}: {found} of {to_cloud}");
        } else {
            assert!(
                label == 2.0 && found < to_cloud + 1e-6 && (found - to_sphere).abs() < 0.03,
                "{here}: {found} of {to_sphere}"
            );
        }
        let expected = if found < f64::from(0.7_f32) { (found, label) } else { (f64::from(0.7_f32), 0.0) };
        assert_eq!((limited[at], limited_labels[at]), expected, "{here}");
    }
    let refused = bench.fail("distance cloud.xyz --exact --method fsm -o x.zarr", 2);
    assert!(refused.contains("--exact") && refused.contains("--method"), "{refused}");
}
