//! TIFF files written byte by byte: kinds of stacks for which no small real file exists.
#![allow(clippy::unwrap_used)]

use std::fs::File;
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};

use strandline::io::stack::tiff::{Select, TiffStack};
use strandline::store::{PlaneSource, SamplesMut};
use tempfile::TempDir;

use crate::common::tiff_bytes::{PageBytes, Value, bytes_u16, gray_page, tiff_file};
use crate::common::tiff_planes;

const WIDTH: u32 = 5;
const HEIGHT: u32 = 3;

/// A plane whose values tell it from every other.
fn plane(number: u16) -> Vec<u16> {
    (0..(WIDTH * HEIGHT) as u16).map(|i| 1000 * number + i).collect()
}

fn page(number: u16, big_endian: bool) -> PageBytes {
    gray_page(WIDTH, HEIGHT, 16, bytes_u16(&plane(number), big_endian))
}

fn write(folder: &TempDir, name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    path
}

/// The planes with these numbers, as they are read.
fn voxels(numbers: &[u16]) -> Vec<f64> {
    numbers.iter().flat_map(|&n| plane(n)).map(f64::from).collect()
}

fn refusal(path: &Path) -> String {
    let error = tiff_planes::stack(path, 0, 0).unwrap_err();
    assert_eq!(error.exit_code(), 2, "{error}");
    let text = error.to_string();
    assert!(text.starts_with(&path.display().to_string()) && !text.contains('\n'), "{text}");
    text
}

/// ImageJ's kind over 4 GB in small: one page, the description counts the planes, data without gaps.
fn single_page(planes: u16, description: &str, big_endian: bool) -> Vec<u8> {
    let data: Vec<u16> = (0..planes).flat_map(plane).collect();
    // ImageJ gives the strip the size of one plane; the rest simply follows, so the directory comes first.
    let head = gray_page(WIDTH, HEIGHT, 16, Vec::new()).with(270, Value::Text(description.to_string()));
    let mut bytes = tiff_file(std::slice::from_ref(&head), big_endian);
    let start = bytes.len() as u32;
    let at = find_entry(&bytes, 273, big_endian);
    bytes[at..at + 4].copy_from_slice(&if big_endian { start.to_be_bytes() } else { start.to_le_bytes() });
    bytes.extend(bytes_u16(&data, big_endian));
    bytes
}

/// Where the value of a tag of the first page lies.
fn find_entry(bytes: &[u8], tag: u16, big_endian: bool) -> usize {
    let number = |at: usize, n: usize| {
        let part = bytes[at..at + n].iter();
        let join = |v: usize, b: &u8| v << 8 | usize::from(*b);
        if big_endian { part.fold(0, join) } else { part.rev().fold(0, join) }
    };
    let ifd = number(4, 4);
    (0..number(ifd, 2)).map(|k| ifd + 2 + 12 * k).find(|&at| number(at, 2) == usize::from(tag)).unwrap() + 8
}

#[test]
fn imagej_stack_with_one_page_in_both_byte_orders() {
    let folder = tempfile::tempdir().unwrap();
    let text = "ImageJ=1.53t\nimages=12\nchannels=2\nslices=3\nframes=2\nhyperstack=true\nunit=nm\nspacing=300\n";
    for big_endian in [false, true] {
        let bytes = single_page(12, text, big_endian);
        let path = write(&folder, "stack.tif", &bytes);
        for (channel, time, planes) in [(0, 0, [0, 2, 4]), (1, 0, [1, 3, 5]), (0, 1, [6, 8, 10]), (1, 1, [7, 9, 11])] {
            let (info, got) = tiff_planes::stack(&path, channel, time).unwrap();
            assert_eq!((info.shape, info.channels, info.times), ([5, 3, 3], 2, 2));
            assert_eq!((info.axes.as_str(), info.unit.as_deref()), ("TZCYX", Some("nanometer")));
            assert_eq!(info.spacing, [None, None, Some(300.0)]);
            assert_eq!(got, voxels(&planes), "channel {channel}, time {time}");
        }
        // 47 bytes of 30 a plane are cut off: two planes are incomplete.
        let cut = write(&folder, "cut.tif", &bytes[..bytes.len() - 47]);
        let text = refusal(&cut);
        assert!(
            text.contains("12 planes") && text.contains("only 10 planes are complete and 47 bytes are missing"),
            "{text}"
        );
    }
}

#[test]
fn a_stack_of_more_than_four_gigabytes_is_read_at_its_end() {
    let folder = tempfile::tempdir().unwrap();
    let (edge, planes) = (1024_u32, 2200_u64);
    let text = format!("ImageJ=1.53t\nimages={planes}\nslices={planes}\n");
    let mut bytes = tiff_file(&[gray_page(edge, edge, 16, Vec::new()).with(270, Value::Text(text))], true);
    let start = bytes.len() as u64;
    let at = find_entry(&bytes, 273, true);
    bytes[at..at + 4].copy_from_slice(&(start as u32).to_be_bytes());
    let path = write(&folder, "large.tif", &bytes);
    // The file has holes where nothing is written, so that it takes no room on the disk.
    let file = File::options().write(true).open(&path).unwrap();
    let plane = u64::from(edge * edge * 2);
    file.set_len(start + plane * planes).unwrap();
    file.write_all_at(&[0x12, 0x34], start + plane * planes - 2).unwrap();
    let stack = TiffStack::open(&path, Select::default()).unwrap();
    assert_eq!(stack.shape(), [1024, 1024, 2200]);
    let mut out = vec![7; 1024 * 1024];
    stack.read_plane(2199, SamplesMut::U16(&mut out)).unwrap();
    assert!(out.pop() == Some(0x1234) && out.iter().all(|&v| v == 0));
}

#[test]
fn tifffile_shape_with_one_page_and_with_many() {
    let folder = tempfile::tempdir().unwrap();
    let one = write(&folder, "one.tif", &single_page(6, "{\"shape\": [2, 3, 3, 5], \"axes\": \"CZYX\"}", false));
    assert_eq!(tiff_planes::stack(&one, 1, 0).unwrap().1, voxels(&[3, 4, 5]));
    let unnamed = write(&folder, "unnamed.tif", &single_page(6, "{\"shape\": [2, 3, 3, 5]}", true));
    let (info, got) = tiff_planes::stack(&unnamed, 0, 1).unwrap();
    assert_eq!((info.axes.as_str(), info.times, info.notes.len()), ("TZYX", 2, 1));
    assert_eq!(got, voxels(&[3, 4, 5]));
    let mut pages: Vec<PageBytes> = (0..4).map(|n| page(n, false)).collect();
    pages[0] = page(0, false).with(270, Value::Text("{\"shape\": [4, 3, 5]}".to_string()));
    let many = write(&folder, "many.tif", &tiff_file(&pages, false));
    assert_eq!(tiff_planes::stack(&many, 0, 0).unwrap().1, voxels(&[0, 1, 2, 3]));
}

/// Sizes along x, y, z and the unit that a description gives; pixels are 0.5 micrometres wide, in centimetres.
fn sizes(description: &str) -> ([Option<f64>; 3], Option<String>, Vec<String>) {
    let folder = tempfile::tempdir().unwrap();
    let mut pages: Vec<PageBytes> = (0..4).map(|n| page(n, false)).collect();
    let resolution = || Value::Rational(20_000, 1);
    pages[0] = page(0, false)
        .with(270, Value::Text(description.to_string()))
        .with(282, resolution())
        .with(283, resolution())
        .with(296, Value::Short(vec![3]));
    let info = tiff_planes::stack(&write(&folder, "a.tif", &tiff_file(&pages, false)), 0, 0).unwrap().0;
    // In micrometres, to a billionth: quotients of decimal numbers.
    let factor = if info.unit.as_deref() == Some("centimeter") { 1e4 } else { 1.0 };
    (info.spacing.map(|size| size.map(|size| (size * factor * 1e9).round() / 1e9)), info.unit, info.notes)
}

/// What callers of `tifffile` hand over as metadata, and it writes down as it is.
#[test]
fn sizes_in_the_words_of_ome_are_read_from_tifffile_json() {
    let json = |more: &str| format!("{{\"shape\": [4, 3, 5], \"axes\": \"ZYX\", {more}}}");
    let (spacing, unit, notes) = sizes(&json(
        "\"PhysicalSizeX\": 0.25, \"PhysicalSizeY\": 0.25, \"PhysicalSizeZ\": 2, \"Channel\": {\"Name\": [\"a\"]}",
    ));
    assert_eq!((spacing, unit.as_deref()), ([Some(0.25), Some(0.25), Some(2.0)], Some("micrometer")));
    assert!(notes.is_empty(), "{notes:?}");
    let (spacing, unit, _) = sizes(&json(
        "\"PhysicalSizeX\": 0.25, \"PhysicalSizeY\": \"0.25\", \"PhysicalSizeZ\": 2000, \"PhysicalSizeZUnit\": \"nm\"",
    ));
    assert_eq!((spacing, unit.as_deref()), ([Some(0.25), Some(0.25), Some(2.0)], Some("micrometer")));
}

#[test]
fn a_size_along_z_without_a_unit_does_not_make_needles_of_voxels() {
    for description in [
        "{\"shape\": [4, 3, 5], \"axes\": \"ZYX\", \"spacing\": 1.5}",
        "ImageJ=1.53t\nimages=4\nslices=4\nspacing=1.5\n",
    ] {
        let (spacing, _, notes) = sizes(description);
        assert_eq!(spacing, [Some(0.5), Some(0.5), Some(1.5)], "{description}");
        assert!(notes.iter().any(|note| note.contains("1.5 names no unit")), "{notes:?}");
    }
    for description in [
        "{\"shape\": [4, 3, 5], \"axes\": \"ZYX\", \"spacing\": 0.00015}",
        "{\"shape\": [4, 3, 5], \"axes\": \"ZYX\", \"spacing\": 1.5, \"unit\": \"um\"}",
        "ImageJ=1.53t\nimages=4\nslices=4\nspacing=0.00015\n",
    ] {
        let (spacing, _, notes) = sizes(description);
        assert_eq!(spacing, [Some(0.5), Some(0.5), Some(1.5)], "{description}");
        assert!(notes.is_empty(), "{notes:?}");
    }
}

#[test]
fn imagej_hyperstack_with_pages_selects_channel_and_time() {
    let folder = tempfile::tempdir().unwrap();
    let text = "ImageJ=1.53t\nimages=8\nchannels=2\nslices=2\nframes=2\n";
    let mut pages: Vec<PageBytes> = (0..8).map(|n| page(n, true)).collect();
    pages[0] = page(0, true).with(270, Value::Text(text.to_string()));
    let path = write(&folder, "hyper.tif", &tiff_file(&pages, true));
    assert_eq!(tiff_planes::stack(&path, 1, 1).unwrap().1, voxels(&[5, 7]));
    assert_eq!(tiff_planes::stack(&path, 0, 1).unwrap().1, voxels(&[4, 6]));
    let short = write(&folder, "short.tif", &tiff_file(&pages[..6], true));
    assert!(refusal(&short).contains("promises 8 planes but the file holds 6 pages"));
}

#[test]
fn ome_planes_lie_where_tiff_data_says() {
    let folder = tempfile::tempdir().unwrap();
    // Pages in the order (t, z): 10 11 00 01, named one by one and as a run.
    let text = "<OME xmlns=\"http://www.openmicroscopy.org/Schemas/OME/2016-06\"><Image><Pixels DimensionOrder=\"XYZCT\" \
        SizeX=\"5\" SizeY=\"3\" SizeZ=\"2\" SizeC=\"1\" SizeT=\"2\" PhysicalSizeZ=\"4\">\
        <TiffData IFD=\"0\" FirstT=\"1\"/><TiffData IFD=\"1\" FirstT=\"1\" FirstZ=\"1\" PlaneCount=\"1\"/>\
        <TiffData IFD=\"2\" PlaneCount=\"2\"/></Pixels></Image><Image/></OME>";
    let mut pages: Vec<PageBytes> = (0..4).map(|n| page(n, false)).collect();
    pages[0] = page(0, false).with(270, Value::Text(text.to_string()));
    let path = write(&folder, "a.ome.tif", &tiff_file(&pages, false));
    let (info, first) = tiff_planes::stack(&path, 0, 0).unwrap();
    assert_eq!((info.spacing, info.axes.as_str()), ([None, None, Some(4.0)], "TZYX"));
    assert!(info.notes[0].contains("2 images"), "{:?}", info.notes);
    assert_eq!(first, voxels(&[2, 3]));
    assert_eq!(tiff_planes::stack(&path, 0, 1).unwrap().1, voxels(&[0, 1]));
    let short = write(&folder, "b.ome.tif", &tiff_file(&pages[..3], false));
    assert!(refusal(&short).contains("promises 4 planes but the file holds 3 pages"));
}

#[test]
fn planar_tiles_with_padding_keep_their_samples_apart() {
    let folder = tempfile::tempdir().unwrap();
    // 5 x 3 pixels in tiles of 4 x 2: two across, two down, two samples one after the other.
    let sample = |s: u16| -> Vec<Vec<u8>> {
        let value = |x: u32, y: u32| if x < WIDTH && y < HEIGHT { plane(s)[(y * WIDTH + x) as usize] } else { 9999 };
        let tile = |tx: u32, ty: u32| -> Vec<u16> {
            (0..2).flat_map(|y| (0..4).map(move |x| (x, y))).map(|(x, y)| value(4 * tx + x, 2 * ty + y)).collect()
        };
        [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(tx, ty)| bytes_u16(&tile(tx, ty), false)).to_vec()
    };
    let mut page = gray_page(WIDTH, HEIGHT, 16, Vec::new())
        .with(277, Value::Short(vec![2]))
        .with(258, Value::Short(vec![16, 16]))
        .with(284, Value::Short(vec![2]))
        .with(322, Value::Short(vec![4]))
        .with(323, Value::Short(vec![2]));
    page.tiled = true;
    page.chunks = [sample(1), sample(2)].concat();
    let path = write(&folder, "tiles.tif", &tiff_file(&[page], false));
    for channel in 0..2 {
        let (info, got) = tiff_planes::stack(&path, channel, 0).unwrap();
        assert_eq!((info.channels, info.axes.as_str()), (2, "ZSYX"));
        assert_eq!(got, voxels(&[channel as u16 + 1]));
    }
}

#[test]
fn previews_are_left_out_and_palettes_are_indices() {
    let folder = tempfile::tempdir().unwrap();
    let preview = gray_page(2, 2, 8, vec![1; 4]).with(254, Value::Long(vec![1]));
    let palette = |n| page(n, false).with(262, Value::Short(vec![3]));
    let path = write(&folder, "p.tif", &tiff_file(&[preview.clone(), palette(1), palette(2)], false));
    let (info, got) = tiff_planes::stack(&path, 0, 0).unwrap();
    assert_eq!(got, voxels(&[1, 2]));
    assert!(info.notes.iter().any(|n| n.contains("previews")), "{:?}", info.notes);
    let odd = write(&folder, "odd.tif", &tiff_file(&[palette(1), gray_page(2, 2, 8, vec![1; 4])], false));
    assert!(refusal(&odd).contains("page 2: it is 2 x 2 uint8 where the stack is 5 x 3 uint16"));
}

#[test]
fn resolution_of_plain_files_counts_only_when_it_was_measured() {
    let folder = tempfile::tempdir().unwrap();
    let with = |unit: u16, per_unit: u32| {
        let resolution = Value::Rational(per_unit, 1);
        let page =
            page(1, false).with(282, resolution.clone()).with(283, resolution).with(296, Value::Short(vec![unit]));
        let path = write(&folder, "r.tif", &tiff_file(&[page], false));
        let info = tiff_planes::stack(&path, 0, 0).unwrap().0;
        (info.spacing, info.unit)
    };
    assert_eq!(with(3, 20_000), ([Some(0.5), Some(0.5), None], Some("micrometer".to_string())));
    assert_eq!(with(2, 300), ([None; 3], None));
    assert_eq!(with(1, 20_000), ([None; 3], None));
}

#[test]
fn a_folder_of_slices_is_a_stack_in_the_order_of_numbers() {
    let folder = tempfile::tempdir().unwrap();
    for n in [10, 9, 8] {
        write(
            &folder,
            &format!("slice {n}.{}", if n == 9 { "TIFF" } else { "tif" }),
            &tiff_file(&[page(n, n == 8)], n == 8),
        );
    }
    write(&folder, ".hidden.tif", b"no TIFF");
    write(&folder, "notes.txt", b"no TIFF");
    let (info, got) = tiff_planes::stack(folder.path(), 0, 0).unwrap();
    assert_eq!((info.shape, info.axes.as_str()), ([5, 3, 3], "ZYX"));
    assert_eq!(got, voxels(&[8, 9, 10]));

    let odd = write(&folder, "slice 11.tif", &tiff_file(&[gray_page(5, 3, 8, vec![0; 15])], false));
    let text = tiff_planes::stack(folder.path(), 0, 0).unwrap_err().to_string();
    assert!(text.starts_with(&odd.display().to_string()) && text.contains("5 x 3 uint8"), "{text}");
    write(&folder, "slice 11.tif", &tiff_file(&[page(1, false), page(2, false)], false));
    let text = tiff_planes::stack(folder.path(), 0, 0).unwrap_err().to_string();
    assert!(text.contains("slice 11.tif") && text.contains("2 pages"), "{text}");

    let empty = tempfile::tempdir().unwrap();
    assert!(refusal(empty.path()).contains("no slices"));
}

#[test]
fn many_threads_read_what_one_reads() {
    let folder = tempfile::tempdir().unwrap();
    let pages: Vec<PageBytes> = (0..32).map(|n| page(n, false)).collect();
    let stack = TiffStack::open(&write(&folder, "s.tif", &tiff_file(&pages, false)), Select::default()).unwrap();
    std::thread::scope(|scope| {
        for start in 0..4 {
            let stack = &stack;
            scope.spawn(move || {
                for z in (0..32).map(|z| (z * 5 + start * 7) % 32) {
                    assert_eq!(tiff_planes::plane(stack, z).unwrap(), voxels(&[z as u16]));
                }
            });
        }
    });
}

#[test]
fn a_buffer_of_another_type_or_size_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let stack =
        TiffStack::open(&write(&folder, "s.tif", &tiff_file(&[page(1, true)], true)), Select::default()).unwrap();
    assert!(stack.read_plane(0, SamplesMut::U8(&mut [0; 15])).is_err());
    assert!(stack.read_plane(0, SamplesMut::U16(&mut [0; 14])).is_err());
    assert!(stack.read_plane(1, SamplesMut::U16(&mut [0; 15])).is_err());
    assert!(stack.read_plane(0, SamplesMut::U16(&mut [0; 15])).is_ok());
}
