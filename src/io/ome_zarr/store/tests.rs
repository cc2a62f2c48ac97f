//! Stores in the making: what is left of them, what they replace, what their documents say.

use std::fs;

use super::*;
use crate::error::ErrorKind;
use crate::grid::Geometry;
use crate::io::ome_zarr::{Live, LiveState, live};

fn geometry() -> Geometry {
    Geometry { shape: [5, 4, 3], spacing: [1.0; 3], origin: [0.0; 3], unit: None }
}

fn entries(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

fn write_store(path: &Path, overwrite: bool, value: u8) -> Result<()> {
    let store = StoreWriter::create(path, overwrite)?;
    let spec = ImageSpec {
        name: "image",
        geometry: &geometry(),
        element: ElementType::U8,
        content: Content::Grey,
        window: None,
        extremes: None,
    };
    let image = store.image("", &spec)?;
    let level = &image.levels()[0];
    for shard in level.shards() {
        level.write_shard(&shard, &vec![value; shard.len()])?;
    }
    store.finish()
}

fn json(path: &Path) -> serde_json::Value {
    serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()
}

#[test]
fn dropped_stores_leave_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let store = StoreWriter::create(&folder.path().join("out.zarr"), false).unwrap();
    fs::write(store.file("meshes/surface.ply").unwrap(), "ply").unwrap();
    assert_eq!(entries(folder.path()).len(), 1);
    assert!(entries(folder.path())[0].starts_with(".out.zarr.partial-"));
    drop(store);
    assert!(entries(folder.path()).is_empty());
}

#[test]
fn stores_in_the_making_are_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.zarr");
    let first = StoreWriter::create(&path, false).unwrap();
    let dead = folder.path().join(".out.zarr.partial-1-abcdef");
    fs::create_dir(&dead).unwrap();
    fs::write(dead.join("zarr.json"), "{}").unwrap();
    let second = StoreWriter::create(&path, false).unwrap();
    assert!(first.folder().exists() && second.folder().exists() && !dead.exists());
}

#[test]
fn finished_stores_are_in_place_and_readable_by_others() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.zarr");
    write_store(&path, false, 1).unwrap();
    assert_eq!(entries(folder.path()), ["out.zarr"]);
    assert_eq!(entries(&path), ["0", "checksums.txt", "zarr.json"]);
    assert!(path.join("0/c/0/0/0").is_file());
    let plain = folder.path().join("plain");
    fs::create_dir(&plain).unwrap();
    assert_eq!(fs::metadata(&path).unwrap().permissions(), fs::metadata(&plain).unwrap().permissions());
}

#[test]
fn stores_are_replaced_only_when_told_and_only_at_the_end() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.zarr");
    write_store(&path, false, 1).unwrap();
    fs::write(path.join("note"), "old").unwrap();
    let error = write_store(&path, false, 2).unwrap_err();
    assert_eq!((error.kind(), error.path()), (ErrorKind::Usage, Some(path.canonicalize().unwrap().as_path())));
    assert!(error.to_string().contains("--overwrite"), "{error}");
    drop(StoreWriter::create(&path, true).unwrap());
    assert!(path.join("note").exists(), "an unfinished store replaces nothing");
    write_store(&path, true, 2).unwrap();
    assert!(!path.join("note").exists());
    assert_eq!(entries(folder.path()), ["out.zarr"]);
}

#[test]
fn links_stay_links() {
    let folder = tempfile::tempdir().unwrap();
    let (path, link) = (folder.path().join("out.zarr"), folder.path().join("link.zarr"));
    write_store(&path, false, 1).unwrap();
    std::os::unix::fs::symlink(&path, &link).unwrap();
    write_store(&link, true, 2).unwrap();
    assert_eq!(fs::read_link(&link).unwrap(), path);
    assert_eq!(entries(folder.path()), ["link.zarr", "out.zarr"]);
}

#[test]
fn what_is_no_store_is_never_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("photos");
    fs::create_dir(&path).unwrap();
    fs::write(path.join("a.jpg"), "irreplaceable").unwrap();
    for target in [path.clone(), path.join("a.jpg")] {
        let error = StoreWriter::create(&target, true).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Usage, "{error}");
    }
    assert_eq!(entries(&path), ["a.jpg"]);
}

#[test]
fn what_came_meanwhile_stays() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.zarr");
    let store = StoreWriter::create(&path, false).unwrap();
    fs::create_dir(&path).unwrap();
    assert_eq!(store.finish().unwrap_err().kind(), ErrorKind::Usage);
    assert_eq!(entries(folder.path()), ["out.zarr"]);
}

#[test]
fn folders_must_exist() {
    let folder = tempfile::tempdir().unwrap();
    let error = StoreWriter::create(&folder.path().join("no/out.zarr"), false).unwrap_err();
    assert_eq!(error.exit_code(), 2);
    assert_eq!(error.path(), Some(folder.path().join("no").as_path()));
    assert_eq!(StoreWriter::create(Path::new("/"), false).unwrap_err().exit_code(), 2);
}

#[test]
fn groups_on_the_way_say_that_they_are_groups() {
    let folder = tempfile::tempdir().unwrap();
    let store = StoreWriter::create(&folder.path().join("out.zarr"), false).unwrap();
    let geometry = geometry();
    let spec = ImageSpec {
        name: "u",
        geometry: &geometry,
        element: ElementType::F32,
        content: Content::Field,
        window: None,
        extremes: None,
    };
    store.image("levelset/object-1", &spec).unwrap();
    store.image("levelset/object-2", &spec).unwrap();
    for name in ["segmentation", "border"] {
        let spec = LabelSpec { name, geometry: &geometry, element: ElementType::U8, colors: &[] };
        store.labels(&spec).unwrap();
    }
    for group in ["", "levelset", "levelset/object-2", "labels", "labels/border"] {
        assert_eq!(json(&store.folder().join(group).join("zarr.json"))["node_type"], "group", "{group}");
    }
    let list = json(&store.folder().join("labels/zarr.json"));
    assert_eq!(list["attributes"]["ome"]["labels"], serde_json::json!(["border", "segmentation"]));
}

fn live_image(store: &StoreWriter) -> ImageWriter {
    let geometry = geometry();
    let spec = ImageSpec {
        name: "image",
        geometry: &geometry,
        element: ElementType::U8,
        content: Content::Grey,
        window: None,
        extremes: None,
    };
    store.image("", &spec).unwrap()
}

fn write_all(image: &ImageWriter, value: u8) {
    let level = &image.levels()[0];
    for shard in level.shards() {
        level.write_shard(&shard, &vec![value; shard.len()]).unwrap();
    }
}

#[test]
fn live_stores_stand_there_from_the_start_and_say_what_they_are() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.zarr");
    let store = StoreWriter::create_live(&path, false).unwrap();
    let said = || live(&path).unwrap();
    assert_eq!((said().state, said().written), (LiveState::Running, 0));
    let image = live_image(&store);
    assert_eq!(json(&path.join("zarr.json"))["attributes"]["ome"]["multiscales"][0]["name"], "image");
    // Nobody else begins it, whatever is allowed.
    for overwrite in [false, true] {
        for create in [StoreWriter::create, StoreWriter::create_live] {
            let error = create(&path, overwrite).unwrap_err();
            assert!(error.kind() == ErrorKind::Usage && error.to_string().contains("another run"), "{error}");
        }
    }
    write_all(&image, 7);
    let telling = store.live().unwrap();
    telling.tell(LiveState::Running, 0.5).unwrap();
    assert_eq!(said(), Live { state: LiveState::Running, done: 0.5, written: 1 });
    store.finish().unwrap();
    assert_eq!(said(), Live { state: LiveState::Complete, done: 1.0, written: 1 });
    assert_eq!(entries(folder.path()), ["out.zarr"]);
}

#[test]
fn live_stores_that_are_given_up_say_so_or_go() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.zarr");
    let store = StoreWriter::create_live(&path, false).unwrap();
    let image = live_image(&store);
    write_all(&image, 7);
    drop(store);
    assert_eq!(live(&path).unwrap().state, LiveState::Interrupted);
    let error = StoreWriter::create(&path, false).unwrap_err();
    assert!(error.to_string().contains("interrupted"), "{error}");
    // One that never got a shard goes, and what it replaced comes back.
    let store = StoreWriter::create_live(&path, true).unwrap();
    assert_eq!(live(&path).unwrap(), Live { state: LiveState::Running, done: 0.0, written: 0 });
    drop(store);
    assert_eq!(live(&path).unwrap(), Live { state: LiveState::Interrupted, done: 0.0, written: 1 });
    assert!(path.join("0/c/0/0/0").is_file());
    // Who says running and is gone is interrupted.
    let document = fs::read_to_string(path.join("zarr.json")).unwrap().replace("interrupted", "running");
    fs::write(path.join("zarr.json"), document).unwrap();
    assert_eq!(live(&path).unwrap().state, LiveState::Interrupted);
    let store = StoreWriter::create_live(&path, true).unwrap();
    write_all(&live_image(&store), 8);
    store.finish().unwrap();
    assert_eq!(live(&path).unwrap().state, LiveState::Complete);
    assert_eq!(entries(folder.path()), ["out.zarr"]);
}

/// What a live run that is killed leaves in its first moments: the store that was there under a hidden name, and little in its place.
#[test]
fn a_store_that_was_set_aside_comes_back() {
    for stands in ["nothing", "empty", "begun", "more"] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.zarr");
        let aside = folder.path().join(".out.zarr.partial-12-abcDEF-replaced");
        if stands == "empty" {
            fs::create_dir(&path).unwrap();
        } else if stands != "nothing" {
            let store = StoreWriter::create_live(&path, false).unwrap();
            write_all(&live_image(&store), 7);
            drop(store);
        }
        if stands == "begun" {
            let document = fs::read_to_string(path.join("zarr.json")).unwrap();
            fs::write(path.join("zarr.json"), document.replace("\"written\": 1", "\"written\": 0")).unwrap();
            assert_eq!(live(&path).unwrap().written, 0);
        }
        write_store(&folder.path().join("old.zarr"), false, 3).unwrap();
        fs::rename(folder.path().join("old.zarr"), &aside).unwrap();
        // A run that goes on keeps its lock on what it has set aside.
        let held = crate::io::ome_zarr::abandoned::claim(&aside).unwrap();
        let _ = StoreWriter::create_live(&folder.path().join("out.zarr"), false).map(drop);
        assert!(aside.exists(), "{stands}");
        drop(held);
        let error = StoreWriter::create(&path, false).map(drop).unwrap_err().to_string();
        let is_old = live(&path).is_none();
        assert_eq!((is_old, error.contains("interrupted")), (stands != "more", stands == "more"), "{stands}: {error}");
        assert_eq!(entries(folder.path()), ["out.zarr"], "{stands}");
    }
}

#[test]
fn stores_that_are_not_live_say_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.zarr");
    write_store(&path, false, 3).unwrap();
    assert_eq!(live(&path), None);
    assert_eq!(live(folder.path()), None);
}

#[test]
fn live_stores_of_both_versions_say_how_far_they_are() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.zarr");
    let state = || live(&path).map(|live| live.state);
    for version in [OmeVersion::V04, OmeVersion::V05] {
        let store = StoreWriter::create_live_as(version, &path, true).unwrap();
        assert_eq!(state(), Some(LiveState::Running), "{version:?}");
        let spec = LabelSpec { name: "a", geometry: &geometry(), element: ElementType::U8, colors: &[] };
        store.labels(&spec).unwrap();
        store.finish().unwrap();
        assert_eq!(state(), Some(LiveState::Complete), "{version:?}");
        let names: &[&str] = if version == OmeVersion::V04 { &[".zattrs", ".zgroup"] } else { &["zarr.json"] };
        for folder in ["", "labels", "labels/a"] {
            let found = entries(&path.join(folder));
            assert!(names.iter().all(|name| found.iter().any(|found| found == name)), "{folder}: {found:?}");
        }
    }
    let attributes = json(&path.join("labels/a/zarr.json"));
    assert_eq!(attributes["attributes"]["ome"]["image-label"]["source"]["image"], "../../");
}
