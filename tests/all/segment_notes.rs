//! What `segment` says of images and marks that are read as they are, though something else may have been meant.

#![allow(clippy::unwrap_used)]

use std::fs;

use crate::common::ball::{Ball, Bench, HEADER, write_stack};
use crate::common::tiff_bytes::{PageBytes, Value, gray_page, tiff_file};

/// Notes and errors of a run, whatever it ended with.
fn told(bench: &Bench, arguments: &str) -> String {
    String::from_utf8(bench.run(arguments).stderr).unwrap()
}

#[test]
fn a_file_that_is_given_twice_is_told() {
    let bench = Bench::new(&Ball::small());
    let run = "segment image.tif -o none --dry-run --points marks.csv --points";
    assert!(told(&bench, &format!("{run} ./marks.csv")).contains("./marks.csv is given twice"));
    fs::copy(bench.path("marks.csv"), bench.path("other.csv")).unwrap();
    assert!(!told(&bench, &format!("{run} other.csv")).contains("given twice"));
}

#[test]
fn outlines_that_leave_much_open_are_told() {
    let ball = Ball::small();
    let bench = Bench::new(&ball);
    let said = |rows: &str| {
        bench.write("few.csv", &format!("{HEADER}{rows}"));
        told(&bench, "segment image.tif --points few.csv -o none --dry-run")
    };
    let marks = ball.marks(1);
    let whole = said(&marks);
    assert!(!whole.contains("are open") && !whole.contains("one outline"), "{whole}");
    let first = marks.lines().take(24).collect::<Vec<_>>().join("\n") + "\n";
    assert!(said(&first).contains("object 1 has one outline"));
    // Half of the marks of slices 6 and 8: 13 of 24 around each, whose ends are a diameter apart.
    let of = |line: &str, slice: &str| line.split(',').nth(1) == Some(slice);
    let half = |slice| marks.lines().filter(move |line| of(line, slice)).take(13);
    let rest = marks.lines().filter(|line| !of(line, "6") && !of(line, "8"));
    let halves = rest.chain(half("6")).chain(half("8")).collect::<Vec<_>>().join("\n") + "\n";
    let open = said(&halves);
    assert!(open.contains("outlines of object 1 are open (6, 8)"), "{open}");
}

#[test]
fn the_channel_that_is_read_is_told() {
    let ball = Ball::small();
    let bench = Bench::new(&ball);
    let voxels = ball.voxels();
    write_stack(&bench.path("two.tif"), &ball.geometry, &[&voxels, &voxels]);
    let run = "segment two.tif --points marks.csv -o none --dry-run";
    assert!(told(&bench, run).contains("two.tif: has 2 channels; channel 0 is read, --channel N picks another"));
    assert!(!told(&bench, &format!("{run} --channel 1")).contains("channels"));
}

#[test]
fn a_value_that_is_no_number_is_told_with_its_file() {
    let bench = Bench::bare();
    let plane = |z: usize| {
        let value = |n: usize| if (z, n) == (2, 13) { f32::NAN } else { (z + n) as f32 };
        (0..80).flat_map(|n| value(n).to_le_bytes()).collect::<Vec<u8>>()
    };
    let pages: Vec<PageBytes> =
        (0..5).map(|z| gray_page(10, 8, 32, plane(z)).with(339, Value::Short(vec![3]))).collect();
    fs::write(bench.path("a.tif"), tiff_file(&pages, false)).unwrap();
    let said = told(&bench, "segment a.tif --seed 4,4,2,2 --image-spacing 1,1,1 -o none");
    assert!(said.contains("strandline: a.tif: plane 2 (page 3) holds a value that is no number"), "{said}");
    assert!(said.contains("at voxel 3, 1, 2 (x, y, z, counted from 0)"), "{said}");
}

#[test]
fn lengths_in_another_unit_are_told() {
    let ball = Ball::small();
    let bench = Bench::new(&ball);
    let rows = ball.marks(1).lines().fold(String::new(), |text, row| {
        let fields: Vec<&str> = row.split(',').collect();
        let [x, y, z] = [2, 3, 4].map(|n| fields[n].parse::<f64>().unwrap() * 1e-6);
        text + &format!("1,{},{x},{y},{z}\n", fields[1])
    });
    bench.write("metres.csv", &format!("{HEADER}{rows}"));
    let said = told(&bench, "segment image.tif --points metres.csv -o none --dry-run");
    assert!(said.contains("another unit than the image's, micrometer; name theirs in the header"), "{said}");
}
