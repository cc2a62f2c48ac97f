//! Points as other programs write them: random tables of pandas and random ROIs of roifile, read back equal by
//! `read_points`; and the program on marks of napari, of ImageJ, from standard input and from two people.

#![allow(clippy::unwrap_used)]

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;
use std::process::Stdio;

use serde_json::Value;
use strandline::io::geometry::read::point_file::Scale;
use strandline::io::geometry::read::points::read_points;
use strandline::io::geometry::read::source::Source;
use strandline::io::geometry::read::sources::read_source;

use crate::common::ball::{Ball, Bench, HEADER};
use crate::common::patience::output_of;
use crate::common::python;
use crate::common::stores::volume;

fn scale_of(name: &Value) -> Scale {
    match name.as_str().unwrap() {
        "physical" => Scale::Physical,
        "voxels" => Scale::Voxels,
        _ => Scale::Slices,
    }
}

fn integers(values: &Value) -> Vec<i64> {
    values.as_array().unwrap().iter().map(|value| value.as_i64().unwrap()).collect()
}

#[test]
fn random_files_of_other_programs_are_read_back_equal() {
    let Some(interpreter) = python::interpreter() else { return };
    let folder = tempfile::tempdir().unwrap();
    let seed = std::process::id().to_string();
    println!("seed {seed}");
    let arguments = [folder.path(), Path::new(&seed), Path::new("150")];
    python::run_script(interpreter, "write_points.py", &arguments).unwrap_or_else(|text| panic!("{text}"));
    let expected = std::fs::read(folder.path().join("expected.json")).unwrap();
    let expected: Vec<Value> = serde_json::from_slice(&expected).unwrap();
    assert_eq!(expected.len(), 150);
    for expected in expected {
        let name = expected["file"].as_str().unwrap();
        let found = read_points(&folder.path().join(name)).unwrap_or_else(|error| panic!("{error}"));
        let positions: Vec<[f64; 3]> = serde_json::from_value(expected["positions"].clone()).unwrap();
        assert_eq!(found.cloud.positions, positions, "{name}");
        assert_eq!(found.cloud.contours, integers(&expected["contours"]), "{name}");
        let objects: Vec<i64> = found.cloud.objects.iter().map(|&object| i64::from(object)).collect();
        assert_eq!(objects, integers(&expected["objects"]), "{name}");
        assert_eq!(found.times, integers(&expected["times"]), "{name}");
        assert_eq!(found.scales, [0, 1, 2].map(|axis| scale_of(&expected["scales"][axis])), "{name}");
    }
}

/// The rows of marks as napari writes them: voxel indices, z first, with what goes before them.
fn in_voxels(ball: &Ball, start: impl Fn(&str, usize) -> String) -> String {
    let mut text = String::new();
    let (mut last, mut vertex) = (String::new(), 0);
    for row in ball.marks(1).lines() {
        let fields: Vec<&str> = row.split(',').collect();
        let [x, y, z] = [2, 3, 4].map(|n| fields[n].parse::<f64>().unwrap() / ball.geometry.spacing[n - 2]);
        vertex = if last == fields[1] { vertex + 1 } else { 0 };
        last = fields[1].into();
        writeln!(text, "{},{z},{y},{x}", start(fields[1], vertex)).unwrap();
    }
    text
}

/// What a run that succeeds says on standard error.
fn told(bench: &Bench, arguments: &str) -> String {
    let output = bench.run(arguments);
    let told = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{arguments}: {told}");
    told
}

#[test]
fn marks_of_napari_are_voxels_times_the_spacing() {
    let ball = Ball::small();
    let bench = Bench::new(&ball);
    let points = in_voxels(&ball, |contour, _| format!("1,{contour}"));
    bench.write("points.csv", &format!("object,contour,axis-0,axis-1,axis-2\n{points}"));
    let shapes = in_voxels(&ball, |contour, vertex| format!("{contour}.0,polygon,{vertex}.0"));
    bench.write("shapes.csv", &format!("index,shape-type,vertex-index,axis-0,axis-1,axis-2\n{shapes}"));
    let table = in_voxels(&ball, |contour, _| format!("1,{contour}"));
    bench.write("table.csv", &format!("object,contour,z,y,x\n{table}"));
    bench.succeed("segment image.tif --points marks.csv -o out/marks.zarr -q");
    let expected = volume(&bench.path("out/marks.zarr/labels/segmentation"));
    for (name, flags) in [("points", ""), ("shapes", ""), ("table", "--points-in voxels")] {
        let told = told(&bench, &format!("segment image.tif --points {name}.csv -o out/{name}.zarr {flags}"));
        assert_eq!(told.contains("voxel indices, times the spacing (0.5, 0.5, 1)"), flags.is_empty(), "{told}");
        assert!(volume(&bench.path(&format!("out/{name}.zarr/labels/segmentation"))) == expected, "{name}");
    }
    let info = bench.succeed("info shapes.csv");
    for line in ["shapes of napari", "voxels, the first one 0", "points on"] {
        assert!(info.contains(line), "{info}");
    }
    let lost =
        bench.fail("segment image.tif --points points.csv -o none --points-in physical --image-spacing 0.1,0.1,1", 2);
    assert!(lost.contains("--points-in voxels"), "{lost}");
}

/// The grid of an image gives voxel indices their place, in `distance` and `middle` as in `segment`.
#[test]
fn points_of_a_distance_count_voxels_of_the_grid() {
    let ball = Ball::small();
    let bench = Bench::new(&ball);
    bench.write("lengths.csv", "x,y,z\n5,6,7\n12.25,3,11\n");
    bench.write("indices.csv", "x,y,z\n10,12,7\n24.5,6,11\n");
    bench.write("napari.csv", "axis-0,axis-1,axis-2\n7,12,10\n11,6,24.5\n");
    bench.write("slices.csv", " ,X,Y,Slice\n1,10,12,8\n2,24.5,6,12\n");
    let distance = |arguments: &str| {
        let said = told(&bench, &format!("distance {arguments} --overwrite -o out/x.zarr"));
        (volume(&bench.path("out/x.zarr")), said)
    };
    let (expected, _) = distance("lengths.csv --like image.tif");
    let typed = "--origin 0,0,0 --shape 40,36,20 --spacing 0.5,0.5,1";
    for arguments in [
        "indices.csv --like image.tif --points-in voxels",
        "napari.csv --like image.tif",
        "lengths.csv --like image.tif --points-in physical",
        "slices.csv --like image.tif --points-in voxels",
        &format!("indices.csv {typed} --points-in voxels"),
        &format!("napari.csv {typed} --points-in voxels"),
    ] {
        assert!(distance(arguments).0 == expected, "{arguments}");
    }
    let (_, said) = distance("napari.csv --like image.tif");
    assert!(said.contains("napari.csv") && said.contains("times the spacing (0.5, 0.5, 1)"), "{said}");
    // Where nobody names an image they are numbers.
    let (taken, said) = distance(&format!("napari.csv {typed}"));
    assert!(taken != expected && said.contains("they are taken as they are"), "{said}");
    let (taken, _) = distance("napari.csv --like image.tif --points-in physical");
    assert!(taken != expected);
    let said = bench.fail("distance indices.csv --points-in voxels -o none", 2);
    assert!(said.contains("--points-in voxels") && said.contains("--like"), "{said}");
    bench.write("more.csv", "x,y,z\n30,30,4\n");
    bench.succeed("middle indices.csv more.csv --like image.tif --points-in voxels -q -o none");
    bench.write("mesh.obj", "v 1 1 1\nv 9 1 1\nv 1 9 1\nf 1 2 3\n");
    let (_, said) = distance("mesh.obj --like image.tif --points-in voxels");
    assert!(said.contains("mesh.obj: is a mesh, whose vertices are lengths"), "{said}");
}

#[test]
fn the_time_of_the_image_chooses_among_points() {
    let ball = Ball::small();
    let bench = Bench::new(&ball);
    let both = in_voxels(&ball, |contour, _| format!("{contour},0.0"))
        + &in_voxels(&ball, |contour, _| format!("{contour},3.0"));
    bench.write("movie.csv", &format!("contour,axis-0,axis-1,axis-2,axis-3\n{both}"));
    let plan = bench.run("segment image.tif --points movie.csv -o none --dry-run");
    let (plan, told) = (String::from_utf8(plan.stdout).unwrap(), String::from_utf8(plan.stderr).unwrap());
    let marks = ball.marks(1).lines().count();
    assert!(plan.contains(&format!("object 1: {marks} marks")), "{plan}");
    assert!(told.contains(&format!("{marks} points are of other times than 0 (--time)")), "{told}");
    bench.write("later.csv", &format!("contour,axis-0,axis-1,axis-2,axis-3\n{}", both.replace(",0.0,", ",2.0,")));
    let complaint = bench.fail("segment image.tif --points later.csv -o none", 2);
    assert!(complaint.contains("times 2 to 3 and none of time 0"), "{complaint}");
}

#[test]
fn one_object_in_two_files_is_told() {
    let ball = Ball::small();
    let bench = Bench::new(&ball);
    let every = |rest: i64| -> String {
        let of = |row: &&str| row.split(',').nth(1).unwrap().parse::<i64>().unwrap() / 2 % 2 == rest;
        ball.marks(1).lines().filter(of).fold(String::new(), |text, row| text + row + "\n")
    };
    bench.write("a.csv", &format!("{HEADER}{}", every(0)));
    bench.write("b.csv", &format!("{HEADER}{}", every(1)));
    let told = told(&bench, "segment image.tif --points a.csv --points b.csv -o none --dry-run");
    assert!(told.contains("object 1 of b.csv is numbered 2"), "{told}");
    // Every second slice of one ball, each made whole again: the balls differ by what slices in between would have told.
    let share =
        told.split("objects 1 (a.csv) and 2 (b.csv) overlap by ").nth(1).and_then(|rest| rest.split(' ').next());
    assert!(share.is_some_and(|share| share.parse::<f64>().unwrap() >= 80.0), "{told}");
    let one = bench.path("one.csv");
    let rows = ball.marks(1).lines().fold(String::new(), |text, row| {
        let fields: Vec<&str> = row.split(',').collect();
        text + &format!("1,7,{},{},{}\n", fields[2], fields[3], fields[4])
    });
    std::fs::write(one, format!("{HEADER}{rows}")).unwrap();
    let output = bench.run("segment image.tif --points one.csv -o none --dry-run");
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(told.contains("outline 7 of object 1 has marks on 6 slices"), "{told}");
}

#[test]
fn a_dash_is_standard_input() {
    let ball = Ball::small();
    let bench = Bench::new(&ball);
    let fed = |arguments: &str| {
        let mut command = bench.command(arguments);
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let marks = format!("{HEADER}{}", ball.marks(1));
        child.stdin.take().unwrap().write_all(marks.as_bytes()).unwrap();
        output_of(child)
    };
    let marks = ball.marks(1).lines().count();
    let plan = fed("segment image.tif --points - -o none --dry-run");
    assert!(plan.status.success(), "{}", String::from_utf8_lossy(&plan.stderr));
    assert!(String::from_utf8_lossy(&plan.stdout).contains(&format!("object 1: {marks} marks")));
    let info = fed("info -");
    assert!(String::from_utf8_lossy(&info.stdout).contains(&format!("{marks} points")));
    let twice = fed("segment image.tif --points - --points - -o none --dry-run");
    assert_eq!(twice.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&twice.stderr).contains("standard input holds one file"));
}

#[test]
fn tables_say_what_they_are() {
    let bench = Bench::bare();
    let points = "11.002,7.424,14.167\n6.117,11.916,12.5\n14.734,11.378,10.833\n7.44,5.786,9.167\n";
    let headed = |header: &str| format!("{header}\n{points}");
    for (name, text, lines) in [
        ("units.csv", headed("x (\u{b5}m),y (\u{b5}m),z (\u{b5}m)"), &["4 points", "micrometer"][..]),
        ("px.csv", headed("x [px],y [px],z [px]"), &["4 points", "voxels, the first one 0"]),
        ("excel.csv", format!("sep=;\nx;y;z\n{}", points.replace(',', ";")), &["4 points"]),
        (
            "german.csv",
            format!("x;y;z\n{}", points.replace(',', ";").replace('.', ",")),
            &["4 points", "decimal commas"],
        ),
        ("bare.csv", points.into(), &["4 points", "no header", "first three columns"]),
        (
            "rows.xyz",
            points
                .lines()
                .enumerate()
                .fold(String::new(), |text, (n, row)| text + &format!("{n} {}\n", row.replace(',', " "))),
            &["4 points", "counts the lines"],
        ),
        (
            "imagej.csv",
            format!(" ,X,Y,Slice\n{}", "1,7.5,3.25,14\n2,7,3,15\n"),
            &["results table of ImageJ", "2 points", "z in", "slices", "(7, 3, 13)"],
        ),
        (
            "mass.csv",
            " ,Label,XM,YM,Frame,Slice\n1,a:1,7.5,3.25,1,14\n2,a:2,7,3,2,15\n".into(),
            &["results table of ImageJ", "slices", "(7, 3, 13)", "0 to 1"],
        ),
        ("suite.csv", headed("CX (pix),CY (pix),CZ (pix)"), &["4 points", "voxels, the first one 0"]),
        // A frame 0 is none of ImageJ, which counts from 1.
        (
            "trackpy.csv",
            ",y,x,z,mass,frame\n0,3,7,13,5.5,0\n1,3,8,13,5.5,1\n".into(),
            &["table of points", "times", "0 to 1"],
        ),
        (
            "labels.csv",
            "Label,X,Y,Z\n1,2,3,4\n1,3,4,5\n2,4,5,6\n2,5,6,8\n".into(),
            &["its column label holds 2 different numbers", "name it object", "4 points, no contours"],
        ),
        // Row numbers, or one number for all, tell no objects.
        ("rows.csv", "Label,X,Y,Z\n1,2,3,4\n2,3,4,5\n3,4,5,6\n4,5,6,8\n".into(), &["4 points"]),
    ] {
        bench.write(name, &text);
        let info = bench.succeed(&format!("info {name}"));
        for line in lines {
            assert!(info.contains(line), "{name}: {line}: {info}");
        }
    }
    assert!(!bench.succeed("info rows.csv").contains("column label"));
    // A comment that names more columns than the lines have.
    for (header, told) in [("# x y z object", "column 4 as object"), ("# x y z q contour", "column 5 as contour")] {
        bench.write("short.xyz", &format!("{header}\n1 2 3\n2 3 4\n"));
        let complaint = bench.fail("info short.xyz", 2);
        assert!(complaint.contains("line 2 has 3 columns") && complaint.contains(told), "{complaint}");
    }
    for grouped in ["1.234,5", "1\u{202f}234,5", "\"1,234.5\""] {
        bench.write("grouped.csv", &format!("x;y;z\n{grouped};2;3\n"));
        assert!(bench.fail("info grouped.csv", 2).contains("signs between thousands"), "{grouped}");
    }
    bench.write("other.csv", "name,width,height\na,1,2\n");
    let complaint = bench.fail("info other.csv", 2);
    assert!(complaint.contains("'name, width, height'") && complaint.contains("three columns x, y, z"), "{complaint}");
}

/// 7.125 micrometers are 7125 nanometers, along whichever axis and in whichever file.
#[test]
fn lengths_in_several_units_become_one() {
    let bench = Bench::bare();
    let rows = [[12.5, 30.25, 4.0], [13.5, 7.125, 8.5], [21.25, 18.75, 12.0]];
    let table = |header: &str, factors: [f64; 3]| {
        let row = |p: &[f64; 3]| format!("{},{},{}\n", p[0] * factors[0], p[1] * factors[1], p[2] * factors[2]);
        header.to_owned() + &rows.iter().map(row).collect::<String>()
    };
    bench.write("um.csv", &table("x_um,y_um,z_um\n", [1.0; 3]));
    bench.write("nm.csv", &table("x [nm],y [nm],z [nm]\n", [1000.0; 3]));
    bench.write("mixed.csv", &table("x_um,y_um,z_nm\n", [1.0, 1.0, 1000.0]));
    let plan = |files: &str| {
        let output = bench.run(&format!("distance {files} --spacing 1 -o none --dry-run"));
        let (plan, notes) = [output.stdout, output.stderr].map(|text| String::from_utf8(text).unwrap()).into();
        assert!(output.status.success(), "{notes}");
        (plan.lines().find(|line| line.starts_with("grid ")).unwrap().to_owned(), notes)
    };
    let (grid, _) = plan("um.csv");
    for (files, told) in [
        ("mixed.csv", "units differ (micrometer of x, micrometer of y, nanometer of z)"),
        ("um.csv nm.csv", "nm.csv: its lengths are in nanometer, those before it in micrometer"),
    ] {
        let (found, notes) = plan(files);
        assert_eq!(found, grid, "{files}");
        assert!(notes.contains(told), "{files}: {notes}");
    }
    assert!(bench.succeed("info mixed.csv").contains("(12.5, 7.125, 4)"));
}

/// Corners may spell the count of a binary STL file, and its numbers; the first word decides.
#[test]
fn no_polygon_of_imagej_is_taken_for_stl() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("polygon.roi");
    let mut random = crate::common::random::Random(3);
    for corners in 3..120_i16 {
        let mut roi = box_by_hand();
        (roi[6], roi[7]) = (0, 0);
        roi[16..18].copy_from_slice(&corners.to_be_bytes());
        roi.extend((0..2 * corners).flat_map(|_| (random.below(600) as i16).to_be_bytes()));
        std::fs::write(&path, &roi).unwrap();
        match read_source(&path).unwrap_or_else(|error| panic!("{error}")) {
            Source::Cloud(cloud) => assert_eq!(cloud.len(), corners as usize),
            Source::Mesh(_) => panic!("{corners} corners are a mesh"),
        }
    }
}

/// A ROI of two bytes for each number of its header, by hand: a box from (3, 5) to (13, 25) on slice 8.
fn box_by_hand() -> Vec<u8> {
    let mut roi = b"Iout\0\xe4\x01\0".to_vec();
    roi.extend([5_i16, 3, 25, 13].iter().flat_map(|v| v.to_be_bytes()));
    roi.resize(64, 0);
    roi[56..60].copy_from_slice(&8_i32.to_be_bytes());
    roi
}

#[test]
fn a_box_of_imagej_runs_along_the_edges_of_its_pixels() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("box.roi");
    std::fs::write(&path, box_by_hand()).unwrap();
    let found = read_points(&path).unwrap();
    assert_eq!(found.cloud.positions, [[2.5, 4.5, 7.0], [12.5, 4.5, 7.0], [12.5, 24.5, 7.0], [2.5, 24.5, 7.0]]);
    assert_eq!((found.scales, &found.cloud.contours[..]), ([Scale::Voxels; 3], &[1; 4][..]));
    let mut oval = box_by_hand();
    oval[6] = 2;
    std::fs::write(&path, &oval).unwrap();
    for [x, y, z] in read_points(&path).unwrap().cloud.positions {
        let round = ((x - 7.5) / 5.0).powi(2) + ((y - 14.5) / 10.0).powi(2);
        assert!((round - 1.0).abs() < 1e-12 && z == 7.0);
    }
    let mut nowhere = box_by_hand();
    nowhere[56..60].fill(0);
    std::fs::write(&path, &nowhere).unwrap();
    assert!(read_points(&path).unwrap_err().to_string().contains("tells no slice"));
}

/// Damaged ROIs and sets of them are read or refused, and nothing else.
#[test]
fn damaged_rois_never_panic() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("damaged");
    let whole = box_by_hand();
    for place in 4..64 {
        for value in [0, 1, 2, 7, 10, 0x7f, 0x80, 0xff] {
            let mut roi = whole.clone();
            roi[place] = value;
            std::fs::write(&path, &roi).unwrap();
            if let Ok(found) = read_points(&path) {
                assert!(found.cloud.positions.iter().flatten().all(|v| v.is_finite()));
            }
        }
        std::fs::write(&path, &whole[..place]).unwrap();
        assert!(read_points(&path).is_err());
    }
}
