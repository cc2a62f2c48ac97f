//! What the page of `strandline view` is told of a folder: each store in it can be chosen, all that a store holds has a layer, what cannot be
//! shown is named, and other programs are offered what they can open.

#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::Path;

use serde_json::{Value, json};

use crate::common::ball::{Ball, Bench};
use crate::common::patience::wait_until;
use crate::view::Served;

/// A store of all that `segment` writes.
fn store() -> Bench {
    let bench = Bench::new(&Ball::small());
    bench.succeed("segment image.tif --points marks.csv -q -o out/a.zarr");
    bench
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap().map(|entry| entry.unwrap().path()) {
        let other = to.join(entry.file_name().unwrap());
        if entry.is_dir() {
            copy(&entry, &other);
        } else {
            fs::copy(&entry, &other).unwrap();
        }
    }
}

fn names(state: &Value) -> Vec<&str> {
    state["layers"].as_array().unwrap().iter().map(|layer| layer["name"].as_str().unwrap()).collect()
}

fn seen(state: &Value) -> Vec<&str> {
    let layers = state["layers"].as_array().unwrap().iter();
    layers.filter(|layer| layer["visible"] == true).map(|layer| layer["name"].as_str().unwrap()).collect()
}

#[test]
fn each_of_many_stores_can_be_chosen() {
    let bench = store();
    let folders = ["a.zarr", "b c.zarr", "d#1.zarr", "e?.zarr", "f%20.zarr", "\u{fc}.zarr"];
    for name in &folders[1..] {
        copy(&bench.path("out/a.zarr"), &bench.path("out").join(name));
    }
    let encoded = ["a.zarr", "b%20c.zarr", "d%231.zarr", "e%3F.zarr", "f%2520.zarr", "%C3%BC.zarr"];
    let served = Served::new(&bench, "out");
    let first = served.json("/live.json");
    assert_eq!((&first["store"], &first["choices"]), (&json!("a.zarr"), &json!(folders)));
    for (name, sent) in folders.iter().zip(encoded) {
        let live = served.json(&format!("/live.json?store={sent}"));
        assert_eq!(live["store"], *name);
        let report = format!("/data/{sent}/report.html");
        assert_eq!(live["reports"], json!([{ "title": format!("report of {name}"), "address": report }]));
        assert!(served.get(&report).body.to_ascii_lowercase().starts_with(b"<!doctype html>"), "{report}");
        assert!(live["notes"].to_string().contains(&format!("layers are those of {name} alone; the other 5 stores")));
        let state = served.json(&format!("/state.json?store={sent}"));
        let of = |layer: &str| format!("{} {layer}", name.trim_end_matches(".zarr"));
        let all = ["image", "segmentation", "distance", "levelset", "surfaces", "marks"].map(of);
        assert_eq!(names(&state), all, "all of it and nothing else");
        assert_eq!(seen(&state), ["image", "segmentation", "surfaces", "marks"].map(of));
    }
    let unknown = served.json("/live.json?store=none");
    assert_eq!(unknown, first, "another one, which it says");
    let told = bench.succeed("view out --no-open --for 1s --print-links");
    for sent in encoded {
        assert!(told.contains(&format!("/?store={sent}\n")) && told.contains(&format!("/data/{sent}/report.html\n")));
    }
}

/// Of few stores all are there, and the one that is chosen is seen in its own world.
#[test]
fn layers_of_a_few_stores_lie_beside_each_other() {
    let bench = store();
    bench.write("far.xyz", "1000 0 0\n1004 0 0\n1000 4 0\n1000 0 4\n");
    bench.succeed("distance far.xyz --spacing 1 -q -o out/far.zarr");
    let served = Served::new(&bench, "out");
    let (near, far) = (served.json("/state.json"), served.json("/state.json?store=far.zarr"));
    assert_eq!(names(&near).len(), 7);
    let (mut these, mut those) = (names(&near), names(&far));
    assert_eq!(those[0], "far distance", "what is seen lies first");
    these.sort_unstable();
    those.sort_unstable();
    assert_eq!(these, those);
    assert_eq!(seen(&far), ["far distance"]);
    assert_eq!(near["dimensions"]["x"][1], "m");
    assert_eq!((&far["dimensions"]["x"], &far["showScaleBar"]), (&json!([1.0, ""]), &json!(false)));
    assert!(far["position"][0].as_f64().unwrap() > 900.0);
}

#[test]
fn fields_beyond_the_first_few_wait_in_the_list_and_are_told() {
    let bench = store();
    for n in 0..7 {
        copy(&bench.path("out/a.zarr/distance"), &bench.path(&format!("out/a.zarr/more/d{n}")));
    }
    let served = Served::new(&bench, "out/a.zarr");
    let state = served.json("/state.json");
    let layers = state["layers"].as_array().unwrap();
    let aside = layers.iter().filter(|layer| layer["archived"] == true).count();
    // Distance, level set and seven more are nine fields.
    assert_eq!((aside, layers.iter().filter(|layer| layer["type"] == "image").count()), (3, 10));
    assert!(served.json("/live.json")["notes"].to_string().contains("3 more fields are in the list of layers"));
}

/// An image of another program, with what is said of it.
fn foreign(bench: &Bench, name: &str, ome: &Value, shape: &Value) {
    fs::create_dir_all(bench.path(&format!("out/{name}/0"))).unwrap();
    bench.write(
        &format!("out/{name}/zarr.json"),
        &json!({ "zarr_format": 3, "attributes": { "ome": ome } }).to_string(),
    );
    let array = json!({ "node_type": "array", "shape": shape, "data_type": "uint8" });
    bench.write(&format!("out/{name}/0/zarr.json"), &array.to_string());
}

fn multiscale(axes: &[&str], scale: &Value) -> Value {
    let axes: Vec<Value> = axes.iter().map(|name| json!({ "name": name, "type": "space" })).collect();
    let level = json!({ "path": "0", "coordinateTransformations": [{ "type": "scale", "scale": scale }] });
    json!({ "version": "0.5", "multiscales": [{ "axes": axes, "datasets": [level] }] })
}

#[test]
fn stores_that_cannot_be_shown_are_named_with_the_reason() {
    let bench = store();
    for name in ["empty.zarr", "scratch"] {
        fs::create_dir(bench.path("out").join(name)).unwrap();
    }
    let (axes, cube) = (["z", "y", "x"], json!([4, 4, 4]));
    foreign(&bench, "axes.zarr", &multiscale(&[], &json!([])), &cube);
    foreign(&bench, "rank.zarr", &multiscale(&axes[1..], &json!([1, 1])), &cube);
    foreign(&bench, "flat.zarr", &multiscale(&axes, &json!([1, 0, 1])), &cube);
    foreign(&bench, "none.zarr", &multiscale(&axes, &json!([1, 1, 1])), &json!([4, 0, 4]));
    foreign(&bench, "bare.zarr", &json!({}), &cube);
    foreign(&bench, "array.zarr", &multiscale(&axes, &json!([1, 1, 1])), &cube);
    foreign(&bench, "whole", &multiscale(&axes, &json!([1, 1, 1])), &cube);
    fs::remove_dir_all(bench.path("out/array.zarr/0")).unwrap();
    foreign(&bench, "plain.zarr", &json!({}), &cube);
    fs::copy(bench.path("out/plain.zarr/0/zarr.json"), bench.path("out/plain.zarr/zarr.json")).unwrap();
    let served = Served::new(&bench, "out");
    let live = served.json("/live.json");
    assert_eq!(live["choices"], json!(["a.zarr", "whole"]));
    let mut notes: Vec<&str> = live["notes"].as_array().unwrap().iter().map(|note| note.as_str().unwrap()).collect();
    notes.sort_unstable();
    assert_eq!(
        notes,
        [
            "array.zarr names the level 0, and 0/zarr.json is no array of Zarr",
            "axes.zarr names no axes",
            "bare.zarr/zarr.json names no image (no multiscales)",
            "empty.zarr is no store: it holds neither zarr.json nor .zattrs",
            "flat.zarr has a scale of 0 along y, with which nothing can be drawn",
            "none.zarr has no voxels along y",
            "plain.zarr is a plain Zarr array, which says nothing of axes and levels as OME-Zarr does",
            "rank.zarr names 2 axes, and its level 0 has 3",
        ]
    );
    // What was only begun is shown when it is whole.
    copy(&bench.path("out/a.zarr"), &bench.path("out/empty.zarr"));
    wait_until("a store more", || served.json("/live.json")["choices"] == json!(["a.zarr", "empty.zarr", "whole"]));
    for name in ["a.zarr", "whole", "empty.zarr"] {
        fs::remove_dir_all(bench.path("out").join(name)).unwrap();
    }
    let told = bench.fail("view out --no-open", 2);
    assert!(
        told.contains("out: holds nothing that can be shown: array.zarr names") && told.contains("; and 2 more"),
        "{told}"
    );
    let told = bench.fail("view out/flat.zarr --no-open", 2);
    assert!(told.contains("has a scale of 0 along y"), "{told}");
}

#[test]
fn types_and_versions_that_the_page_does_not_draw_are_named() {
    let bench = Bench::bare();
    let axes = ["z", "y", "x"];
    foreign(&bench, "double.zarr", &multiscale(&axes, &json!([1, 1, 1])), &json!([4, 4, 4]));
    let array = json!({ "node_type": "array", "shape": [4, 4, 4], "data_type": "float64" });
    bench.write("out/double.zarr/0/zarr.json", &array.to_string());
    fs::create_dir_all(bench.path("out/old.zarr/0")).unwrap();
    let level = json!({ "path": "0" });
    let old = json!({ "multiscales": [{ "version": "0.3", "axes": axes, "datasets": [level] }] });
    bench.write("out/old.zarr/.zattrs", &old.to_string());
    bench.write("out/old.zarr/0/.zarray", &json!({ "shape": [4, 4, 4], "dtype": "|u1" }).to_string());
    let told = bench.fail("view out --no-open", 2);
    assert!(told.contains("double.zarr is of float64, which the page does not draw"), "{told}");
    assert!(told.contains("old.zarr is of OME-Zarr 0.3"), "{told}");
    for (name, text, says) in [
        ("cloud.xyz", "0 0 0\n1 0 0\n0 1 0\n", "strandline reconstruct makes one of them"),
        ("a.vtp", "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\">", "which ParaView opens and a page does not"),
        ("a.txt", "nothing of this kind", "is no mesh that can be shown (PLY, OBJ, STL, OFF)"),
    ] {
        bench.write(name, text);
        let told = bench.fail(&format!("view {name} --no-open"), 2);
        assert!(told.contains(says), "{told}");
    }
    // A mesh is one by what is in it.
    bench.write("mesh.txt", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
    assert!(bench.succeed("view mesh.txt --no-open --for 1s --print-links").contains("neuroglancer mesh"));
}

/// Channels, units and grey ranges as other programs tell them, or do not; the voxels are there.
#[test]
fn images_of_other_programs_have_channels_units_and_grey_ranges() {
    let bench = Bench::bare();
    let folder = bench.path("out/two.zarr");
    fs::create_dir_all(folder.join("0/0/0/0")).unwrap();
    let axis = |name: &str, kind: &str, unit: Value| json!({ "name": name, "type": kind, "unit": unit });
    let axes = [
        json!({ "name": "c", "type": "channel" }),
        axis("z", "space", json!("um")),
        axis("y", "space", json!("Micron")),
        axis("x", "space", json!("furlong")),
    ];
    let scale = json!([{ "type": "scale", "scale": [1, 2, 0.5, 0.5] }]);
    let said = json!({ "label": "GFP", "color": "00FF00", "window": { "start": 5, "end": 9 } });
    let attributes = json!({
        "multiscales": [{ "version": "0.4", "name": "two", "axes": axes, "datasets": [{ "path": "0", "coordinateTransformations": scale }] }],
        "omero": { "channels": [said, { "label": "DAPI", "color": "000000", "active": false }] },
    });
    bench.write("out/two.zarr/.zattrs", &attributes.to_string());
    bench.write("out/two.zarr/.zgroup", r#"{"zarr_format":2}"#);
    let array = json!({
        "zarr_format": 2, "shape": [2, 2, 10, 10], "chunks": [1, 2, 10, 10], "dtype": "<u2", "compressor": null,
        "fill_value": 0, "filters": null, "order": "C", "dimension_separator": "/",
    });
    bench.write("out/two.zarr/0/.zarray", &array.to_string());
    // The second channel goes from 1000 to 1199.
    let voxels: Vec<u8> = (1000..1200_u16).flat_map(u16::to_le_bytes).collect();
    for c in 0..2 {
        fs::create_dir_all(folder.join(format!("0/{c}/0/0"))).unwrap();
        fs::write(folder.join(format!("0/{c}/0/0/0")), &voxels).unwrap();
    }
    let state = Served::new(&bench, "out/two.zarr").json("/state.json");
    assert_eq!((names(&state), seen(&state)), (vec!["two GFP", "two DAPI"], vec!["two GFP"]));
    let layers = &state["layers"];
    assert_eq!(layers[0]["shaderControls"]["normalized"]["range"], json!([5.0, 9.0]));
    assert_eq!(layers[1]["shaderControls"]["normalized"]["range"], json!([1002.0, 1199.0]), "1 % and 99.8 %");
    assert!(layers[0]["shader"].as_str().unwrap().contains("#00ff00"));
    assert!(!layers[1]["shader"].as_str().unwrap().contains("#000000"), "black would not be seen");
    assert_eq!(
        (&layers[1]["localDimensions"], &layers[1]["localPosition"]),
        (&json!({ "c'": [1.0, ""] }), &json!([1.5]))
    );
    let dimensions = json!({ "c'": [1.0, ""], "z": [2e-6, "m"], "y": [5e-7, "m"], "x": [0.5, ""] });
    assert_eq!(layers[0]["source"]["transform"]["outputDimensions"], dimensions);
    assert_eq!(layers[0]["source"]["transform"]["inputDimensions"], dimensions);
    assert_eq!(state["dimensions"], json!({ "x": [0.5, ""], "y": [5e-7, "m"], "z": [2e-6, "m"] }));
}

/// Several images in a store whose root is none, as bioformats2raw writes them.
#[test]
fn images_below_a_root_that_is_none_are_shown() {
    let bench = Bench::bare();
    let (axes, cube) = (["z", "y", "x"], json!([4, 4, 4]));
    for n in 0..2 {
        foreign(&bench, &format!("many.zarr/{n}"), &multiscale(&axes, &json!([1, 1, 1])), &cube);
    }
    bench.write(
        "out/many.zarr/zarr.json",
        &json!({ "zarr_format": 3, "node_type": "group", "attributes": { "ome": { "bioformats2raw.layout": 3 } } })
            .to_string(),
    );
    for what in ["out/many.zarr", "out"] {
        let state = Served::new(&bench, what).json("/state.json");
        assert_eq!((names(&state), seen(&state)), (vec!["many.zarr/0", "many.zarr/1"], vec!["many.zarr/0"]), "{what}");
    }
}

#[test]
fn programs_are_offered_what_they_can_open() {
    let bench = Bench::bare();
    let faces = "3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    bench.write("out/a.off", &format!("OFF\n{faces}"));
    bench.write("out/b.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    let told = bench.succeed("view out --no-open --for 1s --print-links");
    let offered: Vec<&str> = told.lines().map(|line| line.split_once("  ").unwrap().0).collect();
    assert_eq!(offered, ["page", "neuroglancer mesh", "neuroglancer mesh", "MeshLab", "ParaView"], "{told}");
    assert!(told.contains("meshlab ") && told.contains("a.off\n") && told.contains("b.obj\n"), "{told}");
    foreign(&bench, "image.zarr", &multiscale(&["y", "x"], &json!([1, 1])), &json!([4, 4]));
    let told = bench.succeed("view out --no-open --for 1s --print-links");
    assert_eq!(told.matches("napari --plugin napari-ome-zarr ").count(), 1, "{told}");
}
