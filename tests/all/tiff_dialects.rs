//! TIFF files that `tifffile` wrote of random content in random dialects, through `scripts/write_tiffs.py`.

#![allow(clippy::unwrap_used)]

use std::fs;

use serde_json::Value;
use strandline::io::stack::tiff::Select;

use crate::common::{python, tiff_planes};

#[test]
fn files_of_tifffile_read_back_equal() {
    let Some(interpreter) = python::interpreter() else { return };
    let folder = tempfile::tempdir().unwrap();
    let [seed, count] = ["20261129", "240"].map(std::path::Path::new);
    let lines = python::run_script(interpreter, "write_tiffs.py", &[seed, count, folder.path()]).unwrap();
    let mut read = 0;
    for line in lines.lines() {
        check(folder.path(), &serde_json::from_str(line).unwrap());
        read += 1;
    }
    assert_eq!(read, 240);
}

fn check(folder: &std::path::Path, due: &Value) {
    let path = folder.join(due["file"].as_str().unwrap());
    let bytes = fs::read(path.with_extension("f64")).unwrap();
    let values: Vec<f64> = bytes.chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect();
    let count = |name: &str| due[name].as_u64().unwrap() as u32;
    let stack = values.len() / (count("channels") * count("times")) as usize;
    let mut stacks = values.chunks_exact(stack);
    for channel in 0..count("channels") {
        for time in 0..count("times") {
            let select = Select { channel, time, ..Select::default() };
            let (info, voxels) = tiff_planes::selected(&path, select).unwrap_or_else(|error| panic!("{error}: {due}"));
            assert_eq!((info.channels, info.times), (count("channels"), count("times")), "{due}");
            assert!(voxels == stacks.next().unwrap(), "channel {channel}, time {time}: {due}");
            for a in 0..3 {
                assert_eq!(info.shape[a], due["shape"][a].as_i64().unwrap(), "{due}");
                // Resolution tags are fractions of 32-bit numbers.
                match (info.spacing[a], due["spacing"][a].as_f64()) {
                    (Some(found), Some(due)) => assert!((found - due).abs() < 1e-6 * due, "{found}, not {due}"),
                    (found, wanted) => assert_eq!(found, wanted, "{due}"),
                }
            }
            assert_eq!(info.unit.as_deref(), due["unit"].as_str(), "{due}");
        }
    }
}
