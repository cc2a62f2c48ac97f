//! Small files that would cost much: they unpack to a thousand times of themselves, or hold as many groups as numbers.

use std::fs;
use std::io::{Cursor, Write};

use strandline::io::geometry::read::points::read_points;
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

use crate::tiff_hostile::{LIMITED, rerun_limited};

/// A set of one ROI of so many points at one place, on slice 1 or each on its own.
fn set_of_points(count: u32, own_slice: Option<fn(u32) -> u32>) -> Vec<u8> {
    let mut roi = b"Iout\0\xe4\x0a\0".to_vec();
    roi.resize(64, 0);
    roi[18..22].copy_from_slice(&count.to_be_bytes());
    roi[56..60].copy_from_slice(&1_u32.to_be_bytes());
    let second = 64 + 4 * count;
    roi[60..64].copy_from_slice(&second.to_be_bytes());
    roi.resize(second as usize + 64, 0);
    if let Some(slice) = own_slice {
        roi[second as usize + 48..][..4].copy_from_slice(&(second + 64).to_be_bytes());
        roi.extend((0..count).flat_map(|n| (slice(n) << 8).to_be_bytes()));
    }
    let mut set = ZipWriter::new(Cursor::new(Vec::new()));
    set.start_file("points.roi", SimpleFileOptions::default()).expect("an entry");
    set.write_all(&roi).expect("its content");
    set.finish().expect("an archive").into_inner()
}

#[test]
fn sets_of_rois_cost_no_more_than_their_points() {
    if std::env::var_os(LIMITED).is_none() {
        return rerun_limited("fuzz::costly::sets_of_rois_cost_no_more_than_their_points");
    }
    let folder = tempfile::tempdir().expect("room");
    let path = folder.path().join("set.zip");
    let read = |set: Vec<u8>| {
        fs::write(&path, set).expect("room for a set");
        read_points(&path)
    };
    let error = read(set_of_points(20 << 20, None)).expect_err("too much");
    assert!(error.exit_code() == 2 && error.to_string().contains("MiB of ROIs"), "{error}");
    // Nearly the most that is read.
    let count = (8 << 20) - 100;
    let most = read(set_of_points(count, None)).expect("as many points as there may be");
    assert_eq!(most.cloud.positions.len(), count as usize);
    let spread = read(set_of_points(100_000, Some(|n| 1 + n.reverse_bits() % 99_991))).expect("points on many slices");
    let mut slices: Vec<i64> = spread.cloud.positions.iter().map(|p| p[2] as i64).collect();
    slices.sort_unstable();
    slices.dedup();
    assert!(slices.len() > 50_000 && spread.cloud.positions.len() == 100_000);
    // Slices of one or two points hold no contours.
    assert!(spread.cloud.contours.is_empty());
}
