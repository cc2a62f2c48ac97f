//! Label volumes as sources: the borders of their labels, and middle surfaces between these.

use strandline::grid::Geometry;

use crate::common::ball::{Bench, write_stack};
use crate::common::lab::PlainGrid;
use crate::common::stores::volume;
use crate::common::textbook::{position, squared};

/// Two boxes and a rod in a volume of oblong voxels.
fn bodies() -> (Geometry, Vec<u16>) {
    let geometry =
        Geometry { shape: [24, 19, 9], spacing: [0.5, 0.5, 1.25], origin: [0.0; 3], unit: Some("micrometer".into()) };
    let label = |[x, y, z]: [i64; 3]| match (x, y, z) {
        (2..8, 3..9, 1..5) => 9,
        (14..20, 5..16, 2..8) => 3,
        (3..6, 13..17, _) => 700,
        _ => 0,
    };
    let voxels = PlainGrid { shape: geometry.shape }.voxels().map(label).collect();
    (geometry, voxels)
}

/// The label of the nearest border voxel of each voxel, one by one; of equal distances the lowest.
fn nearest(geometry: &Geometry, labels: &[u16]) -> Vec<f64> {
    let grid = PlainGrid { shape: geometry.shape };
    let domain = geometry.domain();
    let at = |voxel: [i64; 3]| labels[domain.offset_of(voxel)];
    let is_border = |voxel: &[i64; 3]| {
        at(*voxel) > 0
            && (0..6).any(|side| {
                let mut beside = *voxel;
                beside[side / 2] += if side % 2 == 0 { 1 } else { -1 };
                domain.contains(beside) && at(beside) != at(*voxel)
            })
    };
    let border: Vec<([f64; 3], u16)> =
        grid.voxels().filter(is_border).map(|voxel| (position(geometry, voxel), at(voxel))).collect();
    let of = |voxel| {
        let here = position(geometry, voxel);
        let far = (f64::INFINITY, u16::MAX);
        let closest = border.iter().map(|(place, label)| (squared(here, *place), *label));
        f64::from(closest.fold(far, |best, next| if next < best { next } else { best }).1)
    };
    grid.voxels().map(of).collect()
}

#[test]
fn labels_of_a_volume_share_its_voxels() {
    let bench = Bench::bare();
    let (geometry, voxels) = bodies();
    write_stack(&bench.path("cells.tif"), &geometry, &[&voxels]);
    let printed = bench.succeed("middle cells.tif --labels exact -o out.zarr --mesh out.stl");
    assert!(printed.contains("labels 3 and 9: area"), "{printed}");
    let wanted = nearest(&geometry, &voxels);
    assert_eq!(volume(&bench.path("out.zarr/labels/nearest")), wanted);
    let report = bench.json("out.zarr/report.json");
    let pairs = report["result"]["pairs"].as_array().unwrap();
    let labels: Vec<_> = pairs.iter().map(|pair| pair["labels"].to_string()).collect();
    assert_eq!(labels, ["[3,9]", "[3,700]", "[9,700]"]);
    assert_eq!(report["grid"]["unit"], "micrometer");
    // A volume of shares has nothing between them: walls alone are drawn, and what is written is the volume.
    bench.succeed("middle out.zarr/labels/nearest -o again.zarr");
    assert_eq!(volume(&bench.path("again.zarr/labels/nearest")), wanted);
    // Ranks change nothing.
    bench.succeed("middle cells.tif --labels exact -o ranks.zarr --ranks 3 --mesh ranks.stl");
    assert_eq!(std::fs::read(bench.path("ranks.stl")).unwrap(), std::fs::read(bench.path("out.stl")).unwrap());
    assert_eq!(volume(&bench.path("ranks.zarr/labels/nearest")), wanted);
    // Behind a cloud, labels are numbered on; the distance takes volumes too.
    bench.write("point.xyz", "6 4.5 5\n");
    bench.succeed("distance point.xyz cells.tif --labels -o mixed.zarr");
    let found = bench.json("mixed.zarr/report.json");
    let keys: Vec<&String> = found["result"]["label_voxels"].as_object().unwrap().keys().collect();
    assert_eq!(keys, ["1", "10", "4", "701"]);
    assert_eq!(found["grid"]["shape_zyx"], serde_json::json!([9, 19, 24]));
}

#[test]
fn an_image_in_place_of_labels_is_noted() {
    let bench = Bench::bare();
    let (geometry, voxels) = bodies();
    let grey: Vec<u16> = (0..voxels.len()).map(|n| (n * 7919 % 1000) as u16).collect();
    for (name, values) in [("image.tif", &grey), ("labels.tif", &voxels)] {
        write_stack(&bench.path(name), &geometry, &[values]);
        let told = bench.run(&format!("middle {name} -o none --dry-run"));
        let is_noted = String::from_utf8_lossy(&told.stderr).contains("is it an image");
        assert_eq!((told.status.success(), is_noted), (true, name == "image.tif"), "{told:?}");
    }
}

#[test]
fn what_holds_no_labels_is_refused() {
    let bench = Bench::bare();
    let (geometry, voxels) = bodies();
    write_stack(&bench.path("cells.tif"), &geometry, &[&voxels]);
    write_stack(&bench.path("same.tif"), &geometry, &[&vec![4; voxels.len()]]);
    let one: Vec<u16> = voxels.iter().map(|&label| if label == 9 { 9 } else { 0 }).collect();
    write_stack(&bench.path("one.tif"), &geometry, &[&one]);
    bench.succeed("distance cells.tif -o field.zarr");
    for (arguments, complaint) in [
        ("middle field.zarr -o none", "a label volume holds whole numbers"),
        ("middle same.tif -o none", "all of its voxels are the same"),
        ("middle one.tif -o none", "the files hold one"),
        ("middle one.tif cells.tif --image-spacing 0 -o none", "--image-spacing is 0,0,0"),
        ("distance cells.tif --signed -o none", "--signed needs triangle meshes"),
    ] {
        let text = bench.fail(arguments, 2);
        assert!(text.contains(complaint), "{arguments}: {text}");
    }
}
