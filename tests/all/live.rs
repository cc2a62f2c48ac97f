//! Stores that live: what a front has passed does not change any more, a live run leaves the bits of another one, and what an
//! interrupted one leaves says so.

#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::sync::Mutex;

use strandline::error::Result;
use strandline::grid::{Box3, BrickGrid, BrickSet, Geometry, PointBins};
use strandline::io::ome_zarr::{Content, ImageSpec, LiveState, StoreWriter};
use strandline::pipeline::distance::{
    Early, Method, Options, Passed, Reads, SOLVERS, Schedule, Solved, Sources, solve_watched,
};
use strandline::store::ElementType;

use crate::common::ball::{Ball, Bench, HEADER, write_stack};
use crate::common::lab::Lab;
use crate::common::patience::wait_until;
use crate::common::random::Random;

/// Keeps what was read of boxes when the front had passed them.
struct Watched {
    boxes: Vec<Box3>,
    seen: Mutex<Vec<(Box3, Vec<f32>)>>,
}

impl Early<f32> for Watched {
    fn passed(&self, passed: &Passed<'_>, solved: &Solved<'_, f32>) -> Result<()> {
        let mut seen = self.seen.lock().unwrap();
        for part in &self.boxes {
            if passed.holds(part) && seen.iter().all(|(other, _)| other != part) {
                let mut values = vec![0.0; part.len()];
                solved.values.read_box(part, &mut values)?;
                seen.push((*part, values));
            }
        }
        Ok(())
    }

    fn reopened(&self) {
        panic!("what was passed has changed");
    }
}

/// Against the finished field, all methods, random clouds on grids of unequal spacings.
#[test]
fn what_a_front_has_passed_is_final() {
    let mut random = Random(5);
    for round in 0..6 {
        let spacing = [1.0, 1.0 + 0.5 * random.unit(), 1.0 + random.unit()];
        let geometry = Geometry { shape: [150, 90, 80], spacing, origin: [0.0; 3], unit: None };
        // Some corner is far from all of them.
        let cloud: Vec<[f64; 3]> =
            (0..1 + 40 * round).map(|_| [30.0, 60.0, 60.0].map(|reach| 10.0 + reach * random.unit())).collect();
        let grid = BrickGrid::new(geometry.shape, 16);
        let bins = PointBins::new(grid, &geometry, &cloud);
        let sources = Sources::cloud(&geometry, &cloud, &bins);
        for row in SOLVERS {
            let lab = Lab::new(2);
            let stage = lab.engine.stage("distance", 0);
            let boxes = geometry.domain().tiles([16; 3]).collect();
            let watched = Watched { boxes, seen: Mutex::default() };
            let order = (Method::named(row.name).unwrap(), Schedule::Front);
            let options = Options::up_to(f64::INFINITY);
            let set = BrickSet::dense(grid);
            let solved = solve_watched::<f32>(
                &stage,
                &sources,
                &set,
                order,
                options,
                Reads { early: Some(&watched), boxes: &[] },
            )
            .unwrap();
            let seen = watched.seen.into_inner().unwrap();
            assert!(seen.len() > 20, "{}: only {} boxes were read early", row.name, seen.len());
            for (part, values) in seen {
                let mut last = vec![0.0; part.len()];
                solved.values.read_box(&part, &mut last).unwrap();
                assert!(values == last, "{} {part:?}", row.name);
            }
        }
    }
}

fn on_sphere(random: &mut Random) -> [f64; 3] {
    loop {
        let place = [0; 3].map(|_| 2.0 * random.unit() - 1.0);
        let length = place.iter().map(|v| v * v).sum::<f64>().sqrt();
        if (0.1..1.0).contains(&length) {
            return place.map(|v| v / length);
        }
    }
}

/// Files of a store that hold chunks or surfaces, and their bytes.
fn contents(store: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut found = Vec::new();
    let mut folders = vec![store.to_path_buf()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.file_name().is_some_and(|name| {
                !["zarr.json", "report.json", "report.html", "checksums.txt"].map(AsRef::as_ref).contains(&name)
            }) {
                found.push((path.strip_prefix(store).unwrap().to_path_buf(), fs::read(&path).unwrap()));
            }
        }
    }
    found.sort();
    found
}

#[test]
fn live_runs_leave_the_bits_of_others() {
    let bench = Bench::bare();
    let mut ball = Vec::new();
    let mut random = Random(2);
    for _ in 0..2000 {
        let place = on_sphere(&mut random);
        ball.push(format!("{} {} {}", place[0], place[1], place[2]));
    }
    fs::write(bench.path("ball.xyz"), ball.join("\n")).unwrap();
    fs::write(bench.path("other.xyz"), "3 0 0\n3 1 0\n3 0 1\n").unwrap();
    for (name, command) in [
        ("distance", "distance ball.xyz --spacing 0.06 --labels --closest-point"),
        ("reconstruct", "reconstruct ball.xyz"),
        ("middle", "middle ball.xyz other.xyz --spacing 0.08"),
    ] {
        bench.succeed(&format!("{command} -q -o {name}.zarr"));
        bench.succeed(&format!("{command} -q --live -o {name}-live.zarr"));
        let [plain, live] = ["", "-live"].map(|end| contents(&bench.path(&format!("{name}{end}.zarr"))));
        assert!(plain == live, "{name}");
        let root = fs::read_to_string(bench.path(&format!("{name}-live.zarr/zarr.json"))).unwrap();
        assert!(root.contains("\"complete\""), "{root}");
    }
}

/// Two objects, apart and so near that what one is depends on the other, with small shards of labels between them.
#[test]
#[ignore = "long; .ci/run has it"]
fn live_segmentations_leave_the_bits_of_others() {
    for (case, between, flags) in [("apart", 24.0, ""), ("near", 11.5, ""), ("shared", 12.5, "--fill-gaps 2")] {
        let first = Ball::large();
        let mut geometry = first.geometry.clone();
        geometry.shape[0] = 500;
        let ball = |x: f64| Ball { geometry: geometry.clone(), centre: [x, 9.0, 9.5], radius: 6.0 };
        let balls = [ball(8.0), ball(8.0 + between)];
        let bench = Bench::bare();
        let [a, b] = [&balls[0], &balls[1]].map(Ball::voxels);
        let voxels: Vec<u16> = a.iter().zip(&b).map(|(a, b)| *a.max(b)).collect();
        write_stack(&bench.path("image.tif"), &geometry, &[&voxels]);
        bench.write("marks.csv", &format!("{HEADER}{}{}", balls[0].marks(1), balls[1].marks(2)));
        let command =
            format!("segment image.tif --points marks.csv --image none --max-steps 2 {flags} -q --memory 1GiB");
        bench.succeed(&format!("{command} -o plain.zarr"));
        bench.succeed(&format!("{command} --live -o live.zarr"));
        let [plain, live] = ["plain", "live"].map(|name| contents(&bench.path(&format!("{name}.zarr"))));
        let names = |found: &[(PathBuf, Vec<u8>)]| found.iter().map(|(path, _)| path.clone()).collect::<Vec<_>>();
        // Shards of coarser levels are smaller in a live store; the finest ones are the same.
        let finest = |found: Vec<(PathBuf, Vec<u8>)>| -> Vec<(PathBuf, Vec<u8>)> {
            found.into_iter().filter(|(path, _)| !path.iter().any(|name| name == "1" || name == "2")).collect()
        };
        let [plain, live] = [finest(plain), finest(live)];
        assert_eq!(names(&plain), names(&live), "{case}");
        for (plain, live) in plain.iter().zip(&live) {
            assert!(plain == live, "{case}: {}", plain.0.display());
        }
        assert!(!bench.path("live.zarr/growing").exists());
    }
}

/// Killed in the midst of it, a live store stays, says that it was interrupted, and is replaced when that is asked for.
#[test]
fn a_killed_live_run_is_told_by_the_next() {
    let bench = Bench::bare();
    fs::write(bench.path("points.xyz"), "0 0 0\n1 0 0\n0 1 0\n").unwrap();
    let grid = "--origin=-1,-1,-1 --spacing 0.01 --shape 300,300,300";
    let command = format!("distance points.xyz {grid} --method fsm --labels --live -q -o out.zarr");
    let store = bench.path("out.zarr");
    let mut child = bench.command(&command).stderr(Stdio::null()).spawn().unwrap();
    wait_until("a store", || store.join("zarr.json").is_file());
    let said = bench.fail(&command, 2);
    assert!(said.contains("another run writes this output"), "{said}");
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(bench.succeed("info out.zarr").contains("interrupted"), "it says that it is not complete");
    let said = bench.fail(&command, 2);
    assert!(said.contains("left incomplete by a run that was interrupted"), "{said}");
    bench.succeed(&format!("{command} --overwrite"));
    assert!(bench.succeed("info out.zarr").contains("complete"));
    let left: Vec<_> = fs::read_dir(store.parent().unwrap()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert!(!left.iter().any(|name| name.to_string_lossy().contains(".partial-")), "{left:?}");
}

/// Many small objects that grow and come to rest at the same time.
#[test]
fn many_objects_grow_side_by_side() {
    let bench = Bench::bare();
    let geometry = Geometry { shape: [160, 160, 40], spacing: [1.0; 3], origin: [0.0; 3], unit: None };
    write_stack(&bench.path("image.tif"), &geometry, &[&vec![7; 160 * 160 * 40]]);
    let ball = |n: u32| Ball {
        geometry: geometry.clone(),
        centre: [16.0 + 32.0 * f64::from(n % 5), 16.0 + 32.0 * f64::from(n / 5), 20.0],
        radius: 11.0,
    };
    let marks: String = (0..25).map(|n| ball(n).marks(n + 1)).collect();
    bench.write("marks.csv", &format!("{HEADER}{marks}"));
    let command =
        "segment image.tif --points marks.csv --image none --image-spacing 1,1,1 --live --threads 4 --log json";
    bench.succeed(&format!("{command} -o live.zarr"));
    assert!(!bench.path("live.zarr/growing").exists());
    assert_eq!(bench.entries("live.zarr/meshes").iter().filter(|name| name.starts_with("object-")).count(), 25);
}

/// Somebody takes the store away, and puts a folder of their own in its place.
#[test]
fn a_live_store_that_is_taken_away_is_no_success() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.zarr");
    let geometry = Geometry { shape: [8; 3], spacing: [1.0; 3], origin: [0.0; 3], unit: None };
    let (element, content) = (ElementType::U8, Content::Grey);
    let spec = ImageSpec { name: "image", geometry: &geometry, element, content, window: None, extremes: None };
    let store = StoreWriter::create_live(&path, false).unwrap();
    let image = store.image("", &spec).unwrap();
    fs::rename(&path, folder.path().join("moved.zarr")).unwrap();
    fs::create_dir(&path).unwrap();
    fs::write(path.join("mine"), "precious").unwrap();
    let written = image.levels()[0].write_shard(&geometry.domain(), &[1u8; 512]);
    let told = store.live().unwrap().tell(LiveState::Running, 0.5);
    for error in [written.map(|_| ()).unwrap_err(), told.unwrap_err(), store.finish().unwrap_err()] {
        assert!(error.to_string().contains("removed, moved or replaced"), "{error}");
    }
    let left: Vec<_> = fs::read_dir(&path).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(left, ["mine"]);
}

/// What is read of a store that is not complete is told.
#[test]
fn incomplete_stores_are_no_silent_inputs() {
    let bench = Bench::bare();
    let geometry = Geometry { shape: [8; 3], spacing: [1.0; 3], origin: [0.0; 3], unit: None };
    let (element, content) = (ElementType::U8, Content::Grey);
    let spec = ImageSpec { name: "image", geometry: &geometry, element, content, window: None, extremes: None };
    let store = StoreWriter::create_live(&bench.path("in.zarr"), false).unwrap();
    let image = store.image("", &spec).unwrap();
    image.levels()[0].write_shard(&geometry.domain(), &[1u8; 512]).unwrap();
    let told = |name: &str| {
        let ended = bench.run(&format!("convert in.zarr {name}"));
        assert!(ended.status.success());
        String::from_utf8(ended.stderr).unwrap()
    };
    assert!(told("a.nrrd").contains("still written by another run"));
    drop(store);
    assert!(told("b.nrrd").contains("left by a run that was interrupted"));
}

/// Each event of a run is an object on a line of its own, the last of which says how it ended.
#[test]
fn events_are_lines_of_json() {
    let bench = Bench::bare();
    fs::write(bench.path("points.xyz"), "0 0 0\n1 0 0\n0 1 0\n").unwrap();
    let told = |command: &str| -> Vec<serde_json::Value> {
        let ended = bench.command(command).env("NO_COLOR", "1").output().unwrap();
        let text = String::from_utf8(ended.stderr).unwrap();
        text.lines().map(|line| serde_json::from_str(line).unwrap_or_else(|_| panic!("{line}"))).collect()
    };
    let events = told("distance points.xyz --spacing 0.1 --log json -o out.zarr");
    let of = |name: &str| events.iter().filter(|event| event["event"] == name).count();
    assert!(of("begin") > 2 && of("begin") == of("end") && of("message") == 1, "{events:?}");
    assert_eq!(events.last().unwrap()["event"], "done");
    let events = told("distance points.xyz --spacing 0.1 --log json -o out.zarr");
    let last = events.last().unwrap();
    // Commands with fewer flags of their own tell likewise.
    let converted = told("convert out.zarr a.nrrd --log json");
    assert!(converted.iter().any(|event| event["event"] == "begin"), "{converted:?}");
    assert_eq!(converted.last().unwrap()["event"], "done");
    let refused = told("demo -o out.zarr --log json");
    assert_eq!(refused[0]["code"], 2, "{refused:?}");
    let usage = told("distance points.xyz --log json --spacing nonsense -o other.zarr");
    assert_eq!((usage.len(), &usage[0]["event"], &usage[0]["code"]), (1, &"error".into(), &2.into()));
    assert_eq!((&last["event"], &last["code"]), (&"error".into(), &2.into()), "{events:?}");
}
