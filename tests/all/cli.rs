//! The program as users run it: arguments, exit codes, messages, and results against what is known of a ball.

#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::Path;

use strandline::grid::Box3;
use strandline::io::ome_zarr::ImageReader;

use crate::common::ball::{Ball, Bench, HEADER, write_stack};
use crate::common::python;
use crate::common::stores::{contents, same, volume};
use crate::common::tiff_bytes::{Value, gray_page, tiff_file};

/// Twice the shared voxels over all voxels of both.
fn dice(labels: &[f64], label: f64, shape: [i64; 3], truth: impl Fn([i64; 3]) -> bool) -> f64 {
    let voxels = Box3::from_shape(shape).rows().flat_map(|(y, z)| (0..shape[0]).map(move |x| [x, y, z]));
    let (mut both, mut sum) = (0, 0);
    for (voxel, &found) in voxels.zip(labels) {
        let (found, truth) = (found == label, truth(voxel));
        both += i32::from(found && truth);
        sum += i32::from(found) + i32::from(truth);
    }
    2.0 * f64::from(both) / f64::from(sum)
}

#[test]
fn help_and_version_are_complete() {
    let bench = Bench::new(&Ball::small());
    assert_eq!(bench.succeed("-V"), format!("strandline {}\n", env!("CARGO_PKG_VERSION")));
    let readme = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("README.md")).unwrap();
    for (command, at_least) in [("segment", 30), ("distance", 20), ("reconstruct", 17)] {
        let help = bench.succeed(&format!("help {command}"));
        let flags: Vec<&str> = help
            .lines()
            .filter_map(|line| line.trim().split([' ', ',', '[']).find(|word| word.starts_with("--")))
            .filter(|flag| !matches!(*flag, "--help"))
            .collect();
        assert!(flags.len() > at_least, "{flags:?}");
        // Each command has a table of its own.
        let table = readme.split(&format!("### Flags of `{command}`")).nth(1).unwrap().split("\n#").next().unwrap();
        for flag in flags {
            assert!(
                table.contains(&format!("`{flag}")) || flag == "--output",
                "{command}: README does not name {flag}"
            );
        }
        assert!(help.lines().all(|line| line.chars().count() <= 100));
    }
    for command in ["segment", "distance", "reconstruct", "measure", "convert", "demo", "info"] {
        assert!(bench.succeed("help").contains(command) && readme.contains(&format!("\n| `{command}` |")), "{command}");
    }
}

#[test]
fn wrong_usage_is_told_with_code_2() {
    let bench = Bench::new(&Ball::small());
    bench.write("plain.txt", "plain");
    for (arguments, reason) in [
        ("segment", "--points"),
        ("segment image.tif --points marks.csv", "--output"),
        ("segment image.tif -o out/x.zarr", "--points"),
        ("sgment image.tif", "segment"),
        ("segment image.tif --points marks.csv -o none --resume", "--resume"),
        ("segment image.tif --points marks.csv -o out/x.zarr --checkpoint-every soon", "--checkpoint-every"),
        ("segment image.tif --points marks.csv -o out/x.zarr --ome 0.3", "--ome"),
        ("segment image.tif --points marks.csv -o out/x.zarr --theta x", "--theta"),
        ("segment image.tif --points marks.csv -o out/x.zarr --theta nan", "--theta is NaN"),
        ("segment image.tif --points marks.csv -o out/x.zarr --rho -1", "--rho is -1"),
        ("segment image.tif --points marks.csv -o out/x.zarr --image-spacing 1,0,1", "--image-spacing is 1,0,1"),
        ("segment image.tif --points marks.csv -o out/x.zarr --image-spacing 1,1", "--image-spacing"),
        ("segment image.tif --points marks.csv -o out/x.zarr --crop 0:0,:,:", "along x"),
        ("segment image.tif --points marks.csv -o out/x.zarr --crop :,0:99,:", "0 to 36"),
        ("segment image.tif --points marks.csv -o out/x.zarr --crop :,-2:9,:", "along y"),
        ("segment image.tif --points marks.csv -o out/x.zarr --percentiles 90,10", "--percentiles is 90,10"),
        ("segment image.tif --points marks.csv -o out/x.zarr --brick 8", "multiple of 16"),
        ("segment image.tif --points marks.csv -o out/x.zarr --threads 0", "--threads is 0"),
        ("segment image.tif --points marks.csv -o out/x.zarr --memory lots", "--memory"),
        ("segment image.tif --points marks.csv -o out/x.zarr --memory 64MiB", "give at least --memory"),
        ("segment image.tif --points marks.csv -o out/x.zarr --method fim", "fsm, vdt"),
        ("segment image.tif --points marks.csv -o out/x.zarr --channel 1", "channel 1"),
        ("segment image.tif --points marks.csv -o out/x.zarr --time 2", "time 2"),
        ("segment image.tif --points marks.csv -o out/x.zarr --scratch nowhere", "--scratch"),
        ("segment image.tif --points marks.csv -o nowhere/x.zarr", "create it first"),
        ("segment image.tif --points marks.csv -o out/x.zarr --report nowhere/r.json", "create it first"),
        ("segment image.tif --points marks.csv -o out/x.zarr --beta 1e9", "--beta is 1000000000"),
        ("segment image.tif --points marks.csv -o out/x.zarr --fill-gaps 1e9", "--fill-gaps is 1000000000"),
        ("segment image.tif --points marks.csv -o out/x.zarr --image-spacing 1,1,1e9", "give --image-spacing"),
        ("segment image.tif --points marks.csv -o out/x.zarr --mesh /dev/null --overwrite", "no regular file"),
        ("segment image.tif --points marks.csv -o scratch", "exists already"),
        ("segment image.tif --points marks.csv -o plain.txt --overwrite", "no Zarr store"),
        ("info nothing", "no such file"),
    ] {
        let complaint = bench.fail(arguments, 2);
        assert!(complaint.contains(reason), "{arguments}: {complaint}");
        assert!(bench.entries("out").is_empty(), "{arguments} leaves {:?}", bench.entries("out"));
    }
}

#[test]
fn unusable_marks_are_told_with_code_2() {
    let ball = Ball::small();
    let bench = Bench::new(&ball);
    let rows = ball.marks(1);
    let scaled = |factor: [f64; 3]| {
        let row = |line: &str| {
            let mut values: Vec<f64> = line.split(',').map(|v| v.parse().unwrap()).collect();
            (0..3).for_each(|a| values[2 + a] *= factor[a]);
            format!("{},{},{},{},{}\n", values[0], values[1], values[2], values[3], values[4])
        };
        rows.lines().map(row).collect::<String>()
    };
    let one = rows.lines().next().unwrap();
    for (marks, reason) in [
        (String::new(), "no point"),
        (format!("{one}\n"), "object 1 has one point"),
        (format!("{rows}1,4,nan,1,1\n"), "line "),
        (scaled([2.0, 2.0, 1.0]), "multiply them by the spacing (0.5, 0.5, 1)"),
        (scaled([1e3; 3]), "divided by 1000"),
        (scaled([-1.0, 1.0, 1.0]), "lie outside of the image: they span x "),
        ("1,1,3,3,3\n1,1,3.1,3,3\n1,1,3.1,3.1,3\n1,1,3,3.1,3\n".into(), "encloses nothing: its marks around (3.05"),
    ] {
        bench.write("bad.csv", &format!("{HEADER}{marks}"));
        let complaint = bench.fail("segment image.tif --points bad.csv -o out/x.zarr -q", 2);
        assert!(complaint.contains(reason), "{reason}: {complaint}");
        assert_eq!(complaint.lines().count(), 1, "{complaint}");
        assert!(complaint.contains("bad.csv") || reason.starts_with("encloses nothing"), "{complaint}");
        assert!(bench.entries("out").is_empty());
    }
    bench.write("loose.csv", "x,y,z\n1,1,1\n2,1,1\n1,2,1\n1,1,2\n");
    let complaint = bench.fail("segment image.tif --points marks.csv --points loose.csv -o none", 2);
    assert!(complaint.contains("loose.csv") && complaint.contains("contour"), "{complaint}");
}

#[test]
fn unusable_images_are_told_with_code_2() {
    let ball = Ball::small();
    let bench = Bench::new(&ball);
    let constant = vec![7_u16; ball.geometry.domain().len()];
    write_stack(&bench.path("constant.tif"), &ball.geometry, &[&constant]);
    let mut flat = ball.geometry.clone();
    flat.shape[2] = 1;
    write_stack(&bench.path("flat.tif"), &flat, &[&constant]);
    let floats = |broken: f32| {
        let plane = |z: usize| (0..40 * 36).map(move |i| if (i, z) == (99, 3) { broken } else { (i % 7) as f32 });
        let page = |z| gray_page(40, 36, 32, plane(z).flat_map(f32::to_le_bytes).collect());
        tiff_file(&(0..20).map(|z| page(z).with(339, Value::Short(vec![3]))).collect::<Vec<_>>(), false)
    };
    fs::write(bench.path("nan.tif"), floats(f32::NAN)).unwrap();
    fs::write(bench.path("text.tif"), "this is no image").unwrap();
    for (image, reason) in [
        ("constant.tif", "constant.tif: the image holds only the value 7"),
        ("flat.tif", "one voxel along z"),
        ("nan.tif --image-spacing 0.5,0.5,1", "nan.tif: plane 3 (page 4) holds a value that is no number"),
        ("text.tif", "text.tif"),
        ("missing.tif", "no such file"),
        ("scratch", "no slices"),
    ] {
        let complaint = bench.fail(&format!("segment {image} --points marks.csv -o out/x.zarr"), 2);
        assert!(complaint.contains(reason), "{image}: {complaint}");
        assert!(bench.entries("out").is_empty());
    }
    // The marks alone are enough when the image has no say.
    bench.succeed("segment constant.tif --points marks.csv -o none --rho 0");
}

#[test]
fn inputs_are_never_outputs() {
    let bench = Bench::new(&Ball::small());
    fs::copy(bench.path("marks.csv"), bench.path("scan.csv")).unwrap();
    std::os::unix::fs::symlink(bench.path("image.tif"), bench.path("out/link.tif")).unwrap();
    let before = ["image.tif", "marks.csv", "scan.csv"].map(|name| fs::read(bench.path(name)).unwrap());
    for arguments in [
        "segment image.tif --points marks.csv -o none --report marks.csv",
        "segment image.tif --points marks.csv -o none --picture out/link.tif",
        "segment image.tif --points marks.csv -o image.tif",
        "segment image.tif --points scan.csv --points marks.csv -o none --mesh out/../scan.csv",
        "distance scan.csv -o none --report out/../scan.csv",
        "distance scan.csv --like image.tif -o none --report image.tif",
        "reconstruct scan.csv -o none --report scan.csv",
    ] {
        for overwrite in ["", " --overwrite"] {
            let complaint = bench.fail(&format!("{arguments} -q{overwrite}"), 2);
            assert!(complaint.contains("is an input of this run"), "{arguments}{overwrite}: {complaint}");
            assert_eq!(complaint.lines().count(), 1, "{complaint}");
        }
    }
    assert!(before == ["image.tif", "marks.csv", "scan.csv"].map(|name| fs::read(bench.path(name)).unwrap()));
}

#[test]
fn a_picture_is_a_png() {
    let bench = Bench::new(&Ball::small());
    let complaint = bench.fail("segment image.tif --points marks.csv -o none --picture out/p.jpg", 2);
    assert!(complaint.contains("p.jpg: pictures are PNG files"), "{complaint}");
}

#[test]
fn outputs_that_cannot_be_written_end_with_code_1() {
    let bench = Bench::new(&Ball::small());
    let complaint = bench.fail("segment image.tif --points marks.csv -o /proc/x.zarr", 1);
    assert!(complaint.contains("/proc/x.zarr"), "{complaint}");
    // No file may grow beyond 8 KiB: the store cannot be written, nor what does not fit memory.
    let larger = Bench::new(&Ball::large());
    for (bench, arguments, reasons) in [
        (&bench, "-o out/x.zarr", ["out/", ".zarr"]),
        (&larger, "-o none --threads 2 --memory 152MiB", ["--scratch", "scratch:"]),
    ] {
        let program = env!("CARGO_BIN_EXE_strandline");
        let limited = format!("ulimit -f 8; exec {program} segment image.tif --points marks.csv {arguments}");
        let mut command = std::process::Command::new("bash");
        let output = command.args(["-c", &limited]).current_dir(bench.path("")).env("TMPDIR", bench.path("scratch"));
        let output = output.output().unwrap();
        let complaint = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{complaint}");
        assert!(reasons.iter().all(|reason| complaint.contains(reason)), "{complaint}");
        assert!(bench.entries("out").is_empty() && bench.entries("scratch").is_empty());
    }
}

#[test]
fn a_ball_is_found_and_reported() {
    let ball = Ball::small();
    let bench = Bench::new(&ball);
    let printed = bench.succeed(
        "segment image.tif --points marks.csv -o out/x.zarr --mesh out/m.ply --report out/r.json --picture out/p.png \
         --threads 2",
    );
    assert!(printed.starts_with("stage ") && printed.lines().all(|line| line.chars().count() <= 100), "{printed}");
    assert_eq!(bench.entries("out"), ["m.ply", "p.png", "r.json", "x.zarr"]);
    assert!(bench.entries("scratch").is_empty());
    let labels = volume(&bench.path("out/x.zarr/labels/segmentation"));
    let dice = dice(&labels, 1.0, ball.geometry.shape, |v| ball.holds(v));
    assert!(dice > 0.95, "Dice {dice}");
    let mesh = fs::read(bench.path("out/m.ply")).unwrap();
    assert!(mesh == fs::read(bench.path("out/x.zarr/meshes/surface.ply")).unwrap());
    check_report(&bench, &ball, &labels);
    let again = bench.fail("segment image.tif --points marks.csv -o out/x.zarr", 2);
    assert!(again.contains("--overwrite"), "{again}");
    bench.succeed("segment image.tif --points marks.csv -o out/x.zarr --overwrite -q");
    let info = bench.succeed("info out/x.zarr");
    assert!(info.contains("40 x 36 x 20 uint16") && info.contains("closed: true"), "{info}");
}

fn check_report(bench: &Bench, ball: &Ball, labels: &[f64]) {
    let report = bench.json("out/x.zarr/report.json");
    let inside = labels.iter().filter(|&&l| l == 1.0).count();
    for key in [
        "version",
        "command",
        "settings",
        "grid",
        "threads",
        "ranks",
        "memory_budget_bytes",
        "peak_rss_bytes",
        "seconds",
        "stages",
        "result",
        "notes",
        "arguments",
    ] {
        assert!(!report[key].is_null(), "{key}: {report}");
    }
    assert_eq!((report["command"].as_str(), report["threads"].as_i64()), (Some("segment"), Some(2)));
    let grid = &report["grid"];
    assert_eq!(grid["shape_zyx"], serde_json::json!([20, 36, 40]));
    assert_eq!(grid["spacing_zyx"], serde_json::json!([1.0, 0.5, 0.5]));
    assert_eq!(grid["unit"], "micrometer");
    for key in ["name", "seconds", "brick_loads", "bricks", "bytes_read", "bytes_written", "iterations", "residual"] {
        assert!(!report["stages"][0][key].is_null(), "{key}");
    }
    let result = &report["result"];
    let sphere = 4.0 / 3.0 * std::f64::consts::PI * ball.radius.powi(3);
    assert!((result["volume"].as_f64().unwrap() / sphere - 1.0).abs() < 0.1, "{result}");
    assert_eq!(result["label_voxels"]["1"], inside);
    assert_eq!((&result["closed"], &result["components"]), (&true.into(), &1.into()));
    assert!(result["hausdorff"]["mean"].as_f64().unwrap() < 0.5 && result["hausdorff"]["max"].as_f64().unwrap() < 1.5);
    assert_eq!(result["objects"].as_array().unwrap().len(), 1);
    for key in ["time_steps", "sor_iterations", "band_voxels", "beta", "stopped_by", "image_model", "cloud_points"] {
        assert_eq!(result[key], result["objects"][0][key], "{key}");
        assert!(!result[key].is_null(), "{key}");
    }
    // The file of its own was written later; what was found is the same.
    assert_eq!(bench.json("out/r.json")["result"], *result);
}

/// Without points, from a ball that is larger than the object and beside its middle, smoothed as in the paper (Kósa
/// 2015, Fig. 2.3): a Gaussian of as many voxels is wider where it counts, and curvature takes more of a ball of twelve.
#[test]
fn a_seed_goes_to_the_edges_of_the_image() {
    let ball = Ball::small();
    let bench = Bench::new(&ball);
    let plain = "--smoothing heat --edge plain --rho 1 --k 100 --delta 0.1 --max-steps 400 --tol 0.005";
    bench.succeed(&format!("segment image.tif --seed 10.5,9.5,9,8.5 {plain} -q -o out/s.zarr"));
    let report = bench.json("out/s.zarr/report.json");
    assert_eq!(report["settings"]["seeds"], serde_json::json!([[10.5, 9.5, 9.0, 8.5]]));
    let labels = volume(&bench.path("out/s.zarr/labels/segmentation"));
    let overlap = dice(&labels, 1.0, ball.geometry.shape, |v| ball.holds(v));
    assert!(overlap > 0.95, "{overlap}, {}", report["result"]);
    for (seed, said) in [("1,2,3", "4 numbers"), ("1,2,3,0", "radius above 0"), ("90,2,3,4", "holds no voxel")] {
        let text = bench.fail(&format!("segment image.tif --seed {seed} -o out/x.zarr"), 2);
        assert!(text.contains(said), "{seed}: {text}");
    }
    assert_eq!(bench.entries("out"), ["s.zarr"]);
}

#[test]
fn layout_threads_and_memory_change_no_bit() {
    let bench = Bench::new(&Ball::small());
    let run = |name: &str, flags: &str| {
        bench.succeed(&format!("segment image.tif --points marks.csv -q -o out/{name}.zarr {flags}"));
        contents(&bench.path(&format!("out/{name}.zarr")))
    };
    let first = run("first", "");
    assert!(first.iter().any(|(name, _)| name.starts_with("labels/segmentation/0/c/")), "no labels");
    assert!(first.iter().any(|(name, _)| name.starts_with("levelset/0/c/")), "no level set");
    for (n, flags) in
        ["--brick 16 --threads 1 --memory 256MiB", "--brick 32 --threads 3 --memory 4GiB", "--method vdt --brick 128"]
            .iter()
            .enumerate()
    {
        same(&first, &run(&n.to_string(), flags), flags);
    }
}

#[test]
fn nested_objects_become_rings_and_files_number_on() {
    let outer = Ball::small();
    let inner = Ball { radius: 3.5, ..outer.clone() };
    let bench = Bench::new(&outer);
    bench.write("inner.csv", &format!("{HEADER}{}", inner.marks(1)));
    bench.write("both.csv", &format!("{HEADER}{}{}", outer.marks(1), inner.marks(2)));
    bench.succeed(
        "segment image.tif --points marks.csv --points inner.csv -q -o out/files.zarr --mesh out/m.ply --rho 0",
    );
    bench.succeed("segment image.tif --points both.csv -q -o out/both.zarr --rho 0");
    same(&contents(&bench.path("out/files.zarr")), &contents(&bench.path("out/both.zarr")), "files or one file");
    assert_eq!(bench.entries("out"), ["both.zarr", "files.zarr", "m-1.ply", "m-2.ply"]);
    let meshes = fs::read(bench.path("out/m-1.ply")).unwrap();
    let complaint = bench.fail("segment image.tif --points both.csv -q -o none --mesh out/m.ply", 2);
    assert!(complaint.contains("m-1.ply") && complaint.contains("--overwrite"), "{complaint}");
    assert_eq!(fs::read(bench.path("out/m-1.ply")).unwrap(), meshes);
    let shape = outer.geometry.shape;
    let labels = volume(&bench.path("out/both.zarr/labels/segmentation"));
    let ring = dice(&labels, 1.0, shape, |v| outer.holds(v) && !inner.holds(v));
    let core = dice(&labels, 2.0, shape, |v| inner.holds(v));
    assert!(ring > 0.88 && core > 0.88, "ring {ring}, core {core}");
    let report = bench.json("out/both.zarr/report.json");
    assert_eq!(report["result"]["objects"].as_array().unwrap().len(), 2);
    assert!(report["result"]["volume"].is_null(), "several objects have no one volume");
    bench.succeed("segment image.tif --points both.csv -q -o out/larger.zarr --rho 0 --overlap larger");
    let labels = volume(&bench.path("out/larger.zarr/labels/segmentation"));
    assert!(labels.iter().all(|&label| label != 2.0), "the larger object hides the one inside");
}

#[test]
fn a_crop_of_a_channel_is_the_same_as_cropping_before() {
    let ball = Ball::small();
    let bench = Bench::new(&ball);
    let (voxels, other) = (ball.voxels(), vec![3_u16; ball.geometry.domain().len()]);
    write_stack(&bench.path("two.tif"), &ball.geometry, &[&other, &voxels]);
    let part = Box3::new([2, 1, 2], [38, 35, 18]);
    let crop: Vec<u16> = part
        .rows()
        .flat_map(|(y, z)| (part.lo[0]..part.hi[0]).map(move |x| [x, y, z]))
        .map(|v| voxels[ball.geometry.domain().offset_of(v)])
        .collect();
    let mut geometry = ball.geometry.crop(&part);
    let offset = geometry.origin;
    geometry.origin = [0.0; 3];
    write_stack(&bench.path("part.tif"), &geometry, &[&crop]);
    let moved = |line: &str| {
        let values: Vec<f64> = line.split(',').map(|v| v.parse().unwrap()).collect();
        let [x, y, z]: [f64; 3] = std::array::from_fn(|a| values[2 + a] - offset[a]);
        format!("{},{},{x},{y},{z}\n", values[0], values[1])
    };
    bench.write("moved.csv", &format!("{HEADER}{}", ball.marks(1).lines().map(moved).collect::<String>()));
    bench.succeed("segment two.tif --channel 1 --crop 2:38,1:35,2:18 --points marks.csv -q -o out/crop.zarr");
    bench.succeed("segment part.tif --points moved.csv -q -o out/part.zarr");
    let voxels = |store: &str| {
        let mut files = contents(&bench.path(store));
        files.retain(|(name, _)| name.contains("/c/"));
        files
    };
    assert!(voxels("out/crop.zarr").len() >= 3);
    same(&voxels("out/crop.zarr"), &voxels("out/part.zarr"), "crop");
    let crop = ImageReader::open(&bench.path("out/crop.zarr")).unwrap();
    assert_eq!(crop.levels()[0].geometry.origin, offset);
}

#[test]
fn missing_spacing_and_stray_marks_are_noted() {
    let ball = Ball::small();
    let bench = Bench::new(&ball);
    let page = |plane: &[u16]| gray_page(40, 36, 16, crate::common::tiff_bytes::bytes_u16(plane, false));
    let pages: Vec<_> = ball.voxels().chunks_exact(40 * 36).map(page).collect();
    fs::write(bench.path("bare.tif"), tiff_file(&pages, false)).unwrap();
    bench.write("stray.csv", &format!("{HEADER}{}1,2,35.5,1,2\n", ball.marks(1)));
    let output = bench.run("segment bare.tif --points stray.csv -o none --dry-run");
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success() && said.contains("no x, y, z spacing in bare.tif: 1 is assumed"), "{said}");
    let output = bench.run("segment image.tif --points stray.csv -o none --dry-run --image-spacing 0.5,0.5,1");
    let (plan, said) = (String::from_utf8(output.stdout).unwrap(), String::from_utf8(output.stderr).unwrap());
    assert!(said.contains("note: 1 mark lies outside"), "{said}");
    for word in ["40 x 36 x 20", "object 1: ", "memory", "temporary fields", "time"] {
        assert!(plan.contains(word), "{word}: {plan}");
    }
    assert!(bench.entries("out").is_empty());
}

#[test]
fn nothing_is_written_without_an_output_but_what_was_named() {
    let bench = Bench::new(&Ball::small());
    let printed = bench.succeed("segment image.tif --points marks.csv -o none --mesh out/m.ply --report out/r.json");
    assert!(printed.contains("object "));
    assert_eq!(bench.entries("out"), ["m.ply", "r.json"]);
    assert!(bench.entries("scratch").is_empty());
    // With no mesh to be written none is kept, and it is measured all the same.
    bench.succeed("segment image.tif --points marks.csv -o none --report out/measured.json");
    assert_eq!(bench.json("out/measured.json")["result"], bench.json("out/r.json")["result"]);
    let output = bench.run("segment image.tif --points marks.csv -o none -q");
    assert!(output.status.success() && output.stdout.is_empty() && output.stderr.is_empty());
}

#[test]
fn the_demo_runs_and_replaces_only_what_it_made() {
    let bench = Bench::new(&Ball::small());
    let printed = bench.succeed("demo --threads 2");
    for word in ["level set", "closed", "strandline-demo.zarr/picture.png", "strandline segment", "Moukhtar"] {
        assert!(printed.contains(word), "{word}: {printed}");
    }
    let report = bench.json("strandline-demo.zarr/report.json");
    assert_eq!(report["command"], "demo");
    // The marks lie two voxels of 0.35 outside of the wall's crest, and the surface on it.
    assert_eq!(report["result"]["image_model"], "wall");
    assert!(report["result"]["hausdorff"]["mean"].as_f64().unwrap() < 1.0, "{report}");
    let mut picture = png_size(&bench.path("strandline-demo.zarr/picture.png"));
    assert!((1100..1300).contains(&picture.remove(0)), "{picture:?}");
    fs::create_dir(bench.path("mine.zarr")).unwrap();
    bench.write("mine.zarr/zarr.json", "{}");
    assert!(bench.fail("demo -o mine.zarr", 2).contains("not made by the demo"));
    bench.succeed("demo -q");
}

fn png_size(path: &Path) -> Vec<u32> {
    let bytes = fs::read(path).unwrap();
    bytes[16..24].chunks_exact(4).map(|b| u32::from_be_bytes(b.try_into().unwrap())).collect()
}

#[test]
fn info_tells_what_things_are() {
    let bench = Bench::new(&Ball::small());
    let stack = bench.succeed("info image.tif");
    for word in ["TIFF stack", "40, 36, 20", "0.5, 0.5, 1 micrometer", "uint16"] {
        assert!(stack.contains(word), "{word}: {stack}");
    }
    let points: serde_json::Value = serde_json::from_str(&bench.succeed("info marks.csv --json")).unwrap();
    assert_eq!((&points["kind"], &points["objects"][0]["object"]), (&"points".into(), &1.into()));
    assert_eq!(points["points"], points["objects"][0]["points"]);
}

#[test]
fn other_programs_read_the_store() {
    let Some(interpreter) = python::interpreter() else { return };
    let ball = Ball::small();
    let bench = Bench::new(&ball);
    bench.succeed("segment image.tif --points marks.csv -q -o out/x.zarr");
    let values: Vec<u8> = ball.voxels().iter().flat_map(|v| v.to_le_bytes()).collect();
    fs::write(bench.path("image.raw"), values).unwrap();
    bench.write(
        "expect.json",
        r#"{"": {"dtype": "uint16", "shape": [20, 36, 40], "values": "image.raw", "scale": [1.0, 0.5, 0.5],
            "translation": [0.0, 0.0, 0.0], "unit": "micrometer"},
            "labels/segmentation": {"dtype": "uint8", "shape": [20, 36, 40], "unit": "micrometer"},
            "levelset": {"dtype": "float32", "scale": [1.0, 0.5, 0.5]}}"#,
    );
    let (store, expect) = (bench.path("out/x.zarr"), bench.path("expect.json"));
    let printed = python::run_script(interpreter, "check_store.py", &[&store, Path::new("--expect"), &expect]);
    let printed = printed.unwrap_or_else(|text| panic!("{text}"));
    assert_eq!(printed.lines().filter(|line| line.starts_with("ok ")).count(), 4, "{printed}");
}
