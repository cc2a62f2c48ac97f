//! A live store of several times: what is to be seen of it while others are still solved, and when it is gone on with.

#![allow(clippy::unwrap_used)]

use serde_json::Value;

use crate::common::ball::Bench;
use crate::common::held::Held;
use crate::common::stores::{contents, same};
use crate::series::bench;

const COMMAND: &str = "segment drop.tif --points three.csv --time 8:12";

/// What the store says of itself, and the times whose labels are there.
fn seen(bench: &Bench) -> (Value, Vec<String>) {
    let mut root = bench.json("out/live.zarr/zarr.json");
    (root["attributes"]["strandline"].take(), bench.entries("out/live.zarr/labels/segmentation/0/c"))
}

#[test]
fn a_live_series_shows_times_as_they_are_done() {
    let bench = bench();
    bench.succeed(&format!("{COMMAND} -q -o out/whole.zarr"));
    let whole = contents(&bench.path("out/whole.zarr"));
    let mut run = Held::start(bench.command(&format!("{COMMAND} --live -o out/live.zarr")));
    run.hear("time 10 (3 of 4)");
    let (said, times) = seen(&bench);
    assert_eq!((&said["state"], &said["done"], times), (&"running".into(), &0.5.into(), vec!["0".into(), "1".into()]));
    assert_eq!(bench.json("out/live.zarr/0/zarr.json")["shape"][0], 4);
    // What is there is what will be.
    for (name, bytes) in contents(&bench.path("out/live.zarr")) {
        if name.contains("/c/") || name.starts_with("times/") {
            assert!(whole.contains(&(name.clone(), bytes)), "{name}");
        }
    }
    run.signal("TERM");
    assert_eq!(run.finish().status.code(), Some(143));
    let (said, times) = seen(&bench);
    assert_eq!((&said["state"], times.len()), (&"interrupted".into(), 2));
    bench.succeed(&format!("{COMMAND} --live --resume -q -o out/live.zarr"));
    assert_eq!(seen(&bench).0["state"], "complete");
    let but_root = |name: &str| {
        let mut files = contents(&bench.path(&format!("out/{name}.zarr")));
        files.retain(|(name, _)| name != "zarr.json");
        files
    };
    same(&but_root("whole"), &but_root("live"), "live");
    let [whole, live] = ["whole", "live"].map(|name| bench.json(&format!("out/{name}.zarr/zarr.json")));
    assert_eq!(whole["attributes"]["ome"], live["attributes"]["ome"]);
    assert!(!bench.path("out/live.zarr.checkpoint").exists());
    bench.succeed("verify out/live.zarr");
}
