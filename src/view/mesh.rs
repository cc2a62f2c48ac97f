//! Meshes as neuroglancer reads them: "legacy precomputed", one mesh a fragment. The number of vertices, their positions in
//! nanometres, the corners of triangles; little-endian, 32 bit.

use std::path::Path;

use crate::error::{Error, Result};
use crate::io::geometry::read::source::Source;
use crate::io::geometry::read::sources::read_source;

/// The bytes of a mesh file whose unit has so many metres.
///
/// # Errors
/// When it is no mesh, or too large for the format.
pub(super) fn fragment(file: &Path, metres: f64) -> Result<Vec<u8>> {
    let Source::Mesh(mesh) = read_source(file)? else {
        return Err(Error::input("holds points and no triangle").at(file));
    };
    let count =
        u32::try_from(mesh.vertices.len()).map_err(|_| Error::input("has too many vertices for this view").at(file))?;
    let mut bytes = Vec::with_capacity(4 + 12 * (mesh.vertices.len() + mesh.triangles.len()));
    bytes.extend(count.to_le_bytes());
    for value in mesh.vertices.iter().flatten() {
        bytes.extend(((value * metres * 1e9) as f32).to_le_bytes());
    }
    for corner in mesh.triangles.iter().flatten() {
        bytes.extend(corner.to_le_bytes());
    }
    Ok(bytes)
}
