//! Files that a run writes: what killed runs leave, what others write meanwhile, what is found out before the work.

#![allow(clippy::unwrap_used)]

use std::fs;

use crate::common::ball::{Ball, Bench};
use crate::common::held::Held;

const MIDDLE: &str = "middle a.xyz b.xyz --spacing 0.1 -o none --mesh out/m.stl --report out/r.json";

/// Two points, and the surface between them.
fn points() -> Bench {
    let bench = Bench::bare();
    bench.write("a.xyz", "0 0 0\n");
    bench.write("b.xyz", "2 1 1\n");
    bench
}

#[test]
fn hidden_files_of_killed_runs_go_with_the_next_one() {
    let bench = points();
    let mut run = Held::start(bench.command(&format!("{MIDDLE} -v")));
    run.hear("distance  done");
    let of_living = bench.entries("out");
    assert!(of_living.len() == 1 && of_living[0].ends_with(".stl.part"), "{of_living:?}");
    bench.succeed(&format!("{MIDDLE} -q"));
    assert_eq!(bench.entries("out"), [&of_living[0], "m.stl", "r.json"], "the other run goes on");
    run.signal("KILL");
    assert_eq!(run.finish().status.code(), None);
    bench.succeed(&format!("{MIDDLE} -q --overwrite"));
    assert_eq!(bench.entries("out"), ["m.stl", "r.json"]);
}

#[test]
fn passing_folders_of_killed_runs_go_with_the_next_one() {
    let bench = Bench::new(&Ball::small());
    let run = "segment image.tif --points marks.csv -o none --picture out/p.png";
    let mut killed = Held::start(bench.command(&format!("{run} -v --tol 1e-30 --max-steps 1000000000")));
    killed.hear("speed 1  done");
    bench.succeed(&format!("{run} -q --max-steps 1"));
    assert_eq!(bench.entries("scratch").len(), 1, "that of the run that goes on");
    killed.signal("KILL");
    assert_eq!(killed.finish().status.code(), None);
    assert_eq!(bench.entries("scratch").len(), 1);
    bench.succeed(&format!("{run} -q --max-steps 1 --overwrite"));
    assert!(bench.entries("scratch").is_empty(), "{:?}", bench.entries("scratch"));
}

#[test]
fn what_another_program_writes_meanwhile_stays() {
    let bench = points();
    for (name, others) in [("m.stl", "r.json"), ("r.json", "m.stl")] {
        for (overwrite, code) in [("", Some(1)), (" --overwrite", Some(0))] {
            let mut run = Held::start(bench.command(&format!("{MIDDLE} -v{overwrite}")));
            run.hear("distance  done");
            bench.write(&format!("out/{name}"), "another program's");
            let ended = run.finish();
            assert_eq!(ended.status.code(), code, "{}", ended.said);
            let is_kept = fs::read(bench.path(&format!("out/{name}"))).unwrap() == b"another program's";
            assert_eq!(is_kept, overwrite.is_empty());
            assert_eq!(is_kept, ended.said.contains("something else came to lie there"), "{}", ended.said);
            fs::remove_file(bench.path(&format!("out/{name}"))).unwrap();
            let _ = fs::remove_file(bench.path(&format!("out/{others}")));
            assert!(bench.entries("out").is_empty(), "{:?}", bench.entries("out"));
        }
    }
}

#[test]
fn what_cannot_be_an_output_is_told_before_the_work() {
    let bench = points();
    let run = "middle a.xyz b.xyz --spacing 0.1 -o";
    let long = "m".repeat(252);
    for (arguments, reason) in [
        (format!("{run} none --mesh out/{long}.ply"), "a name of 256 bytes, which is too long"),
        (format!("{run} none --report {long}.json"), "a name of 257 bytes, which is too long"),
        (format!("{run} out/{}.zarr", &long[..245]), "a name of 250 bytes, which is too long"),
        (format!("{run} none --mesh ."), ".: is a folder"),
        (format!("{run} none --report out/.."), "out/..: is a folder"),
        ("middle a.xyz --spacing 0.1 -o none --mesh a.xyz".into(), "two files or more"),
    ] {
        let complaint = bench.fail(&format!("{arguments} -q"), 2);
        assert!(complaint.contains(reason), "{arguments}: {complaint}");
    }
    bench.succeed(&format!("{run} none -q --mesh out/{}.ply", &long[..251]));
    let (report, store) = ("x".repeat(200), "y".repeat(200));
    bench.succeed(&format!("{run} out/{store}.zarr -q --report out/{report}.json"));
}

/// Temporary parts of a mesh may lie on another disk than the mesh.
#[test]
fn a_scratch_folder_that_takes_nothing_is_named() {
    let bench = points();
    for ending in ["ply", "obj", "vtp"] {
        let run = format!("middle a.xyz b.xyz --spacing 0.1 -o none -q --mesh out/m.{ending} --scratch /proc");
        let complaint = bench.fail(&run, 1);
        assert!(complaint.contains("/proc: the mesh's temporary part cannot be written"), "{complaint}");
        assert!(bench.entries("out").is_empty());
    }
}
