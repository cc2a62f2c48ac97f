//! `strandline distance --speed` as users run it: the grid of the image, what is told of times, ranks and memory, and what is refused.

#![allow(clippy::unwrap_used)]

use std::fs;

use strandline::grid::Geometry;

use crate::common::ball::{Bench, write_stack};
use crate::common::lab::PlainGrid;
use crate::common::random::Random;
use crate::common::stores::{contents, same, volume};
use crate::common::times::{fixed_times, plain_times};

const POINTS: [[f64; 3]; 2] = [[2.3, 3.4, 4.2], [15.2, 9.1, 11.9]];

/// The grid of `speed.nrrd`.
fn grid() -> Geometry {
    Geometry::new([40, 33, 35], [0.5, 0.4, 0.5], [0.0; 3])
}

/// An NRRD file of single precision.
fn nrrd(grid: &Geometry, speeds: &[f32]) -> Vec<u8> {
    let ([x, y, z], [hx, hy, hz]) = (grid.shape, grid.spacing);
    let header = format!(
        "NRRD0004\ntype: float\ndimension: 3\nsizes: {x} {y} {z}\nspacings: {hx} {hy} {hz}\nendian: little\nencoding: raw\n\n"
    );
    let values = speeds.iter().flat_map(|v| v.to_le_bytes());
    header.into_bytes().into_iter().chain(values).collect()
}

fn speeds() -> Vec<f32> {
    let mut random = Random(11);
    let plain = PlainGrid { shape: grid().shape };
    plain.voxels().map(|v| if v[2] == 17 && v[0] > 4 { 0.0 } else { 0.25 + 3.0 * random.unit() as f32 }).collect()
}

/// A folder with the points, the image of speeds, and a mesh.
fn bench() -> Bench {
    let bench = Bench::bare();
    for (name, point) in ["a.xyz", "b.xyz"].into_iter().zip(POINTS) {
        bench.write(name, &format!("{} {} {}\n", point[0], point[1], point[2]));
    }
    fs::write(bench.path("speed.nrrd"), nrrd(&grid(), &speeds())).unwrap();
    bench.write("mesh.off", "OFF\n3 1 0\n3 3 3\n9 3 3\n3 9 5\n3 0 1 2\n");
    bench
}

#[test]
fn times_lie_on_the_grid_of_the_image_and_are_told_as_times() {
    let bench = bench();
    let printed = bench.succeed("distance a.xyz b.xyz --speed speed.nrrd --labels -o out/t.zarr");
    let times = volume(&bench.path("out/t.zarr"));
    let plain = plain_times(&grid(), &speeds(), &fixed_times(&grid(), &speeds(), &POINTS));
    for (time, expected) in times.iter().zip(&plain) {
        assert!(time == expected || (time - expected).abs() <= 3e-6 * expected, "{time} {expected}");
    }
    assert!(printed.contains("largest travel time") && printed.contains("unit of the speeds"), "{printed}");
    let report = bench.json("out/t.zarr/report.json");
    assert_eq!(report["grid"]["spacing_zyx"], serde_json::json!([0.5, 0.4, 0.5]));
    let settings = &report["settings"];
    assert_eq!((settings["speed"].as_str(), settings["method"].as_str()), (Some("speed.nrrd"), Some("fmm")));
    let result = &report["result"];
    assert_eq!(result["quantity"], "travel time");
    let walls = speeds().iter().filter(|speed| **speed == 0.0).count();
    assert_eq!(result["unlabelled_voxels"], walls);
    let store = bench.json("out/t.zarr/zarr.json");
    assert_eq!(store["attributes"]["ome"]["multiscales"][0]["name"], "travel time");
    bench.succeed("verify out/t.zarr --rerun");
    let report = bench.succeed("distance a.xyz b.xyz -o none --spacing 0.5");
    assert!(report.contains("largest distance"), "{report}");
}

#[test]
fn ranks_threads_and_memory_change_no_bit() {
    let bench = bench();
    for order in [
        "--method fmm",
        "--method fsm",
        "--method fsm --schedule sweep --iterations 3",
        "--method fmm --schedule sweep",
    ] {
        let run = |flags: &str| {
            bench.succeed(&format!(
                "distance a.xyz b.xyz mesh.off --speed speed.nrrd {order} --labels --brick 16 -q -o out/t.zarr --overwrite {flags}"
            ));
            contents(&bench.path("out/t.zarr"))
        };
        let one = run("--threads 1");
        for flags in ["--ranks 2", "--ranks 5 --threads 5", "--threads 2 --memory 150MiB"] {
            same(&one, &run(flags), &format!("{order} {flags}"));
        }
    }
}

/// A stack with its own spacing, a limit to the times, and points that count its voxels.
#[test]
fn stacks_limits_and_voxels() {
    let bench = bench();
    let grid = Geometry::new([20, 16, 12], [0.5, 0.5, 1.0], [0.0; 3]);
    let speeds: Vec<u16> = PlainGrid { shape: grid.shape }.voxels().map(|[x, ..]| 1 + x as u16 % 4).collect();
    write_stack(&bench.path("speed.tif"), &grid, &[&speeds]);
    bench.write("voxels.csv", "x,y,z\n3.25,4.5,6\n");
    bench.succeed("distance voxels.csv --speed speed.tif --points-in voxels --max-distance 1.5 -q -o out/t.zarr");
    let speeds: Vec<f32> = speeds.iter().map(|v| f32::from(*v)).collect();
    let plain = plain_times(&grid, &speeds, &fixed_times(&grid, &speeds, &[[1.625, 2.25, 6.0]]));
    for (time, expected) in volume(&bench.path("out/t.zarr")).iter().zip(&plain) {
        assert!((time - expected.min(1.5)).abs() <= 3e-6 * expected, "{time} {expected}");
    }
}

#[test]
fn what_makes_no_times_is_refused_in_a_sentence() {
    let bench = bench();
    let flat = |value: f32| vec![value; 40 * 33 * 35];
    for (name, value) in [("nan", f32::NAN), ("minus", -1.0), ("infinite", f32::INFINITY), ("tiny", 1e-42)] {
        let mut speeds = speeds();
        speeds[5 + 40 * (6 + 33 * 7)] = value;
        fs::write(bench.path(&format!("{name}.nrrd")), nrrd(&grid(), &speeds)).unwrap();
    }
    fs::write(bench.path("zero.nrrd"), nrrd(&grid(), &flat(0.0))).unwrap();
    let mut around = flat(0.0);
    around[0] = 1.0;
    fs::write(bench.path("walls.nrrd"), nrrd(&grid(), &around)).unwrap();
    let speed = "distance a.xyz --speed speed.nrrd";
    for (arguments, expected) in [
        (speed.to_owned() + " --method vdt", "--method vdt measures straight ways"),
        (speed.to_owned() + " --method dp", "with --speed give fsm or fmm"),
        (speed.to_owned() + " --exact", "--exact"),
        (speed.to_owned() + " --neighbours 26", "leave --neighbours out"),
        (speed.to_owned() + " --init contiguous", "--init contiguous"),
        (speed.to_owned() + " --padding 3", "--padding"),
        (speed.to_owned() + " --spacing 0.5", "has the spacing (0.5, 0.4, 0.5)"),
        (speed.to_owned() + " --origin 0,0,0 --shape 40,33,34 --spacing 0.5,0.4,0.5", "has 40 x 33 x 35 voxels"),
        (speed.to_owned() + " --precision f16 --image-spacing 1e5", "--precision float16"),
        ("distance mesh.off --signed --speed speed.nrrd".into(), "no sign"),
        ("distance mesh.off --closest-point --speed speed.nrrd".into(), "--closest-point"),
        ("distance a.xyz --speed nan.nrrd".into(), "the speed NaN at voxel 5, 6, 7"),
        ("distance a.xyz --speed minus.nrrd --method fsm".into(), "the speed -1 at voxel 5, 6, 7"),
        ("distance a.xyz --speed infinite.nrrd".into(), "the speed inf at voxel 5, 6, 7"),
        ("distance a.xyz --speed tiny.nrrd".into(), "at voxel 5, 6, 7"),
        ("distance a.xyz --speed zero.nrrd".into(), "zero.nrrd: holds no speed above 0"),
        ("distance a.xyz --speed walls.nrrd".into(), "no front begins"),
        ("distance a.xyz --speed a.xyz".into(), "a.xyz"),
        ("distance a.xyz --speed none.nrrd".into(), "none.nrrd"),
    ] {
        let told = bench.fail(&format!("{arguments} -q -o none"), 2);
        assert!(told.contains(expected) && told.lines().count() == 1, "{arguments}: {told}");
    }
}
