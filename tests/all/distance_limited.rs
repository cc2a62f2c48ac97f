//! A distance with a limit: within it all is as without one, beyond it nothing is known, wherever bricks lie.

#![allow(clippy::unwrap_used)]

use crate::common::ball::Bench;
use crate::common::clouds::sphere;
use crate::common::random::Random;
use crate::common::stores::volume;

const GRID: &str = "--origin 0,0,0 --shape 40,37,33 --spacing 0.1 --labels";

/// Two clouds that come near to each other here and there.
fn clouds(bench: &Bench) {
    let mut random = Random(5);
    for name in ["a.xyz", "b.xyz"] {
        let mut at = || 4.0 * random.unit();
        let text = (0..60).fold(String::new(), |text, _| text + &format!("{} {} {}\n", at(), at(), at()));
        bench.write(name, &text);
    }
}

#[test]
fn labels_end_where_the_distance_does_whatever_the_bricks() {
    let bench = Bench::bare();
    clouds(&bench);
    for method in ["fsm", "vdt", "fmm", "dp"] {
        bench.succeed(&format!("distance a.xyz b.xyz {GRID} --method {method} -q -o out/all.zarr --overwrite"));
        let [distances, labels] = ["", "labels/nearest"].map(|group| volume(&bench.path("out/all.zarr").join(group)));
        for brick in [16, 32, 48] {
            let limited = format!("--method {method} --brick {brick} --max-distance 0.45 -q -o out/x.zarr --overwrite");
            bench.succeed(&format!("distance a.xyz b.xyz {GRID} {limited}"));
            let [within, known] = ["", "labels/nearest"].map(|group| volume(&bench.path("out/x.zarr").join(group)));
            let mut beyond = 0;
            for n in 0..distances.len() {
                let is_beyond = distances[n] >= f64::from(0.45_f32);
                let expected = if is_beyond { (f64::from(0.45_f32), 0.0) } else { (distances[n], labels[n]) };
                assert_eq!((within[n], known[n]), expected, "{method}, bricks of {brick}, voxel {n}");
                beyond += usize::from(is_beyond);
            }
            assert!(beyond > 1000 && beyond < distances.len() - 1000, "{beyond}");
        }
    }
}

#[test]
fn middle_surfaces_with_a_limit_do_not_tell_where_bricks_lie() {
    let bench = Bench::bare();
    clouds(&bench);
    for method in ["vdt", "fmm"] {
        let mesh = |brick: i64| {
            let grid = "--origin 0,0,0 --shape 40,37,33 --spacing 0.1 --max-distance 0.45";
            bench.succeed(&format!(
                "middle a.xyz b.xyz {grid} --method {method} --brick {brick} -q -o none --mesh out/m.ply --overwrite"
            ));
            std::fs::read(bench.path("out/m.ply")).unwrap()
        };
        let of_16 = mesh(16);
        assert!(of_16.len() > 10_000);
        assert!([32, 48, 64].into_iter().all(|brick| mesh(brick) == of_16), "{method}");
    }
}

#[test]
fn no_surface_is_a_failure_and_no_file() {
    let bench = Bench::bare();
    for (name, at) in [("a.xyz", [0.0; 3]), ("b.xyz", [9.0, 0.0, 0.0])] {
        let points = sphere([0.0; 3], 1.0, 60, |_| true);
        let row = |p: &[f64; 3]| format!("{} {} {}\n", p[0] + at[0], p[1] + at[1], p[2] + at[2]);
        bench.write(name, &points.iter().fold(String::new(), |text, p| text + &row(p)));
    }
    for kind in ["exact", "labels"] {
        let grid = "--origin -1,-1,-1 --shape 10,10,10 --spacing 0.1";
        let said = bench.fail(&format!("middle a.xyz b.xyz {grid} --surface {kind} -o out/x.zarr --mesh out/m.stl"), 1);
        assert!(said.contains("no surface lies between the data sets"), "{said}");
        assert!(bench.entries("out").is_empty(), "{:?}", bench.entries("out"));
    }
}
