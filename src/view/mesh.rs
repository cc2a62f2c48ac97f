//! Meshes as neuroglancer reads them, made of files of other formats when they are asked for.

use std::path::Path;

use super::shown::MeshFile;
use crate::error::{Error, Result};
use crate::io::geometry::read::source::Source;
use crate::io::geometry::read::sources::read_source;
use crate::io::geometry::write::precomputed;

/// The least and largest coordinates of a mesh; none where it cannot be read, which is told when it is asked for.
pub(super) fn bounds(mesh: &MeshFile) -> Option<([f64; 3], [f64; 3])> {
    let Ok(Source::Mesh(mesh)) = read_source(&mesh.file) else { return None };
    mesh.bounds()
}

/// The bytes of a mesh file whose unit has so many metres.
///
/// # Errors
/// When it is no mesh, or too large for the format.
pub(super) fn fragment(file: &Path, metres: f64) -> Result<Vec<u8>> {
    let Source::Mesh(mesh) = read_source(file)? else {
        return Err(Error::input("holds points and no triangle").at(file));
    };
    if u32::try_from(mesh.vertices.len()).is_err() {
        return Err(Error::input("has too many vertices for this view").at(file));
    }
    Ok(precomputed::fragment(&mesh.vertices, &mesh.triangles, metres * 1e9))
}
