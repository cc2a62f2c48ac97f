//! Clouds as scanners give them: merged scans, outliers, dense parts, thin bodies. What is enclosed is found, or what to do
//! is said.

#![allow(clippy::unwrap_used)]

use std::f64::consts::PI;

use crate::common::ball::Bench;
use crate::common::clouds::sphere;
use crate::common::random::Random;

fn write(bench: &Bench, name: &str, cloud: &[[f64; 3]]) {
    let lines: Vec<String> = cloud.iter().map(|[x, y, z]| format!("{x} {y} {z}")).collect();
    bench.write(name, &lines.join("\n"));
}

/// The points of a cloud once more, each moved by a random step of some size.
fn again(cloud: &[[f64; 3]], step: f64, seed: u64) -> Vec<[f64; 3]> {
    let mut random = Random(seed);
    cloud.iter().map(|p| p.map(|v| v + step * (2.0 * random.unit() - 1.0))).collect()
}

/// The result has to be that of the scan alone: a ball of radius 1, 500 points, on a grid of about 0.076.
#[test]
fn merged_scans_outliers_and_dense_parts_change_no_grid() {
    let bench = Bench::bare();
    let once = sphere([0.0; 3], 1.0, 500, |_| true);
    let patch = sphere([0.0; 3], 1.0, 60_000, |d| d[2] > 0.985);
    let clouds = [
        ("once", once.clone()),
        ("copies", [once.clone(), once.clone()].concat()),
        ("1e-4", [once.clone(), again(&once, 1e-4, 3)].concat()),
        ("1e-2", [once.clone(), again(&once, 1e-2, 4)].concat()),
        ("half", [once.clone(), again(&once[..250], 1e-3, 5)].concat()),
        ("patch", [once.clone(), patch].concat()),
    ];
    for (name, cloud) in clouds {
        write(&bench, "cloud.xyz", &cloud);
        bench.succeed("reconstruct cloud.xyz -q -o none --report out/r.json --overwrite");
        let report = bench.json("out/r.json");
        let spacing = report["grid"]["spacing_zyx"][0].as_f64().unwrap();
        assert!((spacing / 0.0762 - 1.0).abs() < 0.1, "{name}: {spacing}");
        let volume = report["result"]["volume"].as_f64().unwrap();
        assert!((volume / (4.0 / 3.0 * PI) - 1.0).abs() < 0.04, "{name}: {volume}");
        assert_eq!(
            (&report["result"]["components"], &report["result"]["lost_points"]),
            (&1.into(), &0.into()),
            "{name}"
        );
    }
    write(&bench, "cloud.xyz", &[once, vec![[30.0, -4.0, 2.0]]].concat());
    bench.succeed("reconstruct cloud.xyz --drop-isolated -q -o none --report out/r.json --overwrite");
    let report = bench.json("out/r.json");
    assert_eq!(report["result"]["cloud_points"], 500);
    assert!((report["grid"]["spacing_zyx"][0].as_f64().unwrap() / 0.0762 - 1.0).abs() < 0.02, "{report}");
}

const EDGE: f64 = 0.6;
const THICK: f64 = 0.1;

/// Points about 0.04 apart on all six sides of a plate, each anywhere in the middle of a square of its own.
fn plate() -> Vec<[f64; 3]> {
    let mut random = Random(5);
    let mut cloud = Vec::new();
    for (across, along, beside) in [(2, 0, 1), (1, 0, 2), (0, 1, 2)] {
        let size = |axis: usize| if axis == 2 { THICK } else { EDGE };
        let count = |axis: usize| (size(axis) / 0.04).round() as usize;
        for side in [0.0, size(across)] {
            for (i, j) in (0..count(along)).flat_map(|i| (0..count(beside)).map(move |j| (i, j))) {
                let mut point = [side; 3];
                for (axis, n) in [(along, i), (beside, j)] {
                    let place = n as f64 + 0.15 + 0.7 * random.unit();
                    point[axis] = place * size(axis) / count(axis) as f64;
                }
                cloud.push(point);
            }
        }
    }
    cloud
}

/// The number that stands behind a flag in a sentence.
fn behind(flag: &str, text: &str) -> f64 {
    let rest = text.split_once(flag).unwrap_or_else(|| panic!("no {flag}: {text}")).1.trim_start();
    let end = rest.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(rest.len());
    rest[..end].trim_end_matches('.').parse().unwrap_or_else(|_| panic!("no number behind {flag}: {text}"))
}

/// A space less deep than its holes are wide is a gap between points, unless a beta is given: the one that is named works.
#[test]
fn a_thin_body_is_told_the_beta_that_works() {
    let bench = Bench::bare();
    write(&bench, "plate.xyz", &plate());
    let said = bench.fail("reconstruct plate.xyz -o none", 2);
    for part in ["plate.xyz", "enclose nothing", " wide at (", "--spacing"] {
        assert!(said.contains(part), "{part}: {said}");
    }
    let beta = behind("--beta", &said);
    bench.succeed(&format!("reconstruct plate.xyz --beta {beta} -q -o none --report out/r.json"));
    let report = bench.json("out/r.json");
    let volume = report["result"]["volume"].as_f64().unwrap();
    assert!((volume / (EDGE * EDGE * THICK) - 1.0).abs() < 0.08, "{volume}");
}

#[test]
fn a_vanished_surface_is_a_failure_that_names_the_beta() {
    let bench = Bench::bare();
    write(&bench, "plate.xyz", &plate());
    for output in ["-o none", "-o none --mesh out/m.ply", "-o out/x.zarr --report out/r.json"] {
        let said = bench.fail(&format!("reconstruct plate.xyz --beta 0.03 {output}"), 1);
        assert!(said.contains("plate.xyz") && said.contains("vanished"), "{said}");
        let beta = behind("such as", &said);
        assert!(0.04 < beta && beta < 0.06, "{said}");
        assert!(bench.entries("out").is_empty(), "{output}: {:?} left", bench.entries("out"));
    }
}

/// A stray point far away makes a long thin grid of many thousand empty bricks, or one that no memory holds.
#[test]
fn far_strays_cost_nothing_or_are_named() {
    let bench = Bench::bare();
    let once = sphere([0.0; 3], 1.0, 500, |_| true);
    write(&bench, "cloud.xyz", &[once.clone(), vec![[1e4, 0.0, 0.0]]].concat());
    bench.succeed("reconstruct cloud.xyz -q -o none --report out/r.json");
    let report = bench.json("out/r.json");
    let volume = report["result"]["volume"].as_f64().unwrap();
    assert!((volume / (4.0 / 3.0 * PI) - 1.0).abs() < 0.04, "{volume}");
    // From the stray point to the surface, straight along x.
    let farthest = report["result"]["hausdorff"]["max"].as_f64().unwrap();
    assert!((farthest - (1e4 - 1.0)).abs() < 0.1, "{farthest}");
    let survey: Vec<[f64; 3]> = once.iter().map(|p| [p[0] + 5e5, p[1] + 4e6, p[2]]).collect();
    write(&bench, "survey.xyz", &[survey, vec![[0.0; 3]]].concat());
    let said = bench.fail("reconstruct survey.xyz -o none", 2);
    assert!(said.contains("survey.xyz: 1 of 501 points") && said.contains("--drop-isolated"), "{said}");
    bench.succeed("reconstruct survey.xyz --drop-isolated -q -o none");
}

#[test]
fn flat_clouds_are_told_to_be_flat() {
    let bench = Bench::bare();
    let tilted = |i: f64, j: f64| [i + 100.0, j, 0.5 * i + 2.0 * j];
    let plane: Vec<_> = (0..400).map(|n| tilted(f64::from(n % 20), f64::from(n / 20))).collect();
    let line: Vec<_> = (0..60).map(|n| tilted(f64::from(n), 0.0)).collect();
    for (cloud, told) in [(plane, "in one plane"), (line, "on one line")] {
        write(&bench, "flat.xyz", &cloud);
        for beta in ["", "--beta 0.9"] {
            let said = bench.fail(&format!("reconstruct flat.xyz -o none {beta}"), 2);
            assert!(said.contains(told) && said.contains("no inside"), "{said}");
        }
    }
}

/// The two faces of a plate without its rim, nearer to each other than their points are: with a beta that lies under the
/// depth by rounding alone nothing is found, within the reach that such a space can have.
#[test]
fn a_beta_that_encloses_nothing_is_told_soon() {
    let bench = Bench::bare();
    let face = |z: f64| (0..441).map(move |n| [0.05 * f64::from(n % 21), 0.05 * f64::from(n / 21), z]);
    write(&bench, "plate.xyz", &face(0.0).chain(face(0.02)).collect::<Vec<_>>());
    let said = bench.fail("reconstruct plate.xyz --beta 0.03 --spacing 0.01 -o none", 2);
    assert!(said.contains("enclose nothing") && said.contains("with --beta 0.03"), "{said}");
}
