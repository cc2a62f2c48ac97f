//! Small whole files of every format to start from.

use std::io::{Cursor, Write};
use std::sync::Arc;

use serde_json::{Value, json};
use strandline::grid::Geometry;
use strandline::io::ome_zarr::{Compression, Content, ImageSpec, OmeVersion, StoreWriter};
use strandline::io::stack::write::formats::{Format as VolumeFormat, VolumeFile, VolumeSpec};
use strandline::store::Element;
use zarrs::array::Array;
use zarrs::filesystem::FilesystemStore;
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

use super::readers::Files;
use crate::common::meshes::{Form, cuboid, sphere};
use crate::common::stores;

pub(super) fn tables() -> Vec<Files> {
    let texts = [
        "x,y,z\n1,2,3\n4,5,6\n7.5,8,9e0\n",
        "x;y;z;object;contour\n1,5;2;3;1;1\n4;5,25;6;1;1\n7;8;9;2;3\n",
        "\"object\"\t\"x\"\t\"y\"\t\"z\"\n1\t1\t2\t3\n2\t4\t5\t6\n",
        "index,axis-0,axis-1,axis-2\n0,3.0,2.0,1.0\n1,4.0,2.0,1.0\n",
        "index,shape-type,vertex-index,axis-0,axis-1,axis-2\n0,polygon,0,3,2,1\n0,polygon,1,3,4,1\n0,polygon,2,3,4,5\n",
        "# a cloud\n1 2 3\n4 5 6 0.1 0.2 0.3\n\n7 8 9\n",
        "3\n1 2 3\n4 5 6\n7 8 9\n",
        "sep=;\nx;y;z\n1;2;3\n4;5;6\n",
        "LABEL,ID,POSITION_X,POSITION_Y,POSITION_Z\nLabel,Id,X,Y,Z\n,,(micron),(micron),(micron)\nID1,1,1.0,2.0,3.0\nID2,2,4.0,5.0,6.0\n",
        "Position\n====================\nPosition X,Position Y,Position Z,Unit\n1,2,3,um\n4,5,6,um\n",
        " ,Area,X,Y,Slice\n1,10,1.5,2.5,3\n2,12,4.5,5.5,4\n",
    ];
    texts.iter().map(|text| vec![("input.csv".to_owned(), text.as_bytes().to_vec())]).collect()
}

pub(super) fn meshes() -> Vec<Files> {
    let shapes = [cuboid([0.0; 3], [1.0, 2.0, 3.0]), sphere([1.0, 0.0, -1.0], 2.0, 4, std::f64::consts::PI)];
    let written = shapes.iter().flat_map(|mesh| Form::ALL.iter().map(|form| form.write(mesh)));
    let rest = [
        &b"ply\nformat ascii 1.0\ncomment c\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
           property uchar red\nproperty list uchar float extra\nelement edge 1\nproperty int vertex1\nproperty int vertex2\n\
           end_header\n0 0 0 1 0\n1 0 0 1 2 1 1\n0 1 0 1 0\n0 1\n"[..],
        b"ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty double y\nproperty double z\n\
          element tristrips 1\nproperty list int int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n5 0 1 2 3 -1\n",
        b"OFF8 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n5 0 1 2 3 4\n",
        b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv .5 .5 0\nf 1 2 3 4 5\nl 1 2\np 1\ng a\nusemtl b\nf 1/2/3 2/3 3//4\n",
    ];
    let all = written.chain(rest.iter().map(|bytes| bytes.to_vec()));
    all.map(|bytes| vec![("input.mesh".to_owned(), bytes)]).collect()
}

pub(super) fn pages() -> Vec<Files> {
    let made = crate::tiff_hostile::seeds();
    made.into_iter().map(|(_, bytes)| vec![("input.tif".to_owned(), bytes)]).collect()
}

/// Folders of three slices each.
pub(super) fn slices() -> Vec<Files> {
    let made = crate::tiff_hostile::seeds();
    let three = |bytes: &Vec<u8>| (8..11).map(|n| (format!("s{n:02}.tif"), bytes.clone())).collect();
    made.iter().map(|(_, bytes)| three(bytes)).collect()
}

/// NRRD volumes, raw and packed, of either byte order, as others write them and as this program does.
pub(super) fn headed() -> Vec<Files> {
    let raw = b"NRRD0005\ntype: short\ndimension: 3\nsizes: 4 3 2\nendian: big\nspacings: 1 1 2\nencoding: raw\n\n";
    let several = b"NRRD0004\n# a\ntype: uchar\ndimension: 4\nsizes: 2 3 2 2\nbyte skip: -1\nk:=v\nencoding: raw\n\n";
    let by_hand = [[&raw[..], &[1; 48]].concat(), [&several[..], &[2; 24]].concat()];
    let files = by_hand.into_iter().chain([Compression::Fast, Compression::None].map(|packed| volume("nrrd", packed)));
    files.map(|bytes| vec![("input.nrrd".to_owned(), bytes)]).collect()
}

/// VTI volumes of points and of cells.
pub(super) fn in_xml() -> Vec<Files> {
    let points = volume("vti", Compression::None);
    let place = |bytes: &[u8], part: &[u8]| bytes.windows(part.len()).position(|there| there == part);
    let end = place(&points, b"<AppendedData").expect("appended data");
    let cells =
        String::from_utf8_lossy(&points[..end]).replace("PointData", "CellData").replace("0 4 0 3 0 2", "0 5 0 4 0 3");
    let short = String::from_utf8_lossy(&points[..end]).replace("UInt64", "UInt32");
    let all = [
        points.clone(),
        [cells.as_bytes(), &points[end..]].concat(),
        [short.as_bytes(), &points[end..], &[0; 8]].concat(),
    ];
    all.map(|bytes| vec![("input.vti".to_owned(), bytes)]).into()
}

/// A volume of 5 x 4 x 3 voxels as this program writes it.
fn volume(ending: &str, compression: Compression) -> Vec<u8> {
    let folder = tempfile::tempdir().expect("room for a file");
    let path = folder.path().join("seed").with_extension(ending);
    let geometry = Geometry { unit: Some("micrometer".into()), ..Geometry::new([5, 4, 3], [0.5, 0.5, 2.0], [1.0; 3]) };
    let spec = VolumeSpec { name: "seed", geometry: &geometry, guessed: [false; 3], element: f32::TYPE, compression };
    let format = VolumeFormat::of(&path).expect("a format");
    let mut file = VolumeFile::create(format, &path, &spec).expect("a file");
    for piece in file.pieces() {
        let bytes = (0..piece.len()).flat_map(|n| (n as f32).to_le_bytes()).collect();
        let packed = file.pack(&piece, bytes).expect("a piece");
        file.append(packed).expect("a piece");
    }
    file.finish(false).expect("a whole file");
    std::fs::read(&path).expect("a file")
}

/// Stores that this program writes, and those of plain chunks by hand, of both versions.
pub(super) fn images() -> Vec<Files> {
    let mut all = vec![written::<u16>(OmeVersion::V05), written::<u8>(OmeVersion::V04), plain_three(), plain_two()];
    all.extend(codecs().iter().enumerate().map(|(n, codecs)| coded(codecs, n)));
    all
}

/// Chains of codecs of an array of 2 x 4 x 6 values in chunks of 2 x 4 x 4.
fn codecs() -> Vec<Value> {
    let bytes = json!({"name": "bytes", "configuration": {"endian": "little"}});
    let gzip = json!({"name": "gzip", "configuration": {"level": 1}});
    let sum = json!({"name": "crc32c"});
    let turned = json!({"name": "transpose", "configuration": {"order": [2, 0, 1]}});
    let blosc = json!({"name": "blosc", "configuration": {"cname": "lz4", "clevel": 1, "shuffle": "shuffle", "typesize": 2, "blocksize": 0}});
    let shards = |inner: Value, index: Value, place: &str, shape: [u32; 3]| {
        json!({"name": "sharding_indexed", "configuration":
            {"chunk_shape": shape, "codecs": inner, "index_codecs": index, "index_location": place}})
    };
    let plain = shards(json!([bytes]), json!([bytes]), "end", [1, 2, 4]);
    let packed = shards(json!([turned, bytes, gzip]), json!([bytes, sum]), "start", [2, 2, 2]);
    let nested = shards(
        json!([shards(json!([bytes]), json!([bytes]), "end", [1, 2, 2])]),
        json!([bytes, sum]),
        "end",
        [2, 2, 2],
    );
    vec![
        json!([bytes, gzip]),
        json!([bytes, blosc]),
        json!([turned, bytes, {"name": "zstd", "configuration": {"level": 1, "checksum": true}}, sum]),
        json!([bytes, {"name": "numcodecs.zlib", "configuration": {"level": 1}}]),
        json!([bytes, {"name": "numcodecs.bz2", "configuration": {"level": 1}}, {"name": "numcodecs.fletcher32", "configuration": {}}]),
        json!([plain]),
        json!([packed]),
        json!([nested]),
        json!([shards(json!([bytes]), json!([bytes]), "end", [1, 2, 2]), gzip]),
        json!([turned, shards(json!([bytes, blosc]), json!([bytes, sum]), "start", [2, 2, 1])]),
    ]
}

/// An image of one level whose array has these codecs, written by `zarrs`.
fn coded(codecs: &Value, number: usize) -> Files {
    let folder = tempfile::tempdir().expect("room for a store");
    let metadata = json!({
        "zarr_format": 3, "node_type": "array", "shape": [2, 4, 6], "data_type": "uint16", "fill_value": number % 2,
        "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": [2, 4, 4]}}, "codecs": codecs,
        "chunk_key_encoding": {"name": "default", "configuration": {"separator": "/"}}, "attributes": {},
    });
    let metadata = serde_json::from_value(metadata).expect("metadata of an array");
    let store = Arc::new(FilesystemStore::new(folder.path()).expect("a store"));
    let array = Array::new_with_metadata(store, "/0", metadata).expect("an array");
    array.store_metadata().expect("metadata");
    let values: Vec<u16> = (0..48).map(|n| n % 5).collect();
    array.store_array_subset(&array.subset_all(), &values).expect("chunks");
    let mut files = stores::contents(folder.path());
    files.push(plain_three().swap_remove(0));
    files
}

fn written<T: Element>(version: OmeVersion) -> Files {
    let folder = tempfile::tempdir().expect("room for a store");
    let path = folder.path().join("seed.zarr");
    let store = StoreWriter::create_as(version, &path, false).expect("a new store");
    let geometry =
        Geometry { shape: [5, 4, 3], spacing: [0.5, 0.5, 2.0], origin: [0.0; 3], unit: Some("micrometer".into()) };
    let (element, content) = (T::TYPE, Content::Grey);
    let spec = ImageSpec { name: "seed", geometry: &geometry, element, content, window: None, extremes: None };
    let image = store.image("", &spec).expect("an image");
    for level in image.levels() {
        for shard in level.shards() {
            let values: Vec<T> = (0..shard.len()).map(|n| T::from_f64((n % 7) as f64)).collect();
            level.write_shard(&shard, &values).expect("a shard");
        }
    }
    store.finish().expect("a whole store");
    stores::contents(&path)
}

fn plain_three() -> Files {
    let group = r#"{"zarr_format": 3, "node_type": "group", "attributes": {"ome": {"version": "0.5", "multiscales": [{"axes": [
        {"name": "z", "type": "space", "unit": "micrometer"}, {"name": "y", "type": "space", "unit": "micrometer"},
        {"name": "x", "type": "space", "unit": "micrometer"}], "datasets": [{"path": "0", "coordinateTransformations":
        [{"type": "scale", "scale": [2.0, 0.5, 0.5]}, {"type": "translation", "translation": [1, 2, 3]}]}]}]}}}"#;
    let array = r#"{"zarr_format": 3, "node_type": "array", "shape": [2, 3, 4], "data_type": "uint16", "chunk_grid": {"name": "regular",
        "configuration": {"chunk_shape": [2, 3, 4]}}, "chunk_key_encoding": {"name": "default", "configuration": {"separator": "/"}},
        "fill_value": 0, "codecs": [{"name": "bytes", "configuration": {"endian": "little"}}], "dimension_names": ["z", "y", "x"]}"#;
    vec![
        ("zarr.json".to_owned(), group.into()),
        ("0/zarr.json".to_owned(), array.into()),
        ("0/c/0/0/0".to_owned(), (0..48).map(|n| u8::from(n % 2 == 0 && n > 9)).collect()),
    ]
}

fn plain_two() -> Files {
    let attributes = r#"{"multiscales": [{"version": "0.4", "axes": [{"name": "t", "type": "time"}, {"name": "c", "type": "channel"},
        {"name": "z", "type": "space"}, {"name": "y", "type": "space"}, {"name": "x", "type": "space", "unit": "micrometer"}],
        "datasets": [{"path": "0", "coordinateTransformations": [{"type": "scale", "scale": [1, 1, 2.0, 0.5, 0.5]}]}],
        "coordinateTransformations": [{"type": "scale", "scale": [1, 1, 1, 1, 1]}]}]}"#;
    let array = r#"{"zarr_format": 2, "shape": [1, 1, 2, 3, 4], "chunks": [1, 1, 1, 3, 4], "dtype": "<i8", "order": "C",
        "compressor": null, "filters": null, "fill_value": 0, "dimension_separator": "/"}"#;
    let chunk = |z: u8| (0..96).map(|n| if n % 8 == 0 { z + 1 } else { 0 }).collect();
    vec![
        (".zgroup".to_owned(), br#"{"zarr_format": 2}"#.to_vec()),
        (".zattrs".to_owned(), attributes.into()),
        ("0/.zarray".to_owned(), array.into()),
        ("0/0/0/0/0/0".to_owned(), chunk(0)),
        ("0/0/0/1/0/0".to_owned(), chunk(1)),
    ]
}

/// ROIs of every type, and sets of them.
pub(super) fn rois() -> Vec<Files> {
    let triangle = [[1.0, 2.0], [9.0, 2.5], [4.0, 8.0]];
    let path = [0.0, 1.0, 1.0, 1.0, 5.0, 1.0, 2.0, 6.0, 3.0, 5.0, 5.0, 3.0, 4.0, 6.0, 2.0, 6.0, 1.0, 5.0, 4.0];
    let mut all: Vec<Vec<u8>> = (0..=10).map(|kind| roi(kind, 0, &triangle)).collect();
    // Turned ellipses and boxes, texts and images.
    all.extend([1, 3, 4, 5].map(|subtype| roi(7, subtype, &[])));
    all.push(composite(&path));
    let set = |range: std::ops::Range<usize>, named: &dyn Fn(usize) -> String| {
        let mut written = ZipWriter::new(Cursor::new(Vec::new()));
        for n in range {
            written.start_file(named(n), SimpleFileOptions::default()).expect("an entry");
            written.write_all(&all[n]).expect("its content");
        }
        written.finish().expect("an archive").into_inner()
    };
    let sets = [
        set(0..all.len(), &|n| format!("{:04}-0100-0088.roi", n + 1)),
        set(0..6, &|n| format!("{}-{n}.roi", ["cell", "nucleus"][n % 2])),
        set(9..12, &|n| format!("folder/{n}.ROI")),
    ];
    all.iter().cloned().chain(sets).map(|bytes| vec![("input.roi".to_owned(), bytes)]).collect()
}

/// A ROI with whole and fractional coordinates and both headers.
fn roi(kind: u8, subtype: i16, points: &[[f32; 2]]) -> Vec<u8> {
    let mut bytes = header(kind, subtype, points.len() as u16);
    for axis in [0, 1] {
        bytes.extend(points.iter().flat_map(|point| (point[axis] as u16).to_be_bytes()));
    }
    for axis in [0, 1] {
        bytes.extend(points.iter().flat_map(|point| point[axis].to_be_bytes()));
    }
    with_second_header(bytes, points.len())
}

fn composite(path: &[f32]) -> Vec<u8> {
    let mut bytes = header(1, 0, 0);
    bytes[36..40].copy_from_slice(&(path.len() as i32).to_be_bytes());
    bytes.extend(path.iter().flat_map(|number| number.to_be_bytes()));
    with_second_header(bytes, 0)
}

fn header(kind: u8, subtype: i16, count: u16) -> Vec<u8> {
    let mut bytes = [&b"Iout\0\xe5"[..], &[kind, 0]].concat();
    bytes.extend([2_i16, 1, 8, 9].iter().flat_map(|v| v.to_be_bytes()));
    bytes.extend(count.to_be_bytes());
    bytes.extend([1.0_f32, 2.0, 5.0, 6.0].iter().flat_map(|v| v.to_be_bytes()));
    bytes.resize(64, 0);
    bytes[48..50].copy_from_slice(&subtype.to_be_bytes());
    bytes[50..52].copy_from_slice(&128_i16.to_be_bytes());
    bytes[52..56].copy_from_slice(&0.5_f32.to_be_bytes());
    bytes[56..60].copy_from_slice(&3_i32.to_be_bytes());
    bytes
}

/// Adds the second header, a name, and a number with a slice for each point.
fn with_second_header(mut bytes: Vec<u8>, points: usize) -> Vec<u8> {
    let at = bytes.len();
    bytes[60..64].copy_from_slice(&(at as i32).to_be_bytes());
    bytes.resize(at + 64, 0);
    let name: Vec<u8> = "cell-3".encode_utf16().flat_map(u16::to_be_bytes).collect();
    let words = [(8, 3), (12, 1), (16, at + 64), (20, name.len() / 2), (48, at + 64 + name.len())];
    for (place, value) in words {
        bytes[at + place..][..4].copy_from_slice(&(value as i32).to_be_bytes());
    }
    bytes[at + 30] = 2;
    bytes.extend(name);
    bytes.extend((0..points as u32).flat_map(|n| ((n + 2) << 8).to_be_bytes()));
    bytes
}
