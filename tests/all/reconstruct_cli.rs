//! `strandline reconstruct` and `measure` as users run them: what they write, in which formats, and what they refuse.

#![allow(clippy::unwrap_used)]

use std::fs;

use serde_json::json;
use strandline::io::geometry::read::source::Source;
use strandline::io::geometry::read::sources::read_source;
use strandline::kernel::geometry::winding_number::WindingTree;

use crate::common::ball::Bench;
use crate::common::clouds::sphere;
use crate::common::meshes::{self, Form};
use crate::common::stores::volume;

/// A folder with a sphere of radius 2 as a cloud.
fn bench() -> Bench {
    let bench = Bench::bare();
    bench.write("ball.xyz", &lines(&sphere([1.0, 2.0, 3.0], 2.0, 1500, |_| true)));
    bench
}

fn lines(cloud: &[[f64; 3]]) -> String {
    let lines: Vec<String> = cloud.iter().map(|[x, y, z]| format!("{x} {y} {z}")).collect();
    lines.join("\n")
}

#[test]
fn a_run_is_told_and_reported() {
    let bench = bench();
    let printed = bench.succeed("reconstruct ball.xyz -o out/x.zarr --mesh out/m.ply --report out/r.json --threads 2");
    assert!(printed.starts_with("stage ") && printed.contains("closed surface in 1 pieces"), "{printed}");
    assert_eq!(bench.entries("out"), ["m.ply", "r.json", "x.zarr"]);
    assert_eq!(
        fs::read(bench.path("out/m.ply")).unwrap(),
        fs::read(bench.path("out/x.zarr/meshes/surface.ply")).unwrap()
    );
    let told = bench.succeed("info out/x.zarr");
    assert!(told.lines().any(|line| line.starts_with("from ") && line.ends_with("ball.xyz")), "{told}");
    let report = bench.json("out/x.zarr/report.json");
    assert_eq!((&report["command"], &report["result"]["closed"]), (&"reconstruct".into(), &true.into()));
    for key in ["volume", "area", "components", "time_steps", "sor_iterations", "band_voxels", "beta", "stopped_by"] {
        assert!(!report["result"][key].is_null(), "{key}: {report}");
    }
    assert_eq!(bench.json("out/r.json")["result"], report["result"]);
    let measured: serde_json::Value =
        serde_json::from_str(&bench.succeed("measure out/m.ply --points ball.xyz --json")).unwrap();
    for key in ["volume", "area"] {
        let [told, found] = [&report["result"][key], &measured[key]].map(|v| v.as_f64().unwrap());
        assert!((told / found - 1.0).abs() < 1e-5, "{key}: {told}, {found}");
    }
    let mean = |v: &serde_json::Value| v["hausdorff"]["mean"].as_f64().unwrap();
    assert!((mean(&measured) / mean(&report["result"]) - 1.0).abs() < 1e-3, "{measured}");
}

/// A clump of stray points would be a second body.
#[test]
fn points_that_stand_alone_are_left_out() {
    let bench = bench();
    let stray: Vec<[f64; 3]> = (0..40).map(|n| [9.0 + f64::from(n % 4), f64::from(n / 4), 2.0]).collect();
    bench.write("stray.xyz", &format!("{}\n{}", lines(&sphere([1.0, 2.0, 3.0], 2.0, 1500, |_| true)), lines(&stray)));
    bench.succeed("reconstruct stray.xyz --drop-isolated -q -o none --report out/r.json");
    let report = bench.json("out/r.json");
    assert_eq!(report["result"]["cloud_points"], 1500, "{report}");
    assert!(report["notes"][0].as_str().unwrap().starts_with("40 of 1 540 points stand alone"), "{}", report["notes"]);
    assert_eq!((&report["result"]["lost_points"], &report["result"]["components"]), (&0.into(), &1.into()));
    let text = bench.fail("reconstruct stray.xyz --drop-isolated=0 -o none", 2);
    assert!(text.contains("--drop-isolated is 0; it must be a number, more than 0"), "{text}");
}

/// Of a clean ball nothing is taken away, so the flag changes no bit of it; that it was given is told.
#[test]
fn what_is_taken_away_is_told_unless_the_flag_keeps_it() {
    let bench = bench();
    bench.succeed("reconstruct ball.xyz -q -o none --mesh out/a.ply --report out/a.json");
    bench.succeed("reconstruct ball.xyz -q -o none --mesh out/b.ply --report out/b.json --keep-topology");
    let [taken, kept] = ["out/a.json", "out/b.json"].map(|path| bench.json(path));
    let nothing = serde_json::json!({ "handles": 0, "tunnels": 0, "widest": 0.0, "crumbs": 0 });
    assert_eq!((&taken["result"]["removed"], &taken["settings"]["keep_topology"]), (&nothing, &false.into()));
    assert!(kept["result"]["removed"].is_null() && kept["settings"]["keep_topology"] == true, "{kept}");
    assert_eq!(fs::read(bench.path("out/a.ply")).unwrap(), fs::read(bench.path("out/b.ply")).unwrap());
}

/// Every format holds the same surface; the readers of other programs' files read ours.
#[test]
fn meshes_come_in_the_format_of_their_name() {
    let bench = bench();
    let volume = |name: &str| {
        let found: serde_json::Value = serde_json::from_str(&bench.succeed(&format!("measure {name} --json"))).unwrap();
        assert_eq!((&found["closed"], &found["components"]), (&true.into(), &1.into()), "{name}: {found}");
        found["volume"].as_f64().unwrap()
    };
    for name in ["m.ply", "m.obj", "m.STL", "m.vtp"] {
        bench.succeed(&format!("reconstruct ball.xyz -q -o none --mesh out/{name}"));
    }
    let expected = volume("out/m.ply");
    for name in ["out/m.obj", "out/m.STL"] {
        assert!((volume(name) / expected - 1.0).abs() < 1e-6, "{name}");
    }
    let vtp = fs::read(bench.path("out/m.vtp")).unwrap();
    let ply = fs::read(bench.path("out/m.ply")).unwrap();
    let after = |bytes: &[u8], mark: &[u8]| bytes.windows(mark.len()).position(|w| w == mark).unwrap() + mark.len();
    let (at, start) = (after(&vtp, b"raw\">\n_"), after(&ply, b"end_header\n"));
    let length = u64::from_le_bytes(vtp[at..at + 8].try_into().unwrap()) as usize;
    assert_eq!(vtp[at + 8..at + 8 + length], ply[start..start + length], "the points");
    let triangles = (ply.len() - start - length) / 13;
    let head = String::from_utf8_lossy(&vtp[..at]).into_owned();
    assert!(head.contains(&format!("NumberOfPoints=\"{}\" NumberOfPolys=\"{triangles}\"", length / 12)), "{head}");
    let tail = vtp.len() - (at + 8 + length);
    // Of each point the distance from the cloud, in single precision.
    let distances = 8 + length / 3;
    assert_eq!(tail, 8 + 24 * triangles + 8 + 8 * triangles + distances + "\n</AppendedData></VTKFile>\n".len());
}

#[test]
fn meshes_are_measured_as_they_are() {
    let bench = Bench::bare();
    fs::write(bench.path("box.stl"), Form::StlBinary.write(&meshes::cuboid([10.0, 0.0, 0.0], [12.0, 1.0, 3.0])))
        .unwrap();
    bench.write("points.xyz", "11 0.5 4\n10 0 0\n");
    let printed = bench.succeed("measure box.stl --points points.xyz");
    for line in ["closed", "pieces      1", "volume      6", "area        22", "0.5 in the mean, 1 at most"] {
        assert!(printed.contains(line), "{line}: {printed}");
    }
}

#[test]
fn what_cannot_be_done_is_refused_in_a_sentence() {
    let bench = bench();
    bench
        .write("plane.xyz", &lines(&(0..900).map(|n| [f64::from(n % 30), f64::from(n / 30), 0.0]).collect::<Vec<_>>()));
    bench.write("one.xyz", "1 2 3\n1 2 3\n");
    for (arguments, code, words) in [
        ("reconstruct plane.xyz -o out/x.zarr", 2, ["plane.xyz", "enclose nothing"]),
        ("reconstruct one.xyz -o out/x.zarr", 2, ["one.xyz", "one place"]),
        ("reconstruct none.xyz -o out/x.zarr", 2, ["none.xyz", ""]),
        ("reconstruct ball.xyz -o out/x.zarr --spacing 0", 2, ["--spacing", "more than 0"]),
        ("reconstruct ball.xyz -o out/x.zarr --spacing 1e-5", 2, ["--spacing", "memory"]),
        ("reconstruct ball.xyz -o out/x.zarr --spacing 1e-300", 2, ["--spacing", "voxels"]),
        ("reconstruct ball.xyz -o out/x.zarr --beta 0.01", 2, ["--beta 0.01", "leaks"]),
        ("reconstruct ball.xyz -o out/x.zarr --beta -1", 2, ["--beta", "more than 0"]),
        ("reconstruct ball.xyz -o out/x.zarr --noise -1", 2, ["--noise", "0 or more"]),
        ("reconstruct ball.xyz -o out/x.zarr --mesh out/m.xyz", 2, ["m.xyz", ".vtp"]),
        ("reconstruct ball.xyz -o out/x.zarr --memory 1MiB", 2, ["memory", ""]),
        ("measure ball.xyz", 2, ["ball.xyz", "no triangle"]),
    ] {
        let output = bench.run(arguments);
        let complaint = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(code), "{arguments}: {complaint}");
        let said = complaint.lines().filter(|line| line.starts_with("strandline: ")).collect::<Vec<_>>();
        assert_eq!(said.len(), 1, "{arguments}: {complaint}");
        assert!(words.iter().all(|word| said[0].contains(word)), "{arguments}: {complaint}");
        assert!(bench.entries("out").is_empty(), "{arguments}: {:?}", bench.entries("out"));
    }
}

/// A grid that is asked for is the one that fields are written on, also where it cuts what the points enclose.
#[test]
fn fields_lie_on_the_grid_that_is_asked_for() {
    let bench = bench();
    let run = |name: &str, flags: &str| {
        bench.succeed(&format!(
            "reconstruct ball.xyz --spacing 0.25 -q --overwrite -o out/{name}.zarr {flags} --report out/{name}.json"
        ));
        (volume(&bench.path(&format!("out/{name}.zarr"))), bench.json(&format!("out/{name}.json")))
    };
    let (whole, report) = run("whole", "--origin -2.5,-1.5,-0.5 --shape 29,30,31");
    let grid = &report["grid"];
    assert_eq!(
        [&grid["shape_zyx"], &grid["origin_zyx"], &grid["spacing_zyx"]],
        [&json!([31, 30, 29]), &json!([-0.5, -1.5, -2.5]), &json!([0.25, 0.25, 0.25])]
    );
    assert_eq!(whole.len(), 29 * 30 * 31);
    // The surface is where u is 1/2: voxels above that lie inside of it and no others do, up to the rounding of its vertices.
    let told = report["result"]["volume"].as_f64().unwrap();
    let Source::Mesh(surface) = read_source(&bench.path("out/whole.zarr/meshes/surface.ply")).unwrap() else {
        panic!("no mesh")
    };
    let tree = WindingTree::new(&surface);
    let at = |n: usize| [n % 29, n / 29 % 30, n / 29 / 30];
    for (n, &u) in whole.iter().enumerate().filter(|(_, u)| (*u - 0.5).abs() > 1e-3) {
        let [x, y, z] = at(n).map(|v| 0.25 * v as f64);
        let is_inside = tree.winding_number([x - 2.5, y - 1.5, z - 0.5]) > 0.5;
        assert_eq!(u > 0.5, is_inside, "{:?}: {u}", at(n));
    }
    assert!(report["notes"].as_array().unwrap().is_empty(), "{}", report["notes"]);
    // The surface is the same, whatever of it the fields show; they are the same where both grids have a voxel.
    let (half, report) = run("half", "--origin -2.5,-1.5,-0.5 --shape 14,60,31");
    assert_eq!(report["result"]["volume"].as_f64().unwrap(), told);
    assert!(report["notes"].to_string().contains("of 1 500 points lie outside of the grid"), "{}", report["notes"]);
    for (n, &u) in half.iter().enumerate() {
        let (x, y, z) = (n % 14, n / 14 % 60, n / 14 / 60);
        assert_eq!(u, if y < 30 { whole[(z * 30 + y) * 29 + x] } else { 0.0 }, "{x} {y} {z}");
    }
    // The papers' grid: room on every side, one voxel more than it needs.
    let (_, report) = run("padded", "--padding 1");
    assert_eq!(report["grid"]["shape_zyx"], json!([25, 25, 25]));
    // The lowest of 1500 points lies a 1500th part of the radius above the pole (`clouds::sphere`).
    let origin = report["grid"]["origin_zyx"][0].as_f64().unwrap();
    let lowest = 3.0 - 2.0 * (1.0 - 1.0 / 1500.0);
    assert!((origin - (lowest - 1.0)).abs() < 1e-12, "{origin}");
    for (flags, word) in [("--origin 0,0,0", "--shape"), ("--padding -1", "--padding is -1")] {
        let text = bench.run(&format!("reconstruct ball.xyz -o none {flags}"));
        let said = String::from_utf8_lossy(&text.stderr).into_owned();
        assert!(text.status.code() == Some(2) && said.contains(word), "{flags}: {said}");
    }
}
