//! Smaller copies of the pages of a TIFF file, in directories below them: read by `--level`, where both cover the same place.

#![allow(clippy::unwrap_used)]

use std::fs;

use strandline::io::stack::tiff::Select;

use crate::common::ball::Bench;
use crate::common::tiff_bytes::{PageBytes, Value, gray_page, tiff_file};
use crate::common::tiff_planes;

fn number(bytes: &[u8]) -> usize {
    bytes.iter().rev().fold(0, |n, &byte| n << 8 | usize::from(byte))
}

/// Where the directories of a little-endian file lie, and where each names the next one.
fn directories(file: &[u8]) -> Vec<(usize, usize)> {
    let mut found = Vec::new();
    let mut next = number(&file[4..8]);
    while next != 0 {
        let link = next + 2 + 12 * number(&file[next..next + 2]);
        found.push((next, link));
        next = number(&file[link..link + 4]);
    }
    found
}

/// A stack of `depth` pages of 8 x 6, each with copies of 4 x 3 and 2 x 2, by hand: all pages are chained first, then those
/// of the copies are taken out of the chain and named by the pages. Voxels hold 10 z + level.
fn pyramid(depth: usize) -> Vec<u8> {
    let page = |level: usize, z: usize| -> PageBytes {
        let [width, height] = [[8, 6], [4, 3], [2, 2]][level];
        let page = gray_page(width, height, 8, vec![(10 * z + level) as u8; (width * height) as usize]);
        if level == 0 { page.with(330, Value::Long(vec![0, 0])) } else { page.with(254, Value::Long(vec![1])) }
    };
    let text = "ImageJ=1.54f\nimages=3\nslices=3\nunit=um\nspacing=2\n";
    let pages = (0..3).flat_map(|level| (0..depth).map(move |z| (level, z))).map(|(level, z)| {
        let page = page(level, z);
        let first = (level, z) == (0, 0);
        let resolved = |page: PageBytes| page.with(282, Value::Rational(2, 1)).with(283, Value::Rational(2, 1));
        if first { resolved(page.with(270, Value::Text(text.into()))) } else { page }
    });
    let mut file = tiff_file(&pages.collect::<Vec<_>>(), false);
    let places = directories(&file);
    for z in 0..depth {
        let (at, link) = places[z];
        let entry = (at + 2..link).step_by(12).find(|&entry| number(&file[entry..entry + 2]) == 330).unwrap();
        let values = number(&file[entry + 8..entry + 12]);
        for level in 1..3 {
            let below = places[level * depth + z].0 as u32;
            file[values + 4 * (level - 1)..values + 4 * level].copy_from_slice(&below.to_le_bytes());
        }
    }
    file[places[depth - 1].1..][..4].fill(0);
    file
}

#[test]
fn levels_of_a_stack_are_read() {
    let bench = Bench::bare();
    let path = bench.path("pyramid.tif");
    fs::write(&path, pyramid(3)).unwrap();
    for (level, shape, spacing, origin) in [
        (0, [8, 6, 3], [0.5, 0.5, 2.0], [0.0; 3]),
        // Twice as wide: the middle of two voxels of 0.5.
        (1, [4, 3, 3], [1.0, 1.0, 2.0], [0.25, 0.25, 0.0]),
        // Four and three times.
        (2, [2, 2, 3], [2.0, 1.5, 2.0], [0.75, 0.5, 0.0]),
    ] {
        let (info, found) = tiff_planes::selected(&path, Select { level, ..Select::default() }).unwrap();
        let spacing_found = info.spacing.map(Option::unwrap);
        assert_eq!((info.shape, spacing_found, info.origin), (shape, spacing, origin), "level {level}");
        let plane = (shape[0] * shape[1]) as usize;
        let expected: Vec<f64> = (0..3 * plane).map(|n| (10 * (n / plane)) as f64 + f64::from(level)).collect();
        assert_eq!(found, expected, "level {level}");
    }
    assert!(
        bench.succeed("info pyramid.tif").contains("3 levels, the pages and smaller copies of them (4 x 3, 2 x 2)")
    );
    let complaint = bench.fail("segment pyramid.tif --seed 1,1,1,1 --level 3 -o none", 2);
    assert!(complaint.contains("level 3 was asked for but there are 3"), "{complaint}");
}

#[test]
fn a_file_without_copies_has_one_level() {
    let bench = Bench::bare();
    let pages: Vec<PageBytes> = (0..3).map(|n| gray_page(4, 3, 8, vec![n; 12])).collect();
    fs::write(bench.path("plain.tif"), tiff_file(&pages, false)).unwrap();
    let complaint = bench.fail("segment plain.tif --seed 1,1,1,1 --level 1 -o none", 2);
    assert!(complaint.contains("level 1 was asked for but there are 1"), "{complaint}");
    fs::create_dir(bench.path("slices")).unwrap();
    for (n, page) in pages.iter().enumerate() {
        fs::write(bench.path(&format!("slices/s{n}.tif")), tiff_file(std::slice::from_ref(page), false)).unwrap();
    }
    let complaint = bench.fail("segment slices --seed 1,1,1,1 --level 1 -o none", 2);
    assert!(complaint.contains("slices are read whole"), "{complaint}");
}
