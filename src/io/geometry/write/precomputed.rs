//! Meshes as neuroglancer reads them from a folder of files, its format "legacy precomputed", single-resolution meshes: `info`; for
//! each segment a manifest `N:0` that names its parts, here one, `N`: the number of vertices, their positions in nanometres, the
//! corners of triangles, little-endian, 32 bit. What segments are called stands in `segment_properties/info`.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use crate::error::{Error, Result};
use crate::store::HiddenFile;

/// The folder of names below that of the meshes.
const PROPERTIES: &str = "segment_properties";

/// A folder of such meshes, which is there.
#[derive(Clone, Debug)]
pub struct Precomputed {
    folder: PathBuf,
    nanometres: f64,
}

impl Precomputed {
    /// That in a folder, of meshes whose unit has so many metres.
    #[must_use]
    pub fn new(folder: &Path, metres: f64) -> Self {
        Self { folder: folder.to_path_buf(), nanometres: metres * 1e9 }
    }

    /// Writes the mesh of a segment.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub fn segment(&self, number: u64, vertices: &[[f64; 3]], triangles: &[[u32; 3]]) -> Result<()> {
        let manifest = json!({ "fragments": [number.to_string()] }).to_string();
        // Who finds a manifest finds its mesh.
        for (name, bytes) in [
            (number.to_string(), fragment(vertices, triangles, self.nanometres)),
            (format!("{number}:0"), manifest.into_bytes()),
        ] {
            let path = self.folder.join(name);
            std::fs::write(&path, bytes).map_err(|error| unwritable(&error, &path))?;
        }
        Ok(())
    }

    /// Says what the folder holds; `names` are those of segments, where they have any.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub fn describe(&self, names: &[(u64, String)]) -> Result<()> {
        if !names.is_empty() {
            let folder = self.folder.join(PROPERTIES);
            std::fs::create_dir_all(&folder).map_err(|error| unwritable(&error, &folder))?;
            self.put(&format!("{PROPERTIES}/info"), properties(names).to_string().as_bytes())?;
        }
        self.put("info", info(names).to_string().as_bytes())
    }

    /// The file is there whole or not at all.
    fn put(&self, name: &str, bytes: &[u8]) -> Result<()> {
        let path = self.folder.join(name);
        let put = || -> io::Result<()> {
            let (hidden, mut file) = HiddenFile::create(&path, "")?;
            file.write_all(bytes)?;
            hidden.place(true)
        };
        put().map_err(|error| unwritable(&error, &path))
    }
}

/// What a folder of meshes says of itself; `names` are those of segments, where they have any.
#[must_use]
pub fn info(names: &[(u64, String)]) -> Value {
    match names {
        [] => json!({ "@type": "neuroglancer_legacy_mesh" }),
        _ => json!({ "@type": "neuroglancer_legacy_mesh", "segment_properties": PROPERTIES }),
    }
}

/// What segments are called.
#[must_use]
pub fn properties(names: &[(u64, String)]) -> Value {
    let ids: Vec<String> = names.iter().map(|(number, _)| number.to_string()).collect();
    let values: Vec<&str> = names.iter().map(|(_, name)| name.as_str()).collect();
    let label = json!({ "id": "label", "type": "label", "values": values });
    json!({ "@type": "neuroglancer_segment_properties", "inline": { "ids": ids, "properties": [label] } })
}

/// The bytes of a mesh in whose unit a length is so many nanometres.
#[must_use]
pub fn fragment(vertices: &[[f64; 3]], triangles: &[[u32; 3]], nanometres: f64) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(4 + 12 * (vertices.len() + triangles.len()));
    bytes.extend((vertices.len() as u32).to_le_bytes());
    for value in vertices.iter().flatten() {
        bytes.extend(((value * nanometres) as f32).to_le_bytes());
    }
    for corner in triangles.iter().flatten() {
        bytes.extend(corner.to_le_bytes());
    }
    bytes
}

fn unwritable(error: &io::Error, path: &Path) -> Error {
    Error::from_io("the mesh cannot be written", error).at(path)
}
