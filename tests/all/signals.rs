//! Signals: a run that is asked to end does so in the stage it is in, in order, and leaves nothing behind.

#![allow(clippy::unwrap_used)]

use std::fs;
use std::process::Stdio;

use crate::common::ball::{Ball, Bench};
use crate::common::held::{Ended, Held};
use crate::common::patience::{output_of, wait_until};

// Checkpoints are what a run may leave: tests/all/resume.rs.
const RUN: &str = "segment image.tif --points marks.csv -o out/x.zarr -v --checkpoint off";
const SENTENCE: &str = "strandline: interrupted; nothing is left that looks complete and is not";

/// True for the line that says how far a slow stage is.
fn is_progress(line: &str) -> bool {
    line.contains(" %  ") || line.contains(" steps  ")
}

#[test]
fn every_stage_heeds_signals() {
    let bench = Bench::new(&Ball::small());
    let Ended { status, said, .. } = Held::start(bench.command(RUN)).finish();
    assert!(status.success(), "{said}");
    fs::remove_dir_all(bench.path("out/x.zarr")).unwrap();
    let lines: Vec<&str> = said.lines().filter(|line| !is_progress(line)).collect();
    let stages: Vec<&str> = lines.iter().filter_map(|line| Some(line.split_once("  done  ")?.0)).collect();
    let wanted = [
        "read stack",
        "scatter of marks",
        "marks 1",
        "profiles 1",
        "image model",
        "shape 1",
        "distance 1",
        "band 1",
        "presmoothing 1",
        "speed 1",
        "level set 1",
        "surface 1",
        "meshes for viewers",
        "write levelset 1",
        "write distance 1",
        "neighbours",
        "write labels",
        "write image",
        "report page",
    ];
    assert_eq!(stages, wanted);
    // The line at which a stage ends is said right before the next one begins: that one is interrupted. Before the
    // first one the settings are said; after the last one nothing is left but to put the output in its place.
    for (number, line) in lines.iter().enumerate().skip(lines.len() - 1 - stages.len()) {
        let (signal, code) = if number % 2 == 0 { ("INT", 130) } else { ("TERM", 143) };
        let mut run = Held::start(bench.command(RUN));
        run.hold_at(number);
        run.signal(signal);
        let Ended { status, said, printed } = run.finish();
        assert_eq!(status.code(), Some(code), "{signal} at {line:?}: {said}");
        assert_eq!(said.lines().last(), Some(SENTENCE), "{signal} at {line:?}: {said}");
        let more = said.lines().skip(1).filter(|line| !is_progress(line)).count();
        assert_eq!(more, 1, "{signal} at {line:?}: the run goes on: {said}");
        assert!(printed.is_empty(), "{printed}");
        for folder in ["out", "scratch"] {
            assert!(bench.entries(folder).is_empty(), "{signal} at {line:?}: {:?} left", bench.entries(folder));
        }
    }
}

#[test]
fn a_stage_under_way_is_left() {
    let bench = Bench::new(&Ball::small());
    // A level set that never rests: what ends the run is the signal, wherever in the stage it comes.
    let mut run = Held::start(bench.command(&format!("{RUN} --tol 1e-30 --max-steps 1000000000")));
    run.hear("speed 1  done");
    run.signal("INT");
    let Ended { status, said, .. } = run.finish();
    assert_eq!((status.code(), said.lines().last()), (Some(130), Some(SENTENCE)), "{said}");
    assert!(bench.entries("out").is_empty() && bench.entries("scratch").is_empty());
}

/// Whoever is in a hurry asks twice.
#[test]
fn a_second_signal_leaves_nothing_either() {
    let bench = Bench::new(&Ball::small());
    for (first, second) in [("INT", "INT"), ("TERM", "INT")] {
        let mut run = Held::start(bench.command(&format!("{RUN} --tol 1e-30 --max-steps 1000000000")));
        run.hear("speed 1  done");
        run.signal(first);
        run.signal(second);
        let Ended { status, said, .. } = run.finish();
        assert!(matches!(status.code(), Some(130 | 143)), "{said}");
        assert_eq!(said.lines().last(), Some(SENTENCE), "{said}");
        assert!(bench.entries("out").is_empty() && bench.entries("scratch").is_empty(), "{first}, {second}");
    }
}

/// Nothing can be done in order when a process is killed; the next one cleans up after it.
#[test]
fn what_a_killed_run_leaves_goes_with_the_next_one() {
    let bench = Bench::new(&Ball::small());
    let mut run = Held::start(bench.command(&format!("{RUN} --tol 1e-30 --max-steps 1000000000")));
    run.hear("speed 1  done");
    // While a run goes on, another one leaves its store alone.
    bench.succeed("segment image.tif --points marks.csv -o out/x.zarr -q --max-steps 1");
    assert_eq!(bench.entries("out").len(), 2, "{:?}", bench.entries("out"));
    fs::remove_dir_all(bench.path("out/x.zarr")).unwrap();
    run.signal("KILL");
    assert_eq!(run.finish().status.code(), None);
    let left = bench.entries("out");
    assert!(left.len() == 1 && left[0].starts_with(".x.zarr.partial-"), "{left:?}");
    bench.succeed("segment image.tif --points marks.csv -o out/x.zarr -q");
    assert_eq!(bench.entries("out"), ["x.zarr"]);
}

/// Whether whoever runs the tests has SIGHUP passed over, which their children inherit.
fn is_hang_up_ignored() -> bool {
    let text = fs::read_to_string("/proc/self/status").unwrap();
    let mask = text.lines().find_map(|line| line.strip_prefix("SigIgn:")).unwrap().trim();
    u64::from_str_radix(mask, 16).unwrap() & 1 == 1
}

/// A pipe that nobody writes to: the run waits in a call of the system, and looks at no flag.
#[test]
fn a_run_that_cannot_look_up_ends_all_the_same() {
    let bench = Bench::bare();
    for (command, signal, code) in [
        ("reconstruct - -o out/x.zarr", "INT", 130),
        ("distance - -o out/x.zarr --spacing 1", "TERM", 143),
        ("distance - -o out/x.zarr --spacing 1", "HUP", 129),
    ] {
        // As under nohup, where the program passes it over too.
        if signal == "HUP" && is_hang_up_ignored() {
            continue;
        }
        let mut command = bench.command(command);
        let mut child = command.stdin(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let _held = child.stdin.take();
        let status = format!("/proc/{}/status", child.id());
        // Bit 1 of the signals that are caught is SIGINT's, bit 14 SIGTERM's; both are once the run has begun.
        let caught = || {
            let text = fs::read_to_string(&status).unwrap();
            let mask = text.lines().find_map(|line| line.strip_prefix("SigCgt:")).unwrap().trim().to_owned();
            u64::from_str_radix(&mask, 16).unwrap()
        };
        wait_until("the run listens", || caught() & (1 << 1) != 0 && caught() & (1 << 14) != 0);
        let sent = std::process::Command::new("kill").args(["-s", signal, &child.id().to_string()]).status().unwrap();
        assert!(sent.success());
        let output = output_of(child);
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!((output.status.code(), said.lines().last()), (Some(code), Some(SENTENCE)), "{said}");
        assert!(bench.entries("out").is_empty() && bench.entries("scratch").is_empty());
    }
}
