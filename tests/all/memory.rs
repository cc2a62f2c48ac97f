//! The memory that a plan tells is that which the run asks for, and about that which it takes by its report.

#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::Path;

use crate::common::ball::{Ball, Bench};

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
