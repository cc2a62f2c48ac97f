//! Files that `tifffile` wrote from one crop read back to that crop; real stacks have the known shapes and values.
#![allow(clippy::unwrap_used)]

use std::path::Path;

use strandline::store::ElementType;

use crate::common::{npy, shared_data, shipped, tiff_planes};

/// What a file holds instead of the crop itself, as a function of its value.
type Map = fn(f64) -> f64;

fn same(v: f64) -> f64 {
    v
}

/// Name, channels, times, type handed out, values.
const READABLE: &[(&str, u32, u32, ElementType, Map)] = &[
    ("imagej_f32.tif", 1, 1, ElementType::F32, same),
    ("imagej_u16_be.tif", 1, 1, ElementType::U16, same),
    ("imagej_u8.tif", 1, 1, ElementType::U8, |v| (v / 4.0).floor().min(255.0)),
    ("ome_f32_zlib_pred3.ome.tif", 1, 1, ElementType::F32, same),
    ("ome_f64.ome.tif", 1, 1, ElementType::F64, |v| v / 7.0),
    ("ome_i16.ome.tif", 1, 1, ElementType::F32, |v| v - 500.0),
    ("ome_u16_2ch_contig.ome.tif", 2, 1, ElementType::U16, same),
    ("ome_u16_2ch_planar.ome.tif", 2, 1, ElementType::U16, same),
    ("ome_u16_2ch_zcyx.ome.tif", 2, 1, ElementType::U16, same),
    ("ome_u16_bigtiff_be.ome.tif", 1, 1, ElementType::U16, same),
    ("ome_u16_bigtiff_le.ome.tif", 1, 1, ElementType::U16, same),
    ("ome_u16_bigtiff_tiled_zstd.ome.tif", 1, 1, ElementType::U16, same),
    ("ome_u16_lzw.ome.tif", 1, 1, ElementType::U16, same),
    ("ome_u16_lzw_pred2.ome.tif", 1, 1, ElementType::U16, same),
    ("ome_u16_packbits.ome.tif", 1, 1, ElementType::U16, same),
    ("ome_u16_pyramid_subifd.ome.tif", 1, 1, ElementType::U16, same),
    ("ome_u16_tczyx.ome.tif", 2, 2, ElementType::U16, same),
    ("ome_u16_tiled32_zlib.ome.tif", 1, 1, ElementType::U16, same),
    ("ome_u16_zlib.ome.tif", 1, 1, ElementType::U16, same),
    ("ome_u16_zlib_pred2.ome.tif", 1, 1, ElementType::U16, same),
    ("ome_u16_zstd.ome.tif", 1, 1, ElementType::U16, same),
    ("ome_u32.ome.tif", 1, 1, ElementType::U32, |v| v * 70_000.0),
    ("plain_miniswhite.tif", 1, 1, ElementType::U16, same),
    ("plain_multipage_be_strips7.tif", 1, 1, ElementType::U16, same),
];

/// Name, and a word of the reason for which it is refused.
const REFUSED: &[(&str, &str)] = &[
    ("bad_empty.tif", "empty"),
    ("bad_huge_width.tif", "2147483647 x 40"),
    ("bad_ifd_loop.tif", "loop"),
    ("bad_lzw_corrupt_data.tif", "strip 1 cannot be unpacked (LZW)"),
    ("bad_truncated_8bytes.tif", "page 1 should begin at byte 8"),
    ("bad_truncated_half.tif", "truncated"),
    ("odd_page_sizes.tif", "page 2: it is 20 x 20"),
    ("ome_u16_lzma.ome.tif", "LZMA compression is not supported"),
];

#[test]
fn every_derived_file_reads_to_the_truth() {
    let folder = shipped("tiff-derived");
    let (shape, truth) = npy::read_u16(&folder.join("truth.npy"));
    assert_eq!(shape, [8, 40, 40]);
    let plane = 40 * 40;
    for &(name, channels, times, element, map) in READABLE {
        for channel in 0..channels {
            for time in 0..times {
                let (info, voxels) = tiff_planes::stack(&folder.join(name), channel, time).unwrap();
                assert_eq!((info.shape, info.channels, info.times), ([40, 40, 8], channels, times), "{name}");
                assert_eq!(info.element, element, "{name}");
                // The second channel is the first one upside down in z.
                for (z, got) in voxels.chunks(plane).enumerate() {
                    let z = if channel == 1 { 7 - z } else { z };
                    let due: Vec<f64> = truth[z * plane..][..plane].iter().map(|&v| map(v.into())).collect();
                    assert!(got == due, "{name}, channel {channel}, time {time}, plane {z}");
                }
                check_spacing(name, &info.spacing, info.unit.as_deref());
            }
        }
    }
}

fn check_spacing(name: &str, spacing: &[Option<f64>; 3], unit: Option<&str>) {
    if name.starts_with("plain") {
        assert_eq!((spacing, unit), (&[None; 3], None), "{name}");
    } else {
        assert_eq!((spacing, unit), (&[Some(0.8), Some(0.8), Some(1.744)], Some("micrometer")), "{name}");
    }
}

#[test]
fn broken_files_are_refused_with_their_reason() {
    let folder = shipped("tiff-derived");
    for (name, word) in REFUSED {
        let error = tiff_planes::stack(&folder.join(name), 0, 0).unwrap_err();
        assert_eq!(error.exit_code(), 2, "{name}: {error}");
        let text = error.to_string();
        assert!(text.contains(name) && text.contains(word) && !text.contains('\n'), "{text}");
    }
    let listed = READABLE.iter().map(|row| row.0).chain(REFUSED.iter().map(|row| row.0));
    let listed: std::collections::BTreeSet<String> = listed.map(str::to_string).collect();
    let found = std::fs::read_dir(&folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap());
    assert_eq!(listed, found.filter(|name| Path::new(name).extension().is_some_and(|e| e == "tif")).collect());
}

#[test]
fn absent_channels_and_times_are_usage_errors() {
    let folder = shipped("tiff-derived");
    for (channel, time, word) in [(2, 0, "channel 2"), (0, 2, "time 2")] {
        let error = tiff_planes::stack(&folder.join("ome_u16_tczyx.ome.tif"), channel, time).unwrap_err();
        assert!(error.exit_code() == 2 && error.to_string().contains(word), "{error}");
    }
}

/// File, shape, channels, times, smallest and largest value, sum (by `tifffile`), spacing, unit.
type Row = (&'static str, [i64; 3], u32, u32, [f64; 2], f64, [Option<f64>; 3], Option<&'static str>);

const UM: Option<&str> = Some("micrometer");
const NO: [Option<f64>; 3] = [None; 3];

const SHIPPED: &[Row] = &[
    (
        "stacks/image_3D_calibrated.tif",
        [207, 207, 7],
        1,
        1,
        [0., 247.],
        3_272_682.,
        [Some(558_345_799. / 4_294_967_295.), Some(558_345_799. / 4_294_967_295.), Some(0.52)],
        UM,
    ),
    ("stacks/napari-stress-ExampleTifSequence.tif", [31, 30, 16], 1, 21, [0., 230.], 4_502_535., NO, None),
    (
        "stacks/xyz_16bit__spots.tif",
        [89, 88, 17],
        1,
        1,
        [208., 54004.],
        158_634_001.,
        [Some(1e6 / 10_623_103.), Some(1e6 / 10_623_103.), Some(0.399_999_999_999_999_74)],
        UM,
    ),
];

const SHARED: &[Row] = &[
    ("stacks/arabidopsis-embryo.tif", [109, 112, 106], 1, 1, [0., 255.], 14_852_059., NO, None),
    ("stacks/mouse-8cell-raw.tif", [122, 120, 51], 1, 1, [92., 4171.], 91_881_918., NO, None),
    ("stacks/mouse-8cell-truth-centres.tif", [122, 120, 51], 1, 1, [0., 255.], 67_320., NO, None),
    ("stacks/mouse-8cell-truth-mask.tif", [122, 120, 51], 1, 1, [0., 255.], 4_315_620., NO, None),
    ("stacks/plusTIPs_mini.tif", [128, 128, 22], 2, 1, [0., 45883.], 116_923_983., NO, None),
    (
        "stacks/xyz_8bit__chromosomes.tif",
        [126, 152, 40],
        1,
        1,
        [35., 237.],
        93_054_994.,
        [Some(1e6 / 29_538_460.), Some(1e6 / 29_538_460.), Some(0.149_999_999_999_636_2)],
        UM,
    ),
    (
        "stacks/xyz_nuclear_envelope_drosophila.tif",
        [305, 224, 14],
        1,
        1,
        [1., 251.],
        47_499_664.,
        [Some(1e6 / 4_138_217.), Some(1e6 / 4_138_217.), None],
        UM,
    ),
    ("embryo-like/stack.tif", [512, 512, 58], 1, 1, [0., 255.], 530_828_954., [Some(0.5), Some(0.5), Some(1.0)], UM),
    ("embryo-like/truth.tif", [512, 512, 58], 1, 1, [0., 2.], 4_667_057., [Some(0.5), Some(0.5), Some(1.0)], UM),
];

#[test]
fn real_stacks_have_known_shapes_values_and_spacings() {
    for row in SHIPPED {
        check_stack(&shipped(row.0), row);
    }
}

#[test]
fn more_real_stacks_have_known_shapes_values_and_spacings() {
    for row in SHARED {
        let Some(path) = shared_data(row.0) else { return };
        check_stack(&path, row);
    }
}

fn check_stack(path: &Path, &(name, shape, channels, times, range, sum, spacing, unit): &Row) {
    let mut found = [f64::INFINITY, f64::NEG_INFINITY];
    let mut total = 0.0;
    for (channel, time) in (0..channels).flat_map(|channel| (0..times).map(move |time| (channel, time))) {
        let (info, voxels) = tiff_planes::stack(path, channel, time).unwrap();
        assert_eq!((info.shape, info.channels, info.times), (shape, channels, times), "{name}");
        assert_eq!(info.unit.as_deref(), unit, "{name}");
        for (got, due) in info.spacing.iter().zip(spacing) {
            let close = matches!((got, due), (Some(a), Some(b)) if (a - b).abs() <= 1e-12 * b);
            assert!(close || *got == due, "{name}: {got:?} {due:?}");
        }
        found = voxels.iter().fold(found, |[lo, hi], &v| [lo.min(v), hi.max(v)]);
        total += voxels.iter().sum::<f64>();
    }
    assert_eq!((found, total), (range, sum), "{name}");
}
