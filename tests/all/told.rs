//! What the program tells of odd inputs, and where: a hole in marks, a value that is no number, whole numbers that no double
//! holds, a mesh without its first word.

#![allow(clippy::unwrap_used)]

use std::fmt::Write as _;
use std::fs;

use serde_json::Value as Json;
use strandline::grid::TriangleMesh;

use crate::common::ball::{Ball, Bench};
use crate::common::clouds::sphere;
use crate::common::meshes::{self, Form};
use crate::common::stores::volume;
use crate::common::tiff_bytes::{Value, gray_page, tiff_file};
use crate::common::zarr_files::{group, gzip_array, scale};

/// What a run that succeeds says on standard error.
fn told(bench: &Bench, arguments: &str) -> String {
    let output = bench.run(arguments);
    let told = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{arguments}: {told}");
    told
}

/// Points all over the ball's border, but for a cap at its top, from a height on in parts of the radius.
fn open_at_the_top(ball: &Ball, from: f64) -> String {
    let mut text = String::from("x,y,z\n");
    for n in 0..2000 {
        let up = 1.0 - (2.0 * f64::from(n) + 1.0) / 2000.0;
        if up > from {
            continue;
        }
        let (turn, across) = (2.399_963 * f64::from(n), (1.0 - up * up).sqrt());
        let on = [across * turn.cos(), across * turn.sin(), up];
        let [x, y, z]: [f64; 3] = std::array::from_fn(|a| ball.centre[a] + ball.radius * on[a]);
        writeln!(text, "{x},{y},{z}").unwrap();
    }
    text
}

/// The widest hole is the rim's middle, also where a crop moves the grid.
#[test]
fn a_hole_in_marks_is_told_with_its_place_and_slice() {
    let ball = Ball::small();
    let bench = Bench::new(&ball);
    // The space within is deeper than twice the hole's half width in the first one alone.
    for (from, crop, words) in [(0.93, "", "leaks through a hole "), (0.85, "--crop 2:39,1:35,2:20", "has a hole ")] {
        bench.write("open.csv", &open_at_the_top(&ball, from));
        let said = bench.fail(&format!("segment image.tif --points open.csv --beta 1 {crop} -o none -q"), 2);
        assert!(said.contains(words), "{said}");
        let place = said.split_once(" micrometer wide at (").unwrap().1.split(')').next().unwrap();
        let at: Vec<f64> = place.split(", ").map(|word| word.parse().unwrap()).collect();
        // The saddle lies on a voxel, in the plane of the rim or beside it.
        let off = [at[0] - ball.centre[0], at[1] - ball.centre[1], at[2] - ball.centre[2] - from * ball.radius];
        assert!(off[0].abs() < 1.1 && off[1].abs() < 1.1 && off[2].abs() < 1.6, "{said}");
        assert!(said.contains(&format!("on slice {} (counted from 0)", at[2].round())), "{said}");
    }
}

/// The file, and the page, slice or chunk, of a value that is no number.
#[test]
fn a_value_that_is_no_number_is_told_with_file_and_place() {
    let ball = Ball::small();
    let bench = Bench::new(&ball);
    let [x, y, z] = ball.geometry.shape.map(|n| n as usize);
    let mut values: Vec<f32> = ball.voxels().into_iter().map(f32::from).collect();
    values[(3 * y + 2) * x + 19] = f32::NAN;
    let bytes = |values: &[f32]| -> Vec<u8> { values.iter().flat_map(|v| v.to_le_bytes()).collect() };
    let page = |n: usize| {
        let plane = bytes(&values[n * x * y..(n + 1) * x * y]);
        gray_page(x as u32, y as u32, 32, plane).with(339, Value::Short(vec![3]))
    };
    fs::write(bench.path("nan.tif"), tiff_file(&(0..z).map(page).collect::<Vec<_>>(), false)).unwrap();
    fs::create_dir(bench.path("slices")).unwrap();
    for n in 0..z {
        fs::write(bench.path(&format!("slices/s{n:02}.tif")), tiff_file(&[page(n)], false)).unwrap();
    }
    group(&bench.path("nan.zarr"), 3, "zyx", &scale(&[1.0, 0.5, 0.5]), &Json::Null);
    gzip_array(&bench.path("nan.zarr/0"), &[z as i64, y as i64, x as i64], "float32", &bytes(&values));
    for (image, file, place) in [
        ("nan.tif", "nan.tif: ", "plane 3 (page 4) "),
        ("slices", "s03.tif: ", "plane 3 "),
        ("nan.zarr", "nan.zarr/0: ", "plane 3 (chunk 0, 0, 0) "),
    ] {
        let said = bench
            .fail(&format!("segment {image} --image-spacing 0.5,0.5,1 --crop :,:,2:20 --points marks.csv -o none"), 2);
        assert!(said.contains(&format!("{file}{place}holds a value that is no number")), "{said}");
        assert!(said.contains("at voxel 19, 2, 3 (x, y, z, counted from 0)"), "{said}");
    }
}

#[test]
fn whole_numbers_that_no_double_holds_are_told() {
    let ball = Ball::small();
    let bench = Bench::new(&ball);
    let [x, y, z] = ball.geometry.shape;
    let notes = |data_type: &str, word: &dyn Fn(u16) -> [u8; 8]| {
        let folder = bench.path("image.zarr");
        let _ = fs::remove_dir_all(&folder);
        group(&folder, 3, "zyx", &scale(&[1.0, 0.5, 0.5]), &Json::Null);
        let bytes: Vec<u8> = ball.voxels().into_iter().flat_map(word).collect();
        gzip_array(&folder.join("0"), &[z, y, x], data_type, &bytes);
        told(&bench, "segment image.zarr --points marks.csv -o none")
    };
    let far = |v: u16| (1_i64 << 60) + (i64::from(v) << 20) + 1;
    for (told, is_told) in [
        (notes("int64", &|v| far(v).to_le_bytes()), true),
        (notes("int64", &|v| (-far(v)).to_le_bytes()), true),
        (notes("uint64", &|v| far(v).unsigned_abs().to_le_bytes()), true),
        (notes("int64", &|v| i64::from(v).to_le_bytes()), false),
        // What is a double in the file loses nothing.
        (notes("float64", &|v| (f64::from(v) * 1e16).to_le_bytes()), false),
    ] {
        assert_eq!(told.contains("image.zarr") && told.contains("beyond 2^53 are rounded"), is_told, "{told}");
    }
}

/// A cube and its OFF text without the word.
fn without_keyword(mesh: &TriangleMesh) -> String {
    let text = String::from_utf8(Form::Off.write(mesh)).unwrap();
    text.strip_prefix("OFF\n").unwrap().to_owned()
}

#[test]
fn off_without_its_first_word_and_points_are_told_apart_in_words() {
    let bench = Bench::bare();
    let run = "--spacing 0.25 --padding 0.5 --overwrite -o out/x.zarr";
    let cube = meshes::cuboid([0.0; 3], [1.0; 3]);
    fs::write(bench.path("named.off"), Form::Off.write(&cube)).unwrap();
    bench.write("bare.off", &without_keyword(&cube));
    bench.succeed(&format!("distance named.off {run} -q"));
    let named = volume(&bench.path("out/x.zarr"));
    let said = told(&bench, &format!("distance bare.off {run}"));
    assert!(said.contains("bare.off: is read as OFF without its first word: a mesh, not points"), "{said}");
    assert!(volume(&bench.path("out/x.zarr")) == named);
    let said = told(&bench, &format!("distance named.off {run}"));
    assert!(!said.contains("without its first word"), "{said}");
    // Faces beyond what is looked at to tell what a file holds.
    let ball = meshes::sphere([0.0; 3], 1.0, 30, std::f64::consts::PI);
    let text = without_keyword(&ball);
    assert!(text.lines().take(1 + ball.vertices.len()).map(str::len).sum::<usize>() > 1 << 16);
    bench.write("ball.off", &text);
    fs::write(bench.path("named.off"), Form::Off.write(&ball)).unwrap();
    bench.succeed(&format!("distance named.off {run} -q"));
    let named = volume(&bench.path("out/x.zarr"));
    let said = told(&bench, &format!("distance ball.off {run}"));
    assert!(said.contains("ball.off: is read as OFF without its first word: a mesh, not points"), "{said}");
    assert!(volume(&bench.path("out/x.zarr")) == named);
    // Lines alone are no mesh; points whose first one counts the others, and points that do not.
    bench.write("lines.off", "4 2 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n2 0 1\n2 2 3\n");
    let said = told(&bench, "distance lines.off --spacing 0.5 --padding 1 -o none");
    assert!(said.contains("all of its 7 lines are taken as points") && said.contains("write OFF above it"), "{said}");
    bench.write("counts.xyz", "4 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 1\n");
    let said = told(&bench, "distance counts.xyz --spacing 0.5 --padding 1 -o none");
    assert!(said.contains("all of its 5 lines are taken as points"), "{said}");
    bench.write("points.xyz", "5 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 1\n");
    let said = told(&bench, "distance points.xyz --spacing 0.5 --padding 1 -o none");
    assert!(!said.contains("OFF"), "{said}");
}

/// Settings are told whether they were given or not.
#[test]
fn reports_tell_how_the_store_was_packed() {
    let bench = Bench::new(&Ball::small());
    let line = |p: [f64; 3]| format!("{} {} {}\n", p[0], p[1], p[2]);
    bench.write("ball.xyz", &sphere([0.0; 3], 1.0, 300, |_| true).into_iter().map(line).collect::<String>());
    bench.write("other.xyz", "3 0 0\n");
    for run in [
        "distance ball.xyz --spacing 0.25",
        "middle ball.xyz other.xyz --spacing 0.25",
        "reconstruct ball.xyz --spacing 0.25 --max-steps 2",
        "segment image.tif --points marks.csv --max-steps 2",
    ] {
        for (flags, told) in [("", "fast"), ("--compress small", "small"), ("--compress none", "none")] {
            bench.succeed(&format!("{run} {flags} -q -o none --report out/r.json --overwrite"));
            assert_eq!(bench.json("out/r.json")["settings"]["compress"], told, "{run}");
        }
        bench.succeed(&format!("{run} --compress small -q -o out/x.zarr --overwrite"));
        assert_eq!(bench.json("out/x.zarr/report.json")["settings"]["compress"], "small", "{run}");
    }
}
