//! What is said on the terminal: enough to go on, and not thousands of lines.

#![allow(clippy::unwrap_used)]

use std::fs;

use crate::common::ball::{Bench, write_stack};
use strandline::grid::Geometry;

const SHAPE: [i64; 3] = [32, 8, 8];

fn stack(bench: &Bench, name: &str, value: impl Fn([i64; 3]) -> u16) {
    let geometry = Geometry { shape: SHAPE, spacing: [1.0; 3], origin: [0.0; 3], unit: Some("micrometer".into()) };
    let [width, height, depth] = SHAPE;
    let place = |n: i64| [n % width, n / width % height, n / (width * height)];
    let voxels: Vec<u16> = (0..width * height * depth).map(|n| value(place(n))).collect();
    write_stack(&bench.path(name), &geometry, &[&voxels]);
}

/// Cubes of 4 voxels, each a label of its own, from 1 on.
fn cubes([x, y, z]: [i64; 3]) -> u16 {
    (1 + x / 4 + 8 * (y / 4) + 16 * (z / 4)) as u16
}

#[test]
fn tables_of_many_labels_are_cut_and_whole_in_the_files() {
    let bench = Bench::bare();
    stack(&bench, "cells.tif", cubes);
    let printed = bench.succeed("middle cells.tif -o out/x.zarr");
    assert!(printed.lines().count() < 45, "{printed}");
    let labels: Vec<&str> = printed.lines().filter(|line| line.starts_with("label ")).collect();
    assert_eq!((labels.len(), &labels[1][..8], &labels[9][..9]), (10, "label 2:", "label 10:"), "{printed}");
    assert!(printed.contains("... 22 more labels in report.json"), "{printed}");
    let rows = fs::read_to_string(bench.path("out/x.zarr/meshes/pairs.csv")).unwrap().lines().count() - 1;
    let more = format!("... {} more pairs of labels in report.json and meshes/pairs.csv", rows - 10);
    assert!(printed.contains(&more), "{more}: {printed}");
    let result = &bench.json("out/x.zarr/report.json")["result"];
    assert_eq!(result["label_voxels"].as_object().unwrap().len(), 32);
    assert_eq!(result["pairs"].as_array().unwrap().len(), rows);
    let printed = bench.succeed("middle cells.tif -o none");
    assert!(printed.contains("... 22 more labels (--report FILE or an output has them all)"), "{printed}");
}

#[test]
fn an_image_given_as_labels_is_asked_about_before_the_run() {
    let bench = Bench::bare();
    let grey = |[x, y, z]: [i64; 3]| (1 + (x * 7919 + y * 104_729 + z * 1_299_709) % 9973) as u16;
    stack(&bench, "grey.tif", grey);
    let output = bench.run("distance grey.tif --labels -o none");
    let said = String::from_utf8(output.stderr).unwrap();
    let asked = said.lines().position(|line| line.contains("is it an image, and no label volume?"));
    let begun = said.lines().position(|line| line.contains("data sets"));
    assert!(output.status.success() && asked.unwrap() < begun.unwrap(), "{said}");
    stack(&bench, "halves.tif", |[x, ..]| 1 + u16::from(x > 15));
    let output = bench.run("distance halves.tif --labels -o none");
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(!said.contains("is it an image"), "{said}");
}

/// Against what is known of the input: all images, their types and ranges, meshes, tables.
#[test]
fn info_tells_every_field_of_a_store() {
    let bench = Bench::bare();
    stack(&bench, "cells.tif", |[x, ..]| (1 + x / 8) as u16);
    bench.succeed("middle cells.tif -q -o out/x.zarr");
    let told = bench.succeed("info out/x.zarr");
    let labels = told.lines().find(|line| line.starts_with("labels/nearest, values")).unwrap();
    assert!(labels.ends_with(" 1 to 4"), "{told}");
    for word in
        ["labels/border, level 0", "32 x 8 x 8", "uint16", "meshes/surface.ply", " triangles", "meshes/pairs.csv"]
    {
        assert!(told.contains(word), "{word}: {told}");
    }
    assert!(told.contains("table of 3 rows: "), "{told}");
    let json: serde_json::Value = serde_json::from_str(&bench.succeed("info out/x.zarr --json")).unwrap();
    assert_eq!(json["images"]["labels/nearest"][0]["range"], serde_json::json!([1.0, 4.0]));
    assert!(json["files"]["meshes/surface.ply"].as_str().unwrap().contains("triangles"), "{json}");
}

/// A device that has no room for anything.
#[cfg(target_os = "linux")]
#[test]
fn results_that_find_no_room_are_a_failure() {
    let bench = Bench::bare();
    bench.write("a.xyz", "0 0 0\n1 1 1\n0 1 0\n");
    for run in ["info a.xyz", "distance a.xyz --spacing 0.5 -o none", "distance a.xyz --spacing 0.5 -o none --dry-run"]
    {
        let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let output = bench.command(run).stdout(full).output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{run}: {said}");
        assert!(said.contains("the result cannot be printed"), "{run}: {said}");
    }
}

/// What a shell makes of `<(command)`.
#[test]
fn pipes_are_read_once() {
    let bench = Bench::bare();
    bench.write("a.xyz", &"0 0 0\n1 1 1\n0 1 0\n".repeat(9));
    let expected = bench.succeed("info a.xyz");
    let piped = |run: &str| {
        let script = format!("exec {} {run}", env!("CARGO_BIN_EXE_strandline"));
        let output =
            std::process::Command::new("bash").args(["-c", &script]).current_dir(bench.path("")).output().unwrap();
        (output.status.code(), String::from_utf8(output.stdout).unwrap(), String::from_utf8(output.stderr).unwrap())
    };
    assert_eq!(piped("info <(cat a.xyz)"), (Some(0), expected, String::new()));
    let (code, _, said) = piped("distance <(cat a.xyz) --spacing 0.5 -o none -q");
    assert_eq!(code, Some(0), "{said}");
    stack(&bench, "cells.tif", cubes);
    let (code, _, said) = piped("segment <(cat cells.tif) --points a.xyz -o none");
    assert!(code == Some(2) && said.contains("is a pipe or a device"), "{said}");
}

/// What nobody writes to is not waited for.
#[cfg(target_os = "linux")]
#[test]
fn named_pipes_and_devices_are_refused() {
    let bench = Bench::bare();
    assert!(std::process::Command::new("mkfifo").arg(bench.path("p")).status().unwrap().success());
    for run in [
        "info p",
        "measure p",
        "reconstruct p -o none",
        "distance p --spacing 1 -o none",
        "convert p out/a.nrrd",
        "convert p out/a.ply",
    ] {
        let said = bench.fail(run, 2);
        assert!(said.contains("pipe"), "{run}: {said}");
        let said = bench.fail(&run.replace(" p", " /dev/zero"), 2);
        assert!(said.contains("device"), "{run}: {said}");
    }
}

#[test]
fn standard_input_is_an_input_like_others() {
    let bench = Bench::bare();
    let text = "0 0 0\n1 1 1\n0 1 0\n";
    bench.write("a.xyz", text);
    let input = || fs::File::open(bench.path("a.xyz")).unwrap();
    let run = "distance - --spacing 0.5 -o none -q --overwrite --report";
    let output = bench.command(&format!("{run} a.xyz")).stdin(input()).output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.code() == Some(2) && said.contains("a.xyz: is an input of this run"), "{said}");
    assert_eq!(fs::read_to_string(bench.path("a.xyz")).unwrap(), text);
    assert!(bench.command(&format!("{run} b.json")).stdin(input()).status().unwrap().success());
}
