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
        ["labels/border, level 0", "32 x 8 x 8", "float32", "meshes/surface.ply", " triangles", "meshes/pairs.csv"]
    {
        assert!(told.contains(word), "{word}: {told}");
    }
    assert!(told.contains("table of 3 rows: "), "{told}");
    let json: serde_json::Value = serde_json::from_str(&bench.succeed("info out/x.zarr --json")).unwrap();
    assert_eq!(json["images"]["labels/nearest"][0]["range"], serde_json::json!([1.0, 4.0]));
    assert!(json["files"]["meshes/surface.ply"].as_str().unwrap().contains("triangles"), "{json}");
}
