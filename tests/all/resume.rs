//! Runs that are ended and gone on with: the same bits as undisturbed, or a clear refusal. `scripts/try_resume` ends them at random
//! moments, some hundred times.

#![allow(clippy::unwrap_used)]

use std::f64::consts::PI;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::common::ball::{Ball, Bench, write_stack};
use crate::common::held::{Ended, Held};
use crate::common::patience::{output_of, wait_until};
use crate::common::stores::{contents, same};

/// Points on a sphere, in a spiral.
fn sphere(count: usize, centre: [f64; 3], radius: f64) -> String {
    let point = |n: usize| {
        let z = 1.0 - (2.0 * n as f64 + 1.0) / count as f64;
        let (around, ring) = (PI * (1.0 + 5.0_f64.sqrt()) * n as f64, (1.0 - z * z).sqrt());
        let at = [ring * around.cos(), ring * around.sin(), z];
        let [x, y, z] = std::array::from_fn(|a| centre[a] + radius * at[a]);
        format!("{x} {y} {z}\n")
    };
    (0..count).map(point).collect()
}

fn bench() -> Bench {
    let bench = Bench::new(&Ball::small());
    bench.write("a.xyz", &sphere(2000, [0.0; 3], 1.0));
    bench.write("b.xyz", &sphere(500, [1.3, 0.0, 0.0], 0.5));
    bench
}

/// The same with a stack of three shards, `wide.tif`.
fn wide_bench() -> Bench {
    let (bench, mut ball) = (bench(), Ball::small());
    ball.geometry.shape = [600, 80, 20];
    write_stack(&bench.path("wide.tif"), &ball.geometry, &[&ball.voxels()]);
    bench
}

/// Each command, long enough to be ended on its way.
const RUNS: [&str; 4] = [
    "segment image.tif --points marks.csv --tol 1e-30 --max-steps 60",
    "distance a.xyz b.xyz --spacing 0.03 --padding 1 --labels --brick 16",
    "middle a.xyz b.xyz --spacing 0.03 --brick 16",
    "reconstruct a.xyz --tol 1e-30 --max-steps 20",
];

/// Ends a run by SIGTERM when it has taken so many checkpoints; its store is `out/x.zarr`.
fn terminated(bench: &Bench, run: &str, checkpoints: usize) {
    let mut command = bench.command(&format!("{run} -o out/x.zarr --checkpoint-every 1ms"));
    let child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    // So many or more, as each goes when there are two later ones.
    let (folder, least) = (bench.path("out/x.zarr.checkpoint"), format!("{checkpoints:06}"));
    let is_taken = |name: &str| name.ends_with(".checkpoint") && *name >= *least;
    wait_until("a checkpoint", || {
        let taken = fs::read_dir(&folder).into_iter().flatten().flatten();
        taken.map(|file| file.file_name()).any(|name| name.to_str().is_some_and(is_taken))
    });
    Command::new("kill").args(["-TERM", &child.id().to_string()]).status().unwrap();
    let output = output_of(child);
    assert_eq!(output.status.code(), Some(143), "{run}: {}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn terminated_runs_go_on_with_the_same_bits() {
    let bench = bench();
    for run in RUNS {
        bench.succeed(&format!("{run} -o out/whole.zarr --checkpoint off"));
        terminated(&bench, run, 1);
        assert_eq!(bench.entries("out"), ["whole.zarr", "x.zarr.checkpoint"], "{run}");
        let told = bench.fail(&format!("{run} -o out/x.zarr"), 2);
        assert!(told.contains("x.zarr.checkpoint: holds checkpoints of a run that was ended; give --resume"), "{told}");
        let output = bench.run(&format!("{run} -o out/x.zarr --resume --threads 1 --memory 400MiB"));
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success() && said.contains("goes on from the checkpoint"), "{run}: {said}");
        assert_eq!(bench.entries("out"), ["whole.zarr", "x.zarr"], "{run}");
        same(&contents(&bench.path("out/whole.zarr")), &contents(&bench.path("out/x.zarr")), run);
        for store in ["out/whole.zarr", "out/x.zarr"] {
            fs::remove_dir_all(bench.path(store)).unwrap();
        }
    }
}

/// Each command with a stage that writes a field of several shards.
const WRITING: [(&str, &str); 5] = [
    ("segment wide.tif --points marks.csv --tol 1e-30 --max-steps 20", "write image"),
    ("segment wide.tif --points marks.csv --tol 1e-30 --max-steps 20", "write labels"),
    ("distance a.xyz b.xyz --origin=-3,-0.4,-0.15 --spacing 0.01 --shape 600,80,30 --closest-point", "read out"),
    ("middle a.xyz b.xyz --origin=-3,-0.4,-0.15 --spacing 0.01 --shape 600,80,30", "read out"),
    (
        "reconstruct a.xyz --origin=-9,-1.4,-1.4 --spacing 0.03 --shape 600,94,94 --tol 1e-30 --max-steps 3",
        "write levelset",
    ),
];

/// Ends a run by SIGTERM when it has taken a checkpoint in a stage; by then it may have said that the stage is done, and no more.
fn terminated_writing(bench: &Bench, run: &str, stage: &str) {
    let mut held = Held::start(bench.command(&format!("{run} -o out/x.zarr -v --threads 1 --checkpoint-every 10ms")));
    let folder = bench.path("out/x.zarr.checkpoint");
    // Manifests name stages as they are, with their number among those of their name.
    let key = format!("{stage} #1").into_bytes();
    let names_it = |path: PathBuf| fs::read(path).is_ok_and(|file| file.windows(key.len()).any(|bytes| bytes == key));
    let is_manifest = |path: &PathBuf| path.extension().is_some_and(|ending| ending == "checkpoint");
    let entries = || fs::read_dir(&folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let is_taken = |_: &Held| entries().filter(is_manifest).any(names_it);
    held.go_on_until(&format!("a checkpoint of {stage} in {run}"), is_taken);
    held.signal("TERM");
    let Ended { status, said, .. } = held.finish();
    assert_eq!(status.code(), Some(143), "{run}: {said}");
}

/// The checksums of a store, but those of reports.
fn checksums(store: &Path) -> Vec<String> {
    let lines = fs::read_to_string(store.join("checksums.txt")).unwrap();
    lines.lines().filter(|line| !line.contains(" report.")).map(String::from).collect()
}

#[test]
fn runs_that_are_terminated_while_they_write_go_on_there() {
    let bench = wide_bench();
    for (n, (run, stage)) in WRITING.into_iter().enumerate() {
        bench.succeed(&format!("{run} -o out/whole.zarr --checkpoint off"));
        terminated_writing(&bench, run, stage);
        assert_eq!(bench.entries("out"), ["whole.zarr", "x.zarr.checkpoint"], "{run}");
        let threads = if n % 2 == 0 { "--threads 3" } else { "--memory 400MiB" };
        let output = bench.run(&format!("{run} -o out/x.zarr --resume {threads}"));
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success() && said.contains(&format!("{stage}: goes on where ")), "{run}: {said}");
        assert_eq!(bench.entries("out"), ["whole.zarr", "x.zarr"], "{run}");
        let [whole, resumed] = ["out/whole.zarr", "out/x.zarr"].map(|store| bench.path(store));
        same(&contents(&whole), &contents(&resumed), run);
        assert_eq!(checksums(&whole), checksums(&resumed), "{run}");
        for store in [whole, resumed] {
            fs::remove_dir_all(store).unwrap();
        }
    }
}

#[test]
fn a_damaged_shard_is_told_and_all_of_its_field_is_written_again() {
    let bench = bench();
    let (run, stage) = WRITING[2];
    bench.succeed(&format!("{run} -o out/whole.zarr --checkpoint off"));
    terminated_writing(&bench, run, stage);
    let mut shards = bench.entries("out/x.zarr.checkpoint");
    shards.retain(|name| name.contains(".shard"));
    let shard = bench.path("out/x.zarr.checkpoint").join(&shards[0]);
    let mut bytes = fs::read(&shard).unwrap();
    bytes[100] ^= 4;
    fs::write(&shard, bytes).unwrap();
    let output = bench.run(&format!("{run} -o out/x.zarr --resume"));
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let told = format!("{stage}: what was written before is not gone on with, and all of it is written again: ");
    assert!(output.status.success() && said.contains(&told) && said.contains("is damaged"), "{said}");
    assert_eq!(bench.entries("out"), ["whole.zarr", "x.zarr"]);
    let [whole, resumed] = ["out/whole.zarr", "out/x.zarr"].map(|store| bench.path(store));
    same(&contents(&whole), &contents(&resumed), run);
    assert_eq!(checksums(&whole), checksums(&resumed));
}

/// Each command with a stage that looks for something or solves it, before the surface moves or anything is written.
const SOLVING: [(&str, &str); 5] = [
    ("reconstruct a.xyz --tol 1e-30 --max-steps 3", "enclosure"),
    ("reconstruct a.xyz --beta 0.2 --tol 1e-30 --max-steps 20", "enclosure"),
    ("segment image.tif --points marks.csv --start flood --tol 1e-30 --max-steps 3", "enclosure 1"),
    ("distance a.xyz b.xyz --spacing 0.03 --padding 1 --labels --brick 16 --method fsm --schedule sweep", "distance"),
    ("distance a.xyz b.xyz --spacing 0.03 --padding 1 --labels --brick 16 --method vdt --schedule sweep", "distance"),
];

#[test]
fn runs_that_are_terminated_while_they_search_or_sweep_go_on_there() {
    let bench = bench();
    for (run, stage) in SOLVING {
        bench.succeed(&format!("{run} -o out/whole.zarr --checkpoint off"));
        terminated_writing(&bench, run, stage);
        assert_eq!(bench.entries("out"), ["whole.zarr", "x.zarr.checkpoint"], "{run}");
        let output = bench.run(&format!("{run} -o out/x.zarr --resume --threads 3"));
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success() && said.contains("goes on from the checkpoint"), "{run}: {said}");
        assert_eq!(bench.entries("out"), ["whole.zarr", "x.zarr"], "{run}");
        let [whole, resumed] = ["out/whole.zarr", "out/x.zarr"].map(|store| bench.path(store));
        same(&contents(&whole), &contents(&resumed), run);
        for store in [whole, resumed] {
            fs::remove_dir_all(store).unwrap();
        }
    }
}

#[test]
fn a_run_goes_on_where_no_checkpoint_can_be_taken_and_says_so_once() {
    let bench = bench();
    let run = RUNS[0];
    bench.succeed(&format!("{run} -o out/whole.zarr --checkpoint off"));
    let told = bench.fail(&format!("{run} -o out/x.zarr --checkpoint /proc/strandline/c"), 1);
    assert!(told.contains("/proc/strandline/c: no checkpoint can be put there; name another folder"), "{told}");
    assert_eq!(bench.entries("out"), ["whole.zarr"]);
    let mut held =
        Held::start(bench.command(&format!("{run} -o out/x.zarr -v --checkpoint out/mine --checkpoint-every 1ms")));
    held.hear("speed 1  done");
    // Each goes when there are two later ones.
    let is_taken = |name: &String| name.ends_with(".checkpoint");
    held.go_on_until("a checkpoint", |_| {
        bench.path("out/mine").exists() && bench.entries("out/mine").iter().any(is_taken)
    });
    // As when a disk goes; what comes to lie there is somebody's own.
    fs::rename(bench.path("out/mine"), bench.path("gone")).unwrap();
    bench.write("out/mine", "my own");
    let Ended { status, said, .. } = held.finish();
    assert!(status.success(), "{said}");
    let told = "no checkpoint could be taken, the run goes on without: out/mine: cannot be made: ";
    assert_eq!(said.matches(told).count(), 1, "{said}");
    assert_eq!(fs::read(bench.path("out/mine")).unwrap(), b"my own");
    same(&contents(&bench.path("out/whole.zarr")), &contents(&bench.path("out/x.zarr")), run);
}

#[test]
fn other_runs_are_refused_with_the_difference() {
    let bench = bench();
    let run = RUNS[1];
    terminated(&bench, run, 1);
    let told = bench.fail(&format!("{run} --method fsm -o out/x.zarr --resume"), 2);
    assert!(told.contains("--method was not given and is fsm"), "{told}");
    let told = bench.fail(&format!("{} -o out/x.zarr --resume", run.replace("0.03", "0.04")), 2);
    assert!(told.contains("--spacing was 0.03 and is 0.04"), "{told}");
    bench.write("b.xyz", &sphere(501, [1.3, 0.0, 0.0], 0.5));
    let told = bench.fail(&format!("{run} -o out/x.zarr --resume"), 2);
    assert!(told.contains("SOURCES was a.xyz (") && told.contains("b.xyz ("), "{told}");
    // With leave it begins anew.
    bench.succeed(&format!("{run} -o out/x.zarr --overwrite"));
    assert_eq!(bench.entries("out"), ["x.zarr"]);
}

#[test]
fn nothing_of_others_goes_without_leave() {
    let bench = bench();
    let run = RUNS[1];
    terminated(&bench, run, 1);
    bench.succeed("distance a.xyz --spacing 0.1 -o out/other.zarr");
    let before = contents(&bench.path("out/other.zarr"));
    let at = "--checkpoint out/x.zarr.checkpoint";
    let told = bench.fail(&format!("{run} {at} -o out/other.zarr --resume"), 2);
    assert!(told.contains("other.zarr: the output exists already"), "{told}");
    bench.write("mine.json", "{}");
    let told = bench.fail(&format!("{run} -o out/x.zarr --report mine.json --resume"), 2);
    assert!(told.contains("mine.json: exists already"), "{told}");
    same(&before, &contents(&bench.path("out/other.zarr")), "another run's store");
    let told = bench.fail(&format!("{run} --checkpoint out/y.zarr/c -o out/y.zarr"), 2);
    assert!(told.contains("lies in the store that the run writes"), "{told}");
    let told = bench.fail("distance - --spacing 0.1 -o out/y.zarr --resume", 2);
    assert!(told.contains("reads standard input"), "{told}");
}

#[test]
fn a_checkpoint_can_be_asked_for() {
    let bench = bench();
    let run = RUNS[0];
    bench.succeed(&format!("{run} -o out/whole.zarr --checkpoint off"));
    let mut held = Held::start(bench.command(&format!("{run} -o out/x.zarr -v --checkpoint out/mine")));
    held.hear("speed 1  done");
    held.signal("USR1");
    held.hear("--resume goes on from it");
    assert!(
        bench.entries("out/mine").iter().any(|name| name == "000001.checkpoint"),
        "{:?}",
        bench.entries("out/mine")
    );
    let Ended { status, said, .. } = held.finish();
    assert!(status.success(), "{said}");
    assert_eq!(bench.entries("out"), ["whole.zarr", "x.zarr"]);
    same(&contents(&bench.path("out/whole.zarr")), &contents(&bench.path("out/x.zarr")), run);
}

#[test]
fn a_torn_checkpoint_is_told_and_the_one_before_is_taken() {
    let bench = bench();
    let run = RUNS[0];
    bench.succeed(&format!("{run} -o out/whole.zarr --checkpoint off"));
    terminated(&bench, run, 3);
    let folder = bench.path("out/x.zarr.checkpoint");
    let manifests = || {
        let names = bench.entries("out/x.zarr.checkpoint");
        names.into_iter().filter(|name| name.ends_with(".checkpoint")).collect::<Vec<_>>()
    };
    let last = folder.join(manifests().last().unwrap());
    let bytes = fs::read(&last).unwrap();
    fs::write(&last, &bytes[..bytes.len() / 2]).unwrap();
    let output = bench.run(&format!("{run} -o out/x.zarr --resume"));
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{said}");
    assert!(said.contains("a checkpoint is passed over") && said.contains("is cut short"), "{said}");
    assert!(said.contains("goes on from the checkpoint"), "{said}");
    same(&contents(&bench.path("out/whole.zarr")), &contents(&bench.path("out/x.zarr")), run);
}

#[test]
fn there_may_be_nothing_to_go_on_with() {
    let bench = bench();
    let run = RUNS[1];
    let told = bench.fail(&format!("{run} -o none --resume"), 2);
    assert!(told.contains("give the store with -o"), "{told}");
    bench.succeed(&format!("{run} -o out/x.zarr --resume"));
    let before = contents(&bench.path("out/x.zarr"));
    // As a run leaves it that is ended while it removes its checkpoints.
    fs::create_dir(bench.path("out/x.zarr.checkpoint")).unwrap();
    bench.write("out/x.zarr.checkpoint/strandline.lock", "");
    bench.write("out/x.zarr.checkpoint/000007-0.bricks", "x");
    let report = fs::read(bench.path("out/x.zarr/report.json")).unwrap();
    bench.succeed(&format!("{run} -o out/x.zarr --resume"));
    same(&before, &contents(&bench.path("out/x.zarr")), "complete already");
    assert_eq!(bench.entries("out"), ["x.zarr"]);
    assert_eq!(report, fs::read(bench.path("out/x.zarr/report.json")).unwrap(), "nothing ran");
    let told = bench.fail(&format!("{} -o out/x.zarr --resume", run.replace("0.03", "0.04")), 2);
    assert!(told.contains("is complete, and of another run: --spacing was 0.03 and is 0.04"), "{told}");
    let folder = bench.path("held.checkpoint");
    fs::create_dir(&folder).unwrap();
    let lock = fs::File::create(folder.join("strandline.lock")).unwrap();
    lock.lock().unwrap();
    let told = bench.fail(&format!("{run} -o out/y.zarr --checkpoint held.checkpoint"), 2);
    assert!(told.contains("belongs to a run that goes on"), "{told}");
}
