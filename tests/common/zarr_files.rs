//! Zarr arrays and OME-Zarr groups written byte by byte, as small stores of a known content.
#![allow(clippy::unwrap_used)]

use std::fs;
use std::io::Write;
use std::path::Path;

use serde_json::{Value, json};

/// Writes a JSON document, and the folders it lies in.
pub(crate) fn document(path: &Path, value: &Value) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, value.to_string()).unwrap();
}

/// Writes an array of version 3 with one chunk, gzip-packed, of a type and its little-endian bytes.
pub(crate) fn gzip_array(folder: &Path, shape: &[i64], data_type: &str, bytes: &[u8]) {
    document(
        &folder.join("zarr.json"),
        &json!({
            "zarr_format": 3, "node_type": "array", "shape": shape, "data_type": data_type, "fill_value": 0,
            "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": shape}},
            "chunk_key_encoding": {"name": "default", "configuration": {"separator": "/"}}, "attributes": {},
            "codecs": [
                {"name": "bytes", "configuration": {"endian": "little"}},
                {"name": "gzip", "configuration": {"level": 1}}
            ],
        }),
    );
    let key = shape.iter().fold("c".to_owned(), |key, _| key + "/0");
    let path = folder.join(key);
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    packed.write_all(bytes).unwrap();
    fs::write(path, packed.finish().unwrap()).unwrap();
}

/// Writes an array of version 2, not compressed, in chunks `[z][y][x]` that need not divide its shape.
pub(crate) fn plain_array_v2(folder: &Path, shape: [usize; 3], chunks: [usize; 3], values: &[u16], order: &str) {
    document(
        &folder.join(".zarray"),
        &json!({
            "zarr_format": 2, "shape": shape, "chunks": chunks, "dtype": ">u2", "compressor": null, "fill_value": 7,
            "filters": null, "order": order, "dimension_separator": ".",
        }),
    );
    let counts: [usize; 3] = std::array::from_fn(|a| shape[a].div_ceil(chunks[a]));
    for place in places(counts) {
        let mut bytes = Vec::new();
        // The first index runs fastest in order F.
        let extents = if order == "F" { [chunks[2], chunks[1], chunks[0]] } else { chunks };
        for inside in places(extents) {
            let inside = if order == "F" { [inside[2], inside[1], inside[0]] } else { inside };
            let at: [usize; 3] = std::array::from_fn(|a| place[a] * chunks[a] + inside[a]);
            let holds = (0..3).all(|a| at[a] < shape[a]);
            let value = if holds { values[(at[0] * shape[1] + at[1]) * shape[2] + at[2]] } else { 0 };
            bytes.extend(value.to_be_bytes());
        }
        // What holds the fill value alone is not stored.
        if bytes.chunks(2).any(|word| word != [0, 7]) {
            fs::write(folder.join(format!("{}.{}.{}", place[0], place[1], place[2])), bytes).unwrap();
        }
    }
}

fn places(counts: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    let [a, b, c] = counts;
    (0..a).flat_map(move |i| (0..b).flat_map(move |j| (0..c).map(move |k| [i, j, k])))
}

/// Axes of OME-Zarr by their letters, lengths in micrometres.
pub(crate) fn axes(letters: &str) -> Value {
    let axis = |letter: char| match letter {
        't' => json!({"name": "t", "type": "time"}),
        'c' => json!({"name": "c", "type": "channel"}),
        other => json!({"name": other.to_string(), "type": "space", "unit": "micrometer"}),
    };
    letters.chars().map(axis).collect()
}

/// A scale as OME-Zarr writes it.
pub(crate) fn scale(numbers: &[f64]) -> Value {
    json!([{"type": "scale", "scale": numbers}])
}

/// Writes the group of an image with one level, `0`: OME-Zarr 0.5 for version 3, 0.4 for version 2.
pub(crate) fn group(folder: &Path, version: u32, letters: &str, own: &Value, common: &Value) {
    let multiscale = json!({
        "axes": axes(letters), "datasets": [{"path": "0", "coordinateTransformations": own}],
        "coordinateTransformations": common
    });
    if version == 2 {
        document(&folder.join(".zgroup"), &json!({"zarr_format": 2}));
        document(&folder.join(".zattrs"), &json!({"multiscales": [multiscale]}));
        return;
    }
    let ome = json!({"version": "0.5", "multiscales": [multiscale]});
    let node = json!({"zarr_format": 3, "node_type": "group", "attributes": {"ome": ome}});
    document(&folder.join("zarr.json"), &node);
}
