//! What TIFF files say of their axes, images and spacing where that is wrong, odd or of several images: read to the right
//! values, by `--axes` and `--image-index` where the file cannot tell.

#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::Path;

use strandline::io::stack::tiff::{Select, StackInfo};

use crate::common::ball::Bench;
use crate::common::tiff_bytes::{PageBytes, Value, gray_page, tiff_file};
use crate::common::tiff_planes;

const PLANE: usize = 12;

/// A page of 4 x 3 whose voxels hold its number.
fn page(number: u8) -> PageBytes {
    gray_page(4, 3, 8, vec![number; PLANE])
}

/// Pages numbered from 0, the first with a description and 2 pixels to the unit.
fn write(path: &Path, pages: u8, description: &str) {
    let first = page(0)
        .with(270, Value::Text(description.into()))
        .with(282, Value::Rational(2, 1))
        .with(283, Value::Rational(2, 1))
        .with(296, Value::Short(vec![1]));
    let pages: Vec<PageBytes> = std::iter::once(first).chain((1..pages).map(page)).collect();
    fs::write(path, tiff_file(&pages, false)).unwrap();
}

fn select(axes: &str) -> Select {
    Select { axes: Some(axes.parse().unwrap()), ..Select::default() }
}

/// The numbers of the pages that the planes are, and what the file says of itself.
fn planes(path: &Path, select: Select) -> (StackInfo, Vec<u8>) {
    let (info, voxels) = tiff_planes::selected(path, select).unwrap();
    let plane = (info.shape[0] * info.shape[1]) as usize;
    (info, voxels.chunks(plane).map(|plane| plane[0] as u8).collect())
}

fn ome(pixels: &str) -> String {
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?><OME><Image ID=\"Image:0\" Name=\"first\"><Pixels {pixels}</Pixels></Image></OME>"
    )
}

#[test]
fn axes_say_what_pages_are() {
    let bench = Bench::bare();
    let path = bench.path("a.tif");
    let all: Vec<u8> = (0..6).collect();
    for stored in ["frames=6", "channels=6", "channels=2\nframes=3", "channels=2\nslices=3"] {
        write(&path, 6, &format!("ImageJ=1.53t\nimages=6\n{stored}\nhyperstack=true\nunit=um\n"));
        let (info, found) = planes(&path, select("zyx"));
        assert_eq!((info.shape, info.channels, info.times, found), ([4, 3, 6], 1, 1, all.clone()), "{stored}");
        assert!(info.notes.iter().any(|note| note.contains("--axes")), "{:?}", info.notes);
    }
    // Channels are fastest in ImageJ's files; the letters rename the axes in the order of the file.
    let (info, found) = planes(&path, Select { channel: 2, ..select("czyx") });
    assert_eq!((info.channels, info.shape[2], found), (3, 2, vec![4, 5]));
    let (_, found) = planes(&path, Select { time: 1, ..select("ztyx") });
    assert_eq!(found, [1, 3, 5]);
    let (_, found) = planes(&path, Select { channel: 1, ..select("c2zyx") });
    assert_eq!(found, [3, 4, 5]);
    let refused = tiff_planes::selected(&path, select("c4zyx")).unwrap_err();
    assert!(refused.exit_code() == 2 && refused.to_string().contains("6 planes"), "{refused}");
}

#[test]
fn the_message_names_the_flag() {
    let bench = Bench::bare();
    bench.write("marks.csv", "object,contour,x,y,z\n1,1,0,0,0\n1,1,1,0,0\n1,1,1,1,0\n");
    for (stored, word) in [("frames=31", "times"), ("channels=31", "channels")] {
        write(&bench.path("t.tif"), 31, &format!("ImageJ=1.11a\nimages=31\n{stored}\nhyperstack=true\nunit=um\n"));
        let complaint = bench.fail("segment t.tif --points marks.csv -o none", 2);
        let due = format!("31 planes are stored as {word}; if they are slices, give --axes zyx");
        assert!(complaint.contains("one voxel along z") && complaint.contains(&due), "{complaint}");
        assert!(bench.succeed("info t.tif").contains(&due));
        assert!(bench.succeed("info t.tif --axes zyx").contains("4, 3, 31"));
    }
    write(&bench.path("ct.tif"), 62, "ImageJ=1.11a\nimages=62\nchannels=2\nframes=31\nhyperstack=true\nunit=um\n");
    let complaint = bench.fail("segment ct.tif --points marks.csv -o none", 2);
    let due = "if the times are slices, give --axes zcyx, if the channels are, --axes tzyx, if all are, --axes zyx";
    assert!(complaint.contains("31 times and 2 channels") && complaint.contains(due), "{complaint}");
    assert!(bench.succeed("info ct.tif --axes zcyx").contains("4, 3, 31"));
    let complaint = bench.fail("info t.tif --axes xyz", 2);
    assert!(complaint.contains("zyx, tzyx"), "{complaint}");
    assert!(bench.fail("info marks.csv --axes zyx", 2).contains("no TIFF"));
}

#[test]
fn the_image_of_an_ome_file_is_picked() {
    let bench = Bench::bare();
    let pixels = |n: u32, size: &str, from: u32, count: u32| {
        format!(
            "<Image ID=\"Image:{n}\" Name=\"part {n}\"><Pixels DimensionOrder=\"XYCZT\" {size} SizeC=\"1\" SizeT=\"1\" \
             PhysicalSizeX=\"{}\"><TiffData IFD=\"{from}\" PlaneCount=\"{count}\"/></Pixels></Image>",
            n + 1
        )
    };
    let text = format!(
        "<OME>{}{}</OME>",
        pixels(0, "SizeX=\"2\" SizeY=\"2\" SizeZ=\"1\"", 0, 1),
        pixels(1, "SizeX=\"4\" SizeY=\"3\" SizeZ=\"5\"", 1, 5)
    );
    let first = gray_page(2, 2, 8, vec![99; 4]).with(270, Value::Text(text));
    let pages: Vec<PageBytes> = std::iter::once(first).chain((1..6).map(page)).collect();
    let path = bench.path("two.ome.tif");
    fs::write(&path, tiff_file(&pages, false)).unwrap();
    let (info, found) = planes(&path, Select { image: Some(1), ..Select::default() });
    assert_eq!((info.shape, info.spacing[0], found), ([4, 3, 5], Some(2.0), vec![1, 2, 3, 4, 5]));
    let (info, found) = planes(&path, Select::default());
    assert_eq!((info.shape, info.spacing[0], found), ([2, 2, 1], Some(1.0), vec![99]));
    let note = "the file holds 2 images (0: \"part 0\", 2 x 2 x 1, 1: \"part 1\", 4 x 3 x 5); image 0 is read";
    assert!(info.notes[0].starts_with(note), "{:?}", info.notes);
    let marks = "object,contour,x,y,z\n1,1,0,0,0\n1,1,1,0,0\n1,1,1,1,0\n";
    bench.write("marks.csv", marks);
    let complaint = bench.fail("segment two.ome.tif --points marks.csv -o none", 2);
    assert!(complaint.contains("give --image-index 1"), "{complaint}");
    assert!(bench.succeed("info two.ome.tif --image-index 1").contains("4, 3, 5"));
    assert!(bench.fail("info two.ome.tif --image-index 2", 2).contains("there are 2, counted from 0"));
}

#[test]
fn pages_of_several_sizes_are_images() {
    let bench = Bench::bare();
    let path = bench.path("mixed.tif");
    let small = |n: u8| gray_page(2, 2, 8, vec![n; 4]);
    let preview = gray_page(1, 1, 8, vec![7]).with(254, Value::Long(vec![1]));
    fs::write(&path, tiff_file(&[preview, page(0), small(50), page(1), small(51), page(2)], false)).unwrap();
    for (image, shape, due) in [(0, [4, 3, 3], vec![0, 1, 2]), (1, [2, 2, 2], vec![50, 51]), (2, [1, 1, 1], vec![7])] {
        let (info, found) = planes(&path, Select { image: Some(image), ..Select::default() });
        assert_eq!((info.shape, found), (shape, due));
    }
    let refused = tiff_planes::stack(&path, 0, 0).unwrap_err().to_string();
    assert!(refused.contains("page 3: it is 2 x 2") && refused.contains("--image-index 0, or up to 1"), "{refused}");
    // Series that tifffile wrote one after the other are of one size.
    let series = |n: u8, count: u32| page(n).with(270, Value::Text(format!("{{\"shape\": [{count}, 3, 4]}}")));
    fs::write(&path, tiff_file(&[series(0, 2), page(1), series(2, 3), page(3), page(4)], false)).unwrap();
    assert_eq!(planes(&path, Select::default()).1, [0, 1]);
    assert_eq!(planes(&path, Select { image: Some(1), ..Select::default() }).1, [2, 3, 4]);
    // Pages that were added one by one are slices.
    let alone = |n: u8| page(n).with(270, Value::Text("{\"shape\": [3, 4]}".into()));
    fs::write(&path, tiff_file(&[alone(0), alone(1), alone(2)], false)).unwrap();
    let (info, found) = planes(&path, Select::default());
    assert!(found == [0, 1, 2] && info.notes[0].contains("each of the 3 pages"), "{found:?} {:?}", info.notes);
}

#[test]
fn samples_of_pixels_may_be_slices() {
    let bench = Bench::bare();
    let path = bench.path("rgb.tif");
    let mixed: Vec<u8> = (0..PLANE).flat_map(|_| [5, 6, 7]).collect();
    let rgb = gray_page(4, 3, 8, mixed).with(258, Value::Short(vec![8; 3])).with(277, Value::Short(vec![3]));
    fs::write(&path, tiff_file(&[rgb], false)).unwrap();
    assert_eq!(planes(&path, Select { channel: 1, ..Select::default() }).1, [6]);
    assert_eq!(planes(&path, select("zyx")).1, [5, 6, 7]);
}

#[test]
fn counts_of_planes_and_pages_that_differ_are_told() {
    let bench = Bench::bare();
    let path = bench.path("a.ome.tif");
    let text = |z: u32| {
        ome(&format!(
            "DimensionOrder=\"XYZCT\" SizeX=\"4\" SizeY=\"3\" SizeZ=\"{z}\" SizeC=\"1\" SizeT=\"1\"><TiffData/>"
        ))
    };
    write(&path, 5, &text(7));
    let refused = tiff_planes::stack(&path, 0, 0).unwrap_err().to_string();
    assert!(refused.contains("plane 6") && refused.contains("--axes zyx"), "{refused}");
    assert_eq!(planes(&path, select("zyx")).1, [0, 1, 2, 3, 4]);
    write(&path, 5, &text(3));
    let (info, found) = planes(&path, Select::default());
    assert_eq!(found, [0, 1, 2]);
    assert!(info.notes[0].contains("3 planes but the file holds 5 pages"), "{:?}", info.notes);
    assert_eq!(planes(&path, select("zyx")).1, [0, 1, 2, 3, 4]);
    write(&path, 5, "ImageJ=1.53t\nimages=7\nslices=7\n");
    let refused = tiff_planes::stack(&path, 0, 0).unwrap_err().to_string();
    assert!(refused.contains("7 planes but the file holds 5 pages") && refused.contains("--axes zyx"), "{refused}");
    assert_eq!(planes(&path, select("zyx")).1, [0, 1, 2, 3, 4]);
}

#[test]
fn spacing_is_right_in_any_spelling() {
    let bench = Bench::bare();
    let path = bench.path("a.tif");
    let um = Some("micrometer");
    let imagej = |keys: &str| format!("ImageJ=1.53t\nimages=3\nslices=3\n{keys}\n");
    let sized = |x: &str, z: &str| {
        ome(&format!(
            "DimensionOrder=\"XYZCT\" SizeX=\"4\" SizeY=\"3\" SizeZ=\"3\" SizeC=\"1\" SizeT=\"1\" PhysicalSizeX=\"0.5\" \
             PhysicalSizeXUnit=\"{x}\" PhysicalSizeY=\"0.5\" PhysicalSizeYUnit=\"{x}\" {z}><TiffData/>"
        ))
    };
    for (text, z, unit, note) in [
        (imagej("unit=um\nzunit=nm\nspacing=500.0"), Some(0.5), um, ""),
        (imagej("unit=\\u00B5m\nspacing=-2"), Some(2.0), um, "without its sign"),
        (imagej("unit=\u{b5}m\nspacing=2"), Some(2.0), um, ""),
        (imagej("unit=parsec\nspacing=2"), Some(2.0), None, "\"parsec\" is not known"),
        (imagej("unit=um\nzunit=parsec\nspacing=2"), None, um, "z size is in \"parsec\""),
        (imagej("spacing=2"), Some(2.0), None, ""),
        (sized("\u{c2}\u{b5}m", "PhysicalSizeZ=\"2\" PhysicalSizeZUnit=\"\u{c2}\u{b5}m\""), Some(2.0), um, ""),
        (sized("&#181;m", "PhysicalSizeZ=\"-2\""), Some(2.0), um, "without its sign"),
        (sized("blob", "PhysicalSizeZ=\"2\" PhysicalSizeZUnit=\"blob\""), Some(2.0), None, "\"blob\" is not known"),
        (sized("pixel", "PhysicalSizeZ=\"2\" PhysicalSizeZUnit=\"pixel\""), Some(2.0), None, ""),
        (sized("\u{b5}m", "PhysicalSizeZ=\"2000\" PhysicalSizeZUnit=\"nm\""), Some(2.0), um, ""),
        (sized("\u{b5}m", "PhysicalSizeZ=\"0\""), None, um, "z size of 0"),
        (sized("\u{b5}m", ""), None, um, ""),
        ("{\"shape\": [3, 3, 4], \"axes\": \"ZYX\", \"spacing\": 2, \"unit\": \"um\"}".into(), Some(2.0), um, ""),
    ] {
        write(&path, 3, &text);
        let (info, found) = planes(&path, Select::default());
        assert_eq!((info.spacing[0], info.spacing[1], found), (Some(0.5), Some(0.5), vec![0, 1, 2]), "{text}");
        assert!(
            info.spacing[2].zip(z).map_or(info.spacing[2] == z, |(a, b)| (a - b).abs() < 1e-12),
            "{text}: {info:?}"
        );
        assert_eq!(info.unit.as_deref(), unit, "{text}");
        let told = info.notes.join("; ");
        assert!(told.contains(note) && (!note.is_empty() || told.is_empty()), "{text}: {told}");
    }
}

#[test]
fn pages_that_are_no_planes_of_rows_are_refused() {
    let bench = Bench::bare();
    let path = bench.path("a.tif");
    write(&path, 5, "{\"shape\": [5, 3, 4], \"axes\": \"YXZ\"}");
    let refused = tiff_planes::stack(&path, 0, 0).unwrap_err().to_string();
    assert!(refused.contains("its axes are YXZ") && refused.contains("--axes"), "{refused}");
    assert_eq!(planes(&path, select("zyx")).1, [0, 1, 2, 3, 4]);
}
