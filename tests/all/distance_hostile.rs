//! What `strandline distance` says to files and settings that make no sense: one sentence, the right exit code, nothing
//! left behind, little memory taken.

#![allow(clippy::unwrap_used)]

use std::fs;
use std::process::{Command, Output};

use crate::common::ball::{Ball, Bench};
use crate::common::lab::PlainGrid;
use crate::common::meshes::{self, Form};
use crate::common::stores::volume;
use crate::common::textbook::squared;

/// Runs the program in the folder with at most 1 GiB of address space.
fn run_limited(bench: &Bench, arguments: &str) -> Output {
    let program = env!("CARGO_BIN_EXE_strandline");
    let mut command = Command::new("sh");
    command.args(["-c", &format!("ulimit -v 1048576; exec {program} {arguments} --threads 2")]);
    command.current_dir(bench.path("")).env("TMPDIR", bench.path("scratch")).output().unwrap()
}

/// The one sentence with which a run ends; nothing may be left of it.
#[track_caller]
fn refusal(bench: &Bench, arguments: &str, code: i32) -> String {
    let output = run_limited(bench, arguments);
    let complaint = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(code), "{arguments}: {complaint}");
    assert!(output.stdout.is_empty(), "{arguments}: results on stdout");
    assert!(complaint.starts_with("strandline: ") && complaint.lines().count() == 1, "{arguments}: {complaint}");
    assert!(complaint.chars().count() < 500 && !complaint.contains("fault of strandline"), "{arguments}: {complaint}");
    for folder in ["out", "scratch"] {
        assert!(bench.entries(folder).is_empty(), "{arguments}: {:?} left", bench.entries(folder));
    }
    complaint
}

/// Each file is refused with code 2 in a sentence that names it and holds the words.
fn assert_files_refused(files: &[(&str, Vec<u8>, &[&str])]) {
    let bench = Bench::bare();
    for (name, bytes, words) in files {
        fs::write(bench.path(name), bytes).unwrap();
        let complaint = refusal(&bench, &format!("distance {name} --spacing 0.1 -q -o out/x.zarr"), 2);
        assert!(complaint.contains(name), "{complaint}");
        for word in *words {
            assert!(complaint.contains(word), "{name}: {complaint} lacks {word:?}");
        }
    }
}

fn ply(format: &str, vertices: u64, faces: u64, body: &[u8]) -> Vec<u8> {
    let header = format!(
        "ply\nformat {format} 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {faces}\nproperty list uint int vertex_indices\nend_header\n"
    );
    [header.as_bytes(), body].concat()
}

#[test]
fn files_without_content_are_refused() {
    let stl_header = [&[b' '; 80][..], &[0; 4]].concat();
    let mut files: Vec<(&str, Vec<u8>, &[&str])> =
        ["a.ply", "a.off", "a.stl", "a.obj", "a.xyz", "a.csv"].map(|name| (name, Vec::new(), &["empty"][..])).into();
    files.extend([
        ("none.ply", ply("ascii", 0, 0, b""), &["no point"][..]),
        ("none.ply", ply("binary_little_endian", 8, 12, b""), &["8 vertices"]),
        ("cut.ply", b"ply\nformat ascii 1.0\nelement vertex 8\n".to_vec(), &["header"]),
        ("none.off", b"OFF\n".to_vec(), &["counts"]),
        ("none.off", b"OFF\n0 0 0\n".to_vec(), &["no point"]),
        ("none.off", b"OFF\n8 12 0\n".to_vec(), &["8 vertices"]),
        ("none.stl", b"solid a\nendsolid a\n".to_vec(), &["without a triangle"]),
        ("none.stl", stl_header, &["without a triangle"]),
        ("none.obj", b"# made\no a\n".to_vec(), &["no point"]),
        ("none.xyz", b"# x y z\n".to_vec(), &["no point"]),
        ("none.csv", b"x,y,z\n".to_vec(), &["no point"]),
        ("Cargo.toml", b"[package]\nname = \"a\"\n".to_vec(), &["neither a point cloud nor a mesh", "'[package]'"]),
    ]);
    assert_files_refused(&files);
}

#[test]
fn counts_that_the_file_belies_take_no_memory() {
    const BILLION: u64 = 1_000_000_000;
    let mut stl = Form::StlBinary.write(&meshes::cuboid([0.0; 3], [1.0; 3]));
    stl.truncate(134);
    stl[80..84].copy_from_slice(&1_000_000_000_u32.to_le_bytes());
    // A face that claims a billion corners, in text and in binary.
    let corners = [&[0; 36][..], &1_000_000_000_u32.to_le_bytes(), &[0; 12]].concat();
    let three = "0 0 0\n1 0 0\n0 1 0\n";
    assert_files_refused(&[
        ("vertices.ply", ply("ascii", BILLION, 0, b"0 0 0\n"), &["1000000000 vertices"]),
        ("vertices.ply", ply("binary_big_endian", BILLION, 0, &[0; 24]), &["1000000000 vertices"]),
        ("faces.ply", ply("binary_little_endian", 3, BILLION, &[0; 60]), &["1000000000 faces"]),
        ("corners.ply", ply("binary_little_endian", 3, 1, &corners), &["face 0"]),
        ("corners.ply", ply("ascii", 3, 1, format!("{three}1000000000 0 1 2\n").as_bytes()), &["line "]),
        ("vertices.off", b"OFF\n1000000000 1 0\n0 0 0\n".to_vec(), &["1000000000 vertices"]),
        ("corners.off", format!("OFF\n3 1 0\n{three}1000000000 0 1 2\n").into_bytes(), &["line 6"]),
        ("triangles.stl", stl, &["1000000000 triangles"]),
    ]);
}

#[test]
fn damaged_files_are_refused() {
    let cube = meshes::cuboid([0.0; 3], [1.0; 3]);
    let cut = |form: Form| {
        let mut file = form.write(&cube);
        file.truncate(file.len() - 5);
        file
    };
    let text = b"0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    let nan = [f32::NAN, 0.0, 0.0].map(f32::to_le_bytes).concat();
    assert_files_refused(&[
        ("cut.ply", cut(Form::PlyLittle), &["face 11"]),
        ("cut.ply", cut(Form::PlyDouble), &["face 11"]),
        ("cut.stl", cut(Form::StlBinary), &["12 triangles"]),
        ("text.ply", ply("binary_little_endian", 3, 1, text), &["3 vertices"]),
        ("bytes.obj", b"v 0 0 0\nv 1 0 0\0\x01\xff\nf 1 2 2\n".to_vec(), &["byte 15"]),
        ("bytes.xyz", [&b"0 0 0\n"[..], &[0; 60]].concat(), &["binary data"]),
        ("index.ply", ply("ascii", 3, 1, b"0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n"), &["vertex 3 of 3"]),
        ("index.off", b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n".to_vec(), &["vertex 7 of 3"]),
        ("index.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n".to_vec(), &["line 4", "'4'"]),
        ("nan.ply", ply("binary_little_endian", 1, 0, &nan), &["not finite"]),
        ("nan.off", b"OFF\n1 0 0\n0 nan 0\n".to_vec(), &["line 3", "not finite"]),
        ("inf.obj", b"v 0 0 0\nv 1 -inf 0\n".to_vec(), &["line 2", "not finite"]),
        ("nan.stl", b"solid a\nfacet normal 0 0 0\nouter loop\nvertex nan 0 0\n".to_vec(), &["line 4", "not finite"]),
        ("inf.xyz", b"0 0 0\n1 inf 2\n".to_vec(), &["line 2"]),
        ("huge.csv", b"x,y,z\n1,1e999,2\n".to_vec(), &["line 2"]),
    ]);
    let bench = Bench::bare();
    for (arguments, word) in [("distance out", "folder"), ("distance missing.ply", "missing.ply")] {
        let complaint = refusal(&bench, &format!("{arguments} -q -o out/x.zarr"), 2);
        assert!(complaint.contains(word), "{complaint}");
    }
}

/// Coordinates at the end of the numbers, and clouds that tell no scale.
#[test]
fn clouds_without_a_scale_are_refused_or_need_a_grid() {
    let bench = Bench::bare();
    bench.write("same.xyz", &"2 3 4\n".repeat(20));
    bench.write("far.xyz", "-1e308 0 0\n1e308 0 0\n");
    bench.write("one.xyz", "2 3 4\n");
    for (arguments, words) in [
        ("distance same.xyz", ["one point", "--spacing"]),
        ("distance one.xyz --spacing 1", ["one point", "--padding"]),
        ("distance far.xyz", ["farther than numbers", "scale"]),
    ] {
        let complaint = refusal(&bench, &format!("{arguments} -q -o out/x.zarr"), 2);
        assert!(words.iter().all(|word| complaint.contains(word)), "{complaint}");
    }
    let found = bench.succeed("distance same.xyz --spacing 0.5 --padding 2 -o none");
    assert!(found.contains("8 voxels fixed by sources, 0 not reached"), "{found}");
}

#[test]
fn flat_triangles_are_sources() {
    let bench = Bench::bare();
    // A point, a segment, and a segment there and back.
    bench.write("flat.obj", "v 0 0 0\nv 4 0 0\nv 2 0 0\nv 1 3 2\nf 4 4 4\nf 1 2 2\nf 1 2 3\n");
    bench.succeed("distance flat.obj --spacing 0.5 --padding 1 -q -o out/x.zarr");
    let report = bench.json("out/x.zarr/report.json");
    assert_eq!(report["result"]["unlabelled_voxels"], 0);
    let [z, y, x] = [0, 1, 2].map(|a| report["grid"]["shape_zyx"][a].as_i64().unwrap());
    let found = volume(&bench.path("out/x.zarr"));
    for (v, found) in (PlainGrid { shape: [x, y, z] }).voxels().zip(found) {
        let here = v.map(|i| -1.0 + 0.5 * i as f64);
        let along = [here[0].clamp(0.0, 4.0), 0.0, 0.0];
        let exact = squared(here, along).min(squared(here, [1.0, 3.0, 2.0])).sqrt();
        assert!((found - exact).abs() < 1e-5, "{v:?}: {found} for {exact}");
    }
}

#[test]
fn sources_outside_the_grid() {
    let ball = Ball::small();
    let bench = Bench::new(&ball);
    bench.write("away.xyz", "-500 0 0\n-501 3 0\n");
    bench.write("some.xyz", "-500 0 0\n5 5 5\n");
    bench.write("within.xyz", "5 5 5\n");
    bench.write("across.obj", "v -900 5 5\nv 900 5 5\nv 0 900 5\nf 1 2 3\n");
    for grid in ["--like image.tif", "--spacing 1 --origin 0,0,0 --shape 9,9,9"] {
        for (source, fixed, note) in [
            ("some.xyz", 1..9, Some("1 of 2 sources lies outside")),
            ("across.obj", 9..10_000, Some("the only source lies outside of the grid or reaches out")),
            ("away.xyz", 100..10_000, Some("all 2 sources lie outside")),
            ("within.xyz", 1..9, None),
        ] {
            bench.succeed(&format!("distance {source} {grid} -q --overwrite -o none --report out/r.json"));
            let (report, told) = (bench.json("out/r.json"), note.unwrap_or_default());
            let found = report["result"].clone();
            assert!(fixed.contains(&found["fixed_voxels"].as_u64().unwrap()), "{source} {grid}: {found}");
            assert_eq!(found["unlabelled_voxels"], 0);
            assert_eq!(
                report["notes"].to_string().contains("outside"),
                note.is_some(),
                "{source}: {}",
                report["notes"]
            );
            assert!(report["notes"].to_string().contains(told), "{source}: {}", report["notes"]);
            fs::remove_file(bench.path("out/r.json")).unwrap();
        }
    }
}

#[test]
fn grids_that_make_no_sense_are_refused() {
    let bench = Bench::bare();
    bench.write("a.xyz", "0 0 0\n1 1 1\n");
    let exact = "--spacing 0.1 --origin 0,0,0 --shape";
    for (flags, code, words) in [
        ("--spacing 0", 2, &["--spacing is 0,0,0"][..]),
        ("--spacing 0.1,-0.1,0.1", 2, &["--spacing is 0.1,-0.1,0.1"]),
        ("--spacing nan", 2, &["--spacing is NaN"]),
        ("--spacing inf", 2, &["--spacing is inf"]),
        ("--padding -1", 2, &["--padding is -1"]),
        ("--padding nan", 2, &["--padding is NaN"]),
        (&format!("{exact} 0,4,4"), 2, &["--shape is 0,4,4"]),
        (&format!("{exact} 4,-4,4"), 2, &["--shape is 4,-4,4"]),
        ("--spacing 0.1 --origin nan,0,0 --shape 4,4,4", 2, &["--origin is NaN"]),
        // 10^15 voxels, which no machine holds; what they would take is told.
        (
            &format!("{exact} 100000,100000,100000 --brick 64"),
            2,
            &["1 000 000 000 000 000 voxels", "iB of memory", "TiB of temporary fields", "give at least --memory"],
        ),
        (&format!("{exact} 100000,100000,100000 --brick 16"), 2, &["bricks", "--brick"]),
        (&format!("{exact} 100,100,100 --memory 9000TiB"), 2, &["--memory is 9000 TiB", "the machine"]),
        (
            &format!("{exact} 16000,16000,2000 --memory 4GiB"),
            1,
            &["512 000 000 000 voxels", "TiB of temporary files", "are free", "--scratch"],
        ),
        ("--spacing 1e-12", 2, &["voxels", "--spacing"]),
        (&format!("{exact} 9000000000000000000,9,9"), 2, &["voxels", "--shape"]),
        ("--spacing 0.1 --memory 64MiB", 2, &["--memory"]),
        ("--like out", 2, &["out"]),
        ("--like a.xyz", 2, &["a.xyz"]),
        ("--spacing 1000 --precision f16 --padding 1e5", 2, &["--precision float16"]),
        ("--spacing 0.1 --max-distance 0", 2, &["--max-distance is 0"]),
        ("--spacing 0.1 --max-distance nan", 2, &["--max-distance is NaN"]),
    ] {
        let complaint = refusal(&bench, &format!("distance a.xyz {flags} -q -o out/x.zarr"), code);
        assert!(words.iter().all(|word| complaint.contains(word)), "{flags}: {complaint}");
    }
}

#[test]
fn settings_that_contradict_are_refused() {
    let bench = Bench::bare();
    bench.write("there.json", "{}");
    bench.write("a.xyz", "0 0 0\n1 1 1\n");
    for (flags, word) in [
        ("--signed", "--signed"),
        ("--method fsm --neighbours 26", "--neighbours"),
        ("--schedule sweep --max-distance 1", "--max-distance"),
        ("--schedule sweep --iterations 0", "--iterations is 0"),
        ("--brick 8", "multiple of 16"),
        ("--scratch nowhere", "--scratch"),
        ("--report nowhere/r.json", "create it first"),
        ("--report /dev/null --overwrite", "no regular file"),
        ("--report there.json", "--overwrite"),
    ] {
        let complaint = refusal(&bench, &format!("distance a.xyz --spacing 0.1 {flags} -q -o out/x.zarr"), 2);
        assert!(complaint.contains(word), "{flags}: {complaint}");
    }
    // The table of arguments itself says the rest, in more lines.
    for flags in
        ["", "a.xyz", "a.xyz -o none --method xyz", "a.xyz -o none --spacing 1,2", "a.xyz -o none --shape 4,4,4"]
    {
        assert!(bench.fail(&format!("distance {flags}"), 2).contains("help"), "{flags}");
    }
}

#[test]
fn outputs_are_replaced_only_when_asked() {
    let bench = Bench::bare();
    bench.write("a.xyz", "0 0 0\n1 1 1\n");
    let complaint = refusal(&bench, "distance a.xyz --spacing 0.1 -q -o /proc/x.zarr", 1);
    assert!(complaint.contains("/proc/x.zarr"), "{complaint}");
    bench.succeed("distance a.xyz --spacing 0.1 -q -o out/x.zarr");
    let before = fs::read(bench.path("out/x.zarr/report.json")).unwrap();
    let complaint = bench.fail("distance a.xyz --spacing 0.2 -q -o out/x.zarr", 2);
    assert!(complaint.contains("exists already") && complaint.contains("--overwrite"), "{complaint}");
    assert_eq!(fs::read(bench.path("out/x.zarr/report.json")).unwrap(), before);
    bench.succeed("distance a.xyz --spacing 0.2 -q -o out/x.zarr --overwrite");
    assert_ne!(fs::read(bench.path("out/x.zarr/report.json")).unwrap(), before);
    // No file may grow beyond 8 KiB: the store cannot be written.
    let program = env!("CARGO_BIN_EXE_strandline");
    let limited = format!("ulimit -f 8; exec {program} distance a.xyz --spacing 0.02 -q -o out/y.zarr");
    let output = Command::new("bash").args(["-c", &limited]).current_dir(bench.path("")).output().unwrap();
    let complaint = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{complaint}");
    assert_eq!(bench.entries("out"), ["x.zarr"], "{complaint}");
}

#[cfg(target_os = "linux")]
#[test]
fn signals_end_a_distance_in_order() {
    use std::io::{BufRead, BufReader};
    let bench = Bench::bare();
    bench.write("a.xyz", "0 0 0\n1 1 1\n0 1 0\n");
    for (stage, signal, code) in [("sort sources", "INT", 130), ("distance", "INT", 130), ("distance", "TERM", 143)] {
        // Seconds of work are left after each of these stages.
        let arguments = "distance a.xyz --spacing 0.004 --labels --closest-point -o out/x.zarr -v --threads 2";
        let mut child = bench
            .command(arguments)
            .stderr(std::process::Stdio::piped())
            .stdout(std::process::Stdio::null())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
        let done = lines.by_ref().map(Result::unwrap).any(|line| line.contains(stage) && line.contains("done"));
        assert!(done, "{stage} never ended");
        let sent = Command::new("kill").args(["-s", signal, &child.id().to_string()]).status().unwrap();
        assert!(sent.success());
        let rest: Vec<String> = lines.map(Result::unwrap).collect();
        assert_eq!(child.wait().unwrap().code(), Some(code), "{stage}: {rest:?}");
        assert!(rest.last().unwrap().contains("interrupted"), "{rest:?}");
        // What SIGTERM ends may be gone on with.
        let left = bench.entries("out");
        let is_kept = signal == "TERM" && left == ["x.zarr.checkpoint"];
        assert!((left.is_empty() || is_kept) && bench.entries("scratch").is_empty(), "{stage}: {left:?} is left");
    }
}
