//! `strandline distance` as users run it: what it writes, what it reports, what other programs make of it.

#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::Path;

use strandline::grid::Geometry;

use crate::common::ball::{Ball, Bench};
use crate::common::clouds::sponge_and_sphere;
use crate::common::lab::PlainGrid;
use crate::common::meshes::{self, Form};
use crate::common::python;
use crate::common::stores::{contents, same, volume};
use crate::common::textbook::{position, squared};

/// A folder with the Sponge and its sphere as clouds, and two overlapping closed meshes.
fn bench() -> Bench {
    let bench = Bench::bare();
    for (name, cloud) in ["sponge.xyz", "sphere.xyz"].into_iter().zip(sponge_and_sphere()) {
        let lines: Vec<String> = cloud.iter().map(|[x, y, z]| format!("{x} {y} {z}")).collect();
        bench.write(name, &lines.join("\n"));
    }
    let ball = meshes::sphere([0.5, 0.5, 0.0], 1.0, 20, std::f64::consts::PI);
    fs::write(bench.path("ball.off"), Form::Off.write(&ball)).unwrap();
    fs::write(bench.path("box.stl"), Form::StlBinary.write(&meshes::cuboid([-2.0, 0.0, -0.5], [0.0, 1.0, 0.5])))
        .unwrap();
    bench
}

#[test]
fn a_run_is_told_and_reported() {
    let bench = bench();
    let printed = bench.succeed(
        "distance sponge.xyz sphere.xyz --spacing 0.1 --labels --closest-point -o out/x.zarr --report out/r.json \
         --threads 2",
    );
    assert!(printed.starts_with("stage ") && printed.lines().all(|line| line.chars().count() <= 100), "{printed}");
    assert!(
        printed.contains("1 890 voxels fixed by sources, 0 not reached") && printed.contains("label 2: "),
        "{printed}"
    );
    assert_eq!(bench.entries("out"), ["r.json", "x.zarr"]);
    assert_eq!(bench.entries("out/x.zarr/closest-point"), ["x", "y", "z", "zarr.json"]);
    let report = bench.json("out/x.zarr/report.json");
    for key in ["version", "settings", "grid", "ranks", "memory_budget_bytes", "peak_rss_bytes", "seconds", "arguments"]
    {
        assert!(!report[key].is_null(), "{key}: {report}");
    }
    assert_eq!((&report["command"], &report["threads"]), (&"distance".into(), &2.into()));
    assert_eq!(report["grid"]["spacing_zyx"], serde_json::json!([0.1, 0.1, 0.1]));
    let result = &report["result"];
    assert_eq!((&result["fixed_voxels"], &result["unlabelled_voxels"]), (&1890.into(), &0.into()));
    let [z, y, x] = [0, 1, 2].map(|a| report["grid"]["shape_zyx"][a].as_u64().unwrap());
    let labelled: u64 = ["1", "2"].iter().map(|label| result["label_voxels"][label].as_u64().unwrap()).sum();
    assert_eq!(labelled, x * y * z);
    let largest = volume(&bench.path("out/x.zarr")).into_iter().fold(0.0, f64::max);
    assert!((result["max"].as_f64().unwrap() - largest).abs() < 1e-6, "{largest}: {result}");
    assert_eq!(bench.json("out/r.json")["result"], *result);
}

/// A small grid is cut into small bricks whatever the machine; an edge that is asked for is taken.
#[test]
fn bricks_follow_from_the_grid() {
    let bench = bench();
    for (flags, brick) in [("--threads 1", 32), ("--threads 4 --memory 900MiB", 32), ("--brick 64", 64)] {
        bench.succeed(&format!(
            "distance sponge.xyz --method fsm --spacing 0.1 -q -o none --overwrite --report r.json {flags}"
        ));
        assert_eq!(bench.json("r.json")["settings"]["brick"], brick, "{flags}");
    }
}

/// A triangle that covers a layer of cells is measured from the voxels below and above it, once each: two planes of the
/// grid for each triangle. Nothing but the sources and the grid decides that.
#[test]
fn triangle_distances_are_counted_for_each_voxel() {
    let bench = bench();
    let layers = [2.3, 2.4, 9.5];
    let corners = layers.map(|z| format!("-500 -500 {z}\n900 -500 {z}\n-500 900 {z}\n")).concat();
    bench.write("layers.off", &format!("OFF\n9 3 0\n{corners}3 0 1 2\n3 3 4 5\n3 6 7 8\n"));
    let grid = "--origin 0,0,0 --shape 40,37,20 --spacing 1 -q -o none --overwrite --report r.json";
    for flags in [
        "--brick 16 --threads 1",
        "--brick 64 --threads 4",
        "--brick 16 --ranks 3",
        "--schedule sweep",
        "--method dp --ranks 2",
        "--method dp --schedule sweep",
        "--method fsm --brick 16",
        "--method fmm --labels",
        "--method fmm --schedule sweep --labels",
    ] {
        bench.succeed(&format!("distance layers.off sponge.xyz {grid} {flags}"));
        let result = &bench.json("r.json")["result"];
        assert_eq!(result["triangle_distances"], 3 * 2 * 40 * 37, "{flags}: {result}");
    }
    bench.succeed(&format!("distance sponge.xyz {grid}"));
    assert!(bench.json("r.json")["result"]["triangle_distances"].is_null());
    let printed = bench.succeed("distance layers.off --origin 0,0,0 --shape 4,3,20 --spacing 1 -o none");
    assert!(printed.contains("72 distances to triangles"), "{printed}");
}

/// Labels, closest points and distances of one store fit together, and no distance is below that of a plain search.
#[test]
fn fields_fit_together() {
    let bench = bench();
    bench.succeed(
        "distance sponge.xyz sphere.xyz --spacing 0.1,0.12,0.15 --labels --closest-point --precision f64 -q -o \
         out/x.zarr",
    );
    let [distance, label] = ["", "/labels/nearest"].map(|group| volume(&bench.path(&format!("out/x.zarr{group}"))));
    let closest = ["x", "y", "z"].map(|axis| volume(&bench.path(&format!("out/x.zarr/closest-point/{axis}"))));
    let report = bench.json("out/x.zarr/report.json");
    let xyz = |key: &str| [2, 1, 0].map(|a| report["grid"][key][a].as_f64().unwrap());
    let geometry = Geometry {
        shape: xyz("shape_zyx").map(|n| n as i64),
        spacing: xyz("spacing_zyx"),
        origin: xyz("origin_zyx"),
        unit: None,
    };
    let clouds = sponge_and_sphere();
    let nearest =
        |here, cloud: &[[f64; 3]]| cloud.iter().map(|p| squared(here, *p)).fold(f64::INFINITY, f64::min).sqrt();
    for (at, v) in (PlainGrid { shape: geometry.shape }).voxels().enumerate() {
        let here = position(&geometry, v);
        let point = [0, 1, 2].map(|a| closest[a][at]);
        assert!((squared(here, point).sqrt() - distance[at]).abs() < 1e-6, "{v:?}: {point:?}");
        let own = &clouds[label[at] as usize - 1];
        assert!(nearest(point, own) < 1e-6, "{v:?}: {point:?} is no point of {}", label[at]);
        let exact = clouds.iter().map(|cloud| nearest(here, cloud)).fold(f64::INFINITY, f64::min);
        assert!(distance[at] > exact - 1e-12, "{v:?}: {} for {exact}", distance[at]);
    }
}

#[test]
fn layout_threads_and_memory_change_no_bit() {
    let bench = bench();
    for method in ["vdt", "fsm"] {
        let run = |name: &str, flags: &str| {
            let sources = "ball.off sponge.xyz --spacing 0.05 --labels --closest-point";
            bench.succeed(&format!("distance {sources} --method {method} -q --overwrite -o out/{name}.zarr {flags}"));
            contents(&bench.path(&format!("out/{name}.zarr")))
        };
        let first = run("front", "--threads 1");
        same(&first, &run("front-2", "--threads 2 --memory 192MiB"), "front, threads and memory");
        let first = run("sweep", "--schedule sweep --brick 16 --threads 1");
        let other = run("sweep-2", "--schedule sweep --brick 64 --threads 2 --memory 256MiB");
        same(&first, &other, "sweep, bricks and threads");
    }
}

#[test]
fn a_grid_like_an_image_has_its_voxels() {
    let ball = Ball::small();
    let bench = Bench::new(&ball);
    bench.succeed("distance marks.csv --like image.tif -q -o out/x.zarr");
    let report = bench.json("out/x.zarr/report.json");
    assert_eq!(report["grid"]["shape_zyx"], serde_json::json!([20, 36, 40]));
    assert_eq!((&report["grid"]["spacing_zyx"][0], &report["grid"]["unit"]), (&1.0.into(), &"micrometer".into()));
}

#[test]
fn a_band_holds_its_width_beyond() {
    let bench = bench();
    bench.succeed("distance ball.off --spacing 0.1 -q -o out/all.zarr");
    bench.succeed("distance ball.off --spacing 0.1 --max-distance 0.35 -q -o out/band.zarr");
    let [all, band] = ["all", "band"].map(|name| volume(&bench.path(&format!("out/{name}.zarr"))));
    let width = f64::from(0.35_f32);
    assert!(all.iter().any(|&d| d > 2.0 * width));
    assert!(all.iter().zip(&band).all(|(&all, &band)| band == all.min(width)));
}

#[test]
fn nothing_is_written_without_an_output() {
    let bench = bench();
    let output = bench.run("distance sponge.xyz -o none -q");
    assert!(output.status.success() && output.stdout.is_empty() && output.stderr.is_empty());
    let plan = bench.succeed("distance sponge.xyz ball.off --spacing 0.1 --dry-run -o out/x.zarr");
    for word in
        ["231 points", "triangles in 2 data sets", "voxels, spacing (0.1, 0.1, 0.1)", "temporary fields", "memory"]
    {
        assert!(plan.contains(word), "{word}: {plan}");
    }
    assert!(bench.entries("out").is_empty() && bench.entries("scratch").is_empty());
}

/// Open meshes work, with a note.
#[test]
fn open_meshes_are_noted() {
    let bench = bench();
    let bowl = meshes::sphere([0.0; 3], 1.0, 12, 2.0);
    fs::write(bench.path("bowl.off"), Form::Off.write(&bowl)).unwrap();
    let output = bench.run("distance bowl.off --spacing 0.1 --signed -o none --report out/r.json");
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success() && said.contains("bowl.off is open: 24 boundary edges"), "{said}");
    assert!(bench.json("out/r.json")["notes"][0].as_str().unwrap().contains("24 boundary edges"));
}

#[test]
fn info_tells_what_meshes_and_distances_are() {
    let bench = bench();
    let mesh = bench.succeed("info ball.off");
    for word in ["triangle mesh", "1 600", "closed", "true"] {
        assert!(mesh.contains(word), "{word}: {mesh}");
    }
    let json: serde_json::Value = serde_json::from_str(&bench.succeed("info box.stl --json")).unwrap();
    assert_eq!((&json["kind"], &json["triangles"], &json["closed"]), (&"mesh".into(), &12.into(), &true.into()));
    bench.succeed("distance box.stl ball.off --spacing 0.1 --labels --closest-point -q -o out/x.zarr");
    let store = bench.succeed("info out/x.zarr");
    for word in ["float32", "labels/nearest", "closest-point/z", "strandline", "distance", "box.stl, ball.off"] {
        assert!(store.contains(word), "{word}: {store}");
    }
    assert!(!store.contains("null"), "{store}");
}

#[test]
fn other_programs_read_distances() {
    let Some(interpreter) = python::interpreter() else { return };
    let bench = bench();
    for (precision, dtype) in [("f16", "float16"), ("f32", "float32"), ("f64", "float64")] {
        bench.succeed(&format!(
            "distance ball.off box.stl --spacing 0.02,0.04,0.05 --signed --labels --closest-point --precision \
             {precision} --overwrite -q -o out/x.zarr"
        ));
        let report = bench.json("out/x.zarr/report.json");
        let grid = &report["grid"];
        let same = serde_json::json!({
            "shape": grid["shape_zyx"], "scale": grid["spacing_zyx"], "translation": grid["origin_zyx"]
        });
        let with = |dtype: &str| {
            let mut expected = same.clone();
            expected["dtype"] = dtype.into();
            expected
        };
        let expected = serde_json::json!({
            "": with(dtype), "labels/nearest": with("uint8"), "closest-point/x": with("float32"),
            "closest-point/y": with("float32"), "closest-point/z": with("float32")
        });
        bench.write("expect.json", &expected.to_string());
        let (store, expect) = (bench.path("out/x.zarr"), bench.path("expect.json"));
        let printed = python::run_script(interpreter, "check_store.py", &[&store, Path::new("--expect"), &expect]);
        let printed = printed.unwrap_or_else(|text| panic!("{precision}: {text}"));
        assert_eq!(printed.lines().filter(|line| line.starts_with("ok ")).count(), 5, "{printed}");
    }
}
