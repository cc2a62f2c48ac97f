//! What the page of `strandline view` is told: whose page it is, whether that is still there, what of it is not to be seen, and in which
//! colours, shaders and panels the rest is.

#![allow(clippy::unwrap_used)]

use std::fs;

use serde_json::{Value, json};

use crate::common::ball::{Ball, Bench};
use crate::common::patience::wait_until;
use crate::series;
use crate::view::Served;

/// A store of all that `segment` writes.
fn store() -> Bench {
    let bench = Bench::new(&Ball::small());
    bench.succeed("segment image.tif --points marks.csv -q -o out/ball.zarr");
    bench
}

fn layer<'s>(state: &'s Value, name: &str) -> &'s Value {
    state["layers"].as_array().unwrap().iter().find(|layer| layer["name"] == name).unwrap()
}

#[test]
fn a_store_that_goes_and_comes_back_is_told() {
    let bench = store();
    let (store, away) = (bench.path("out/ball.zarr"), bench.path("away"));
    let served = Served::new(&bench, "out/ball.zarr");
    let first = served.json("/live.json");
    assert_eq!((&first["text"], &first["gone"]), (&json!(""), &json!(false)));
    let told = |text: &str| wait_until(text, || served.json("/live.json")["text"] == text);
    fs::rename(&store, &away).unwrap();
    told("ball.zarr is gone");
    assert_eq!(served.json("/live.json")["shown"], first["shown"], "the page stays as it is");
    fs::rename(&away, &store).unwrap();
    told("");
    assert_eq!(served.json("/live.json"), first, "it is the same");
    // What takes its place is another, which the page has to read anew.
    fs::remove_dir_all(&store).unwrap();
    told("ball.zarr is gone");
    bench.succeed("distance marks.csv --like image.tif -q -o out/ball.zarr");
    told("");
    let other = served.json("/live.json");
    assert_ne!(other["stores"]["ball.zarr"], first["stores"]["ball.zarr"]);
    assert_ne!(other["shown"], first["shown"]);
    assert_eq!(layer(&served.json("/state.json"), "distance")["visible"], true);
}

#[test]
fn one_of_several_stores_and_a_mesh_that_go_are_seen_to() {
    let bench = store();
    bench.succeed("distance marks.csv --like image.tif -q -o out/z.zarr");
    fs::copy(bench.path("out/ball.zarr/meshes/surface.ply"), bench.path("a.ply")).unwrap();
    let (served, mesh) = (Served::new(&bench, "out"), Served::new(&bench, "a.ply"));
    assert_eq!(served.json("/live.json")["stores"].as_object().unwrap().len(), 2);
    fs::remove_dir_all(bench.path("out/z.zarr")).unwrap();
    wait_until("one store", || served.json("/live.json")["stores"].as_object().unwrap().len() == 1);
    assert_eq!(served.json("/live.json")["text"], "");
    // One that comes to lie there is seen, and so is one that is damaged meanwhile.
    bench.succeed("distance marks.csv --like image.tif -q -o out/z.zarr");
    wait_until("two stores", || served.json("/live.json")["stores"].as_object().unwrap().len() == 2);
    bench.write("out/z.zarr/zarr.json", "{");
    wait_until("a note", || served.json("/live.json")["notes"].to_string().contains("z.zarr/zarr.json is no JSON: "));
    fs::remove_file(bench.path("a.ply")).unwrap();
    wait_until("no mesh", || mesh.json("/live.json")["text"] == "a.ply is gone");
}

#[test]
fn the_page_names_its_store_and_links_its_report() {
    let bench = store();
    let served = Served::new(&bench, "out/ball.zarr");
    assert_eq!(served.json("/state.json")["title"], "ball.zarr");
    let live = served.json("/live.json");
    assert_eq!(live["name"], "ball.zarr");
    assert_eq!(live["reports"], json!([{ "title": "report", "address": "/data/ball.zarr/report.html" }]));
    assert_eq!(served.get("/data/ball.zarr/report.html").code, 200);
    // Beside stores lies the page of a batch, whose links lead into them; nothing else there is served.
    for name in ["summary.html", "report.html", "summary.csv"] {
        bench.write(&format!("out/{name}"), "beside");
    }
    assert_eq!(served.get("/data/summary.html").code, 404, "outside of the store");
    let several = Served::new(&bench, "out");
    let live = several.json("/live.json");
    assert_eq!((&live["name"], &live["reports"][0]["address"]), (&json!("out"), &json!("/data/summary.html")));
    assert_eq!(several.get("/data/summary.html").body, b"beside");
    for name in ["report.html", "summary.csv", "../marks.csv", "%2e%2e/marks.csv", "./summary.csv"] {
        assert_eq!(several.get(&format!("/data/{name}")).code, 404, "{name}");
    }
    #[cfg(unix)]
    {
        fs::remove_file(bench.path("out/summary.html")).unwrap();
        std::os::unix::fs::symlink(bench.path("marks.csv"), bench.path("out/summary.html")).unwrap();
        assert_eq!(several.get("/data/summary.html").code, 404, "a link that leads outside");
    }
}

/// Both stores have an object of the number 1, and other colours for it.
#[test]
fn surfaces_of_each_store_have_the_colours_of_its_labels() {
    let bench = store();
    bench.succeed("segment image.tif --points marks.csv -q -o out/other.zarr");
    let document = bench.path("out/other.zarr/labels/segmentation/zarr.json");
    let mut labels: Value = serde_json::from_slice(&fs::read(&document).unwrap()).unwrap();
    labels["attributes"]["ome"]["image-label"]["colors"] = json!([{ "label-value": 1, "rgba": [1, 2, 3, 255] }]);
    fs::write(&document, labels.to_string()).unwrap();
    let state = Served::new(&bench, "out").json("/state.json");
    let colors = |name: &str| layer(&state, name)["segmentColors"].as_object().unwrap().values().next().unwrap();
    assert_eq!(colors("other surfaces"), "#010203");
    assert_eq!(colors("ball surfaces"), colors("ball segmentation"));
    let segments = |name: &str| layer(&state, name)["segments"].clone();
    assert_ne!(segments("other surfaces"), segments("ball surfaces"), "the page tells them apart by number");
}

#[test]
fn meshes_alone_open_in_one_panel() {
    let bench = store();
    fs::copy(bench.path("out/ball.zarr/meshes/surface.ply"), bench.path("ball.ply")).unwrap();
    for (what, layout) in [("ball.ply", "3d"), ("out/ball.zarr/meshes", "3d"), ("out/ball.zarr", "4panel-alt")] {
        assert_eq!(Served::new(&bench, what).json("/state.json")["layout"], layout, "{what}");
    }
}

/// Distances end where they are as large as was asked for; where nothing ends, nothing but chunks that are not there is left out.
#[test]
fn distances_that_were_not_solved_are_not_drawn() {
    let bench = store();
    bench.succeed("distance marks.csv --like image.tif --max-distance 1.5 -q -o out/near.zarr");
    bench.succeed("distance marks.csv --like image.tif -q -o out/far.zarr");
    let shader = |of: &str, name: &str| {
        let state = Served::new(&bench, of).json("/state.json");
        layer(&state, name)["shader"].as_str().unwrap().to_owned()
    };
    assert!(shader("out/near.zarr", "distance").contains("(value == 0e0 || abs(value) >= 1.5e0)"));
    let whole = shader("out/far.zarr", "distance");
    assert!(whole.contains("(value == 0e0)"), "{whole}");
    let beside = shader("out/ball.zarr", "distance");
    let document: Value =
        serde_json::from_slice(&fs::read(bench.path("out/ball.zarr/distance/zarr.json")).unwrap()).unwrap();
    let far = &document["attributes"]["ome"]["omero"]["channels"][0]["window"]["end"];
    let end = beside.split("abs(value) >= ").nth(1).unwrap().split(')').next().unwrap();
    assert_eq!(end.parse::<f32>().unwrap(), far.as_f64().unwrap() as f32);
    let image = shader("out/ball.zarr", "image");
    assert!(!image.contains("emitTransparent"), "a dark voxel is one: {image}");
}

/// Marks of each time are seen at that time.
#[test]
fn pages_show_marks_at_their_times() {
    let bench = series::bench();
    bench.write("two.csv", &series::marks([3, 4]));
    bench.succeed("segment drop.tif --points two.csv --time 3:5 --max-steps 1 -q -o out/x.zarr");
    let state = Served::new(&bench, "out/x.zarr").json("/state.json");
    let marks = state["layers"].as_array().unwrap().iter().find(|layer| layer["name"] == "marks").unwrap();
    assert_eq!(marks["source"]["transform"]["outputDimensions"]["t"], serde_json::json!([1.0, ""]));
    // The page opens at a time and in the middle of it: an axis without a place would leave none to the others.
    assert_eq!(state["dimensions"].as_object().unwrap().keys().collect::<Vec<_>>(), ["x", "y", "z", "t"]);
    assert_eq!(state["position"], json!([15.5, 15.0, 8.0, 3.0]));
    let points = marks["annotations"].as_array().unwrap();
    let table = fs::read_to_string(bench.path("two.csv")).unwrap();
    let told: Vec<f64> = table.lines().skip(1).map(|line| line.split(',').nth(2).unwrap().parse().unwrap()).collect();
    let shown: Vec<f64> = points.iter().map(|point| point["point"][3].as_f64().unwrap()).collect();
    assert!(shown == told && told.contains(&3.0) && told.contains(&4.0));
}

#[test]
fn times_without_a_surface_are_told() {
    let bench = series::bench();
    // At time 5 the marks are a line that encloses nothing.
    let line: Vec<String> = (0..8).map(|n| format!("1,0,5,{n},2,3\n")).collect();
    bench.write("some.csv", &(series::marks([4, 6]) + &line.concat()));
    bench.fail("segment drop.tif --points some.csv --time 4:7 --max-steps 1 -q -o out/x.zarr", 3);
    let page = fs::read_to_string(bench.path("out/x.zarr/report.html")).unwrap();
    assert!(page.contains("Surfaces are missing at time 5: the table says why."));
    assert_eq!(page.matches("<img").count(), 6, "slices of the times that were solved");
    let notes = Served::new(&bench, "out/x.zarr").json("/live.json")["notes"].to_string();
    assert!(notes.contains("no surface of time 5; ") && notes.contains("out/x.zarr/meshes/t0004"), "{notes}");
    let of_time = Served::new(&bench, "out/x.zarr/meshes/t0004").json("/state.json");
    assert_eq!((&of_time["layers"][0]["name"], &of_time["layout"]), (&"surfaces".into(), &"3d".into()));
}
