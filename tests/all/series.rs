//! Several times of an image: one store with an axis of time, from marks on some of the times.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::fmt::Write;
use std::fs;
use std::path::Path;

use serde_json::Value;
use strandline::grid::{Box3, Geometry};
use strandline::io::ome_zarr::ImageReader;
use strandline::io::stack::formats::open_stack;
use strandline::io::stack::volume::Select;
use strandline::store::SamplesMut;

use crate::common::ball::Bench;
use crate::common::held::Held;
use crate::common::random::Random;
use crate::common::stores::{contents, same};
use crate::common::tiff_bytes::{Value as Tag, bytes_u16, gray_page, tiff_file};
use crate::common::{python, shipped};

const DROPLET: &str = "stacks/napari-stress-ExampleTifSequence.tif";
const TIMES: u32 = 21;
const SHAPE: [i64; 3] = [31, 30, 16];

/// The droplet at a time.
fn droplet(time: u32) -> Vec<u8> {
    let stack = open_stack(&shipped(DROPLET), Select { time, ..Select::default() }).unwrap();
    let mut values = vec![0; Box3::from_shape(SHAPE).len()];
    stack.read_box(&Box3::from_shape(SHAPE), SamplesMut::U8(&mut values)).unwrap();
    values
}

/// Marks of a time as somebody would draw them: in each second slice the contour at half of the brightness, looked for along rays from its
/// middle.
fn contours(time: u32, text: &mut String) {
    let values = droplet(time);
    let [nx, ny, nz] = SHAPE.map(|n| n as usize);
    let mut sorted = values.clone();
    sorted.sort_unstable();
    let (dark, bright) = (f64::from(sorted[sorted.len() / 2]), f64::from(sorted[sorted.len() * 99 / 100]));
    let level = f64::midpoint(dark, bright);
    for z in 0..nz {
        let plane = &values[z * nx * ny..][..nx * ny];
        let inside: Vec<usize> = (0..plane.len()).filter(|&n| f64::from(plane[n]) > level).collect();
        if inside.len() < 12 || z % 2 == 1 {
            continue;
        }
        let mean =
            |of: fn(usize, usize) -> usize| inside.iter().map(|&n| of(n, nx) as f64).sum::<f64>() / inside.len() as f64;
        let (x, y) = (mean(|n, nx| n % nx), mean(|n, nx| n / nx));
        let grey = |x: f64, y: f64| -> f64 {
            let (x, y) = (x.clamp(0.0, (nx - 1) as f64), y.clamp(0.0, (ny - 1) as f64));
            let (i, j) = ((x as usize).min(nx - 2), (y as usize).min(ny - 2));
            let (u, v) = (x - i as f64, y - j as f64);
            let at = |i: usize, j: usize| f64::from(plane[j * nx + i]);
            (1.0 - v) * ((1.0 - u) * at(i, j) + u * at(i + 1, j))
                + v * ((1.0 - u) * at(i, j + 1) + u * at(i + 1, j + 1))
        };
        for ray in 0..20 {
            let (sin, cos) = (f64::from(ray) * TAU / 20.0).sin_cos();
            let along = |step: i32| (x + 0.05 * f64::from(step) * cos, y + 0.05 * f64::from(step) * sin);
            // The last crossing: the inside may be dark in places.
            let last = (0..400).rev().map(along).find(|&(x, y)| grey(x, y) > level);
            let (x, y) = last.unwrap();
            writeln!(text, "1,{z},{time},{x},{y},{z}").unwrap();
        }
    }
}

pub(crate) fn marks(times: impl IntoIterator<Item = u32>) -> String {
    let mut text = String::from("object,contour,t,x,y,z\n");
    times.into_iter().for_each(|time| contours(time, &mut text));
    text
}

pub(crate) fn bench() -> Bench {
    let bench = Bench::bare();
    fs::copy(shipped(DROPLET), bench.path("drop.tif")).unwrap();
    bench.write("three.csv", &marks([0, 10, 20]));
    bench
}

/// The volumes of an object over time.
fn volumes(report: &Value, object: u64) -> Vec<f64> {
    let times = report["result"]["times"].as_array().unwrap();
    let of = |time: &Value| {
        let objects = time["objects"].as_array().unwrap();
        objects.iter().find(|found| found["label"] == object).unwrap()["volume"].as_f64().unwrap()
    };
    times.iter().map(of).collect()
}

#[test]
fn three_marked_times_tell_the_volumes_of_all() {
    let bench = bench();
    bench.write("all.csv", &marks(0..TIMES));
    let printed = bench.succeed("segment drop.tif --points three.csv --time all -o out/three.zarr");
    assert!(printed.lines().count() == 22 && printed.contains("marks of time"), "{printed}");
    bench.succeed("segment drop.tif --points all.csv --time all -q -o out/all.zarr");
    let (few, all) = (bench.json("out/three.zarr/report.json"), bench.json("out/all.zarr/report.json"));
    for (time, (few, all)) in volumes(&few, 1).into_iter().zip(volumes(&all, 1)).enumerate() {
        assert!((few / all - 1.0).abs() < 0.03, "time {time}: {few} from three marked times, {all} from all");
    }
    let times = few["result"]["times"].as_array().unwrap();
    for (time, told) in times.iter().enumerate() {
        let object = &told["objects"][0];
        assert_eq!((&told["time"], &told["state"]), (&time.into(), &"done".into()));
        assert_eq!(object["marks_from"], [0, 10, 20][(time + 4) / 10], "time {time}");
        assert!(object["hausdorff"]["mean"].is_number() && object["shift_is_told"] == true);
    }
    table_is_that_of_the_report(&bench, &few);
    let told = bench.succeed("verify out/three.zarr");
    assert!(told.contains("meshes: 21 meshes") && told.contains("21 of 21 times"), "{told}");
    let told = bench.succeed("info out/three.zarr");
    assert!(told.contains("axes t, z, y, x") && told.contains("at 21 times"), "{told}");
    the_page_draws_the_volumes(&bench.path("out/three.zarr/report.html"));
    let Some(python) = python::interpreter() else { return };
    let arguments = [bench.path("out/three.zarr"), bench.path("drop.tif"), "0".into(), TIMES.to_string().into()];
    let counts =
        python::run_script(python, "check_series.py", &arguments.iter().map(AsRef::as_ref).collect::<Vec<_>>());
    let counts: Vec<BTreeMap<String, u64>> = serde_json::from_str(&counts.unwrap()).unwrap();
    for (told, counted) in times.iter().zip(counts) {
        assert_eq!(told["label_voxels"]["1"], counted["1"]);
    }
}

fn table_is_that_of_the_report(bench: &Bench, report: &Value) {
    let table = fs::read_to_string(bench.path("out/three.zarr/volumes.csv")).unwrap();
    let rows: Vec<Vec<&str>> = table.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(rows[0][..7], ["t", "time", "object", "state", "volume", "area", "voxels"]);
    let told = volumes(report, 1);
    assert_eq!(rows.len(), 1 + told.len());
    for (row, volume) in rows[1..].iter().zip(told) {
        assert_eq!(row[4].parse::<f64>().unwrap(), volume);
        assert_eq!((row.len(), row[1], row[2], row[3]), (rows[0].len(), "", "1", "done"));
    }
}

fn the_page_draws_the_volumes(path: &Path) {
    let text = fs::read_to_string(path).unwrap();
    let page = roxmltree::Document::parse(&text[text.find("<html").unwrap()..]).unwrap();
    let named = |name: &str| page.descendants().filter(|node| node.tag_name().name() == name).count();
    // A dot for each time.
    assert!(named("circle") >= 21 && named("svg") == 1 && named("tr") > 21, "{} dots", named("circle"));
    assert_eq!(named("a"), 3, "pages of the first, the middle and the last time");
    the_slices_are_those_of_times(path, &page);
}

#[test]
fn a_run_that_was_killed_goes_on_with_the_same_bits() {
    let bench = bench();
    let run = "segment drop.tif --points three.csv --time 7:12 --mesh out/m.ply";
    bench.succeed(&format!("{run} -q -o out/whole.zarr --overwrite"));
    let whole = contents(&bench.path("out/whole.zarr"));
    let meshes: Vec<String> = bench.entries("out").into_iter().filter(|name| name.starts_with("m-")).collect();
    assert_eq!(meshes, ["m-t0007.ply", "m-t0008.ply", "m-t0009.ply", "m-t0010.ply", "m-t0011.ply"]);
    for mesh in &meshes {
        fs::remove_file(bench.path("out").join(mesh)).unwrap();
    }
    let held = |signal: &str, flags: &str| {
        let mut held = Held::start(bench.command(&format!("{run} -o out/x.zarr {flags}")));
        held.hear("time 9 (3 of 5)");
        held.signal(signal);
        held.finish()
    };
    assert!(!held("KILL", "").status.success());
    assert!(!bench.path("out/x.zarr").exists(), "nothing looks finished");
    // What was killed outright leaves its scratch to the next run.
    let refused = |arguments: &str| {
        let output = bench.run(arguments);
        assert_eq!(output.status.code(), Some(2));
        String::from_utf8(output.stderr).unwrap()
    };
    let told = refused(&format!("{run} -o out/x.zarr"));
    assert!(told.contains("holds checkpoints of a run that was ended"), "{told}");
    let told = refused("segment drop.tif --points three.csv --time 7:13 --mesh out/m.ply -o out/x.zarr --resume");
    assert!(told.contains("--time was 7:12 and is 7:13"), "{told}");
    // Ended once more, on its way from there.
    let ended = held("INT", "--resume");
    assert_eq!(ended.status.code(), Some(130), "{}", ended.said);
    assert!(ended.said.contains("2 of 5 times are done"), "{}", ended.said);
    let output = bench.run(&format!("{run} -o out/x.zarr --resume"));
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success() && !said.contains("time 8 (") && said.contains("time 9 ("), "{said}");
    same(&whole, &contents(&bench.path("out/x.zarr")), "a run that was killed");
    assert!(meshes.iter().all(|mesh| bench.path("out").join(mesh).exists()));
    assert!(!bench.entries("out").iter().any(|name| name.contains("checkpoint") || name.starts_with('.')));
    assert!(bench.entries("scratch").is_empty());
    let again = bench.run(&format!("{run} -o out/x.zarr --resume"));
    assert!(String::from_utf8_lossy(&again.stderr).contains("is complete; there is nothing to go on with"));
    bench.succeed(&format!("{run} -q -o out/off.zarr --checkpoint off --overwrite --threads 1"));
    same(&whole, &contents(&bench.path("out/off.zarr")), "without checkpoints");
    let told = bench.succeed("verify out/x.zarr --rerun");
    assert!(told.contains("ok     rerun"), "{told}");
}

/// The page has the very pictures that the pages of its first, middle and last time have.
fn the_slices_are_those_of_times(path: &Path, page: &roxmltree::Document<'_>) {
    let pictures = |page: &roxmltree::Document<'_>| -> Vec<String> {
        let images = page.descendants().filter(|node| node.has_tag_name(("http://www.w3.org/1999/xhtml", "img")));
        images.map(|image| image.attribute("src").unwrap().to_owned()).collect()
    };
    let shown = pictures(page);
    assert_eq!(shown.len(), 9);
    for (n, time) in [0, 10, 20].into_iter().enumerate() {
        let of_time = path.with_file_name(format!("times/t{time:04}/report.html"));
        let text = fs::read_to_string(of_time).unwrap();
        let of_time = roxmltree::Document::parse(&text[text.find("<html").unwrap()..]).unwrap();
        assert!(shown[3 * n..3 * n + 3] == pictures(&of_time)[..3], "time {time}");
    }
}

/// A series of ellipsoids that move, near each other, in noise; 16 bits, with a time interval.
struct Moving {
    geometry: Geometry,
    /// Centre, velocity and half axes of each, physical.
    bodies: Vec<[[f64; 3]; 3]>,
    times: u32,
}

impl Moving {
    fn new() -> Self {
        let geometry = Geometry {
            shape: [72, 64, 24],
            spacing: [0.5, 0.5, 1.0],
            origin: [0.0; 3],
            unit: Some("micrometer".into()),
        };
        let bodies = vec![
            [[9.0, 9.0, 12.0], [1.1, 0.3, 0.0], [5.0, 5.0, 5.0]],
            [[21.0, 10.0, 11.0], [0.4, 1.2, 0.4], [5.5, 5.0, 6.0]],
            [[13.0, 21.5, 12.0], [-0.4, 0.5, -0.3], [6.0, 5.0, 5.5]],
        ];
        Self { geometry, bodies, times: 6 }
    }

    fn centre(&self, body: usize, time: u32) -> [f64; 3] {
        let [from, by, _] = self.bodies[body];
        std::array::from_fn(|a| from[a] + f64::from(time) * by[a])
    }

    fn volume(&self, body: usize) -> f64 {
        2.0 / 3.0 * TAU * self.bodies[body][2].iter().product::<f64>()
    }

    fn write(&self, path: &Path) {
        let mut random = Random(3);
        let [nx, ny, nz] = self.geometry.shape;
        let mut pages = Vec::new();
        for time in 0..self.times {
            for z in 0..nz {
                let grey = |(x, y): (i64, i64)| -> u16 {
                    let p = self.geometry.position([x, y, z]);
                    let level = |body: usize| {
                        let (c, half) = (self.centre(body, time), self.bodies[body][2]);
                        let far = (0..3).map(|a| ((p[a] - c[a]) / half[a]).powi(2)).sum::<f64>().sqrt();
                        300.0 / (1.0 + ((far - 1.0) * 12.0).exp())
                    };
                    (100.0 + (0..3).map(level).fold(0.0, f64::max) + 80.0 * random.unit()) as u16
                };
                let voxels: Vec<u16> = (0..ny).flat_map(|y| (0..nx).map(move |x| (x, y))).map(grey).collect();
                let page = gray_page(nx as u32, ny as u32, 16, bytes_u16(&voxels, false))
                    .with(282, Tag::Rational(2, 1))
                    .with(283, Tag::Rational(2, 1));
                pages.push(page);
            }
        }
        let images = nz * i64::from(self.times);
        let text = format!(
            "ImageJ=1.54f\nimages={images}\nslices={nz}\nframes={}\nhyperstack=true\nunit=um\nspacing=1\nfinterval=2.5\ntunit=min\n",
            self.times
        );
        pages[0] = pages[0].clone().with(270, Tag::Text(text));
        fs::write(path, tiff_file(&pages, false)).unwrap();
    }

    /// Marks of a body at a time, on every second slice.
    fn marks(&self, body: usize, time: u32, text: &mut String) {
        let (c, half) = (self.centre(body, time), self.bodies[body][2]);
        for slice in (0..self.geometry.shape[2]).step_by(2) {
            let square = 1.0 - ((slice as f64 - c[2]) / half[2]).powi(2);
            for n in (0..20).filter(|_| square > 0.1) {
                let (sin, cos) = (f64::from(n) * TAU / 20.0).sin_cos();
                let (x, y) = (c[0] + half[0] * square.sqrt() * cos, c[1] + half[1] * square.sqrt() * sin);
                writeln!(text, "{},{slice},{time},{x},{y},{slice}", body + 1).unwrap();
            }
        }
    }
}

#[test]
fn neighbours_that_move_apart_are_each_followed() {
    let (bench, moving) = (Bench::bare(), Moving::new());
    moving.write(&bench.path("moving.tif"));
    let mut text = String::from("object,contour,t,x,y,z\n");
    // The first is marked at the beginning, the others at times of their own.
    for (body, time) in [(0, 0), (1, 5), (2, 2)] {
        moving.marks(body, time, &mut text);
    }
    bench.write("marks.csv", &text);
    bench.succeed("segment moving.tif --points marks.csv --time all -q -o out/x.zarr --mesh out/m.ply");
    let report = bench.json("out/x.zarr/report.json");
    assert_eq!((&report["grid"]["time_step"], &report["grid"]["time_unit"]), (&2.5.into(), &"minute".into()));
    for (time, told) in report["result"]["times"].as_array().unwrap().iter().enumerate() {
        assert_eq!(told["at"], 2.5 * time as f64);
        for (body, from) in [0_usize, 5, 2].into_iter().enumerate() {
            let object = &told["objects"][body];
            assert_eq!((&object["label"], &object["marks_from"]), (&(body + 1).into(), &from.into()));
            let (truth, volumes) = (moving.volume(body), volumes(&report, body as u64 + 1));
            let (volume, marked) = (volumes[time], volumes[from]);
            assert!((volume / truth - 1.0).abs() < 0.08, "time {time}, body {body}: {volume} of {truth}");
            assert!((volume / marked - 1.0).abs() < 0.04, "time {time}, body {body}: {volume}, {marked} where marked");
            let (now, marked) = (moving.centre(body, time as u32), moving.centre(body, from as u32));
            for a in 0..3 {
                let [centroid, shift] = ["centroid_xyz", "shift_xyz"].map(|key| object[key][a].as_f64().unwrap());
                assert!((centroid - now[a]).abs() < 0.25, "time {time}, body {body}: {centroid} is not {}", now[a]);
                assert!((shift - (now[a] - marked[a])).abs() < 0.4, "time {time}, body {body}: moved by {shift}");
            }
        }
    }
    assert!(bench.path("out/m-t0004-2.ply").exists());
    assert!(bench.path("out/x.zarr/meshes/t0004/object-2.ply").exists());
    bench.succeed("verify out/x.zarr");
    let described = bench.json("out/x.zarr/zarr.json")["attributes"]["ome"]["multiscales"][0].clone();
    assert_eq!(described["axes"][0], serde_json::json!({ "name": "t", "type": "time", "unit": "minute" }));
    // The store is read again, as any image with times is.
    bench.succeed("segment out/x.zarr --points out/x.zarr/marks.csv --time 3:5 -q -o out/y.zarr --ome 0.4");
    let again = bench.json("out/y.zarr/report.json");
    assert_eq!(volumes(&again, 1), volumes(&report, 1)[3..5]);
    assert!(bench.path("out/y.zarr/0/1/0/0/0").exists());
    bench.succeed("verify out/y.zarr");
    bench.succeed("convert out/x.zarr out/one.tif --time 4");
    an_object_leaves_the_part(&bench);
}

/// The first one alone, in a part that it leaves: refused where it has left, and its image is there all the same.
fn an_object_leaves_the_part(bench: &Bench) {
    let marks = fs::read_to_string(bench.path("marks.csv")).unwrap();
    let first: Vec<&str> = marks.lines().filter(|line| line.starts_with(['o', '1'])).collect();
    bench.write("first.csv", &(first.join("\n") + "\n"));
    let output = bench.run("segment moving.tif --points first.csv --time all --crop :27,:,: -q -o out/c.zarr");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(3), "{said}");
    let report = bench.json("out/c.zarr/report.json");
    let states: Vec<&str> =
        report["result"]["times"].as_array().unwrap().iter().map(|time| time["state"].as_str().unwrap()).collect();
    assert_eq!((states[0], states[5]), ("done", "refused"), "{said}");
    let whole = ImageReader::open(&bench.path("out/x.zarr")).unwrap().at(5);
    let part = Box3::new([0; 3], [27, 64, 24]);
    let of_part = ImageReader::open(&bench.path("out/c.zarr")).unwrap().at(5);
    assert_eq!(of_part.read_box(0, &part).unwrap(), whole.read_box(0, &part).unwrap());
    bench.succeed("verify out/c.zarr");
    refused_times_tell_their_object(bench);
}

/// A time that was refused tells which object it is, from which marks, moved by how much, and why.
fn refused_times_tell_their_object(bench: &Bench) {
    let table = fs::read_to_string(bench.path("out/c.zarr/volumes.csv")).unwrap();
    let rows: Vec<Vec<&str>> = table.lines().map(|line| line.splitn(15, ',').collect()).collect();
    assert_eq!((rows[0][10], rows[0][14]), ("marks_from", "reason"));
    let whole = bench.json("out/x.zarr/report.json");
    let refused = bench.json("out/c.zarr/report.json")["result"]["times"][5]["refused"][0].clone();
    let moved = &whole["result"]["times"][5]["objects"][0]["shift_xyz"];
    assert_eq!((&refused["label"], &refused["marks_from"], &refused["shift_xyz"]), (&1.into(), &0.into(), moved));
    let last = &rows[6];
    assert_eq!((last[0], last[2], last[3], last[10]), ("5", "1", "refused", "0"));
    assert_eq!(last[11].parse::<f64>().unwrap(), moved[0].as_f64().unwrap());
    let reason = refused["reason"].as_str().unwrap();
    assert!(!reason.is_empty() && last[14].contains(reason), "{last:?}");
    assert_eq!((rows[1][3], rows[1][14]), ("done", ""));
}

#[test]
fn a_batch_lists_each_time() {
    let bench = bench();
    let list = "[[items]]\ncommand = \"segment\"\nimages = \"drop.tif\"\npoints = \"three.csv\"\ntime = \"9:11\"\nmax_steps = 3\n";
    bench.write("jobs.toml", list);
    bench.succeed("batch jobs.toml -o out/all -q");
    let summary = bench.json("out/all/summary.json");
    let rows = summary["rows"].as_array().unwrap();
    let report = bench.json("out/all/drop.zarr/report.json");
    let told: Vec<f64> = rows.iter().map(|row| row["volume"].as_f64().unwrap()).collect();
    assert_eq!(told, volumes(&report, 1));
    let times: Vec<_> = rows.iter().map(|row| (row["time"].as_u64(), row["object"].as_u64())).collect();
    assert_eq!(times, [(Some(9), Some(1)), (Some(10), Some(1))]);
    let table = fs::read_to_string(bench.path("out/all/summary.csv")).unwrap();
    assert!(table.starts_with("item,object,time,state,") && table.contains("\ndrop,1,10,done,"), "{table}");
}

#[test]
fn what_cannot_be_is_said_in_one_sentence() {
    let bench = bench();
    let run = |flags: &str, code: i32| {
        bench.fail(&format!("segment drop.tif --points three.csv -o out/x.zarr {flags}"), code)
    };
    for (flags, says) in [
        ("--time 0:22", "--time 0:22: the image has the times 0 to 20"),
        ("--time 21:", "the image has the times 0 to 20"),
        ("--time 5:5", "is no time at all"),
        ("--time 7:2", "is no time at all"),
        ("--time x", "'x' is no whole number"),
    ] {
        let told = run(flags, 2);
        assert!(told.contains(says), "{flags}: {told}");
        assert!(bench.entries("out").is_empty(), "{flags}");
    }
    bench.write("late.csv", &marks([20]).replace(",20,", ",40,"));
    let told = bench.fail("segment drop.tif --points late.csv --time all -o out/x.zarr", 2);
    assert!(told.contains("late.csv: has marks of time 40, and the image has the times 0 to 20"), "{told}");
    bench.write("out/m-t0002.ply", "mine");
    let told = run("--time 0:3 --mesh out/m.ply", 2);
    assert!(told.contains("m-t0002.ply: exists already"), "{told}");
    assert_eq!(bench.entries("out"), ["m-t0002.ply"]);
    let told = bench.fail("segment drop.tif --points three.csv --time all -o none --resume", 2);
    assert!(told.contains("give -o OUT.zarr"), "{told}");
}

#[test]
fn what_is_odd_is_noted_and_parts_that_fail_are_told() {
    let bench = bench();
    // Without times the marks are those of the first one.
    let without_time = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        [cells[0], cells[1], cells[3], cells[4], cells[5]].join(",")
    };
    let without: Vec<String> = marks([4]).lines().map(without_time).collect();
    bench.write("plain.csv", &(without.join("\n") + "\n"));
    let plan = bench.succeed("segment drop.tif --points plain.csv --time 4:7 --dry-run -o out/x.zarr");
    assert!(plan.contains("times 4 to 6: object 1 from its") && plan.contains("marks of time 4"), "{plan}");
    assert!(bench.entries("out").is_empty());
    let output = bench.run("segment drop.tif --points plain.csv --time 4:7 -o none --report out/r.json");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(
        output.status.success() && said.contains("names no times (column t); its marks are those of time 4"),
        "{said}"
    );
    assert_eq!(said.matches("no x, y, z spacing").count(), 1, "said once: {said}");
    assert_eq!(volumes(&bench.json("out/r.json"), 1).len(), 3);
    // A second object that is marked at time 5 alone, as a line that encloses nothing.
    let mut two = marks([4, 6]);
    let line: Vec<String> = (0..8).map(|n| format!("2,0,5,{n},2,3\n")).collect();
    two += &line.concat();
    bench.write("two.csv", &two);
    let output = bench.run("segment drop.tif --points two.csv --time 4:7 -q -o out/two.zarr");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(3), "{said}");
    assert!(said.contains("3 of 6 objects at all times could not be solved: time 4: "), "{said}");
    let report = bench.json("out/two.zarr/report.json");
    assert_eq!(report["result"]["times"][1]["state"], "partly");
    assert_eq!(volumes(&report, 1).len(), 3);
    bench.succeed("verify out/two.zarr");
    // The second one's marks are those of time 5 at all times.
    let table = fs::read_to_string(bench.path("out/two.zarr/volumes.csv")).unwrap();
    let refused: Vec<Vec<&str>> = table
        .lines()
        .map(|line| line.splitn(15, ',').collect())
        .filter(|row: &Vec<&str>| row[3] == "refused")
        .collect();
    let origins: Vec<_> = refused.iter().map(|row| (row[0], row[2], row[10])).collect();
    assert_eq!(origins, [("4", "2", "5"), ("5", "2", "5"), ("6", "2", "5")]);
    assert!(refused.iter().all(|row| row[14].contains("object 2")), "{table}");
}
