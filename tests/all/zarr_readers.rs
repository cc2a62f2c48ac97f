//! Stores as other programs read them: zarr-python, ome-zarr-models, yaozarrs and ome-zarr-py, through
//! `scripts/check_store.py`, which makes the pyramid again with numpy.

#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::Path;

use serde_json::{Map, Value, json};
use strandline::grid::{Box3, Geometry};
use strandline::io::ome_zarr::{Content, ImageSpec, ImageWriter, LabelColor, LabelSpec, OmeVersion, StoreWriter};
use strandline::kernel::image::filter::downsample;
use strandline::kernel::image::picture::palette::label_color;
use strandline::store::Element;

use crate::common::python;

fn geometry(shape: [i64; 3], spacing: [f64; 3]) -> Geometry {
    Geometry { shape, spacing, origin: [1000.125, -3.5, 1e-3], unit: Some("micrometer".into()) }
}

fn part_of<T: Element>(whole: &[T], shape: [i64; 3], part: &Box3) -> Vec<T> {
    let domain = Box3::from_shape(shape);
    let length = part.shape()[0] as usize;
    part.rows().flat_map(|(y, z)| &whole[domain.offset_of([part.lo[0], y, z])..][..length]).copied().collect()
}

type Reduce<T> = fn(&[T], [i64; 3], [i64; 3], &mut [T]);

/// Fills all levels of an image, each level's shards from the level before, and notes what level 0 must hold.
fn fill<T: Element>(image: &ImageWriter, value: impl Fn([i64; 3]) -> f64, reduce: Reduce<T>, raw: &Path) -> Value {
    let finest = image.levels()[0].geometry();
    let voxels = finest.domain().rows().flat_map(|(y, z)| (0..finest.shape[0]).map(move |x| [x, y, z]));
    let mut values: Vec<T> = voxels.map(|voxel| T::from_f64(value(voxel))).collect();
    fs::write(raw, values.iter().flat_map(|v| bytes_of(*v)).collect::<Vec<u8>>()).unwrap();
    let mut shape = finest.shape;
    for level in image.levels() {
        if level.factors() != [1; 3] {
            let mut coarser = vec![T::default(); level.geometry().domain().len()];
            reduce(&values, shape, level.factors(), &mut coarser);
            (values, shape) = (coarser, level.geometry().shape);
        }
        for shard in level.shards() {
            level.write_shard(&shard, &part_of(&values, shape, &shard)).unwrap();
        }
    }
    let zyx = |t: [f64; 3]| [t[2], t[1], t[0]];
    let [x, y, z] = finest.shape;
    json!({
        "dtype": T::TYPE.name(), "shape": [z, y, x], "values": raw.file_name().unwrap().to_str().unwrap(),
        "scale": zyx(finest.spacing), "translation": zyx(finest.origin), "unit": finest.unit
    })
}

fn bytes_of<T: Element>(value: T) -> Vec<u8> {
    let value = value.to_f64();
    match T::TYPE.name() {
        "uint8" => vec![value as u8],
        "uint16" => (value as u16).to_le_bytes().to_vec(),
        "uint32" => (value as u32).to_le_bytes().to_vec(),
        "float32" => (value as f32).to_le_bytes().to_vec(),
        "float64" => value.to_le_bytes().to_vec(),
        other => panic!("no bytes for {other}"),
    }
}

/// Numbers that look random, the same for the same voxel.
fn noise([x, y, z]: [i64; 3]) -> f64 {
    ((x * 7919 + y * 104_729 + z * 1_299_709) % 100_003) as f64 / 100_003.0
}

/// Balls of radius 6 on a lattice, one number each.
fn balls([x, y, z]: [i64; 3]) -> f64 {
    let centre = [x, y, z].map(|v| v.div_euclid(16) * 16 + 8);
    let distance2: i64 = (x - centre[0]).pow(2) + (y - centre[1]).pow(2) + (z - centre[2]).pow(2);
    let number = (x.div_euclid(16) * 31 + y.div_euclid(16) * 7 + z.div_euclid(16)) % 200 + 1;
    if distance2 < 36 { number as f64 } else { 0.0 }
}

/// A store with every kind of image: several shards, extents that are no multiple of anything, anisotropic voxels.
fn write_store(version: OmeVersion, path: &Path, raw: &Path) -> Map<String, Value> {
    let store = StoreWriter::create_as(version, path, false).unwrap();
    let mut expected = Map::new();
    let image = |group: &str, geometry: &Geometry, element, window| {
        store
            .image(
                group,
                &ImageSpec { name: "picture", geometry, element, content: Content::Grey, window, extremes: window },
            )
            .unwrap()
    };
    let stack = geometry([321, 270, 37], [0.25, 0.25, 1.0]);
    let root = image("", &stack, u16::TYPE, Some([100.0, 4000.0]));
    let value = |v| 100.0 + (3900.0 * noise(v)).round();
    expected.insert(String::new(), fill::<u16>(&root, value, downsample::mean, &raw.join("root.raw")));

    let cubes = geometry([131, 70, 300], [0.1, 0.1, 0.1]);
    let distance = image("distance", &cubes, f32::TYPE, None);
    let value =
        |[x, y, z]: [i64; 3]| ((x - 60).pow(2) as f64 + (y - 30).pow(2) as f64 + (z as f64 - 150.5).powi(2)).sqrt();
    expected.insert("distance".into(), fill::<f32>(&distance, value, downsample::mean, &raw.join("distance.raw")));

    let wide = geometry([7, 519, 66], [0.8, 0.1, 0.3]);
    let object = image("levelset/object-1", &wide, f64::TYPE, Some([0.0, 1.0]));
    let value = |v| noise(v) - 0.5;
    expected.insert("levelset/object-1".into(), fill::<f64>(&object, value, downsample::mean, &raw.join("u.raw")));

    let flat = geometry([700, 33, 1], [1.0, 1.0, 5.0]);
    let bytes = image("mask", &flat, u8::TYPE, None);
    let value = |v| (255.0 * noise(v)).round();
    expected.insert("mask".into(), fill::<u8>(&bytes, value, downsample::mean, &raw.join("mask.raw")));

    let colors: Vec<LabelColor> = (1..=200)
        .map(|label| {
            let [red, green, blue] = label_color(label);
            LabelColor { label, rgba: [red, green, blue, 255] }
        })
        .collect();
    let spec = LabelSpec { name: "segmentation", geometry: &stack, element: u8::TYPE, colors: &colors };
    let labels = store.labels(&spec).unwrap();
    expected.insert("labels/segmentation".into(), fill::<u8>(&labels, balls, downsample::mode, &raw.join("seg.raw")));
    let spec = LabelSpec { name: "nearest", geometry: &cubes, element: u32::TYPE, colors: &[] };
    let labels = store.labels(&spec).unwrap();
    let value = |v| (noise(v) * 5.0).floor() * 1e9;
    expected.insert("labels/nearest".into(), fill::<u32>(&labels, value, downsample::mode, &raw.join("near.raw")));

    fs::write(store.file("meshes/surface.ply").unwrap(), "ply\n").unwrap();
    fs::write(store.file("report.json").unwrap(), "{}\n").unwrap();
    store.finish().unwrap();
    expected
}

#[test]
fn other_programs_read_what_was_written() {
    check(OmeVersion::V05, "c/0/0/0");
}

#[test]
fn other_programs_read_the_older_version() {
    check(OmeVersion::V04, "0/0/0");
}

/// Checks a store, and that the check notices a chunk that is not there.
fn check(version: OmeVersion, first: &str) {
    let Some(interpreter) = python::interpreter() else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.zarr");
    let expected = write_store(version, &path, folder.path());
    let groups = expected.len();
    let expect = folder.path().join("expect.json");
    fs::write(&expect, Value::Object(expected).to_string()).unwrap();
    let arguments = [path.as_path(), Path::new("--expect"), &expect];
    let printed = python::run_script(interpreter, "check_store.py", &arguments).unwrap_or_else(|text| panic!("{text}"));
    assert_eq!(printed.lines().filter(|line| line.starts_with("ok ")).count(), groups, "{printed}");

    // The check itself must notice one wrong voxel of a coarser level and one of the finest.
    let shard = path.join("labels/segmentation/1").join(first);
    fs::remove_file(&shard).unwrap();
    let complaint = python::run_script(interpreter, "check_store.py", &[&path]).unwrap_err();
    assert!(complaint.contains("do not follow from the level before"), "{complaint}");
    fs::remove_file(path.join("distance/0").join(first)).unwrap();
    let complaint = python::run_script(interpreter, "check_store.py", &arguments).unwrap_err();
    assert!(complaint.contains("distance"), "{complaint}");
}
