//! Zarr stores that are odd and can be read all the same: chunks under other names, metadata that lack or hold too much, several
//! images.

#![allow(clippy::unwrap_used)]

use std::fs;

use serde_json::{Value, json};

use crate::common::ball::Bench;
use crate::common::zarr_files::{document, group, plain_array_v2, scale};
use crate::zarr_input::{area, files, labels, near, store};

/// Chunks whose names are not those of the metadata are no voxels of the fill value.
#[test]
fn chunks_are_found_by_the_names_they_have() {
    let bench = Bench::bare();
    let path = bench.path("a.zarr");
    group(&path, 2, "zyx", &scale(&[1.0; 3]), &Value::Null);
    plain_array_v2(&path.join("0"), [20, 24, 28], [7, 24, 5], &labels(), "C");
    // As writers left it that put chunks into folders before there was a word for it.
    for name in files(&path.join("0")) {
        let key = name.file_name().unwrap().to_string_lossy().into_owned();
        let parts: Vec<&str> = key.split('.').collect();
        let [z, y, x] = parts[..] else { continue };
        fs::create_dir_all(path.join(format!("0/{z}/{y}"))).unwrap();
        fs::rename(&name, path.join(format!("0/{z}/{y}/{x}"))).unwrap();
    }
    near(area(&bench, "a.zarr"), 437.0);
    assert!(bench.succeed("info a.zarr").contains("chunks are named with '/'"));
    for (number, z) in ["0", "1", "2"].iter().enumerate() {
        let folder = path.join("0").join(z);
        for chunk in files(&folder) {
            let x = chunk.file_name().unwrap().to_string_lossy().into_owned();
            fs::rename(&chunk, path.join(format!("0/c.{number}.0.{x}"))).unwrap();
        }
        fs::remove_dir_all(folder).unwrap();
    }
    let complaint = bench.fail("middle a.zarr -o none", 2);
    assert!(complaint.contains("has chunks named like c.") && complaint.contains("like 0.0.0"), "{complaint}");
    for chunk in files(&path.join("0")).iter().filter(|file| file.to_string_lossy().contains("/c.")) {
        fs::remove_file(chunk).unwrap();
    }
    assert!(bench.succeed("info a.zarr").contains("none of its chunks is there"));
}

#[test]
fn metadata_that_lack_or_hold_too_much_are_read() {
    let bench = Bench::bare();
    // No axes, as before 0.3, but a scale: the axes are the last of t, c, z, y, x.
    let path = bench.path("noaxes.zarr");
    let datasets = json!([{"path": "0", "coordinateTransformations": scale(&[2.0, 0.5, 0.5])}]);
    document(&path.join(".zgroup"), &json!({"zarr_format": 2}));
    document(&path.join(".zattrs"), &json!({"multiscales": [{"version": "0.4", "datasets": datasets}]}));
    plain_array_v2(&path.join("0"), [20, 24, 28], [7, 24, 5], &labels(), "C");
    near(area(&bench, "noaxes.zarr"), 19.0 * 2.0 * 23.0 * 0.5);
    let info = bench.succeed("info noaxes.zarr");
    assert!(info.contains("axes are not named; z, y, x is taken") && info.contains("0.5, 0.5, 2"), "{info}");
    let datasets = json!([{"path": "0", "coordinateTransformations": scale(&[1.0; 5])}]);
    document(&path.join(".zattrs"), &json!({"multiscales": [{"version": "0.4", "datasets": datasets}]}));
    let complaint = bench.fail("middle noaxes.zarr -o none", 2);
    assert!(complaint.contains("has 3 axes where its transformations have 5 numbers"), "{complaint}");
    // Python writes NaN, which JSON does not know.
    store(&bench, "nan.zarr", "zyx", &scale(&[1.0; 3]), &Value::Null);
    let node = bench.path("nan.zarr/zarr.json");
    let text = fs::read_to_string(&node).unwrap().replacen("\"ome\"", "\"window\": [NaN, -Infinity], \"ome\"", 1);
    assert!(text.contains("NaN") && text.contains("\"path\": \"0\"") || text.contains("\"path\":\"0\""), "{text}");
    let text = text.replace("\"path\": \"0\"", "\"path\": \"./0\"").replace("\"path\":\"0\"", "\"path\":\"./0\"");
    fs::write(&node, format!("\u{feff}{text}")).unwrap();
    near(area(&bench, "nan.zarr"), 437.0);
}

#[test]
fn an_image_of_several_is_picked() {
    let bench = Bench::bare();
    let layout = json!({"zarr_format": 3, "node_type": "group", "attributes": {"ome": {"bioformats2raw.layout": 3}}});
    document(&bench.path("series.zarr/zarr.json"), &layout);
    store(&bench, "series.zarr/0", "zyx", &scale(&[3.0; 3]), &Value::Null);
    store(&bench, "series.zarr/1", "zyx", &scale(&[2.0, 0.5, 0.5]), &Value::Null);
    near(area(&bench, "series.zarr --image-index 1"), 19.0 * 2.0 * 23.0 * 0.5);
    let info = bench.succeed("info series.zarr --image-index 1");
    assert!(info.lines().any(|line| line.starts_with("image, level 0") && line.contains("0.5, 0.5, 2")), "{info}");
    assert!(bench.fail("info series.zarr --image-index 2", 2).contains("there are 2, counted from 0"));
    assert!(bench.fail("info series.zarr --axes zyx", 2).contains("names its axes itself"));
    let complaint = bench.fail("segment series.zarr/zarr.json --seed 1,1,1,1 -o none", 2);
    assert!(complaint.contains("is a file of a Zarr store; name its folder, series.zarr"), "{complaint}");
}
