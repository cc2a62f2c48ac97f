//! Stores as files: what they hold, and whether two hold the same.

#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::Path;

use strandline::io::ome_zarr::ImageReader;

/// The finest level of an image, x fastest.
pub(crate) fn volume(group: &Path) -> Vec<f64> {
    let image = ImageReader::open(group).unwrap();
    image.read_box(0, &image.levels()[0].geometry.domain()).unwrap()
}

/// All files of a store but the report and the checksums, its among them, with their contents.
pub(crate) fn contents(store: &Path) -> Vec<(String, Vec<u8>)> {
    fn walk(folder: &Path, root: &Path, found: &mut Vec<(String, Vec<u8>)>) {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                walk(&path, root, found);
            } else if !["report.json", "report.html", "checksums.txt"].iter().any(|name| path.ends_with(name)) {
                let name = path.strip_prefix(root).unwrap().to_str().unwrap().to_owned();
                found.push((name, fs::read(&path).unwrap()));
            }
        }
    }
    let mut found = Vec::new();
    walk(store, store, &mut found);
    found.sort();
    found
}

pub(crate) fn same(a: &[(String, Vec<u8>)], b: &[(String, Vec<u8>)], what: &str) {
    let names = |files: &[(String, Vec<u8>)]| files.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>();
    assert_eq!(names(a), names(b), "{what}");
    for ((name, a), (_, b)) in a.iter().zip(b) {
        assert!(a == b, "{what}: {name} differs");
    }
}
