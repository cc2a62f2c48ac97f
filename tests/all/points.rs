//! Point clouds: the same points in every dialect, real files, and files that nobody should trust.

use std::fs;

use strandline::error::{ErrorKind, Result};
use strandline::grid::PointCloud;

use crate::common::damage::damaged;
use crate::common::random::Random;
use crate::common::read_cloud;
use crate::common::{shared_data, shipped};

fn read_bytes(bytes: &[u8]) -> Result<PointCloud> {
    let folder = tempfile::tempdir().expect("a scratch folder");
    let path = folder.path().join("cloud");
    fs::write(&path, bytes).expect("a scratch file");
    read_cloud(&path)
}

fn read(text: &str) -> PointCloud {
    read_bytes(text.as_bytes()).unwrap_or_else(|error| panic!("{text:?}: {error}"))
}

/// The message for an unusable file, which must name the file and lead to exit code 2.
fn refusal(bytes: &[u8]) -> String {
    let error = read_bytes(bytes).expect_err(&String::from_utf8_lossy(bytes));
    assert_eq!((error.kind(), error.exit_code()), (ErrorKind::Input, 2));
    assert!(error.path().is_some_and(|p| p.ends_with("cloud")));
    let message = error.to_string();
    assert!(message.chars().count() < 400 && !message.contains(['\n', '\0']), "{message}");
    message
}

fn assert_refused(cases: &[(&str, &[&str])]) {
    for (text, reasons) in cases {
        let message = refusal(text.as_bytes());
        for reason in *reasons {
            assert!(message.contains(reason), "{text:?}: {message} lacks {reason:?}");
        }
    }
}

const POINTS: [[f64; 3]; 3] = [[1.0, 2.5, -3.0], [0.1, 0.2, 3e2], [7.0, 8.0, 9.0]];

#[test]
fn every_dialect_gives_the_same_points() {
    for text in [
        "x,y,z\r\n\r\n1,2.5,-3\r\n0.1,0.2,3e2\r\n7,8,9\r\n",
        "1 2.5 -3\n0.1 0.2 3e2\n7 8 9\n",
        "# cloud\n  1  2.5\t-3 \n\n0.1 0.2 300 # inline\n// more\n7 8 9",
        "1,2.5,-3\r\n.1,.2,+300\r\n7,8,9\r\n",
        "1, 2.5, -3\n0.1, 0.2, 300\n7, 8, 9\n",
        "1;2.5;-3\n0.1;0.2;300\n7;8;9",
        "1 2.5 -3 0 0 1\n0.1 0.2 3e2 nan ? 1\n7 8 9 0 0 1\n",
        "x,y,z\n1,2.5,-3\n0.1,0.2,3e2\n7,8,9\n",
        "\u{feff}Z;X;name;Y\n-3;1;\"a;b\";2.5\n300;0.1;;0.2\n9;7;c;8\n",
        "x\ty\tz\n1\t2.5\t-3\n0.1\t0.2\t300\n\n7\t8\t9\n",
        "# by hand\n\"X\",\"Y\",\"Z\"\n1,2.5,-3\n,,\n0.1,0.2,300\n7,8,9",
        "\tx\ty\tz\n0\t1\t2.5\t-3\n1\t0.1\t0.2\t3e2\n2\t7\t8\t9\n",
        "\"a,b\",x,y,z,spot #\n1,1,2.5,-3,#\n2,0.1,0.2,3e2,\n3,7,8,9,#\n",
        "x y z\n1 2.5 -3\n0.1 0.2 3e2\n7 8 9\n",
        "index,axis-0,axis-1,axis-2\n0.0,-3,2.5,1\n1.0,300,0.2,0.1\n2.0,9,8,7\n",
        "# z y x\n-3 2.5 1\n300 0.2 0.1\n9 8 7\n",
        "sep=;\r\nx;y;z\r\n1;2,5;-3\r\n0,1;0,2;300,0\r\n7;8;9\r\n",
        "x,y,z\r1,2.5,-3\r0.1,0.2,3e2\r7,8,9\r",
        "3\n1 2.5 -3 255\n0.1 0.2 3e2 255\n7 8 9 255\n",
        "2\n1 2.5 -3\n0.1 0.2 3e2\n1\n7 8 9\n",
        "4\n0 1 2.5 -3 7\n1 0.1 0.2 3e2 7\n2 7 8 9 7\n3 7 8 9 7\n0 2 1 2\n",
        "1,0 2,5 -3\n0,1 0,2 3e2\n7 8 9\n",
        "x,y,z\n\"1,0\",\"2,5\",-3\n\"0,1\",\"0,2\",3e2\n7,8,9\n",
        "\nPosition\n=====\nPosition X,Position Y,Position Z,Unit,Category,Collection,Time,ID,\n1,2.5,-3,um,Spot,Position,1,0,\n\
         0.1,0.2,3e2,um,Spot,Position,1,1,\n7,8,9,um,Spot,Position,1,2,\n",
        "LABEL,ID,QUALITY,POSITION_X,POSITION_Y,POSITION_Z,FRAME\nLabel,Spot ID,Quality,X,Y,Z,Frame\n\
         ,,(quality),(micron),(micron),(micron),\nID0,0,1,1,2.5,-3,0\nID1,1,1,0.1,0.2,300,0\nID2,2,1,7,8,9,0\n",
        " ,Area,Mean,X,Y,Slice\n1,0,7,1,2.5,-2\n2,0,7,0.1,0.2,301\n3,0,7,7,8,10\n",
        "x (\u{b5}m),y (\u{b5}m),z (\u{b5}m)\n1,2.5,-3\n0.1,0.2,3e2\n7,8,9\n",
        "Points:0,Points:1,Points:2\n1,2.5,-3\n0.1,0.2,3e2\n7,8,9\n",
        "label,centroid-0,centroid-1,centroid-2\n1,-3,2.5,1\n2,300,0.2,0.1\n3,9,8,7\n",
        "# Markups fiducial file version = 4.11\n# columns = id,x,y,z,ow\nF_0,1,2.5,-3,0\nF_1,0.1,0.2,3e2,0\nF_2,7,8,9,0\n",
        "index,axis-0,axis-1,axis-2,axis-3\n0,5,-3,2.5,1\n1,5,300,0.2,0.1\n2,5,9,8,7\n",
        "x;y;z;;\n1;2.5;-3;;\n0.1;0.2;3e2;;\n7;8;9;;;;\n",
    ] {
        let cloud = read(text);
        let points = &cloud.positions[..3];
        assert_eq!(points, POINTS, "{text:?}");
        assert!(cloud.objects.is_empty() && cloud.contours.is_empty());
        // Spreadsheets save the same in UTF-16.
        for is_big in [false, true] {
            let bytes = |unit: u16| if is_big { unit.to_be_bytes() } else { unit.to_le_bytes() };
            let text = format!("\u{feff}{}", text.trim_start_matches('\u{feff}'));
            let encoded: Vec<u8> = text.encode_utf16().flat_map(bytes).collect();
            assert_eq!(read_bytes(&encoded).unwrap(), cloud, "{text:?}");
        }
    }
}

#[test]
fn objects_and_contours_come_along() {
    for text in [
        "object,contour,x,y,z\n1,8,1,2.5,-3\n2,-9,0.1,0.2,300\n4294967295,10,7,8,9\n",
        "x;Y;z;CONTOUR;Object\n1;2.5;-3;8;1.0\n0.1;0.2;300;-9.0; 2\n7;8;9;10;4294967295\n",
        "# object contour x y z\n1 8 1 2.5 -3\n2 -9 0.1 0.2 300\n4294967295 10 7 8 9\n",
    ] {
        let cloud = read(text);
        assert_eq!(cloud.positions, POINTS, "{text:?}");
        assert_eq!(cloud.objects, [1, 2, u32::MAX]);
        assert_eq!(cloud.contours, [8, -9, 10]);
    }
}

#[test]
fn unusable_tables_are_refused_with_line_and_reason() {
    assert_refused(&[
        ("", &["is empty"]),
        ("# nothing but comments\n\n", &["holds no point"]),
        ("x,y,z\n", &["holds no point"]),
        ("x,y\n1,2\n", &["line 1", "'x, y'", "not z"]),
        ("a,b,c\n1,2,3\n", &["line 1", "'a, b, c'", "not x, y, z"]),
        ("x,y,z,x\n1,2,3,4\n", &["line 1", "twice"]),
        ("OFF\n3 1 0\n0 0 0\n", &["line 1", "'off'"]),
        ("1 2\n3 4\n", &["line 1", "2 columns", "x, y and z"]),
        ("5\n1 2 3\n4 5 6\n", &["5 points", "after 2", "cut off"]),
        ("5\n", &["line 1", "1 column;"]),
        ("1 2 3\n4 5 6\n7 8\n", &["line 3", "2 columns where line 1 has 3"]),
        ("x,y,z\n1,2,3\n\n4,5\n", &["line 4", "2 columns where line 1 has 3"]),
        ("x,y,z\n1,2,3,4\n", &["line 2", "4 columns where line 1 has 3"]),
        ("1 2 3\n4 five 6\n", &["line 2", "y is 'five'"]),
        ("x,y,z\n1,,3\n", &["line 2", "y is ''"]),
        ("1 2 3\nnan 5 6\n", &["line 2", "x is 'nan'", "not finite"]),
        ("nan 2 3\n", &["line 1", "x is 'nan'", "not finite"]),
        ("x,y,z\n1,2,3\n1,2,-inf\n", &["line 3", "z is '-inf'", "not finite"]),
        ("1 2 1e999\n", &["line 1", "z is '1e999'", "not finite"]),
        ("1.234,5;2,5;3,5\n", &["line 1", "x is '1.234,5'", "point"]),
        ("x;y;z\n1,5;2;3\n1.5;2;3\n", &["line 3", "x is '1.5'", "line 2", "sign of decimals"]),
        ("x,y,z,object\n1,2,3,0\n", &["line 2", "object is '0'"]),
        ("x,y,z,object\n1,2,3,1\n1,2,3,-4\n", &["line 3", "object is '-4'"]),
        ("x,y,z,object\n1,2,3,1.5\n", &["line 2", "object is '1.5'"]),
        ("x,y,z,object\n1,2,3,4294967296\n", &["line 2", "object is '4294967296'"]),
        ("x,y,z,object\n1,2,3,\n", &["line 2", "object is ''"]),
        ("x,y,z,contour\n1,2,3,a\n", &["line 2", "contour is 'a'"]),
        ("index,axis-0,axis-1,axis-2,axis-3,axis-4\n0,1,2,3,4,5\n", &["line 1", "more than four axes"]),
        ("index,axis-0,axis-1\n0,1,2\n", &["line 1", "two axes", "needs three"]),
        ("axis-0,axis-1,axis-2,axis-3\n0.5,1,2,3\n", &["line 2", "time is '0.5'"]),
        (
            "name,speed x,speed y,speed z\na,1,2,3\n",
            &["line 1", "'name, speed x, speed y, speed z'", "three columns x, y, z"],
        ),
        ("X,Y,Frame\n1,2,3\n", &["line 1", "not z", "slice"]),
        ("Position\n===\nPosition X,Position Y,Unit\n1,2,um\n", &["line 3", "not z"]),
        ("x,y,z\n1,2,3\r4,5,6\n", &["line 2", "carriage return"]),
        ("# a\n\nx,y,z,name\n1,2,3,\"b\n4,5,6,\"c\n", &["line 4", "quote"]),
        ("1 2 3\r4 5 6\n", &["line 1", "carriage return"]),
    ]);
}

#[test]
fn what_is_no_table_is_refused() {
    assert!(refusal(b"II*\0\x08\0\0\0").contains("binary"));
    assert!(refusal(b"\x93NUMPY\x01").contains("binary"));
    assert!(refusal(b"\xff\xfex\0,\0y\0").contains("not z"));
    assert!(refusal(b"PK\x03\x04 and no more").contains("damaged ZIP"));
    assert!(refusal(b"Iout\0\xe3\0\0").contains("cut off"));
    assert!(refusal(&vec![0xe9; 100_000]).contains("line 1"));
    assert!(refusal(&[&b"1 2 3\n"[..], &vec![b'7'; 2_000_000]].concat()).contains("line 2 is longer"));
    assert!(refusal(&[b"# comment\n".repeat(9000), b"1 2 3\n".to_vec()].concat()).contains("64 kB of comments"));
    let folder = tempfile::tempdir().unwrap();
    let error = read_cloud(folder.path()).unwrap_err();
    assert!(error.to_string().contains("is a folder") && error.exit_code() == 2, "{error}");
    let error = read_cloud(&folder.path().join("missing.csv")).unwrap_err();
    assert!(error.to_string().contains("missing.csv") && error.exit_code() == 2, "{error}");
}

/// A PLY file of [`POINTS`] with elements around the vertices and properties around x, y, z.
fn ply(format: &str, scalar: &str) -> Vec<u8> {
    let header = format!(
        "ply\nformat {format} 1.0\ncomment test\nelement camera 2\nproperty list uchar short focus\nproperty uchar kind\n\
         element vertex 3\nproperty uchar red\nproperty {scalar} z\nproperty {scalar} x\nproperty int flags\n\
         property {scalar} y\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
    );
    let number = |value: f64| -> Vec<u8> {
        match (scalar, format) {
            (_, "ascii") => format!("{value} ").into_bytes(),
            ("float", "binary_little_endian") => (value as f32).to_le_bytes().to_vec(),
            ("float", _) => (value as f32).to_be_bytes().to_vec(),
            (_, "binary_little_endian") => value.to_le_bytes().to_vec(),
            _ => value.to_be_bytes().to_vec(),
        }
    };
    let is_text = format == "ascii";
    let fixed = |text: &str, bytes: &[u8]| if is_text { text.as_bytes().to_vec() } else { bytes.to_vec() };
    let mut file = header.into_bytes();
    file.extend(fixed("1 5 9\n0 7\n", &if format.contains("big") { [1, 0, 5, 9, 0, 7] } else { [1, 5, 0, 9, 0, 7] }));
    for [x, y, z] in POINTS {
        let parts = [fixed("255 ", &[255]), number(z), number(x), fixed("-1 ", &[255; 4]), number(y), fixed("\n", &[])];
        file.extend(parts.concat());
    }
    file.extend(fixed("3 0 1 2\n", &[3, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0]));
    file
}

#[test]
fn ply_vertices_of_every_kind() {
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        for (scalar, tolerance) in [("float", 1e-6), ("double", 0.0)] {
            let cloud = read_bytes(&ply(format, scalar)).unwrap_or_else(|error| panic!("{format} {scalar}: {error}"));
            assert_eq!(cloud.len(), 3);
            for (found, expected) in cloud.positions.iter().flatten().zip(POINTS.iter().flatten()) {
                assert!((found - expected).abs() <= tolerance, "{format} {scalar}: {found} {expected}");
            }
        }
    }
}

#[test]
fn ply_vertices_with_lists() {
    let header = "ply\nformat binary_little_endian 1.0\nelement vertex 2\nproperty uchar x\nproperty list uchar char w\n\
                  property uchar y\nproperty char z\nend_header\n";
    let file = [header.as_bytes(), &[1, 2, 99, 99, 2, 253, 4, 0, 5, 6]].concat();
    assert_eq!(read_bytes(&file).unwrap().positions, [[1.0, 2.0, -3.0], [4.0, 5.0, 6.0]]);
    assert!(refusal(&file[..file.len() - 1]).contains("cut off"));
    let text = "ply\nformat ascii 1.0\nelement vertex 1\nproperty int x\nproperty list uchar int w\nproperty int y\n\
                property int z\nend_header\n1 3 9 9 9 2 3";
    assert_eq!(read(text).positions, [[1.0, 2.0, 3.0]]);
}

/// A small binary PLY file with the given elements before `end_header`, followed by 36 bytes.
fn claim(elements: &str) -> Vec<u8> {
    let header = format!("ply\nformat binary_little_endian 1.0\n{elements}end_header\n");
    [header.as_bytes(), &[0; 36]].concat()
}

#[test]
fn ply_files_that_lie_are_refused_at_once() {
    const XYZ: &str = "property float x\nproperty float y\nproperty float z\n";
    assert_eq!(read_bytes(&claim(&format!("element vertex 3\n{XYZ}"))).unwrap().len(), 3);
    for (elements, reason) in [
        (format!("element vertex 1000000000\n{XYZ}"), "1000000000 vertices"),
        (format!("element vertex {}\n{XYZ}", u64::MAX), "cut off"),
        (format!("element vertex 4\n{XYZ}"), "cut off"),
        (format!("element a {}\nproperty list uchar int q\nelement vertex 1\n{XYZ}", u64::MAX), "cut off"),
        (format!("element a 9\nproperty list uchar int q\nelement vertex 3\n{XYZ}"), "cut off"),
        (format!("element a {}\nelement vertex 4\n{XYZ}", u64::MAX), "cut off"),
        (format!("element vertex -3\n{XYZ}"), "line 3"),
        (format!("element vertex 1e3\n{XYZ}"), "line 3"),
        ("element vertex 3\nproperty float x\nproperty float y\n".into(), "no number z"),
        ("element vertex 3\nproperty list uchar float x\nproperty float y\nproperty float z\n".into(), "no number x"),
        ("element vertex 3\nproperty quad x\n".into(), "line 4"),
        (format!("{XYZ}element vertex 3\n"), "line 3"),
        (format!("element vertex 3\n{XYZ}element vertex 3\n"), "again"),
        ("element face 3\nproperty list uchar int vertex_indices\n".into(), "without vertices"),
        (format!("element vertex 0\n{XYZ}"), "holds no point"),
    ] {
        let message = refusal(&claim(&elements));
        assert!(message.contains(reason), "{elements:?}: {message}");
    }
}

#[test]
fn damaged_ply_files_are_refused() {
    assert!(refusal(b"ply\n").contains("end_header"));
    assert!(refusal(&[&b"ply\ncomment "[..], &vec![b'a'; 3_000_000]].concat()).contains("line 2"));
    assert!(refusal(&[b"ply\n".to_vec(), b"comment a\n".repeat(200_000)].concat()).contains("end_header"));
    assert!(refusal(b"ply\nelement vertex 1\nproperty int x\nend_header\n").contains("format"));
    assert!(refusal(b"ply\nformat binary_middle 1.0\nend_header\n").contains("line 2"));
    let head =
        "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
    assert_refused(&[
        (&format!("{head}1 2 3\n4 5 b\n"), &["line 9", "'4 5 b'"]),
        (&format!("{head}1 2 3\n4 5\n6   "), &["line 9", "'4 5'"]),
        (&format!("{head}1 2 3 4\n4 5 6\n"), &["line 8", "'1 2 3 4'"]),
        (&format!("{head}1 2 3\n4 5 nan\n"), &["line 9", "vertex 1", "not finite"]),
        (&format!("{head}1 2 3000000000000\n"), &["ends after 1"]),
    ]);
    let mut file = ply("binary_little_endian", "double");
    let at = file.len() - 13 - 8;
    file[at..at + 8].copy_from_slice(&f64::NAN.to_le_bytes());
    assert!(refusal(&file).contains("vertex 2"));
}

/// Damaged files give points or a refusal: no panic, no point that is not finite, no more points than bytes.
#[test]
fn damaged_bytes_never_panic() {
    let seed = u64::from(std::process::id()) ^ fs::metadata(env!("CARGO_MANIFEST_DIR")).map_or(0, |m| m.len());
    println!("seed {seed}");
    let mut random = Random(seed);
    let mut files: Vec<Vec<u8>> = ["object,contour,x,y,z\n1,8,1,2.5,-3\n2,9,0.1,0.2,300\n", "1 2.5 -3\n0.1 0.2 3e2\n"]
        .map(|text| text.as_bytes().to_vec())
        .to_vec();
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        files.push(ply(format, "float"));
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cloud");
    for _ in 0..3000 {
        let file = damaged(&mut random, &files, b"\n\r\t ,;0123456789#\"\xff\0");
        fs::write(&path, &file).unwrap();
        match read_cloud(&path) {
            Ok(cloud) => {
                assert!(!cloud.is_empty() && cloud.len() <= file.len());
                assert!(cloud.positions.iter().flatten().all(|x| x.is_finite()));
                assert!(cloud.objects.is_empty() || cloud.objects.len() == cloud.len());
            }
            Err(error) => assert_eq!(error.kind(), ErrorKind::Input, "{error}"),
        }
    }
}

#[test]
fn real_files_have_their_points() {
    for (name, count) in [
        ("points/pilot-whale-cranium-5k.xyz", 5000),
        ("meshes/pilot-whale-cranium-10k.ply", 5000),
        ("meshes/gastruloid.ply", 3324),
    ] {
        assert_eq!(read_cloud(&shipped(name)).unwrap().len(), count, "{name}");
    }
}

#[test]
fn more_real_files_have_their_points() {
    for (name, count) in [
        ("points/kitten.xyz", 5210),
        ("points/whale-cranium-vertices.xyz", 50_000),
        ("meshes/pilot-whale-cranium.ply", 50_000),
    ] {
        let Some(path) = shared_data(name) else { return };
        assert_eq!(read_cloud(&path).unwrap().len(), count, "{name}");
    }
    let Some(marks) = shared_data("embryo-like/marks.csv").map(|path| read_cloud(&path).unwrap()) else { return };
    assert_eq!((marks.positions[0], marks.objects[0], marks.contours[0]), ([159.338, 128.562, 8.0], 1, 8));
    assert_eq!((marks.objects.len(), marks.contours.len()), (3680, 3680));
    assert_eq!(marks.objects.iter().max(), Some(&2));
}

#[test]
fn the_whale_is_the_same_in_text_and_ply() {
    let [text, binary] = ["points/pilot-whale-cranium-5k.xyz", "meshes/pilot-whale-cranium-10k.ply"]
        .map(|name| read_cloud(&shipped(name)).unwrap());
    assert_eq!(text.len(), binary.len());
    for (a, b) in text.positions.iter().flatten().zip(binary.positions.iter().flatten()) {
        assert!((a - b).abs() < 1e-6);
    }
}
