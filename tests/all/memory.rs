//! The memory that a plan tells is that which the run asks for, and about that which it takes by its report.

#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::Path;

use crate::common::ball::{Ball, Bench, write_stack};
use crate::common::lab::PlainGrid;
use crate::common::random::Random;
use std::sync::Arc;
use strandline::exec::{Budget, Cancel, Engine, Silent};
use strandline::grid::{DataSets, Geometry};
use strandline::pipeline::distance::{DistanceSettings, Init, Method, Schedule, distance};
use strandline::store::Scratch;

/// Bytes of a size as it is printed.
fn bytes(text: &str) -> f64 {
    let (number, unit) = text.split_once(' ').unwrap();
    let shift = ["KiB", "MiB", "GiB"].iter().position(|known| *known == unit).unwrap() as i32;
    number.parse::<f64>().unwrap() * 1024_f64.powi(shift + 1)
}

/// The sizes between some words of a text.
fn between(text: &str, before: &str, after: &str) -> String {
    let start = text.find(before).unwrap_or_else(|| panic!("{before}: {text}")) + before.len();
    text[start..].split(after).next().unwrap().to_owned()
}

#[test]
fn a_plan_of_segment_tells_what_the_run_takes() {
    let bench = Bench::new(&Ball::small());
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("data");
    for name in ["arabidopsis-embryo.tif", "arabidopsis-marks.csv"] {
        fs::copy(data.join(name), bench.path(name)).unwrap();
    }
    for inputs in ["arabidopsis-embryo.tif --points arabidopsis-marks.csv", "image.tif --points marks.csv"] {
        let run = format!("segment {inputs} --threads 2 -o none");
        let plan = bench.succeed(&format!("{run} --dry-run"));
        let least = between(&plan, "are used; ", " must be allowed");
        let least = (bytes(&least) / 1024_f64.powi(2)).round() as u64;
        let plan = bench.succeed(&format!("{run} --memory {least}MiB --dry-run"));
        let told = bytes(&between(&plan, "memory: about ", " are used"));
        bench.succeed(&format!("{run} --memory {least}MiB -q --report out/r.json --overwrite"));
        let report = bench.json("out/r.json");
        assert_eq!(report["memory_budget_bytes"].as_u64(), Some(least << 20));
        let peak = report["peak_rss_bytes"].as_f64().unwrap();
        assert!(peak <= (least << 20) as f64, "{inputs}: {peak} of {least} MiB");
        assert!((1.0 / 1.5..1.5).contains(&(told / peak)), "{inputs}: {told} bytes told, {peak} taken");
        // One MiB less is refused, with what the plan told.
        let less = bench.fail(&format!("{run} --memory {}MiB -q", least - 1), 2);
        assert!(less.contains(&format!("give at least --memory {least}MiB")), "{less}");
    }
}

#[test]
fn plans_of_fields_tell_the_least_memory() {
    let bench = Bench::bare();
    bench.write("cube.xyz", "0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 0\n1 0 1\n0 1 1\n1 1 1\n");
    for run in ["distance cube.xyz --spacing 0.05", "reconstruct cube.xyz --spacing 0.25"] {
        let plan = bench.succeed(&format!("{run} --threads 2 -o none --dry-run"));
        let least = (bytes(&between(&plan, ", at least ", ";")) / 1024_f64.powi(2)).round() as u64;
        bench.succeed(&format!("{run} --threads 2 -o none --memory {least}MiB --dry-run"));
        let less = bench.run(&format!("{run} --threads 2 -o none --memory {}MiB", least - 1));
        let said = String::from_utf8_lossy(&less.stderr).into_owned();
        assert!(less.status.code() == Some(2) && said.contains(&format!("--memory {least}MiB")), "{said}");
    }
}

/// Random points in a cube, as a table.
fn spread(seed: u64, count: usize) -> String {
    let mut random = Random(seed);
    let mut line = |_| format!("{:.4},{:.4},{:.4}\n", random.unit(), random.unit(), random.unit());
    (0..count).map(&mut line).collect()
}

/// Random points on a ball of radius 1, as a table.
fn ball(seed: u64, count: usize) -> String {
    let mut random = Random(seed);
    let mut line = |_| {
        let (z, turn) = (2.0 * random.unit() - 1.0, std::f64::consts::TAU * random.unit());
        let across = (1.0 - z * z).sqrt();
        format!("{:.4},{:.4},{z:.4}\n", across * turn.cos(), across * turn.sin())
    };
    (0..count).map(&mut line).collect()
}

/// Jobs whose memory is not in bricks: chunks on their way out, sources and their trees, a surface that fills its grid, many
/// objects. Each gets what it says is the least, and does not take more.
#[test]
fn tight_jobs_keep_to_their_limit() {
    let bench = Bench::new(&Ball::small());
    bench.write("one.csv", &spread(1, 3000));
    bench.write("two.csv", &spread(2, 3000));
    bench.write("ball.csv", &ball(3, 2000));
    for run in [
        "distance one.csv two.csv --spacing 0.02 --labels --closest-point --brick 96 -o out/a.zarr",
        "distance one.csv --spacing 0.02 --method fmm --schedule sweep --precision f64 --brick 16 -o none",
        "middle one.csv two.csv --spacing 0.05 -o none --mesh out/b.ply",
        "reconstruct ball.csv --spacing 0.08 --max-steps 2 -o out/c.zarr",
        "segment image.tif --points marks.csv --max-steps 2 -o out/d.zarr",
    ] {
        let refused = bench.run(&format!("{run} --threads 3 --memory 100MiB --dry-run"));
        let said = String::from_utf8_lossy(&refused.stderr).into_owned();
        let least = between(&said, "give at least --memory ", "MiB").parse::<u64>().unwrap();
        bench.succeed(&format!("{run} --threads 3 --memory {least}MiB -q --report out/r.json --overwrite"));
        let peak = bench.json("out/r.json")["peak_rss_bytes"].as_u64().unwrap();
        assert!(peak <= least << 20, "{run}: {peak} of {least} MiB");
    }
}

/// Whoever calls the library is held to the budget too.
#[test]
fn a_job_of_the_library_refuses_a_budget_that_is_too_small() {
    let folder = tempfile::tempdir().unwrap();
    let scratch = Scratch::new(folder.path(), 1 << 30);
    let budget = Budget { total: 112 << 20 };
    let engine = Engine::new(2, scratch.clone(), budget, Cancel::default(), Arc::new(Silent)).unwrap();
    let geometry = Geometry { shape: [32; 3], spacing: [1.0; 3], origin: [0.0; 3], unit: None };
    let mut sets = DataSets::default();
    sets.add_cloud(&[[3.0, 4.0, 5.0]]);
    let settings = DistanceSettings {
        method: Method::VDT,
        schedule: Schedule::Front,
        neighbours: strandline::kernel::distance::state::neighbours::Neighbours::Faces,
        init: Init::Cell,
        farthest: None,
        signed: false,
        labels: false,
        closest_point: false,
        brick: 32,
        exact: false,
        timed: false,
    };
    let error = distance::<f32>(&engine, &geometry, &sets, &settings, None).unwrap_err().to_string();
    assert!(error.contains("give at least --memory 1"), "{error}");
    let budget = Budget { total: 128 << 20 };
    let engine = Engine::new(2, scratch.clone(), budget, Cancel::default(), Arc::new(Silent)).unwrap();
    distance::<f32>(&engine, &geometry, &sets, &settings, None).unwrap();
    assert!(scratch.window() <= 80 << 20, "what was not held is the window: {}", scratch.window());
}

/// Volumes of cells, with gaps between them and without: what their surfaces take is told before the run.
#[test]
fn crowded_labels_are_refused_before_they_begin_or_not_at_all() {
    let bench = Bench::bare();
    let geometry = Geometry { shape: [36; 3], spacing: [1.0; 3], origin: [0.0; 3], unit: None };
    let mut random = Random(5);
    let seeds: Vec<[f64; 3]> = (0..700).map(|_| std::array::from_fn(|_| 36.0 * random.unit())).collect();
    for gap in [0.0, 1.0] {
        let label = |voxel: [i64; 3]| {
            let square = |seed: &[f64; 3]| (0..3).map(|a| (seed[a] - voxel[a] as f64).powi(2)).sum::<f64>();
            let mut nearest = [(f64::INFINITY, 0), (f64::INFINITY, 0)];
            for (n, seed) in seeds.iter().enumerate() {
                let found = (square(seed).sqrt(), n as u16 + 1);
                if found < nearest[0] {
                    nearest = [found, nearest[0]];
                } else if found < nearest[1] {
                    nearest[1] = found;
                }
            }
            if nearest[1].0 - nearest[0].0 < gap { 0 } else { nearest[0].1 }
        };
        let voxels: Vec<u16> = PlainGrid { shape: geometry.shape }.voxels().map(label).collect();
        write_stack(&bench.path("cells.tif"), &geometry, &[&voxels]);
        let run = "middle cells.tif -o none --threads 2";
        let plan = bench.succeed(&format!("{run} --dry-run"));
        let least = (bytes(&between(&plan, ", at least ", ";")) / 1024_f64.powi(2)).round() as u64;
        let less = bench.run(&format!("{run} --memory {}MiB", least - 1));
        let said = String::from_utf8_lossy(&less.stderr).into_owned();
        assert!(less.status.code() == Some(2) && said.contains(&format!("--memory {least}MiB")), "{said}");
        assert!(said.contains("a grid of 46 656 voxels needs"), "refused before it began: {said}");
        bench.succeed(&format!("{run} --memory {least}MiB -q --report out/r.json --overwrite"));
        let peak = bench.json("out/r.json")["peak_rss_bytes"].as_f64().unwrap();
        assert!(peak <= (least << 20) as f64, "{peak} of {least} MiB");
    }
}
