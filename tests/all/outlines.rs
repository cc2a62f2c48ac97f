//! Whole runs from outlines as people mark them: few of them, in several planes, with holes, loose, wrong; against the
//! bodies that they were taken from.
#![allow(clippy::unwrap_used)]

use std::f64::consts::TAU;
use std::fmt::Write;

use strandline::grid::{Box3, Geometry};

use crate::common::ball::{Bench, HEADER, write_stack};
use crate::common::random::Random;
use crate::common::stores::volume;

const GEOMETRY: Geometry = Geometry { shape: [64, 60, 40], spacing: [0.5, 0.5, 1.0], origin: [0.0; 3], unit: None };
const CENTRE: [f64; 3] = [16.0, 15.0, 19.5];
const RADIUS: f64 = 10.0;

fn length(p: [f64; 3]) -> f64 {
    (0..3).map(|a| (p[a] - CENTRE[a]).powi(2)).sum::<f64>().sqrt()
}

fn positions() -> impl Iterator<Item = [f64; 3]> {
    let shape = GEOMETRY.shape;
    let voxels = Box3::from_shape(shape).rows().flat_map(move |(y, z)| (0..shape[0]).map(move |x| [x, y, z]));
    voxels.map(|v| GEOMETRY.position(v))
}

/// A stack of grey values of a place, a little noisy.
fn stack(bench: &Bench, grey: impl Fn([f64; 3]) -> f64) {
    let mut random = Random(11);
    let voxels: Vec<u16> = positions().map(|p| (grey(p) + 20.0 * random.unit()).max(0.0) as u16).collect();
    write_stack(&bench.path("image.tif"), &GEOMETRY, &[&voxels]);
}

/// Marks on a circle around the centre in a plane across an axis at a height over the centre, `off` outside of the ball
/// and scattered by `jitter`.
fn circle(text: &mut String, contour: u32, (axis, height): (usize, f64), marks: u32, off: f64, jitter: f64) {
    let mut random = Random(u64::from(contour) + 100);
    let radius = (RADIUS * RADIUS - height * height).sqrt() + off;
    for n in 0..marks {
        let angle = f64::from(n) * TAU / f64::from(marks);
        let mut scattered = |v: f64| v + jitter * (random.unit() + random.unit() + random.unit() - 1.5) * 2.0;
        let mut p = CENTRE;
        p[axis] += height;
        p[(axis + 1) % 3] = scattered(p[(axis + 1) % 3] + radius * angle.cos());
        p[(axis + 2) % 3] = scattered(p[(axis + 2) % 3] + radius * angle.sin());
        writeln!(text, "1,{contour},{},{},{}", p[0], p[1], p[2]).unwrap();
    }
}

fn circles(planes: &[(usize, f64)], marks: u32, off: f64, jitter: f64) -> String {
    let mut text = HEADER.to_string();
    for (n, &plane) in planes.iter().enumerate() {
        circle(&mut text, n as u32 + 1, plane, marks, off, jitter);
    }
    text
}

fn dice(labels: &[f64], inside: impl Fn([f64; 3]) -> bool) -> f64 {
    let (mut both, mut all) = (0.0, 0.0);
    for (label, p) in labels.iter().zip(positions()) {
        both += 2.0 * f64::from(*label == 1.0 && inside(p));
        all += f64::from(*label == 1.0) + f64::from(inside(p));
    }
    both / all
}

fn is_ball(p: [f64; 3]) -> bool {
    length(p) <= RADIUS
}

/// Bright inside, as wide a border as a microscope's.
fn bright(p: [f64; 3]) -> f64 {
    100.0 + 300.0 / (1.0 + ((length(p) - RADIUS) / 0.4).exp())
}

/// A bright sheet around a body that is as dark as what is outside.
fn walled(p: [f64; 3]) -> f64 {
    100.0 + 300.0 * (-0.5 * ((length(p) - RADIUS) / 0.7).powi(2)).exp()
}

/// What a run on `marks` says of the one object, and its Dice with the ball.
fn solved(bench: &Bench, marks: &str, flags: &str) -> (serde_json::Value, f64) {
    bench.write("marks.csv", marks);
    bench.succeed(&format!("segment image.tif --points marks.csv {flags} -q -o out/x.zarr --overwrite"));
    let labels = volume(&bench.path("out/x.zarr/labels/segmentation"));
    (bench.json("out/x.zarr/report.json")["result"].clone(), dice(&labels, is_ball))
}

#[test]
fn a_few_outlines_make_a_ball() {
    let bench = Bench::bare();
    stack(&bench, |_| 100.0);
    let z = |heights: &[f64]| heights.iter().map(|&h| (2, h)).collect::<Vec<_>>();
    let oblique = {
        let mut text = HEADER.to_string();
        // Circles in planes across (3, 0, 4) / 5.
        for (n, height) in [-7.0_f64, 0.0, 7.0].into_iter().enumerate() {
            let radius = (RADIUS * RADIUS - height * height).sqrt();
            for m in 0..16 {
                let (sin, cos) = (f64::from(m) * TAU / 16.0).sin_cos();
                let along = [0.8 * radius * cos + 0.6 * height, radius * sin, -0.6 * radius * cos + 0.8 * height];
                let p: [f64; 3] = std::array::from_fn(|a| CENTRE[a] + along[a]);
                writeln!(text, "1,{n},{},{},{}", p[0], p[1], p[2]).unwrap();
            }
        }
        text
    };
    for (what, marks, least) in [
        ("three slices", circles(&z(&[-6.0, 0.0, 6.0]), 12, 0.0, 0.0), 0.95),
        ("every fourth slice", circles(&z(&[-8.0, -4.0, 0.0, 4.0, 8.0]), 12, 0.0, 0.0), 0.97),
        ("every slice", circles(&z(&(-9..10).map(f64::from).collect::<Vec<_>>()), 30, 0.0, 0.0), 0.98),
        ("an xz and a yz plane", circles(&[(1, 0.0), (0, 0.0)], 16, 0.0, 0.0), 0.93),
        ("all three planes", circles(&[(2, 0.0), (1, 0.0), (0, 0.0)], 16, 0.0, 0.0), 0.97),
        ("oblique planes", oblique, 0.95),
        ("scattered marks", circles(&z(&[-8.0, -4.0, 0.0, 4.0, 8.0]), 16, 0.0, 0.7), 0.94),
    ] {
        let (report, dice) = solved(&bench, &marks, "");
        assert!(dice > least, "{what}: {dice}");
        assert_eq!(report["image_model"], "none", "{what}: the image shows nothing");
    }
}

#[test]
fn the_image_corrects_scattered_and_sparse_marks() {
    let bench = Bench::bare();
    stack(&bench, bright);
    for marks in
        [circles(&[(2, -6.0), (2, 1.0)], 10, 0.0, 0.0), circles(&[(2, -5.0), (2, 0.0), (2, 5.0)], 12, 0.0, 0.6)]
    {
        let (with, seen) = solved(&bench, &marks, "");
        let (_, blind) = solved(&bench, &marks, "--image none");
        assert_eq!(with["image_model"], "level");
        assert!(seen > blind + 0.01 && seen > 0.96, "{seen} with the image, {blind} without");
    }
}

/// Marks run two voxels outside of a wall: the surface rests on its crest.
#[test]
fn a_wall_is_found_inside_of_its_marks() {
    let bench = Bench::bare();
    stack(&bench, walled);
    let planes: Vec<(usize, f64)> = [-8.0, -4.0, 0.0, 4.0, 8.0].map(|h| (2, h)).into();
    let (report, dice) = solved(&bench, &circles(&planes, 14, 1.0, 0.2), "");
    assert_eq!(report["image_model"], "wall");
    assert!(dice > 0.965, "{dice}");
    let (_, blind) = solved(&bench, &circles(&planes, 14, 1.0, 0.2), "--image none");
    assert!(blind < 0.93, "the marks are off: {blind}");
}

/// An outline inside another is a hole, one beside another a branch.
#[test]
fn holes_and_branches_are_kept() {
    let bench = Bench::bare();
    stack(&bench, |_| 100.0);
    let mut marks = HEADER.to_string();
    let mut ring = |contour: u32, [x, y, z]: [f64; 3], radius: f64| {
        for n in 0..16 {
            let (sin, cos) = (f64::from(n) * TAU / 16.0).sin_cos();
            writeln!(marks, "1,{contour},{},{},{z}", x + radius * cos, y + radius * sin).unwrap();
        }
    };
    for (n, z) in [8.0, 12.0, 16.0, 20.0].into_iter().enumerate() {
        let contour = 4 * n as u32;
        ring(contour, [11.0, 15.0, z], 8.0);
        ring(contour + 1, [11.0, 15.0, z], 4.0);
        ring(contour + 2, [26.0, 15.0, z], 3.0);
    }
    bench.write("marks.csv", &marks);
    bench.succeed("segment image.tif --points marks.csv -q -o out/x.zarr");
    let labels = volume(&bench.path("out/x.zarr/labels/segmentation"));
    let at = |p: [f64; 3]| labels[GEOMETRY.domain().offset_of(GEOMETRY.to_voxels(p).map(|v| v.round() as i64))];
    for z in [10.0, 14.0, 18.0] {
        assert_eq!([5.0, 17.0].map(|x| at([x, 15.0, z])), [1.0; 2], "the ring at {z}");
        assert_eq!([11.0, 21.5].map(|x| at([x, 15.0, z])), [0.0; 2], "the hole, and between, at {z}");
        assert_eq!(at([26.0, 15.0, z]), 1.0, "the branch at {z}");
    }
}

/// Clicked around twice, or saved twice, an outline is the same outline.
#[test]
fn an_outline_is_no_hole_in_itself() {
    let bench = Bench::bare();
    stack(&bench, |_| 100.0);
    let planes: Vec<(usize, f64)> = [-6.0, -2.0, 2.0, 6.0].map(|h| (2, h)).into();
    let once = circles(&planes, 14, 0.0, 0.0);
    let (_, wanted) = solved(&bench, &once, "");
    let rows: Vec<&str> = once.lines().skip(1).collect();
    let around_twice: Vec<String> = rows.chunks(14).map(|outline| [outline, outline].concat().join("\n")).collect();
    let around_twice = around_twice.join("\n");
    let (_, found) = solved(&bench, &format!("{HEADER}{around_twice}"), "");
    assert!((found - wanted).abs() < 0.01 && wanted > 0.95, "twice around: {found} for {wanted}");
    let again: Vec<String> = rows[..14].iter().map(|row| row.replacen("1,1,", "1,77,", 1)).collect();
    let again = again.join("\n");
    let (_, found) = solved(&bench, &format!("{once}{again}"), "");
    assert!(found == wanted, "saved twice: {found} for {wanted}");
}

#[test]
fn what_is_wrong_with_marks_is_told() {
    let bench = Bench::bare();
    stack(&bench, bright);
    let planes: Vec<(usize, f64)> = [-8.0, -4.0, 0.0, 4.0, 8.0].map(|h| (2, h)).into();
    let good = circles(&planes, 14, 0.0, 0.0);
    // Four marks at almost one place are an outline of nothing.
    let bad = format!("{good}2,1,3,3,3\n2,1,3.1,3,3\n2,1,3.1,3.1,3\n2,1,3,3.1,3\n");
    bench.write("bad.csv", &bad);
    let output = bench.run("segment image.tif --points bad.csv -o out/bad.zarr");
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(3), "{said}");
    assert!(said.contains("object 2"), "{said}");
    let report = bench.json("out/bad.zarr/report.json");
    assert_eq!(report["result"]["refused"][0]["label"], 2);
    assert!(!bench.path("out/bad.zarr/meshes/object-2.ply").exists() && bench.path("out/bad.zarr/meshes").exists());
    assert!(dice(&volume(&bench.path("out/bad.zarr/labels/segmentation")), is_ball) > 0.95);
    bench.write("two.csv", &format!("{good}7,1,1,1,1\n7,1,2,1,1\n"));
    let complaint = bench.fail("segment image.tif --points two.csv -q -o none", 3);
    assert!(complaint.contains("object 7 has 2 points"), "{complaint}");
    // What is missing in the table is told.
    let columns = |names: &str, kept: [usize; 4]| {
        let rows = good.lines().skip(1).map(|line| line.split(',').collect::<Vec<_>>());
        rows.fold(format!("{names}\n"), |text, row| text + &kept.map(|n| row[n]).join(",") + "\n")
    };
    bench.write("slice.csv", &columns("slice,x,y,z", [1, 2, 3, 4]));
    let complaint = bench.fail("segment image.tif --points slice.csv -q -o none", 2);
    assert!(complaint.contains("a column named contour"), "{complaint}");
    bench.write("same.csv", &columns("contour,x,y,z", [0, 2, 3, 4]));
    let complaint = bench.fail("segment image.tif --points same.csv -q -o none", 2);
    assert!(complaint.contains("contour 1 of object 1 lies in no plane"), "{complaint}");
    let complaint = bench.fail("segment image.tif --points bad.csv --crop 0:5,0:5,: -q -o none", 2);
    assert!(complaint.contains("--crop leaves out"), "{complaint}");
    // An outline that crosses itself is told by its number.
    let mut lines: Vec<&str> = good.lines().collect();
    lines.swap(3, 8);
    bench.write("crossed.csv", &format!("{}\n", lines.join("\n")));
    let output = bench.run("segment image.tif --points crossed.csv -o out/crossed.zarr");
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(said.contains("outline 1 of object 1 crosses itself"), "{said}");
    // The body is smooth, marks that scatter are beside it: each farther than a voxel is counted.
    let (report, _) = solved(&bench, &circles(&planes, 14, 0.0, 1.0), "");
    let (counted, largest) = (&report["objects"][0]["marks_off"], &report["objects"][0]["hausdorff"]["max"]);
    assert!((3..40).contains(&counted.as_u64().unwrap()) && largest.as_f64().unwrap() > 1.0, "{counted} {largest}");
    let (report, _) = solved(&bench, &good, "");
    assert_eq!(report["objects"][0]["marks_off"], 0);
}

#[test]
fn cross_validation_says_where_to_mark_next() {
    let bench = Bench::bare();
    stack(&bench, bright);
    let marks = circles(&[(2, -8.0), (2, -6.0), (2, -4.0), (2, 6.0), (2, 8.0)], 14, 0.0, 0.1);
    let (report, _) = solved(&bench, &marks, "--cross-validate");
    let found = &report["objects"][0]["cross_validation"];
    let next = found["next_slice"].as_i64().or_else(|| found["next_slice"]["slice"].as_i64()).unwrap();
    // The widest gap is between slices 15.5 and 25.5.
    assert!((19..=22).contains(&next), "{found}");
    assert!(found["mean"].as_f64().unwrap() < 2.0, "{found}");
}

#[test]
fn models_that_cannot_be_used_are_refused() {
    let bench = Bench::bare();
    stack(&bench, bright);
    let mut random = Random(3);
    let mut loose = "x,y,z\n".to_string();
    for _ in 0..600 {
        let v: [f64; 3] = std::array::from_fn(|_| random.unit() - 0.5);
        let norm = v.iter().map(|x| x * x).sum::<f64>().sqrt();
        let p: [f64; 3] = std::array::from_fn(|a| CENTRE[a] + RADIUS * v[a] / norm);
        writeln!(loose, "{},{},{}", p[0], p[1], p[2]).unwrap();
    }
    bench.write("loose.csv", &loose);
    let complaint = bench.fail("segment image.tif --points loose.csv --image level -o out/l.zarr -q", 2);
    assert!(complaint.contains("--image level") && complaint.lines().count() == 1, "{complaint}");
    bench.succeed("segment image.tif --points loose.csv -o out/l.zarr -q");
    assert!(dice(&volume(&bench.path("out/l.zarr/labels/segmentation")), is_ball) > 0.93);
}

/// The same bits for all brick sizes, thread counts and memory limits, one object or several side by side.
#[test]
fn nothing_but_the_marks_counts() {
    let bench = Bench::bare();
    stack(&bench, bright);
    let planes: Vec<(usize, f64)> = [-7.0, -2.0, 3.0, 7.0].map(|h| (2, h)).into();
    let mut marks = circles(&planes, 12, 0.0, 0.5);
    for (n, z) in [6.0, 9.0, 12.0].into_iter().enumerate() {
        for m in 0..9 {
            let (sin, cos) = (f64::from(m) * TAU / 9.0).sin_cos();
            writeln!(marks, "2,{n},{},{},{z}", 26.0 + 3.0 * cos, 24.0 + 3.0 * sin).unwrap();
        }
    }
    bench.write("marks.csv", &marks);
    let voxels = |flags: &str| {
        bench.succeed(&format!("segment image.tif --points marks.csv {flags} -q -o out/x.zarr --overwrite"));
        ["labels/segmentation", "levelset/object-1", "levelset/object-2", "distance/object-1"]
            .map(|group| volume(&bench.path("out/x.zarr").join(group)))
    };
    let first = voxels("--threads 1");
    assert!(first[1].iter().any(|u| *u > 0.1 && *u < 0.9));
    for flags in ["--threads 2", "--threads 3 --brick 32", "--threads 2 --brick 16 --memory 160MiB"] {
        assert!(voxels(flags) == first, "{flags}");
    }
}
