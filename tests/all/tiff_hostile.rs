//! Files made to break readers: nothing may panic, hang or take more memory than an honest page needs.
#![allow(clippy::unwrap_used)]

use std::path::Path;
use std::process::Command;

use strandline::io::stack::tiff::{Select, TiffStack};
use strandline::io::stack::volume::Stack;
use strandline::store::PlaneSource;

use crate::common::random::Random;
use crate::common::tiff_bytes::{PageBytes, Value, bytes_u16, gray_page, tiff_file};
use crate::common::{shared_data, shipped, tiff_planes};

/// The variable that tells the test below that it runs under the memory limit.
pub(crate) const LIMITED: &str = "STRANDLINE_TEST_LIMITED";

/// Runs the same test in a process of its own that cannot have more than 1 GiB of address space.
pub(crate) fn rerun_limited(test: &str) {
    let program = std::env::current_exe().unwrap();
    let script = "ulimit -v 1048576 && exec \"$0\" --exact \"$1\" --test-threads=1";
    let output = Command::new("sh").args(["-c", script]).arg(program).arg(test).env(LIMITED, "1").output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success() && text.contains("1 passed"), "{text}{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn files_of_the_decoder_suite_read_as_tifffile_reads_them() {
    if std::env::var_os(LIMITED).is_none() {
        return rerun_limited("tiff_hostile::files_of_the_decoder_suite_read_as_tifffile_reads_them");
    }
    let folder = shipped(SUITE);
    let (small, _) = decoder_suite();
    assert_eq!(small.len(), 120);
    for line in small {
        check_line(&folder, line);
    }
}

#[test]
fn more_files_of_the_decoder_suite_read_as_tifffile_reads_them() {
    let Some(folder) = shared_data("tiff-readers/image-tiff/tests") else { return };
    if std::env::var_os(LIMITED).is_none() {
        return rerun_limited("tiff_hostile::more_files_of_the_decoder_suite_read_as_tifffile_reads_them");
    }
    let (_, large) = decoder_suite();
    assert_eq!(large.len(), 76);
    for line in large {
        check_line(&folder, line);
    }
}

/// Where the small files of the suite lie in the project's test data.
const SUITE: &str = "tiff-decoder-suite";

/// Name, whether it is read or refused, and its sums or a word of the reason.
type Line = [&'static str; 3];

/// The files that the project holds, and the others.
fn decoder_suite() -> (Vec<Line>, Vec<Line>) {
    let lines = include_str!("image_tiff_sums.txt").lines().filter(|line| !line.starts_with('#'));
    let lines = lines.map(|line| line.split(';').collect::<Vec<_>>().try_into().unwrap());
    lines.partition(|line: &Line| shipped(SUITE).join(line[0]).exists())
}

fn check_line(folder: &Path, [name, verdict, detail]: Line) {
    let path = folder.join(name);
    if verdict == "refused" {
        let error = tiff_planes::stack(&path, 0, 0).unwrap_err();
        assert!(error.exit_code() == 2 && error.to_string().contains(detail), "{error}");
    } else {
        let sums: Vec<f64> = detail.split(' ').map(|v| v.parse().unwrap()).collect();
        check_sums(&path, &sums);
    }
}

fn check_sums(path: &Path, sums: &[f64]) {
    for (channel, due) in sums.iter().enumerate() {
        let stack = TiffStack::open(path, Select { channel: channel as u32, ..Select::default() }).unwrap();
        assert_eq!(stack.info().channels as usize, sums.len(), "{}", path.display());
        let got: f64 = tiff_planes::plane(&stack, 0).unwrap().iter().sum();
        assert!((got - due).abs() <= 1e-9 * due.abs(), "{}, channel {channel}: {got} {due}", path.display());
        for z in 1..stack.shape()[2] {
            tiff_planes::plane(&stack, z).unwrap();
        }
    }
}

/// Small valid files of every kind that can be made here.
pub(crate) fn seeds() -> Vec<(String, Vec<u8>)> {
    let values: Vec<u16> = (0..15).map(|n| 300 * n).collect();
    let page = |big| gray_page(5, 3, 16, bytes_u16(&values, big));
    let ome = "<OME xmlns=\"x\" UUID=\"urn:uuid:1\"><Image><Pixels DimensionOrder=\"XYZCT\" SizeX=\"5\" SizeY=\"3\" SizeZ=\"2\" \
        SizeC=\"1\" SizeT=\"1\" PhysicalSizeX=\"1\"><TiffData IFD=\"0\" PlaneCount=\"2\"/></Pixels></Image></OME>";
    let texts = [
        "ImageJ=1.53t\nimages=2\nchannels=1\nslices=2\nunit=um\nspacing=2\n",
        "{\"shape\": [2, 3, 5], \"axes\": \"ZYX\"}",
        ome,
    ];
    let mut seeds = Vec::new();
    for big in [false, true] {
        for text in texts {
            let first = page(big).with(270, Value::Text(text.to_string())).with(282, Value::Rational(5, 2));
            seeds.push((format!("{} {big}", &text[..6]), tiff_file(&[first, page(big)], big)));
        }
        let rgb = gray_page(5, 3, 8, (0..45).collect())
            .with(277, Value::Short(vec![3]))
            .with(258, Value::Short(vec![8, 8, 8]))
            .with(262, Value::Short(vec![2]));
        seeds.push((format!("rgb {big}"), tiff_file(&[rgb], big)));
        let packed = PageBytes { chunks: vec![vec![0xf2, 7, 0xf2, 8]], ..gray_page(10, 3, 8, Vec::new()) };
        seeds.push((format!("packbits {big}"), tiff_file(&[packed.with(259, Value::Short(vec![32773]))], big)));
    }
    seeds
}

/// Reads everything of a file that may be damaged; planes too large for a test are only opened.
fn read_all(path: &Path) -> Result<f64, strandline::error::Error> {
    let stack = TiffStack::open(path, Select::default())?;
    let [width, height, depth] = stack.shape();
    let mut sum = 0.0;
    if width.saturating_mul(height) <= 1 << 22 {
        for z in 0..depth.min(64) {
            sum += tiff_planes::plane(&stack, z)?.iter().sum::<f64>();
        }
    }
    Ok(sum)
}

/// Damages `bytes` in up to four places, and sometimes cuts the file.
fn damage(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for _ in 0..=random.below(4) {
        let at = random.below(bytes.len());
        bytes[at] = match random.below(4) {
            0 => 0,
            1 => 0xff,
            2 => bytes[at] ^ (1 << random.below(8)),
            _ => random.next() as u8,
        };
    }
    if random.below(4) == 0 {
        bytes.truncate(random.below(bytes.len()));
    }
    bytes
}

fn survive(name: &str, bytes: &[u8], rounds: usize, random: &mut Random, folder: &Path) {
    let path = folder.join("damaged.tif");
    for round in 0..rounds {
        let damaged = damage(bytes, random);
        std::fs::write(&path, &damaged).unwrap();
        let outcome = std::panic::catch_unwind(|| read_all(&path));
        let Ok(outcome) = outcome else { panic!("{name}, round {round}: the reader panicked") };
        if let Err(error) = outcome {
            let text = error.to_string();
            assert!(error.exit_code() == 2 && !text.contains('\n'), "{name}, round {round}: {text}");
        }
    }
}

#[test]
fn damaged_files_never_panic() {
    let mut random = Random(0x7469_6666);
    println!("seed {:#x}", random.0);
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in seeds() {
        let path = folder.path().join("whole.tif");
        std::fs::write(&path, &bytes).unwrap();
        assert!(read_all(&path).unwrap() > 0.0, "{name}: the undamaged file is valid");
        survive(&name, &bytes, 1000, &mut random, folder.path());
    }
}

#[test]
fn damaged_compressed_files_never_panic() {
    let (derived, suite) = (shipped("tiff-derived"), shipped(SUITE).join("images"));
    let mut random = Random(0x6c7a_7721);
    println!("seed {:#x}", random.0);
    let folder = tempfile::tempdir().unwrap();
    for path in [
        suite.join("random-fp16-pred3.tiff"),
        suite.join("int16_zstd.tif"),
        suite.join("issue_69_lzw.tiff"),
        suite.join("issue_69_packbits.tiff"),
        suite.join("imagemagick_group4.tiff"),
        suite.join("seq/seq-1c-8b-lzw-hpredict-20f3db0c.tiff"),
        suite.join("seq/seq-1c-64f-deflate-fpredict-afa8560e.tiff"),
        suite.join("seq/seq-1c-8b-tiled-bigtiff-20f3db0c.tiff"),
        derived.join("ome_u16_tiled32_zlib.ome.tif"),
    ] {
        let bytes = std::fs::read(&path).unwrap();
        let rounds = if bytes.len() > 20_000 { 60 } else { 600 };
        survive(&path.display().to_string(), &bytes, rounds, &mut random, folder.path());
    }
}

#[test]
fn absurd_claims_are_refused_without_taking_memory() {
    if std::env::var_os(LIMITED).is_none() {
        return rerun_limited("tiff_hostile::absurd_claims_are_refused_without_taking_memory");
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("absurd.tif");
    let refusal = |page: PageBytes, word: &str| {
        std::fs::write(&path, tiff_file(&[page], false)).unwrap();
        let text = read_all(&path).unwrap_err().to_string();
        assert!(text.contains(word), "{text}");
    };
    let huge = |compression: u16, rows: u32| {
        gray_page(4_000_000_000, 4_000_000_000, 16, vec![0; 64])
            .with(259, Value::Short(vec![compression]))
            .with(278, Value::Long(vec![rows]))
    };
    for compression in [1, 5, 8, 32773, 50000] {
        refusal(huge(compression, 4_000_000_000), "can hold");
        refusal(huge(compression, 1), "can hold");
    }
    let strip = |compression: u16| {
        let page = gray_page(60_000, 60_000, 16, vec![0; 8 << 20]);
        page.with(259, Value::Short(vec![compression]))
    };
    refusal(strip(8), "over the limit of 256 MiB");
    refusal(gray_page(60_000, 60_000, 16, vec![0; 8 << 20]), "can hold");
    let planes = "ImageJ=1\nimages=18446744073709551615\nslices=18446744073709551615\n".to_string();
    refusal(gray_page(5, 3, 8, vec![0; 15]).with(270, Value::Text(planes)), "more planes than the file can hold");
    let tag = format!("<?xml version=\"1.0\"?><OME {}/>", "a=\"\" ".repeat(200_000));
    refusal(gray_page(5, 3, 8, vec![0; 15]).with(270, Value::Text(tag)), "tag of");
    let deep = format!("<OME>{}", "<a>".repeat(2_000_000));
    refusal(gray_page(5, 3, 8, vec![0; 15]).with(270, Value::Text(deep)), "malformed");
    let nested = format!("<OME>{}{}</OME>", "<a>".repeat(900_000), "</a>".repeat(900_000));
    refusal(gray_page(5, 3, 8, vec![0; 15]).with(270, Value::Text(nested)), "describes no image");
}
