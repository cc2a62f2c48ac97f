//! Segmentations and reconstructions on several ranks: the store holds the bytes that one rank writes, and the report its figures.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use crate::common::patience;
use crate::common::random::Random;

/// The file of a store by their paths, without those that tell how a run went.
fn files(store: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![store.to_path_buf()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            let name = path.strip_prefix(store).expect("inside").display().to_string();
            match path.is_dir() {
                true => folders.push(path),
                false if ["report.json", "report.html", "checksums.txt"].contains(&name.as_str()) => {}
                false => _ = found.insert(name, std::fs::read(&path).expect("a file")),
            }
        }
    }
    found
}

/// Runs a command into a store on so many ranks: its exit code, files, and what its report tells of the result.
fn run(folder: &Path, words: &[&str], ranks: &str) -> (Option<i32>, BTreeMap<String, Vec<u8>>, serde_json::Value) {
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_strandline"));
    command.current_dir(folder).args(words).args(["-o", "out.zarr", "--quiet", "--overwrite", "--memory", "1GiB"]);
    let done = patience::run(command.args(["--ranks", ranks]));
    let said = String::from_utf8_lossy(&done.stderr).into_owned();
    assert!(matches!(done.status.code(), Some(0 | 3)), "{ranks} ranks: {said}");
    let store = folder.join("out.zarr");
    let report = std::fs::read_to_string(store.join("report.json")).expect("a report");
    let report: serde_json::Value = serde_json::from_str(&report).expect("JSON");
    assert_eq!(report["ranks"].to_string(), ranks);
    assert_eq!(
        report["rank_reports"].as_array().map_or(0, Vec::len),
        if ranks == "1" { 0 } else { ranks.parse().unwrap_or(0) }
    );
    let verified =
        patience::run(std::process::Command::new(env!("CARGO_BIN_EXE_strandline")).arg("verify").arg(&store));
    assert!(verified.status.success(), "{ranks} ranks: {}", String::from_utf8_lossy(&verified.stdout));
    (done.status.code(), files(&store), report["result"].clone())
}

fn check(folder: &Path, words: &[&str], ranks: &[&str]) {
    let expected = run(folder, words, "1");
    assert!(expected.1.len() > 10);
    for ranks in ranks {
        let (code, found, result) = run(folder, words, ranks);
        let other: Vec<&String> =
            expected.1.keys().chain(found.keys()).filter(|name| expected.1.get(*name) != found.get(*name)).collect();
        assert!(other.is_empty(), "{words:?} on {ranks} ranks: {other:?}");
        assert_eq!((code, result), (expected.0, expected.2.clone()), "{words:?} on {ranks} ranks");
    }
}

/// Balls in a noisy volume, two of them beside each other, and their outlines on slices; of one of several too few.
fn cells(folder: &Path) {
    let shape = [96usize, 64, 48];
    let balls =
        [([22.0, 30.0, 22.0], 14.0), ([50.0, 30.0, 24.0], 13.0), ([78.0, 34.0, 20.0], 11.0), ([76.0, 12.0, 34.0], 8.0)];
    let mut random = Random(7);
    let mut volume =
        b"NRRD0004\ntype: uint8\ndimension: 3\nsizes: 96 64 48\nspacings: 0.5 0.5 0.5\nencoding: raw\n\n".to_vec();
    for n in 0..shape.iter().product() {
        let place = [n % 96, n / 96 % 64, n / (96 * 64)].map(|v| v as f64);
        let inside = balls.iter().any(|(centre, radius)| {
            (0..3).map(|a| (place[a] - centre[a]) * (place[a] - centre[a])).sum::<f64>() < radius * radius
        });
        volume.push((if inside { 160.0 } else { 60.0 } + 20.0 * random.unit()) as u8);
    }
    std::fs::write(folder.join("cells.nrrd"), volume).expect("a file is written");
    let mut marks = String::from("object,contour,x,y,z\n");
    for (number, (centre, radius)) in (1..).zip(balls) {
        let slices = (-3..=3).map(|n| (f64::from(n) * 0.28 * radius + centre[2]).round());
        for (contour, z) in slices.enumerate().take(if number == 4 { 1 } else { 7 }) {
            let across = (radius * radius - (z - centre[2]) * (z - centre[2])).sqrt();
            for turn in 0..16 {
                let angle = f64::from(turn) * std::f64::consts::PI / 8.0;
                let (x, y) = (centre[0] + across * libm::cos(angle), centre[1] + across * libm::sin(angle));
                writeln!(marks, "{number},{contour},{},{},{}", 0.5 * x, 0.5 * y, 0.5 * z).expect("a string");
            }
        }
    }
    std::fs::write(folder.join("marks.csv"), marks).expect("a file is written");
}

/// Objects are shared out to ranks, of which some may have none; one object is refused on whichever rank it is.
#[test]
fn objects_are_those_of_one_rank() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    cells(folder.path());
    let words = ["segment", "cells.nrrd", "--points", "marks.csv", "--brick", "32"];
    check(folder.path(), &words, &["2", "5"]);
    check(folder.path(), &[&words[..], &["--fill-gaps", "auto", "--ome", "0.4", "--live"]].concat(), &["3"]);
}

/// Times are solved by one rank, and a picture without a store is drawn by one.
#[test]
fn what_ranks_cannot_do_is_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    cells(folder.path());
    for flags in [
        &["--time", "all", "-o", "out.zarr"][..],
        &["--picture", "a.png", "-o", "none"],
        &["--points", "-", "-o", "out.zarr"],
    ] {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_strandline"));
        command.current_dir(folder.path()).args(["segment", "cells.nrrd", "--points", "marks.csv", "--ranks", "2"]);
        let done = patience::run(command.args(flags));
        assert_eq!(done.status.code(), Some(2), "{flags:?}: {}", String::from_utf8_lossy(&done.stderr));
        assert!(!folder.path().join("out.zarr").exists());
    }
}

/// The distance and the time steps are shared out; sides and surface are those of the whole.
#[test]
fn reconstructions_are_those_of_one_rank() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut random = Random(3);
    let mut cloud = String::new();
    for _ in 0..1500 {
        let direction: [f64; 3] = std::array::from_fn(|_| random.unit() + random.unit() + random.unit() - 1.5);
        let length = direction.iter().map(|v| v * v).sum::<f64>().sqrt().max(1e-9);
        let [x, y, z] = [0, 1, 2].map(|a| direction[a] / length * [5.0, 3.0, 4.0][a] + 100.0);
        writeln!(cloud, "{x} {y} {z}").expect("a string");
    }
    std::fs::write(folder.path().join("cloud.xyz"), cloud).expect("a file is written");
    check(folder.path(), &["reconstruct", "cloud.xyz"], &["2", "3"]);
    check(folder.path(), &["reconstruct", "cloud.xyz", "--beta", "0.7", "--method", "fsm"], &["5"]);
}
