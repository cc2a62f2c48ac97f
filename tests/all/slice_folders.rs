//! Folders of slices: what the names of their files say, and what is missing or does not belong.

#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::{Path, PathBuf};

use strandline::io::stack::tiff::{Select, StackInfo};
use tempfile::TempDir;

use crate::common::ball::Bench;
use crate::common::tiff_bytes::{gray_page, tiff_file};
use crate::common::tiff_planes;

fn slice(path: &Path, value: u8) {
    fs::write(path, tiff_file(&[gray_page(2, 2, 8, vec![value; 4])], false)).unwrap();
}

/// A folder of files whose voxels hold their place in the list.
fn folder(names: &[&str]) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    names.iter().enumerate().for_each(|(n, name)| slice(&folder.path().join(name), n as u8));
    let path = folder.path().to_path_buf();
    (folder, path)
}

/// The places in the list of the planes that are read.
fn read(path: &Path, select: Select) -> (StackInfo, Vec<u8>) {
    let (info, voxels) = tiff_planes::selected(path, select).unwrap();
    (info, voxels.chunks(4).map(|plane| plane[0] as u8).collect())
}

fn of(channel: u32, time: u32) -> Select {
    Select { channel, time, ..Select::default() }
}

fn axes(text: &str) -> Select {
    Select { axes: Some(text.parse().unwrap()), ..Select::default() }
}

fn refusal(names: &[&str], select: Select) -> String {
    let (_held, path) = folder(names);
    let error = tiff_planes::selected(&path, select).unwrap_err();
    let text = error.to_string();
    assert!(error.exit_code() == 2 && !text.contains('\n'), "{text}");
    text
}

#[test]
fn missing_numbers_are_refused() {
    let text = refusal(&["s006.tif", "s007.tif", "s010.tif", "s011.tif"], Select::default());
    assert!(text.contains("s007 is followed by s010: 2 numbers are missing") && text.contains("--axes zyx"), "{text}");
    let text = refusal(&["z1_c0.tif", "z2_c0.tif", "z3_c0.tif", "z1_c1.tif", "z2_c1.tif"], of(1, 0));
    assert!(text.contains("z2_c1 is the last where others end with number 3: 1 number is missing"), "{text}");
    let (_held, path) = folder(&["s7.tif", "s8.tif", "s10.tif"]);
    assert_eq!(read(&path, axes("zyx")).1, [0, 1, 2]);
    // The first channel has all.
    let (_held, path) = folder(&["z1_c0.tif", "z2_c0.tif", "z3_c0.tif", "z1_c1.tif", "z2_c1.tif"]);
    let (info, found) = read(&path, of(0, 0));
    assert_eq!(found, [0, 1, 2]);
    assert!(info.notes.iter().any(|note| note.contains("1 of 2 channels")), "{:?}", info.notes);
}

#[test]
fn the_case_of_missing_slices_is_told_by_the_program() {
    let bench = Bench::bare();
    fs::create_dir(bench.path("s")).unwrap();
    for n in (0..31).filter(|n| ![8, 9, 20].contains(n)) {
        slice(&bench.path(&format!("s/s{n:03}.tif")), n);
    }
    let complaint = bench.fail("info s", 2);
    assert!(
        complaint.contains("s007 is followed by s010, s019 is followed by s021: 3 numbers are missing"),
        "{complaint}"
    );
}

#[test]
fn channels_and_times_are_read_as_such() {
    for names in [
        ["img_z000_c0.tif", "img_z000_c1.tif", "img_z001_c0.tif", "img_z001_c1.tif"],
        ["C=1_Z=05.tif", "C=2_Z=05.tif", "C=1_Z=06.tif", "C=2_Z=06.tif"],
        ["a9-ch1.tif", "a9-ch2.tif", "a10-ch1.tif", "a10-ch2.tif"],
        ["ImageZ1W1.tif", "ImageZ1W2.tif", "ImageZ2W1.tif", "ImageZ2W2.tif"],
        ["slice 1 channel 0.tif", "slice 1 channel 1.tif", "slice 2 channel 0.tif", "slice 2 channel 1.tif"],
        ["e_Z_1_C_0.tif", "e_Z_1_C_1.tif", "e_Z_2_C_0.tif", "e_Z_2_C_1.tif"],
        ["1_DAPI.tif", "1_GFP.tif", "2_DAPI.tif", "2_GFP.tif"],
    ] {
        let (_held, path) = folder(&names);
        let (info, found) = read(&path, of(0, 0));
        assert_eq!((info.shape[2], info.channels, info.times, found), (2, 2, 1, vec![0, 2]), "{names:?}");
        assert!(info.notes[0].contains("--channel"), "{:?}", info.notes);
        assert_eq!(read(&path, of(1, 0)).1, [1, 3], "{names:?}");
        assert!(tiff_planes::selected(&path, of(2, 0)).unwrap_err().to_string().contains("channel 2"));
    }
    let (_held, path) = folder(&["t001_z012.tif", "t001_z013.tif", "t002_z012.tif", "t002_z013.tif"]);
    let (info, found) = read(&path, of(0, 1));
    assert_eq!((info.shape[2], info.channels, info.times, found), (2, 1, 2, vec![2, 3]));
    let (_held, path) = folder(&["t0.tif", "t1.tif", "t2.tif"]);
    let (info, _) = read(&path, Select::default());
    assert!(info.times == 3 && info.notes[0].contains("--axes zyx"), "{info:?}");
    assert_eq!(read(&path, axes("zyx")).1, [0, 1, 2]);
}

#[test]
fn numbers_that_nothing_is_said_of_need_axes() {
    let names = ["1-1.tif", "1-2.tif", "2-1.tif", "2-2.tif"];
    let text = refusal(&names, Select::default());
    assert!(text.contains("1 to 2 and 1 to 2, as in 1-1.tif") && text.contains("--axes"), "{text}");
    let (_held, path) = folder(&names);
    assert_eq!(read(&path, Select { channel: 1, ..axes("zcyx") }).1, [1, 3]);
    assert_eq!(read(&path, Select { time: 1, ..axes("tzyx") }).1, [2, 3]);
    assert_eq!(read(&path, axes("zyx")).1, [0, 1, 2, 3]);
    let (_held, path) = folder(&["1.tif", "2.tif", "3.tif", "4.tif"]);
    assert_eq!(read(&path, Select { channel: 1, ..axes("zc2yx") }).1, [1, 3]);
    let text = refusal(&["x1_z1.tif", "x1_z2.tif", "x2_z1.tif", "x2_z2.tif"], Select::default());
    assert!(text.contains("places on the stage"), "{text}");
    let text = refusal(&["s1.tif", "s01.tif", "s2.tif"], Select::default());
    assert!(text.contains("s01.tif and s1.tif have the same numbers"), "{text}");
    // A number that only goes along, such as a clock.
    let (_held, path) = folder(&["9_0830.tif", "10_0831.tif", "11_0900.tif"]);
    assert_eq!(read(&path, Select::default()).1, [0, 1, 2]);
    let (_held, path) = folder(&["17_z2.tif", "23_z3.tif", "19_z1.tif"]);
    assert_eq!(read(&path, Select::default()).1, [2, 0, 1]);
}

#[test]
fn files_that_do_not_belong_are_left_out_and_told() {
    let (_held, path) = folder(&["s9.tif", "s10.tif", "MAX_s.tif", "s8.tif", "thumb_8.tif", ".s11.tif", "s8 copy.tif"]);
    fs::write(path.join("view.png"), "png").unwrap();
    let (info, found) = read(&path, Select::default());
    assert_eq!(found, [3, 0, 1]);
    let told = info.notes.join("; ");
    for word in ["MAX_s.tif", "thumb_8.tif", "s8 copy.tif", "1 picture is no TIFF"] {
        assert!(told.contains(word), "{told}");
    }
    assert!(!told.contains("s11"), "{told}");
    let text = refusal(&["a1.tif", "a2.tif", "a3.tif", "b7.tif", "b8.tif"], Select::default());
    assert!(text.contains("files of several kinds: 3 as a1.tif, 2 as b7.tif"), "{text}");
    let (_held, path) = folder(&["s1.tif", "s2.tif"]);
    fs::write(path.join("s3.tif"), tiff_file(&[gray_page(3, 2, 8, vec![0; 6])], false)).unwrap();
    let text = tiff_planes::stack(&path, 0, 0).unwrap_err().to_string();
    assert!(text.contains("3 x 2") && text.contains("alike"), "{text}");
    // Names without numbers are in the order of the alphabet, which is told.
    let (_held, path) = folder(&["b.tif", "a.tif"]);
    let (info, found) = read(&path, Select::default());
    assert_eq!(found, [1, 0]);
    assert!(info.notes[0].contains("no number in common"), "{:?}", info.notes);
    // A slice that is elsewhere, on a disk that is not mounted, is not left out: the stack would end without it.
    let (_held, path) = folder(&["s1.tif", "s2.tif"]);
    std::os::unix::fs::symlink("nowhere/s3.tif", path.join("s3.tif")).unwrap();
    let text = tiff_planes::stack(&path, 0, 0).unwrap_err().to_string();
    assert!(text.contains("s3.tif: is a link to a file that is not there"), "{text}");
    let below = tempfile::tempdir().unwrap();
    fs::create_dir(below.path().join("ch0")).unwrap();
    slice(&below.path().join("ch0/1.tif"), 0);
    assert!(tiff_planes::stack(below.path(), 0, 0).unwrap_err().to_string().contains("the folder ch0 in it does"));
}
