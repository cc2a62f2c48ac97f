//! Zarr as input: the right values of small stores of every kind, random dialects that zarr-python wrote, and damaged ones.

#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use strandline::io::stack::volume::{Select, Stack};
use strandline::io::stack::zarr::ZarrImage;
use strandline::store::VolumeSource;

use crate::common::ball::{Ball, Bench};
use crate::common::python;
use crate::common::random::Random;
use crate::common::samples::numbers;
use crate::common::stores::{contents, same};
use crate::common::tiff_bytes::{gray_page, tiff_file};
use crate::common::zarr_files::{axes, document, group, gzip_array, plain_array_v2, scale};

const SHAPE: [i64; 3] = [20, 24, 28];

/// Two bodies that face each other at x = 7 and x = 16, over all of y and z: their middle surface is a plane of 19 x 23.
pub(crate) fn labels() -> Vec<u16> {
    (0..20 * 24 * 28)
        .map(|n| [(0..8, 1), (16..28, 2)].iter().find(|(r, _)| r.contains(&(n % 28))).map_or(0, |l| l.1))
        .collect()
}

fn bytes<const N: usize>(values: &[u16], word: impl Fn(u16) -> [u8; N]) -> Vec<u8> {
    values.iter().flat_map(|v| word(*v)).collect()
}

/// Writes an OME-Zarr 0.5 label image of one level and returns its group.
pub(crate) fn store(bench: &Bench, name: &str, letters: &str, own: &Value, common: &Value) -> PathBuf {
    let path = bench.path(name);
    group(&path, 3, letters, own, common);
    let shape: Vec<i64> = letters.chars().rev().zip([28, 24, 20, 1, 1]).map(|(_, n)| n).collect();
    let shape: Vec<i64> = shape.into_iter().rev().collect();
    gzip_array(&path.join("0"), &shape, "uint16", &bytes(&labels(), u16::to_le_bytes));
    path
}

/// The area of the surface between labels 1 and 2.
pub(crate) fn area(bench: &Bench, arguments: &str) -> f64 {
    bench.succeed(&format!("middle {arguments} -o none --report out/r.json"));
    let report = bench.json("out/r.json");
    fs::remove_file(bench.path("out/r.json")).unwrap();
    assert_eq!(report["result"]["pairs"][0]["labels"], json!([1, 2]));
    report["result"]["pairs"][0]["area"].as_f64().unwrap()
}

pub(crate) fn near(found: f64, wanted: f64) {
    assert!((found - wanted).abs() < 1e-4 * wanted, "{found} where {wanted} is due");
}

#[test]
fn transformations_of_a_multiscale_count() {
    let bench = Bench::bare();
    store(&bench, "a.zarr", "zyx", &scale(&[1.0; 3]), &scale(&[2.0, 0.5, 0.5]));
    assert!(bench.succeed("info a.zarr").contains("spacing 0.5, 0.5, 2 micrometer"));
    near(area(&bench, "a.zarr"), 19.0 * 2.0 * 23.0 * 0.5);
    bench.succeed("middle a.zarr -o out.zarr --mesh out.obj");
    let mesh = fs::read_to_string(bench.path("out.obj")).unwrap();
    let xs =
        mesh.lines().filter_map(|line| line.strip_prefix("v ")).map(|v| v.split(' ').next().unwrap().parse::<f64>());
    assert!(xs.flatten().all(|x| (x - 5.75).abs() < 1e-5), "the plane between voxels 7 and 16");
}

#[test]
fn labels_of_any_whole_type_are_read_where_they_fit() {
    let bench = Bench::bare();
    let labels = labels();
    for (name, stored) in [
        ("int64", bytes(&labels, |v| i64::from(v).to_le_bytes())),
        ("uint64", bytes(&labels, |v| u64::from(v).to_le_bytes())),
        ("int32", bytes(&labels, |v| i32::from(v).to_le_bytes())),
        ("int16", bytes(&labels, |v| (v as i16).to_le_bytes())),
        ("float32", bytes(&labels, |v| f32::from(v).to_le_bytes())),
    ] {
        store(&bench, &format!("{name}.zarr"), "zyx", &scale(&[1.0; 3]), &Value::Null);
        gzip_array(&bench.path(&format!("{name}.zarr/0")), &SHAPE, name, &stored);
        near(area(&bench, &format!("{name}.zarr")), 437.0);
    }
    let wide: Vec<i64> = labels.iter().map(|v| i64::from(*v)).collect();
    for (wrong, told) in [(-3, "holds -3 at voxel 5, 2, 1"), (1 << 32, "holds 4294967296 at voxel 5, 2, 1")] {
        let mut wide = wide.clone();
        wide[28 * 24 + 2 * 28 + 5] = wrong;
        let stored: Vec<u8> = wide.iter().flat_map(|v| v.to_le_bytes()).collect();
        gzip_array(&bench.path("int64.zarr/0"), &SHAPE, "int64", &stored);
        let complaint = bench.fail("middle int64.zarr -o none", 2);
        assert!(complaint.contains(told) && complaint.contains("4294967295"), "{complaint}");
    }
    // TIFF is no worse off.
    for (format, name) in [(2, "signed.tif"), (1, "unsigned.tif")] {
        let page = |plane: &[i64]| {
            gray_page(28, 24, 64, plane.iter().flat_map(|v| v.to_le_bytes()).collect())
                .with(339, crate::common::tiff_bytes::Value::Short(vec![format]))
        };
        let pages: Vec<_> = wide.chunks(28 * 24).map(page).collect();
        fs::write(bench.path(name), tiff_file(&pages, false)).unwrap();
        near(area(&bench, &format!("{name} --image-spacing 1")), 437.0);
    }
}

#[test]
fn every_version_and_order_of_axes_is_read() {
    let bench = Bench::bare();
    store(&bench, "gzip.zarr", "zyx", &scale(&[1.0; 3]), &Value::Null);
    store(&bench, "five.zarr", "tczyx", &scale(&[1.0; 5]), &Value::Null);
    near(area(&bench, "gzip.zarr"), 437.0);
    near(area(&bench, "five.zarr"), 437.0);
    for order in ["C", "F"] {
        let path = bench.path(&format!("old{order}.zarr"));
        group(&path, 2, "zyx", &scale(&[1.0; 3]), &Value::Null);
        plain_array_v2(&path.join("0"), [20, 24, 28], [7, 24, 5], &labels(), order);
        near(area(&bench, &format!("old{order}.zarr")), 437.0);
    }
    // A level by its own folder has the metadata of its image; an array by itself has none.
    near(area(&bench, "oldC.zarr/0"), 437.0);
    fs::rename(bench.path("oldC.zarr/0"), bench.path("plain.zarr")).unwrap();
    let complaint = bench.fail("middle plain.zarr -o none", 2);
    assert!(complaint.contains("--image-spacing"), "{complaint}");
    near(area(&bench, "plain.zarr --image-spacing 2"), 4.0 * 437.0);
    assert!(bench.succeed("info plain.zarr").contains("28 x 24 x 20 uint16"));
}

#[test]
fn what_a_user_may_name_by_mistake_is_told() {
    let bench = Bench::bare();
    store(&bench, "zero.zarr", "zyx", &scale(&[0.0, 0.5, 0.5]), &Value::Null);
    store(&bench, "minus.zarr", "zyx", &scale(&[1.0, 0.5, -0.5]), &Value::Null);
    store(&bench, "good.zarr", "zyx", &scale(&[1.0; 3]), &Value::Null);
    store(&bench, "series.zarr/0", "zyx", &scale(&[1.0; 3]), &Value::Null);
    let layout = json!({"zarr_format": 3, "node_type": "group", "attributes": {"ome": {"bioformats2raw.layout": 3}}});
    document(&bench.path("series.zarr/zarr.json"), &layout);
    group(&bench.path("flat.zarr"), 3, "yx", &scale(&[1.0; 2]), &Value::Null);
    gzip_array(&bench.path("flat.zarr/0"), &[4, 4], "uint8", &[0; 16]);
    let plain = |ome: Value| json!({"zarr_format": 3, "node_type": "group", "attributes": {"ome": ome}});
    document(&bench.path("plate.zarr/zarr.json"), &plain(json!({"plate": {"wells": []}})));
    document(&bench.path("empty.zarr/zarr.json"), &plain(json!({})));
    document(&bench.path("next.zarr/zarr.json"), &plain(json!({"multiscales": [{"coordinateSystems": []}]})));
    document(&bench.path("several.zarr/labels/zarr.json"), &plain(json!({"labels": ["a", "b"]})));
    for name in ["a", "b"] {
        store(&bench, &format!("several.zarr/labels/{name}"), "zyx", &scale(&[1.0; 3]), &Value::Null);
    }
    document(&bench.path("several.zarr/zarr.json"), &plain(json!({})));
    for (arguments, told) in [
        ("zero.zarr", "has scale 0 along z"),
        ("minus.zarr", "has scale -0.5 along x"),
        ("flat.zarr", "has the axes y, x and none that is z"),
        ("plate.zarr", "plate.zarr: is a plate of wells; name one image in it, such as plate.zarr/A/1/0"),
        ("empty.zarr", "without an OME-Zarr image, and empty"),
        ("next.zarr", "is not read; save it as version 0.5"),
        ("several.zarr", "has several label images (a, b)"),
        ("several.zarr/labels", "(a, b), such as several.zarr/labels/a"),
        ("good.zarr --level 1", "level 1 was asked for but there are 1"),
        ("good.zarr --channel 1", "channel 1 was asked for but there are 1"),
        ("good.zarr --time 2", "time 2 was asked for but there are 1"),
    ] {
        let complaint = bench.fail(&format!("middle {arguments} -o none"), 2);
        assert!(complaint.contains(told), "{arguments}: {complaint}");
    }
    near(area(&bench, "zero.zarr --image-spacing 1"), 437.0);
    near(area(&bench, "several.zarr/labels/b"), 437.0);
    let told = bench.run("middle series.zarr -o none");
    let notes = String::from_utf8(told.stderr).unwrap();
    assert!(told.status.success() && notes.contains("image 0 of 1 is read, 0"), "{notes}");
}

/// The same stack in TIFF, in chunks of planes and in chunks of cubes: the same bits of everything but the report.
#[test]
fn an_image_is_segmented_alike_from_tiff_and_zarr() {
    let ball = Ball::small();
    let bench = Bench::new(&ball);
    let [x, y, z] = ball.geometry.shape.map(|n| n as usize);
    let crop = "--crop 3:38,:,1:19";
    bench.succeed(&format!("segment image.tif --points marks.csv {crop} -o tiff.zarr -q"));
    let tiff = contents(&bench.path("tiff.zarr"));
    for (number, chunks) in [[1, y, x], [7, 16, 16]].into_iter().enumerate() {
        let path = bench.path(&format!("image{number}.zarr"));
        let [hx, hy, hz] = ball.geometry.spacing;
        group(&path, 2, "zyx", &scale(&[hz, hy, hx]), &Value::Null);
        plain_array_v2(&path.join("0"), [z, y, x], chunks, &ball.voxels(), "C");
        bench.succeed(&format!("segment image{number}.zarr --points marks.csv {crop} --overwrite -o own.zarr -q"));
        same(&tiff, &contents(&bench.path("own.zarr")), &format!("chunks {chunks:?}"));
    }
}

/// All voxels as f64, read by natural boxes.
fn voxels(image: &ZarrImage) -> strandline::error::Result<Vec<f64>> {
    let domain = strandline::grid::Box3::from_shape(image.shape());
    let mut all = vec![f64::NAN; domain.len()];
    for part in image.natural_boxes(&domain) {
        let values = numbers(image, &part)?;
        let width = part.shape()[0] as usize;
        for (row, (y, z)) in values.chunks(width).zip(part.rows()) {
            all[domain.offset_of([part.lo[0], y, z])..][..width].copy_from_slice(row);
        }
    }
    Ok(all)
}

/// Random images by zarr-python in `count` folders.
fn dialects(folder: &Path, seed: u32, count: u32) -> bool {
    let Some(interpreter) = python::interpreter() else { return false };
    let (seed, count) = (seed.to_string(), count.to_string());
    let arguments = [folder, Path::new(&seed), Path::new(&count)];
    python::run_script(interpreter, "write_zarr.py", &arguments).unwrap_or_else(|text| panic!("{text}"));
    true
}

fn select(expect: &Value) -> Select {
    let number = |key: &str| expect[key].as_u64().unwrap() as u32;
    Select { channel: number("channel"), time: number("time"), level: number("level"), ..Select::default() }
}

fn json_at(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

#[test]
fn what_zarr_python_writes_is_read_back() {
    let folder = tempfile::tempdir().unwrap();
    let (seed, count) = (20, 120);
    if !dialects(folder.path(), seed, count) {
        return;
    }
    for number in 0..count {
        let place = folder.path().join(number.to_string());
        let expect = json_at(&place.join("expect.json"));
        let image = ZarrImage::open(&place.join("image.zarr"), select(&expect)).unwrap();
        let info = image.info();
        let told = json!({
            "shape_xyz": info.shape, "spacing_xyz": info.spacing, "origin_xyz": info.origin, "unit": info.unit,
            "channels": info.channels, "times": info.times,
        });
        for (key, value) in told.as_object().unwrap() {
            assert_eq!(&expect[key], value, "{key} of {seed} {number}");
        }
        let raw = fs::read(place.join("values.raw")).unwrap();
        let wanted: Vec<f64> = raw.as_chunks::<8>().0.iter().map(|word| f64::from_le_bytes(*word)).collect();
        assert!(voxels(&image).unwrap() == wanted, "values of {seed} {number}: {info:?}");
    }
}

/// All files below a folder.
pub(crate) fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() { found.extend(files(&path)) } else { found.push(path) }
    }
    found.sort();
    found
}

/// One file of a store is cut, or has some bytes changed: it is read, or refused in one sentence with code 2.
#[test]
fn damaged_stores_are_refused_in_one_sentence() {
    let folder = tempfile::tempdir().unwrap();
    if !dialects(folder.path(), 21, 60) {
        return;
    }
    let mut random = Random(5);
    let mut refused = 0;
    for number in 0..60 {
        let place = folder.path().join(number.to_string());
        let expect = json_at(&place.join("expect.json"));
        let store = place.join("image.zarr");
        let files = files(&store);
        for _ in 0..20 {
            let path = &files[random.below(files.len())];
            let sound = fs::read(path).unwrap();
            let mut hurt = sound.clone();
            for _ in 0..1 + random.below(3) {
                let Some(last) = hurt.len().checked_sub(1) else { continue };
                let at = random.below(last + 1);
                match random.below(4) {
                    0 => hurt.truncate(at),
                    1 => hurt[at] = 0xff,
                    2 => hurt[at] ^= 1 << random.below(8),
                    // Numbers of the metadata become others.
                    _ => hurt.iter_mut().skip(at).filter(|b| b.is_ascii_digit()).take(1).for_each(|b| *b = b'9'),
                }
            }
            fs::write(path, &hurt).unwrap();
            let opened = ZarrImage::open(&store, select(&expect));
            let huge = opened.as_ref().is_ok_and(|image| image.shape().iter().product::<i64>() > 1 << 22);
            if let Err(error) = opened.and_then(|image| if huge { Ok(Vec::new()) } else { voxels(&image) }) {
                let text = error.to_string();
                assert!(error.exit_code() == 2 && text.lines().count() == 1, "{}: {text}", path.display());
                refused += 1;
            }
            fs::write(path, &sound).unwrap();
        }
    }
    assert!(refused > 100, "{refused} of 1200 were refused");
}

#[test]
fn metadata_that_lie_cost_nothing() {
    let bench = Bench::bare();
    let fails = |told: &str| {
        let complaint = bench.fail("middle a.zarr -o none", 2);
        assert!(complaint.contains(told), "{told}: {complaint}");
    };
    let array = bench.path("a.zarr/0");
    let written = |change: &dyn Fn(&mut Value)| {
        store(&bench, "a.zarr", "zyx", &scale(&[1.0; 3]), &Value::Null);
        let mut node = json_at(&array.join("zarr.json"));
        change(&mut node);
        document(&array.join("zarr.json"), &node);
    };
    written(&|node| node["shape"] = json!([1_u64 << 40, 1_u64 << 40, 1_u64 << 40]));
    fails("more than can be worked on");
    written(&|node| node["shape"] = json!([0, 24, 28]));
    fails("which is empty");
    written(&|node| node["shape"] = json!([20, 24, -1]));
    fails("no list of whole numbers");
    written(&|node| node["chunk_grid"]["configuration"]["chunk_shape"] = json!([1 << 20, 1 << 20, 1 << 20]));
    fails("chunks of more than 2 GiB");
    // The chunk holds less than it says, and then more.
    written(&|node| node["chunk_grid"]["configuration"]["chunk_shape"] = json!([20, 24, 1 << 19]));
    fails("expected 503316480");
    written(&|node| node["chunk_grid"]["configuration"]["chunk_shape"] = json!([1, 1, 28]));
    fails("expected 56");
    written(&|node| node["codecs"][1] = json!({"name": "lzma"}));
    fails("lzma");
    written(&|node| node["data_type"] = json!("complex64"));
    fails("complex64");
    // A shard whose index points past every end.
    written(&|node| {
        let inner = json!([{"name": "bytes", "configuration": {"endian": "little"}}]);
        let told = json!({"chunk_shape": [20, 24, 14], "codecs": inner, "index_codecs": inner});
        node["codecs"] = json!([{"name": "sharding_indexed", "configuration": told}]);
    });
    fs::write(array.join("c/0/0/0"), [u64::MAX - 1, 5, 0, 8].map(u64::to_le_bytes).concat()).unwrap();
    fails("points past its end");
    fs::write(array.join("c/0/0/0"), [0; 9]).unwrap();
    fails("shorter than the index");
    // What leads out of the store, or back to itself.
    store(&bench, "a.zarr", "zyx", &scale(&[1.0; 3]), &Value::Null);
    let mut node = json_at(&bench.path("a.zarr/zarr.json"));
    node["attributes"]["ome"]["multiscales"][0]["datasets"][0]["path"] = json!("../a.zarr/0");
    document(&bench.path("a.zarr/zarr.json"), &node);
    fails("is no folder below it");
    node["attributes"]["ome"]["multiscales"][0]["axes"] = axes("zyyx");
    node["attributes"]["ome"]["multiscales"][0]["datasets"] = json!([{"path": "0"}]);
    document(&bench.path("a.zarr/zarr.json"), &node);
    fails("has 3 axes where its image names 4");
    let around = json!({"zarr_format": 3, "node_type": "group", "attributes": {"ome": {"bioformats2raw.layout": 3}}});
    document(&bench.path("a.zarr/zarr.json"), &around);
    fs::remove_dir_all(&array).unwrap();
    std::os::unix::fs::symlink(bench.path("a.zarr"), &array).unwrap();
    fails("holds no OME-Zarr image");
}
