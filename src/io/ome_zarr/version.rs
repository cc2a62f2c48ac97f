//! The two versions of OME-Zarr that are written, and the documents in which each keeps what it says.
//!
//! OME-Zarr 0.5 is Zarr 3: one `zarr.json` for a group or an array, OME attributes under `ome`. OME-Zarr 0.4 is Zarr 2:
//! `.zgroup` or `.zarray`, and the attributes beside it in `.zattrs`, each with a version of its own. Everything is described
//! once, as 0.5 has it (`super::metadata`); here that becomes the documents of 0.4.

use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

use super::files::write_json;
use crate::error::{Error, Result};

/// A version of OME-Zarr.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum OmeVersion {
    /// Zarr 2, a file for each chunk: what every reader knows.
    V04,
    /// Zarr 3, chunks together in shards.
    #[default]
    V05,
}

impl OmeVersion {
    /// Its number.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::V04 => "0.4",
            Self::V05 => "0.5",
        }
    }

    /// Whether a folder says that it is a group of this version.
    pub(super) fn is_group(self, folder: &Path) -> bool {
        folder.join(if self == Self::V04 { ".zgroup" } else { "zarr.json" }).exists()
    }

    /// Writes the document of a group or an array, given as that of Zarr 3, into its folder.
    pub(super) fn write(self, folder: &Path, document: &Value) -> Result<()> {
        if self == Self::V05 {
            return write_json(&folder.join("zarr.json"), document);
        }
        let attributes = attributes(&document["attributes"]);
        if attributes.as_object().is_some_and(|attributes| !attributes.is_empty()) {
            write_json(&folder.join(".zattrs"), &attributes)?;
        }
        if document["node_type"] == "group" {
            // It never says anything else.
            if self.is_group(folder) {
                return Ok(());
            }
            return write_json(&folder.join(".zgroup"), &json!({ "zarr_format": 2 }));
        }
        write_json(&folder.join(".zarray"), &array(document)?)
    }
}

/// Attributes as 0.4 has them: those of `ome` stand beside the others, and name their version themselves.
fn attributes(told: &Value) -> Value {
    let mut all = told.as_object().cloned().unwrap_or_default();
    let Some(Value::Object(mut ome)) = all.remove("ome") else { return all.into() };
    ome.remove("version");
    for described in ome.get_mut("multiscales").and_then(Value::as_array_mut).into_iter().flatten() {
        described["version"] = OmeVersion::V04.name().into();
    }
    for key in ["omero", "image-label"] {
        if let Some(described) = ome.get_mut(key) {
            described["version"] = OmeVersion::V04.name().into();
        }
    }
    all.extend(ome);
    all.into()
}

/// The `.zarray` of an array.
fn array(document: &Value) -> Result<Value> {
    let packing = document["codecs"][0]["configuration"]["codecs"].as_array().into_iter().flatten();
    let compressor = packing.skip(1).map(compressor).next().transpose()?;
    Ok(json!({
        "zarr_format": 2,
        "shape": document["shape"],
        "chunks": document["chunk_grid"]["configuration"]["chunk_shape"],
        "dtype": type_name(document["data_type"].as_str().unwrap_or_default())?,
        "compressor": compressor,
        "fill_value": document["fill_value"],
        "order": "C",
        "filters": null,
        "dimension_separator": "/"
    }))
}

/// Types by the names of Zarr 3, and as numpy writes them, little-endian.
const TYPES: [(&str, &str); 9] = [
    ("uint8", "|u1"),
    ("uint16", "<u2"),
    ("uint32", "<u4"),
    ("int8", "|i1"),
    ("int16", "<i2"),
    ("int32", "<i4"),
    ("float16", "<f2"),
    ("float32", "<f4"),
    ("float64", "<f8"),
];

fn type_name(name: &str) -> Result<&'static str> {
    let found = TYPES.iter().find(|(told, _)| *told == name).map(|(_, found)| *found);
    found.ok_or_else(|| Error::failed(format!("there are no arrays of {name} in Zarr 2")))
}

/// What Zarr 3 calls a type that Zarr 2 names.
pub(super) fn named_type(name: &str) -> Option<&'static str> {
    TYPES.iter().find(|(_, told)| *told == name).map(|(found, _)| *found)
}

/// A codec as `numcodecs` names it.
fn compressor(codec: &Value) -> Result<Value> {
    let Some(Value::Object(told)) = codec.get("configuration").filter(|_| codec["name"] == "blosc") else {
        return Err(Error::failed(format!("chunks packed by {} are not written in Zarr 2", codec["name"])));
    };
    let shuffle = i32::from(told["shuffle"] != "noshuffle");
    let told = |key: &str| told.get(key).cloned().unwrap_or_default();
    Ok(Value::Object(Map::from_iter([
        ("id".into(), "blosc".into()),
        ("cname".into(), told("cname")),
        ("clevel".into(), told("clevel")),
        ("shuffle".into(), shuffle.into()),
        ("blocksize".into(), told("blocksize")),
    ])))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn attributes_of_the_older_version_name_it_themselves() {
        let told =
            json!({ "ome": { "version": "0.5", "multiscales": [{ "name": "a" }], "omero": {} }, "strandline": 1 });
        let expected = json!({ "multiscales": [{ "name": "a", "version": "0.4" }], "omero": { "version": "0.4" }, "strandline": 1 });
        assert_eq!(attributes(&told), expected);
        assert_eq!(attributes(&json!({})), json!({}));
    }
}
