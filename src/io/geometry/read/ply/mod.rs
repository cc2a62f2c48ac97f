//! PLY (Turk 1994), text or binary in either byte order: vertices, and the faces where there are any.
//!
//! Elements other than `vertex`, `face` and `tristrips`, and their other properties, are passed over. Faces have a list
//! `vertex_indices` or `vertex_index`; polygons are cut into triangles. Strips, as the scans of the Stanford repository have
//! them, are lists of vertices of which every three in a row are a triangle; -1 ends one.

mod body;
mod faces;
mod header;
pub(crate) mod triangles;
mod vertices;

use super::input::Input;
use super::mesh::Faces;
use super::points::refuse_empty;
use super::source::Source;
use crate::error::{Error, Result};
use crate::grid::{PointCloud, TriangleMesh};
use body::Body;
use header::{Element, Header};

/// True for what starts like a PLY file.
pub(crate) fn is_ply(head: &[u8]) -> bool {
    let line = head.split(|&byte| byte == b'\n' || byte == b'\r').next().unwrap_or_default();
    line.starts_with(b"ply") && line[3..].trim_ascii().is_empty() && head.len() > line.len()
}

/// Reads the vertices alone, perhaps none.
pub(crate) fn read_vertices(input: &mut Input) -> Result<PointCloud> {
    let header = Header::read(&mut input.reader)?;
    let vertex = vertex_of(&header)?;
    refuse_overlong(&header, vertex, input.length)?;
    let mut body = Body::after(&header, &mut input.reader);
    header.elements[..vertex].iter().try_for_each(|e| body.skip(e))?;
    let positions = vertices::read(&mut body, &header.elements[vertex], input.length.is_some(), &mut input.notes)?;
    Ok(PointCloud { positions, ..PointCloud::default() })
}

/// Reads a mesh where the file has faces, else a cloud of its vertices.
pub(crate) fn read(input: &mut Input) -> Result<Source> {
    let header = Header::read(&mut input.reader)?;
    let vertex = vertex_of(&header)?;
    let is_face = |e: &Element| ["face", "tristrips"].contains(&e.name.as_str()) && e.count > 0;
    let last = header.elements.iter().rposition(is_face).map_or(vertex, |face| face.max(vertex));
    refuse_overlong(&header, last, input.length)?;
    let vertex_count = header.elements[vertex].count;
    let mut body = Body::after(&header, &mut input.reader);
    let (mut vertices, mut found) = (Vec::new(), Faces::new(vertex_count));
    for (place, element) in header.elements[..=last].iter().enumerate() {
        if place == vertex {
            vertices = vertices::read(&mut body, element, input.length.is_some(), &mut input.notes)?;
        } else if is_face(element) {
            faces::read(&mut body, element, &mut found)?;
        } else {
            body.skip(element)?;
        }
    }
    if last + 1 == header.elements.len() {
        input.note_rest("the elements that it declares")?;
    }
    let triangles = found.finish(&vertices, &mut input.notes);
    if !triangles.is_empty() {
        return Ok(Source::Mesh(TriangleMesh::new(vertices, triangles)?));
    }
    refuse_empty(PointCloud { positions: vertices, ..PointCloud::default() }).map(Source::Cloud)
}

fn vertex_of(header: &Header) -> Result<usize> {
    header
        .elements
        .iter()
        .position(|e| e.name == "vertex")
        .ok_or_else(|| Error::input("is a PLY file without vertices; give one with an element 'vertex'"))
}

/// Refuses a header that declares more, up to and with the element `last`, than the file can hold, before any memory
/// is taken for it.
fn refuse_overlong(header: &Header, last: usize, length: Option<u64>) -> Result<()> {
    let Some(length) = length else { return Ok(()) };
    // The last number of a text file needs no line end.
    let rest = length.saturating_sub(header.bytes).saturating_add(1);
    let mut needed = 0_u64;
    for element in &header.elements[..=last] {
        needed = needed.saturating_add(element.count.saturating_mul(element.least_bytes(header.encoding)));
        if needed > rest {
            return Err(Error::input(format!(
                "declares {} but has {} bytes after its header, too few for them; the file is cut off or damaged",
                Header::declared(element),
                rest - 1
            )));
        }
    }
    Ok(())
}
