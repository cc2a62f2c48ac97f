//! `strandline batch`: what is run, what is run again, what is told of it; the real program on small stacks.

#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;
use std::fs;
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::common::ball::{Ball, Bench};
use crate::common::held::{Ended, Held};
use crate::common::patience::output_of;

/// A folder with stacks and marks of one ball under several names, and a list.
pub(crate) fn bench(names: &[&str], list: &str) -> Bench {
    let bench = Bench::new(&Ball::small());
    fs::create_dir(bench.path("in")).unwrap();
    for name in names {
        fs::copy(bench.path("image.tif"), bench.path(&format!("in/{name}.tif"))).unwrap();
        fs::copy(bench.path("marks.csv"), bench.path(&format!("in/{name}.csv"))).unwrap();
    }
    bench.write("jobs.toml", list);
    bench
}

pub(crate) const LIST: &str = "[defaults]\ncommand = \"segment\"\npoints = \"in/{stem}.csv\"\nmax_steps = 3\n\n[[items]]\nimages = \"in/*.tif\"\n";

/// Runs it; returns the exit code, what was said, and the names of items that ran.
pub(crate) fn batch(bench: &Bench, arguments: &str) -> (i32, String, Vec<String>) {
    let output = bench.run(&format!("batch jobs.toml -o out --memory 600MiB --threads 2 --log json {arguments}"));
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(!said.contains("panicked"), "{said}");
    let events = said.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok());
    let mut ran: Vec<String> = events
        .filter(|event| event["event"] == "item")
        .map(|event| event["item"].as_str().unwrap().to_string())
        .collect();
    ran.sort();
    (output.status.code().unwrap(), said, ran)
}

/// Rows of the summary by item.
pub(crate) fn rows(bench: &Bench, name: &str) -> BTreeMap<String, Value> {
    let summary = bench.json(&format!("out/{name}.json"));
    let rows = summary["rows"].as_array().unwrap().iter();
    rows.map(|row| (row["item"].as_str().unwrap().to_string(), row.clone())).collect()
}

#[test]
fn all_mistakes_are_told_at_once() {
    let list = "\
[defaults]
command = \"segment\"
points = \"in/{stem}.csv\"
colour = 3

[[items]]
images = \"in/a.tif\"
output = \"x.zarr\"
rho = \"much\"

[[items]]
images = \"in/b.tif\"
points = \"in/none.csv\"
no_caps = 1

[[items]]
images = \"in/*.nrrd\"

[[items]]
images = \"in/a.tif\"

[[items]]
command = \"paint\"
sources = \"in/a.csv\"

[[items]]
command = \"middle\"
sources = [[\"in/a.csv\", \"in/b.csv\"], [\"in/c.csv\"]]

[[items]]
command = \"distance\"
name = \"none\"
sources = \"in/b.csv\"
threads = 0

[thing]
a = 1
";
    let bench = bench(&["a", "b"], list);
    let output = bench.run("batch jobs.toml -o results");
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{said}");
    for wanted in [
        "jobs.toml:4: unknown key `colour`",
        "jobs.toml:8: `output` is for batch to give",
        "jobs.toml:9: invalid value 'much' for '--rho <W>'",
        "jobs.toml:13: in/none.csv is not there",
        "jobs.toml:14: `no_caps` is true or false",
        "jobs.toml:17: in/*.nrrd matches nothing",
        "jobs.toml:19: two items are called a",
        "jobs.toml:23: `paint` is no command of items",
        "jobs.toml:28: in/c.csv is not there",
        "jobs.toml:34: --threads is 0; give 1 to 1024",
        "jobs.toml:36: unknown key `thing`",
        "nothing was run",
    ] {
        let lines = said.lines().filter(|line| line.contains(wanted)).count();
        assert_eq!(lines, 1, "{wanted}: {said}");
    }
    assert_eq!(said.lines().count(), 12, "{said}");
    assert!(!bench.path("results").exists());
    bench.write("jobs.toml", "[[items]\nimages = 3\n[defaults\n");
    let said = String::from_utf8(bench.run("batch jobs.toml -o results").stderr).unwrap();
    assert!(said.contains("jobs.toml:1: ") && said.contains("jobs.toml:3: "), "{said}");
}

#[test]
fn failures_stop_nothing_and_only_they_are_tried_again() {
    let bench = bench(&["a", "b", "c", "d", "e"], LIST);
    fs::write(bench.path("in/b.tif"), &fs::read(bench.path("in/b.tif")).unwrap()[..300]).unwrap();
    // A grid that no part of this memory holds.
    bench.write(
        "jobs.toml",
        &format!(
            "{LIST}\n[[items]]\ncommand = \"distance\"\nsources = \"in/a.csv\"\nname = \"large\"\nspacing = 0.02\nmethod = \"fmm\"\nschedule = \"sweep\"\n"
        ),
    );
    let (code, said, ran) = batch(&bench, "");
    assert_eq!((code, ran.join(" ")), (3, "a b c d e large".into()), "{said}");
    let found = rows(&bench, "summary");
    let of = |state: &str| {
        found.iter().filter(|(_, row)| row["state"] == state).map(|(name, _)| name.as_str()).collect::<Vec<_>>()
    };
    assert_eq!((of("done"), of("failed")), (vec!["a", "c", "d", "e"], vec!["b", "large"]));
    assert!(found["b"]["reason"].as_str().unwrap().contains("in/b.tif"), "{}", found["b"]);
    assert!(
        found["large"]["reason"].as_str().unwrap().contains("of memory at least, and may have 568 MiB"),
        "{}",
        found["large"]
    );
    let csv = fs::read_to_string(bench.path("out/summary.csv")).unwrap();
    assert_eq!(csv.lines().count(), 7);
    let page = fs::read_to_string(bench.path("out/summary.html")).unwrap();
    let page = roxmltree::Document::parse_with_options(
        &page,
        roxmltree::ParsingOptions { allow_dtd: true, ..Default::default() },
    );
    let page = page.unwrap();
    assert_eq!(page.descendants().filter(|node| node.has_tag_name("img")).count(), 4);
    for name in ["a", "c", "d", "e"] {
        let report = bench.json(&format!("out/{name}.zarr/report.json"));
        let row = &found[name];
        let hausdorff = &report["result"]["hausdorff"];
        for (told, wanted) in [
            (&row["volume"], &report["result"]["volume"]),
            (&row["area"], &report["result"]["area"]),
            (&row["marks_mean"], &hausdorff["mean"]),
            (&row["marks_max"], &hausdorff["max"]),
            (&row["seconds"], &report["seconds"]),
            (&row["peak_memory_bytes"], &report["peak_rss_bytes"]),
        ] {
            assert!(told.is_number() && told == wanted, "{name}: {told} {wanted}");
        }
    }
    // What is done is left alone.
    let stamp =
        |name: &str| fs::metadata(bench.path(&format!("out/{name}.zarr/report.json"))).unwrap().modified().unwrap();
    let before = stamp("a");
    let (code, said, ran) = batch(&bench, "");
    assert_eq!((code, ran.join(" "), stamp("a")), (3, "b large".into(), before), "{said}");
    fs::copy(bench.path("image.tif"), bench.path("in/b.tif")).unwrap();
    bench.write("jobs.toml", LIST);
    let (code, said, ran) = batch(&bench, "");
    assert_eq!((code, ran.join(" ")), (0, "b".into()), "{said}");
    assert!(bench.entries("scratch").is_empty());
}

#[test]
fn what_changed_is_run_again() {
    let items = |more: &str| {
        format!("{LIST}\n[[items]]\nimages = \"image.tif\"\npoints = \"marks.csv\"\nname = \"{{stem}}-own\"\n{more}")
    };
    let bench = bench(&["a", "b"], &items("theta = 1"));
    assert_eq!(batch(&bench, "").0, 0);
    assert_eq!(batch(&bench, "").2, [""; 0]);
    // Another spelling of the same, and what results do not depend on.
    bench.write("jobs.toml", &items("theta = 1\nmemory = \"300MiB\"\nthreads = 2"));
    assert_eq!(batch(&bench, "").2, [""; 0]);
    bench.write("jobs.toml", &items("theta = 2"));
    let told = bench.succeed("batch jobs.toml -o out --dry-run --memory 600MiB");
    assert!(told.contains("image-own: theta changed from 1 to 2; memory"), "{told}");
    assert!(told.contains("1 of 3 items would run"), "{told}");
    let (code, said, ran) = batch(&bench, "");
    assert_eq!((code, ran.join(" ")), (0, "image-own".into()), "{said}");
    // Touched, then changed.
    let marks = fs::read_to_string(bench.path("in/a.csv")).unwrap();
    bench.write("in/a.csv", &marks);
    assert_eq!(batch(&bench, "").2, [""; 0]);
    bench.write("in/a.csv", marks.trim_end().rsplit_once('\n').unwrap().0);
    assert!(bench.succeed("batch jobs.toml -o out --dry-run").contains("a: in/a.csv changed;"));
    assert_eq!(batch(&bench, "").2, ["a"]);
    fs::remove_dir_all(bench.path("out/b.zarr")).unwrap();
    assert_eq!(batch(&bench, "").2, ["b"]);
    fs::write(bench.path("out/a.zarr/marks.csv"), "cut off").unwrap();
    let told = bench.succeed("batch jobs.toml -o out --dry-run");
    assert!(told.contains("a: damaged: marks.csv in its store is gone or has another length"), "{told}");
    assert_eq!(batch(&bench, "").2, ["a"]);
    assert_eq!(batch(&bench, "").2, [""; 0]);
}

#[test]
fn stores_of_others_stay() {
    let bench = bench(&["a", "b"], LIST);
    fs::create_dir(bench.path("out/a.zarr")).unwrap();
    bench.write("out/a.zarr/mine.txt", "mine");
    for _ in 0..2 {
        let (code, said, ran) = batch(&bench, "");
        assert_eq!((code, ran.contains(&"a".into())), (3, true), "{said}");
        assert!(rows(&bench, "summary")["a"]["reason"].as_str().unwrap().contains("not of this batch"));
        assert_eq!(bench.entries("out/a.zarr"), ["mine.txt"]);
    }
    fs::remove_dir_all(bench.path("out/a.zarr")).unwrap();
    assert_eq!((batch(&bench, "").0, batch(&bench, "").2), (0, vec![]));
}

/// What is the same of two summaries of the same items that different runs wrote: all but times and memory.
fn figures(bench: &Bench, name: &str) -> Vec<Value> {
    let mut rows = bench.json(&format!("out/{name}.json"))["rows"].as_array().unwrap().clone();
    for row in &mut rows {
        row["seconds"] = Value::Null;
        row["peak_memory_bytes"] = Value::Null;
    }
    rows
}

#[test]
fn shards_side_by_side_are_one_run() {
    let bench = bench(&["a", "b", "c", "d", "e"], LIST);
    let start = |shard: &str| {
        let mut command = bench.command(&format!("batch jobs.toml -o out --memory 600MiB --shard {shard} -q"));
        command.spawn().unwrap()
    };
    let both = [start("1/2"), start("2/2")];
    for child in both {
        assert!(output_of(child).status.success());
    }
    let of = |shard: &str| {
        figures(&bench, shard).iter().map(|row| row["item"].as_str().unwrap().to_string()).collect::<Vec<_>>()
    };
    assert_eq!(
        (of("summary-1-of-2"), of("summary-2-of-2")),
        (vec!["a".into(), "c".into(), "e".into()], vec!["b".into(), "d".into()])
    );
    bench.succeed("batch jobs.toml -o out --summary");
    let joined = figures(&bench, "summary");
    let texts = ["csv", "json", "html"].map(|ending| fs::read(bench.path(&format!("out/summary.{ending}"))).unwrap());
    // The whole list runs nothing more, and sums up the same, to the byte.
    assert_eq!(batch(&bench, "").2, [""; 0]);
    let again = ["csv", "json", "html"].map(|ending| fs::read(bench.path(&format!("out/summary.{ending}"))).unwrap());
    assert!(texts == again);
    fs::remove_dir_all(bench.path("out")).unwrap();
    assert_eq!(batch(&bench, "").0, 0);
    assert_eq!(figures(&bench, "summary"), joined);
}

#[test]
fn memory_of_what_runs_at_a_time_is_within_the_limit() {
    let bench = bench(&["a", "b", "c"], LIST);
    assert_eq!(batch(&bench, "").0, 0);
    let given = |name: &str, flag: &str| {
        let log = fs::read_to_string(bench.path(&format!("out/{name}.log"))).unwrap();
        let words: Vec<&str> = log.lines().next().unwrap().split(' ').collect();
        words.iter().find_map(|word| word.strip_prefix(flag)).unwrap().parse::<u64>().unwrap()
    };
    // Two at a time; the last one has more room when it is alone, and never more than all.
    let mut memory = ["a", "b", "c"].map(|name| given(name, "--memory="));
    memory.sort_unstable();
    assert!(memory[0] + memory[1] <= 600 << 20 && memory[2] <= 600 << 20, "{memory:?}");
    assert!(["a", "b", "c"].iter().all(|name| given(name, "--threads=") <= 2));
}

const ENDLESS: &str = "[defaults]\ncommand = \"segment\"\npoints = \"in/{stem}.csv\"\n\n[[items]]\nimages = \"in/*.tif\"\ntol = 1e-30\nmax_steps = 1000000000\n";

/// Waits until logs tell that a number of items are in their time steps.
fn until_moving(run: &mut Held, bench: &Bench, names: &[&str]) {
    let moves = |name: &str| {
        fs::read_to_string(bench.path(&format!("out/{name}.log"))).is_ok_and(|log| log.contains("speed 1  done"))
    };
    run.go_on_until("time steps of all", |_| names.iter().all(|name| moves(name)));
}

#[test]
fn a_second_signal_ends_what_runs() {
    for (signals, code) in [(&["INT", "INT"][..], 130), (&["TERM"][..], 143)] {
        let bench = bench(&["a", "b", "c"], ENDLESS);
        let mut run = Held::start(bench.command("batch jobs.toml -o out --memory 600MiB --threads 2"));
        until_moving(&mut run, &bench, &["a", "b"]);
        for (n, signal) in signals.iter().enumerate() {
            if n == 1 {
                // Two that are on their way at once are one to the system.
                run.hear("no new items start");
            }
            run.signal(signal);
        }
        let Ended { status, said, .. } = run.finish();
        assert_eq!(status.code(), Some(code), "{said}");
        let found = rows(&bench, "summary");
        let states: Vec<&str> = found.values().map(|row| row["state"].as_str().unwrap()).collect();
        assert_eq!(states, ["interrupted", "interrupted", "skipped"], "{said}");
        // One that is terminated may leave a checkpoint.
        assert!(
            !bench.entries("out").iter().any(|name| name.contains("zarr") && !name.ends_with(".zarr.checkpoint")),
            "{:?}",
            bench.entries("out")
        );
        assert!(bench.entries("scratch").is_empty());
        bench.write("jobs.toml", LIST);
        assert_eq!(batch(&bench, "").2, ["a", "b", "c"]);
    }
}

/// What schedulers send before the end: each item takes a checkpoint and goes on.
#[test]
fn items_are_asked_for_checkpoints() {
    let bench = bench(&["a"], ENDLESS);
    let mut run = Held::start(bench.command("batch jobs.toml -o out --memory 600MiB --threads 1"));
    until_moving(&mut run, &bench, &["a"]);
    let is_taken = || fs::read_to_string(bench.path("out/a.log")).is_ok_and(|log| log.contains("a checkpoint of"));
    // One that has just begun is not asked.
    let mut asked = Instant::now();
    run.go_on_until("a checkpoint of a", |run| {
        if asked.elapsed() > Duration::from_millis(100) {
            run.signal("USR1");
            asked = Instant::now();
        }
        is_taken()
    });
    run.signal("TERM");
    assert_eq!(run.finish().status.code(), Some(143), "it had gone on");
}

#[test]
fn a_first_signal_lets_what_runs_end() {
    let bench = bench(&["a", "b", "c"], &LIST.replace("max_steps = 3", "max_steps = 60\ntol = 1e-30"));
    let mut run = Held::start(bench.command("batch jobs.toml -o out --memory 600MiB --threads 1"));
    until_moving(&mut run, &bench, &["a"]);
    run.signal("INT");
    let Ended { status, said, .. } = run.finish();
    assert_eq!(status.code(), Some(130), "{said}");
    let found = rows(&bench, "summary");
    let states: Vec<&str> = found.values().map(|row| row["state"].as_str().unwrap()).collect();
    assert_eq!(states, ["done", "skipped", "skipped"], "{said}");
    assert_eq!(batch(&bench, "").2, ["b", "c"]);
}

/// Items end with a batch that is killed, and the next one goes on with what is not done.
#[test]
fn a_killed_batch_leaves_nothing_running() {
    let bench = bench(&["a", "b"], ENDLESS);
    let mut run = Held::start(bench.command("batch jobs.toml -o out --memory 600MiB --threads 2"));
    until_moving(&mut run, &bench, &["a", "b"]);
    run.signal("KILL");
    assert_eq!(run.finish().status.code(), None);
    bench.write("jobs.toml", LIST);
    let (code, said, ran) = batch(&bench, "");
    assert_eq!((code, ran.join(" ")), (0, "a b".into()), "{said}");
    // It got the logs, which runs have locked as long as they go on.
}

#[test]
fn every_command_has_its_items() {
    let list = "\
[[items]]
command = \"reconstruct\"
sources = [\"ball.xyz\", \"*.other.xyz\"]
name = \"{stem}-surface\"
max_steps = 2

[[items]]
command = \"distance\"
sources = [\"in/a.csv\", \"in/b.csv\"]
name = \"both\"
spacing = 1
labels = true

[[items]]
command = \"distance\"
sources = \"in/*.csv\"
spacing = 1

[[items]]
command = \"middle\"
sources = [[\"in/a.csv\", \"moved.csv\"], [\"in/b.csv\", \"moved.csv\"]]
name = \"{stem}-middle\"
mesh = \"out/{stem}.ply\"
spacing = 1
";
    let bench = bench(&["a", "b"], list);
    let sphere = |n: u32| {
        let (z, angle) = (1.0 - f64::from(2 * n + 1) / 400.0, f64::from(n) * 2.399_963);
        let radius = (1.0 - z * z).sqrt();
        format!("{} {} {}\n", radius * angle.cos(), radius * angle.sin(), z)
    };
    let cloud: String = (0..400).map(sphere).collect();
    bench.write("ball.xyz", &cloud);
    bench.write("c.other.xyz", &cloud);
    let marks = fs::read_to_string(bench.path("marks.csv")).unwrap();
    let moved = |line: &str| {
        let mut cells: Vec<String> = line.split(',').map(String::from).collect();
        cells[2] = (cells[2].parse::<f64>().unwrap() + 20.0).to_string();
        cells.join(",")
    };
    let (head, rest) = marks.split_once('\n').unwrap();
    bench.write("moved.csv", &format!("{head}\n{}\n", rest.lines().map(moved).collect::<Vec<_>>().join("\n")));
    let (code, said, ran) = batch(&bench, "");
    assert_eq!((code, ran.join(" ")), (0, "a a-middle b b-middle ball-surface both c.other-surface".into()), "{said}");
    let found = rows(&bench, "summary");
    for (name, has_volume) in [("a", false), ("ball-surface", true), ("b-middle", false)] {
        assert_eq!(found[name]["volume"].is_number(), has_volume, "{name}");
    }
    assert!(found["b-middle"]["area"].is_number() && bench.path("out/b.ply").exists());
    let sources = bench.json("out/both.zarr/report.json")["settings"]["sources"].as_array().unwrap().len();
    assert_eq!(sources, 2);
    assert_eq!(batch(&bench, "").2, [""; 0]);
    // What it made it makes again, what others made stays.
    fs::remove_dir_all(bench.path("out/a-middle.zarr")).unwrap();
    bench.write("mine.ply", "mine");
    bench
        .write("jobs.toml", &list.replace("out/{stem}.ply", "mine.ply").replace(", [\"in/b.csv\", \"moved.csv\"]", ""));
    let (code, said, ran) = batch(&bench, "");
    assert_eq!((code, ran.join(" ")), (3, "a-middle".into()), "{said}");
    assert_eq!(fs::read_to_string(bench.path("mine.ply")).unwrap(), "mine");
    bench.write("jobs.toml", list);
    let (code, said, ran) = batch(&bench, "");
    assert_eq!((code, ran.join(" ")), (0, "a-middle".into()), "{said}");
}

#[test]
fn a_list_to_begin_with_runs() {
    let bench = bench(&["a", "b"], "");
    fs::copy(bench.path("image.tif"), bench.path("in/alone.tif")).unwrap();
    let told = bench.succeed("batch --init in");
    assert!(told.contains("2 items; 1 stacks have no points"), "{told}");
    bench.succeed("batch in/jobs.toml -o out -q --memory 600MiB");
    assert_eq!(rows(&bench, "summary").len(), 2);
    assert!(bench.fail("batch --init in", 2).contains("is there already"));
    assert!(bench.fail("batch --init scratch", 2).contains("holds no stack"));
}
