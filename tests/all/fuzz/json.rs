//! Damage to JSON documents, such as the metadata of Zarr, that leaves them documents.

use serde_json::{Map, Value, json};

use super::words::NUMBERS;
use crate::common::random::Random;

/// Strings that mean something in metadata.
const STRINGS: &[&str] = &[
    "",
    "0",
    "1",
    "s0",
    "..",
    "../0",
    "/",
    "a/b",
    ".",
    "x",
    "y",
    "z",
    "c",
    "t",
    "X",
    "q",
    "space",
    "time",
    "channel",
    "micrometer",
    "nanometer",
    "um",
    "parsec",
    "0.1",
    "0.3",
    "0.4",
    "0.5",
    "0.6",
    "group",
    "array",
    "bool",
    "uint8",
    "uint16",
    "uint32",
    "uint64",
    "int8",
    "int64",
    "float16",
    "float32",
    "float64",
    "complex64",
    "string",
    "r16",
    "bfloat16",
    "numpy.datetime64",
    "|u1",
    "<u2",
    ">i8",
    "<f2",
    ">f8",
    "|b1",
    "|S4",
    "<U2",
    "|O",
    "<M8[ns]",
    "regular",
    "rectangular",
    "default",
    "v2",
    "C",
    "F",
    "big",
    "little",
    "start",
    "end",
    "NaN",
    "Infinity",
    "-Infinity",
    "0x00",
    "0x7fc00000",
    "AAAA",
    "bytes",
    "gzip",
    "zlib",
    "bz2",
    "zstd",
    "blosc",
    "lz4",
    "blosclz",
    "shuffle",
    "bitshuffle",
    "crc32c",
    "fletcher32",
    "adler32",
    "transpose",
    "sharding_indexed",
    "numcodecs.zlib",
    "numcodecs.bz2",
    "vlen-utf8",
    "packbits",
    "fixedscaleoffset",
    "identity",
    "scale",
    "translation",
    "affine",
    "name",
    "\u{e9}\u{4e00}\n\u{202e}",
];

/// Keys that mean something in metadata.
const KEYS: &[&str] = &[
    "shape",
    "chunks",
    "chunk_shape",
    "chunk_grid",
    "chunk_key_encoding",
    "codecs",
    "index_codecs",
    "index_location",
    "configuration",
    "compressor",
    "filters",
    "dtype",
    "data_type",
    "fill_value",
    "order",
    "separator",
    "dimension_separator",
    "dimension_names",
    "storage_transformers",
    "attributes",
    "consolidated_metadata",
    "must_understand",
    "zarr_format",
    "node_type",
    "ome",
    "multiscales",
    "datasets",
    "path",
    "axes",
    "version",
    "labels",
    "coordinateTransformations",
    "coordinateSystems",
    "plate",
    "well",
    "bioformats2raw.layout",
    "series",
    "omero",
    "image-label",
    "name",
    "id",
    "type",
    "unit",
    "scale",
    "translation",
    "level",
    "cname",
    "shuffle",
    "blocksize",
    "typesize",
    "checksum",
    "endian",
];

/// Codecs, filters and other parts of metadata, whole.
fn part(random: &mut Random) -> Value {
    let number = number(random);
    match random.below(20) {
        0 => json!({"name": "gzip", "configuration": {"level": 1}}),
        1 => json!({"name": "zstd", "configuration": {"level": 1, "checksum": true}}),
        2 => {
            json!({"name": "blosc", "configuration": {"cname": "lz4", "clevel": 1, "shuffle": "shuffle", "typesize": number, "blocksize": 0}})
        }
        3 => json!({"name": "crc32c"}),
        4 => json!({"name": "transpose", "configuration": {"order": [2, 0, 1]}}),
        5 => json!({"name": "transpose", "configuration": {"order": [1, 0, 2, 3]}}),
        6 => json!({"name": "bytes"}),
        7 => json!({"name": "bytes", "configuration": {"endian": "big"}}),
        8 => {
            json!({"name": "sharding_indexed", "configuration": {"chunk_shape": [1, 2, 2], "codecs": [{"name": "bytes", "configuration": {"endian": "little"}}],
            "index_codecs": [{"name": "bytes", "configuration": {"endian": "little"}}], "index_location": "start"}})
        }
        9 => json!({"name": "numcodecs.zlib", "configuration": {"level": 1}}),
        10 => json!({"name": "numcodecs.bz2", "configuration": {"level": 1}}),
        11 => json!({"name": "numcodecs.fletcher32", "configuration": {}}),
        12 => json!({"name": "numcodecs.adler32", "configuration": {"location": "end"}}),
        13 => json!({"id": "zlib", "level": 1}),
        14 => json!({"id": "blosc", "cname": "zstd", "clevel": 1, "shuffle": -1, "blocksize": number}),
        15 => json!({"id": "delta", "dtype": "<u2"}),
        16 => json!({"id": "fletcher32"}),
        17 => json!({"type": "scale", "scale": [1, number, 1]}),
        18 => json!({"type": "translation", "translation": [1, number, 1]}),
        _ => json!({"name": "c", "type": "channel", "unit": "micrometer"}),
    }
}

fn number(random: &mut Random) -> Value {
    let text = NUMBERS[random.below(NUMBERS.len())];
    serde_json::from_str(text).unwrap_or_else(|_| json!(random.below(12)))
}

fn string(random: &mut Random) -> String {
    STRINGS[random.below(STRINGS.len())].to_owned()
}

/// Damages a document in up to four places; none where the bytes are none.
pub(super) fn mutate(bytes: &[u8], random: &mut Random) -> Option<Vec<u8>> {
    if !bytes.trim_ascii_start().starts_with(b"{") {
        return None;
    }
    let mut document: Value = serde_json::from_slice(bytes).ok()?;
    for _ in 0..=random.below(4) {
        if random.below(6) == 0 {
            edit_lists(&mut document, random);
            continue;
        }
        let count = count(&document);
        let graft = at(&mut document, random.below(count)).clone();
        let place = random.below(count);
        edit(at(&mut document, place), graft, random);
    }
    serde_json::to_vec(&document).ok()
}

fn inner(value: &Value) -> Vec<&Value> {
    match value {
        Value::Array(list) => list.iter().collect(),
        Value::Object(map) => map.values().collect(),
        _ => Vec::new(),
    }
}

/// Values in a document, itself among them.
fn count(value: &Value) -> usize {
    1 + inner(value).into_iter().map(count).sum::<usize>()
}

/// The n-th value of a document, in the order of reading.
fn at(value: &mut Value, n: usize) -> &mut Value {
    let Some(mut left) = n.checked_sub(1) else { return value };
    let mut chosen = 0;
    for (k, size) in inner(value).into_iter().map(count).enumerate() {
        chosen = k;
        if left < size {
            break;
        }
        left -= size;
    }
    let next = match value {
        Value::Array(list) => list.get_mut(chosen),
        Value::Object(map) => map.values_mut().nth(chosen),
        _ => None,
    };
    at(next.expect("a value that was counted"), left)
}

fn edit(value: &mut Value, graft: Value, random: &mut Random) {
    match random.below(12) {
        0 => *value = graft,
        1 => *value = part(random),
        2 => {
            *value =
                [Value::Null, json!([]), json!({}), json!(true), json!(""), number(random)][random.below(6)].clone();
        }
        3 => *value = json!([value.take()]),
        _ => match value {
            Value::Array(list) => edit_list(list, graft, random),
            Value::Object(map) => edit_object(map, graft, random),
            Value::String(text) => *text = edited(text, random),
            Value::Number(old) => {
                let near = old.as_i64().map(|n| json!(n.wrapping_add([1, -1, 7, n][random.below(4)])));
                *value = near.filter(|_| random.below(2) == 0).unwrap_or_else(|| number(random));
            }
            _ => *value = if random.below(2) == 0 { number(random) } else { json!(string(random)) },
        },
    }
}

fn edited(text: &str, random: &mut Random) -> String {
    match random.below(4) {
        0 => text.to_owned() + &string(random),
        1 => text.chars().skip(1).collect(),
        _ => string(random),
    }
}

fn edit_list(list: &mut Vec<Value>, graft: Value, random: &mut Random) {
    let n = random.below(list.len() + 1);
    match random.below(7) {
        0 => list.insert(n, graft),
        1 => list.insert(n, part(random)),
        2 if n < list.len() => drop(list.remove(n)),
        3 => list.extend(list.clone()),
        4 => list.reverse(),
        5 => list.truncate(n),
        _ => list.insert(n, number(random)),
    }
}

fn edit_object(map: &mut Map<String, Value>, graft: Value, random: &mut Random) {
    let key = map.keys().nth(random.below(map.len().max(1))).cloned().unwrap_or_default();
    let new = KEYS[random.below(KEYS.len())].to_owned();
    match random.below(4) {
        0 => drop(map.remove(&key)),
        1 => drop(map.insert(new, graft)),
        2 => drop(map.insert(new, part(random))),
        _ => {
            let moved = map.remove(&key).unwrap_or_default();
            map.insert(new, moved);
        }
    }
}

/// The same change to all lists of numbers of one length: shapes, chunks and scales that still fit each other.
fn edit_lists(document: &mut Value, random: &mut Random) {
    let length = 1 + random.below(6);
    let (kind, place, new) = (random.below(4), random.below(length), number(random));
    each_list(document, &mut |list| {
        if list.len() == length && list.iter().all(Value::is_number) {
            match kind {
                0 => list.insert(place, json!(1)),
                1 => list[place] = new.clone(),
                2 => drop(list.remove(place)),
                _ => list.rotate_left(place),
            }
        }
    });
}

fn each_list(value: &mut Value, change: &mut impl FnMut(&mut Vec<Value>)) {
    match value {
        Value::Array(list) => {
            for value in list.iter_mut() {
                each_list(value, change);
            }
            change(list);
        }
        Value::Object(map) => {
            for value in map.values_mut() {
                each_list(value, change);
            }
        }
        _ => {}
    }
}
