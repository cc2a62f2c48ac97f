//! Survey coordinates: a run far from zero gives what the same run gives at zero, in every field, file and message.

#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::Path;

use strandline::io::ome_zarr::ImageReader;

use crate::common::ball::Bench;
use crate::common::clouds::sphere;
use crate::common::stores::volume;

/// A national grid, and a place of which one axis counts billions.
const FAR: [[f64; 3]; 2] = [[500_000.0, 4_000_000.0, 100.0], [-1e9, 7.0, 0.0]];

/// A vertex is rounded once where it is, half a unit in the last place of a double near 10^9, and once at zero, where
/// meshes are written in single precision: half a unit below 2. Both are 2^-24.
const MOST_MOVED: f64 = 2.0 / (1 << 24) as f64;

/// A folder with the unit sphere as a cloud, `name.xyz`, at a place. Coordinates are multiples of 2^-20, which f64 keeps
/// wherever they are.
fn write_ball(bench: &Bench, name: &str, at: [f64; 3]) {
    let keep = |v: f64| (v * 1_048_576.0).round() / 1_048_576.0;
    let cloud = sphere([0.0; 3], 1.0, 500, |_| true);
    let line = |p: &[f64; 3]| {
        let [x, y, z]: [f64; 3] = std::array::from_fn(|a| keep(p[a]) + at[a]);
        format!("{x} {y} {z}\n")
    };
    bench.write(&format!("{name}.xyz"), &cloud.iter().map(line).collect::<String>());
}

fn measured(bench: &Bench, mesh: &str) -> [f64; 2] {
    let found: serde_json::Value = serde_json::from_str(&bench.succeed(&format!("measure {mesh} --json"))).unwrap();
    assert_eq!(found["closed"], true, "{mesh}: {found}");
    ["volume", "area"].map(|key| found[key].as_f64().unwrap())
}

/// The vertices of an OBJ file.
fn vertices(path: &Path) -> Vec<[f64; 3]> {
    let text = fs::read_to_string(path).unwrap();
    let place = |line: &str| {
        let words: Vec<f64> = line.split(' ').map(|word| word.parse().unwrap()).collect();
        [words[0], words[1], words[2]]
    };
    text.lines().filter_map(|line| line.strip_prefix("v ")).map(place).collect()
}

fn alike(a: [f64; 2], b: [f64; 2], within: f64) -> bool {
    a.iter().zip(b).all(|(a, b)| (a / b - 1.0).abs() < within)
}

#[test]
fn surfaces_far_from_zero_are_those_at_zero() {
    let bench = Bench::bare();
    write_ball(&bench, "near", [0.0; 3]);
    let run = "--spacing 0.25 -q --overwrite";
    bench.succeed(&format!("reconstruct near.xyz {run} -o out/near.zarr --mesh out/near.obj"));
    let expected = measured(&bench, "out/near.obj");
    let near = vertices(&bench.path("out/near.obj"));
    let field = volume(&bench.path("out/near.zarr"));
    for far in FAR {
        write_ball(&bench, "far", far);
        for ending in ["ply", "obj", "vtp", "stl"] {
            bench.succeed(&format!("reconstruct far.xyz {run} -o out/far.zarr --mesh out/far.{ending}"));
        }
        for mesh in ["out/far.ply", "out/far.obj", "out/far.stl", "out/far.zarr/meshes/surface.ply"] {
            assert!(alike(measured(&bench, mesh), expected, 1e-4), "{far:?} {mesh}: {:?}", measured(&bench, mesh));
        }
        let report = bench.json("out/far.zarr/report.json");
        let told = ["volume", "area"].map(|key| report["result"][key].as_f64().unwrap());
        assert!(alike(told, expected, 1e-4), "{far:?}: {told:?}");
        let same = volume(&bench.path("out/far.zarr"));
        // Coordinates, places and the spacing are such that every difference of them is exact, so the cloud as seen from the
        // grid is the same, and so is every bit of what is computed.
        assert!(same == field, "{far:?}: another field");
        // Every vertex lies where it lies at zero.
        let there = vertices(&bench.path("out/far.obj"));
        assert_eq!(there.len(), near.len(), "{far:?}");
        for (p, q) in there.iter().zip(&near) {
            let off = (0..3).map(|a| (p[a] - far[a] - q[a]).abs()).fold(0.0, f64::max);
            assert!(off <= MOST_MOVED, "{far:?}: {p:?} for {q:?}");
        }
        let vtp = fs::read(bench.path("out/far.vtp")).unwrap();
        assert!(String::from_utf8_lossy(&vtp[..600]).contains("Float64"));
        // What STL is relative to is told by the file and the report.
        let note = report["notes"].to_string();
        let stl = fs::read(bench.path("out/far.stl")).unwrap();
        let head = String::from_utf8_lossy(&stl[..80]).into_owned();
        let anchor = head.strip_prefix("binary STL from ").unwrap().trim().to_owned();
        let numbers: Vec<f64> = anchor.split(',').map(|word| word.parse().unwrap()).collect();
        assert!((0..3).all(|a| (0.0..200.0).contains(&(far[a] - numbers[a]))), "{head}");
        assert!(note.contains(&anchor.replace(',', ", ")) && note.contains("relative to"), "{note}");
    }
    let near = fs::read(bench.path("out/near.zarr/meshes/surface.ply")).unwrap();
    assert!(String::from_utf8_lossy(&near[..300]).contains("property float x"), "near zero f32 is enough");
}

#[test]
fn messages_keep_the_digits_that_matter() {
    let bench = Bench::bare();
    write_ball(&bench, "far", FAR[0]);
    let told = bench.succeed("info far.xyz");
    for line in ["lowest x, y, z   (499999.0", "3999999.00", "highest x, y, z  (500000.99", "4000000.99"] {
        assert!(told.contains(line), "{line}: {told}");
    }
    assert!(!told.contains("0000000") && told.lines().all(|line| line.len() < 70), "{told}");
    // The largest hole lies where it lies at zero, up to the tenth of its width that places of holes are told to.
    write_ball(&bench, "near", [0.0; 3]);
    let [(near, width), (far, _)] = ["near", "far"].map(|name| {
        let printed = bench.succeed(&format!("reconstruct {name}.xyz --spacing 0.25 --overwrite -o out/{name}.zarr"));
        let hole = printed.lines().find(|line| line.starts_with("largest hole")).unwrap().to_owned();
        let numbers = |text: &str| -> Vec<f64> { text.split(", ").map(|word| word.parse().unwrap()).collect() };
        let width = hole.split(": ").nth(1).unwrap().split(' ').next().unwrap().parse::<f64>().unwrap();
        (numbers(hole.split(['(', ')']).nth(1).unwrap()), width)
    });
    assert!((0..3).all(|a| (far[a] - FAR[0][a] - near[a]).abs() <= 0.1 * width), "{far:?} for {near:?}");
    let told = bench.succeed("info out/far.zarr");
    assert!(told.contains(", origin (49999"), "{told}");
}

/// Distances, closest points, and the place of the grid, in the store and read again.
#[test]
fn distances_far_from_zero_are_those_at_zero() {
    let bench = Bench::bare();
    write_ball(&bench, "near", [0.0; 3]);
    let run = "--spacing 0.25 --padding 0.5 --closest-point -q --overwrite";
    for (method, schedule) in [("vdt", "front"), ("dp", "front"), ("fsm", "sweep"), ("fmm", "sweep")] {
        let flags = format!("{run} --method {method} --schedule {schedule}");
        bench.succeed(&format!("distance near.xyz {flags} -o out/near.zarr"));
        let near = volume(&bench.path("out/near.zarr"));
        for far in FAR {
            write_ball(&bench, "far", far);
            bench.succeed(&format!("distance far.xyz {flags} -o out/far.zarr"));
            let found = volume(&bench.path("out/far.zarr"));
            let most = near.iter().zip(&found).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(found.len() == near.len() && most < 1e-5, "{method} {far:?}: {most}");
            let geometry = ImageReader::open(&bench.path("out/far.zarr")).unwrap().levels()[0].geometry.clone();
            let report = bench.json("out/far.zarr/report.json");
            for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
                assert!((geometry.origin[axis] - far[axis] + 1.5).abs() < 0.03, "{:?}", geometry.origin);
                assert_eq!(report["grid"]["origin_zyx"][2 - axis], geometry.origin[axis]);
                let [near, far_points] =
                    ["near", "far"].map(|store| volume(&bench.path(&format!("out/{store}.zarr/closest-point/{name}"))));
                let off = |(near, there): (&f64, &f64)| (there - far[axis] - near).abs();
                let wrong = near.iter().zip(&far_points).map(off).filter(|off| *off > 1e-6).count();
                // Of sources that are equally near another may be named.
                assert!(wrong * 100 <= near.len(), "{method} {far:?} {name}: {wrong}");
            }
        }
    }
}

/// What was rounded before it came cannot be measured any more, which is told.
#[test]
fn shapes_that_single_precision_has_rounded_are_told() {
    let bench = Bench::bare();
    let corner = |n: usize| [0, 1, 2].map(|a| [0.3, 1.6][n >> a & 1]);
    let quads = "4 0 4 6 2\n4 1 3 7 5\n4 0 1 5 4\n4 2 6 7 3\n4 0 2 3 1\n4 4 5 7 6\n";
    let mesh = |kind: &str| {
        let mut text = format!(
            "ply\nformat ascii 1.0\nelement vertex 8\nproperty {kind} x\nproperty {kind} y\nproperty {kind} z\n\
             element face 6\nproperty list uchar int vertex_indices\nend_header\n"
        );
        for n in 0..8 {
            let place: [f64; 3] = std::array::from_fn(|a| corner(n)[a] + FAR[0][a]);
            let [x, y, z] = if kind == "float" { place.map(|x| f64::from(x as f32)) } else { place };
            text.extend([x, y, z].map(|v| format!("{v} ")));
            text.push('\n');
        }
        text + quads
    };
    for (kind, is_told) in [("float", true), ("double", false)] {
        bench.write("box.ply", &mesh(kind));
        for command in ["measure", "info"] {
            let output = bench.run(&format!("{command} box.ply"));
            let said = String::from_utf8([output.stdout, output.stderr].concat()).unwrap();
            assert_eq!(said.contains("single precision numbers, which lie 0.25 apart near 4000002"), is_told, "{said}");
        }
    }
}

/// A prism over an L, whose corner is a millionth of its height: measured in f64, whatever its sides are.
#[test]
fn narrow_bodies_are_measured_in_full() {
    let bench = Bench::bare();
    let corners = [[0, 0], [4, 0], [4, 1], [1, 1], [1, 4], [0, 4]];
    let vertices =
        |z: f64| corners.map(|[x, y]| format!("v {} {} {z}\n", 1e-9 * f64::from(x), 1e-9 * f64::from(y))).concat();
    let sides: Vec<String> = (1..7).map(|n| format!("f {n} {} {} {}\n", n % 6 + 1, n % 6 + 7, n + 6)).collect();
    let sides = sides.concat();
    bench.write("l.obj", &format!("{}{}f 6 5 4 3 2 1\nf 7 8 9 10 11 12\n{sides}", vertices(0.0), vertices(2.0)));
    // Area 7 and circumference 16 of the L, times its height.
    assert!(alike(measured(&bench, "l.obj"), [14e-18, 32e-9 + 14e-18], 1e-9), "{:?}", measured(&bench, "l.obj"));
}
