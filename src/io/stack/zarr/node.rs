//! The metadata documents of a Zarr hierarchy: `zarr.json` of version 3; `.zgroup`, `.zarray` and `.zattrs` of version 2.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use serde_json::Value;

use crate::error::{Error, Result};

/// The most bytes of a document that are read; those of large plates have some megabytes.
const LONGEST: u64 = 64 << 20;

/// A group or an array.
#[derive(Clone, Debug, Default)]
pub(crate) struct Node {
    /// 2 or 3.
    pub(crate) format: u8,
    pub(crate) attributes: Value,
    /// The document of an array.
    pub(crate) array: Option<Value>,
}

impl Node {
    /// Reads the node in a folder; none where there is none.
    pub(crate) fn read(folder: &Path) -> Result<Option<Self>> {
        if let Some(mut document) = document(&folder.join("zarr.json"))? {
            let attributes = document["attributes"].take();
            let array = (document["node_type"] == "array").then_some(document);
            return Ok(Some(Self { format: 3, attributes, array }));
        }
        let array = document(&folder.join(".zarray"))?;
        let attributes = document(&folder.join(".zattrs"))?;
        if array.is_none() && attributes.is_none() && !folder.join(".zgroup").is_file() {
            return Ok(None);
        }
        Ok(Some(Self { format: 2, attributes: attributes.unwrap_or_default(), array }))
    }

    /// The attributes of OME-Zarr: below `ome` since version 0.5, among all others before.
    pub(crate) fn ome(&self) -> &Value {
        if self.attributes["ome"].is_object() { &self.attributes["ome"] } else { &self.attributes }
    }
}

/// A document, where there is one.
fn document(path: &Path) -> Result<Option<Value>> {
    if !path.is_file() {
        return Ok(None);
    }
    let unreadable = |e: std::io::Error| Error::input(format!("cannot be read: {e}")).caused_by(e).at(path);
    let mut text = Vec::new();
    File::open(path).map_err(unreadable)?.take(LONGEST + 1).read_to_end(&mut text).map_err(unreadable)?;
    if text.len() as u64 > LONGEST {
        return Err(Error::input("has more than 64 MiB, which is no metadata of an image").at(path));
    }
    // Editors of Windows put a byte order mark first.
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&text);
    let parsed = serde_json::from_slice(text).or_else(|e| serde_json::from_slice(&without_nan(text)).map_err(|_| e));
    let value: Value = parsed.map_err(|e| Error::input(format!("is no JSON: {e}")).caused_by(e).at(path))?;
    if value.is_object() { Ok(Some(value)) } else { Err(Error::input("is no JSON object").at(path)) }
}

/// The text with null in place of NaN and Infinity, which JSON does not know and Python writes all the same, such as for
/// the contrast of an empty channel.
fn without_nan(text: &[u8]) -> Vec<u8> {
    const WORDS: [&[u8]; 3] = [b"-Infinity", b"Infinity", b"NaN"];
    let (mut out, mut in_string, mut rest) = (Vec::with_capacity(text.len()), false, text);
    while let [first, after @ ..] = rest {
        let word = WORDS.iter().find(|word| !in_string && rest.starts_with(word));
        let taken = match (word, first) {
            (Some(word), _) => {
                out.extend_from_slice(b"null");
                word.len()
            }
            (None, b'\\') if in_string && !after.is_empty() => {
                out.extend_from_slice(&rest[..2]);
                2
            }
            (None, _) => {
                in_string ^= *first == b'"';
                out.push(*first);
                1
            }
        };
        rest = &rest[taken..];
    }
    out
}

/// Names of the nodes right below a folder, sorted.
pub(crate) fn children(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut names: Vec<String> = entries
        .filter(|entry| ["zarr.json", ".zarray", ".zgroup"].iter().any(|name| entry.path().join(name).is_file()))
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_python_that_json_has_not() {
        let text = br#"{"a": [NaN, -Infinity, 1.5], "NaN \" Infinity": {"b": Infinity}}"#;
        let value: Value = serde_json::from_slice(&without_nan(text)).unwrap();
        assert_eq!(value, serde_json::json!({"a": [null, null, 1.5], "NaN \" Infinity": {"b": null}}));
        assert_eq!(without_nan(b"\"open \\"), b"\"open \\");
    }
}
