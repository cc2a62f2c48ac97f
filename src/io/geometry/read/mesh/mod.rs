//! Triangle meshes from files: OBJ, OFF and STL; PLY, which holds clouds too, is beside them in `crate::io::geometry::read::ply`.
//!
//! These readers are our own. The libraries for OBJ and STL read lines of any length into memory, tell no line in
//! their messages, and let through coordinates that are not finite or a count that the file's length belies.

mod corner_cells;
mod ears;
mod flat_polygon;
mod numbers;
pub(crate) mod obj;
pub(crate) mod off;
mod polygon;
pub(crate) mod stl;
mod stl_text;

pub(crate) use numbers::number;
pub(crate) use polygon::Faces;

use super::points::refuse_empty;
use super::source::Source;
use crate::error::{Error, Result};
use crate::grid::{PointCloud, TriangleMesh};
use crate::io::text::{first_binary_byte, quoted};

/// The position in the first three words of a line; what follows (weights, normals, colours) is left aside.
fn position<'a>(mut words: impl Iterator<Item = &'a str>, line: u64) -> Result<[f64; 3]> {
    let mut position = [0.0_f64; 3];
    for (value, name) in position.iter_mut().zip(["x", "y", "z"]) {
        let word = words
            .next()
            .ok_or_else(|| Error::input(format!("line {line} has no {name}; a vertex needs x, y and z")))?;
        *value = number(word)
            .ok_or_else(|| Error::input(format!("line {line}: {name} is {}, which is not a number", quoted(word))))?;
        if !value.is_finite() {
            return Err(Error::input(format!(
                "line {line}: {name} is {}, which is not finite; delete the vertex",
                quoted(word)
            )));
        }
    }
    Ok(position)
}

/// A mesh, or a cloud of the vertices where there are no triangles.
fn mesh_or_cloud(vertices: Vec<[f64; 3]>, triangles: Vec<[u32; 3]>) -> Result<Source> {
    if triangles.is_empty() {
        return refuse_empty(PointCloud { positions: vertices, ..PointCloud::default() }).map(Source::Cloud);
    }
    Ok(Source::Mesh(TriangleMesh::new(vertices, triangles)?))
}

/// The first line of a text that holds more than blanks and a comment; none in what is not text.
fn first_line(head: &[u8]) -> Option<String> {
    if first_binary_byte(head).is_some() {
        return None;
    }
    let text = String::from_utf8_lossy(head);
    let mut lines = text.split('\n').map(|line| line.split('#').next().unwrap_or_default().trim());
    lines.find(|line| !line.is_empty()).map(ToOwned::to_owned)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_keep_the_digits_of_f64() {
        let found = position("0.1 -2e-3 123456789.123456789 7 8".split_whitespace(), 1).unwrap();
        assert_eq!(found, [0.1, -2e-3, 123_456_789.123_456_79]);
    }

    #[test]
    fn the_first_line_with_words() {
        assert_eq!(first_line(b"# a\r\n\n  OFF # b\n8 6\n").as_deref(), Some("OFF"));
        assert_eq!(first_line(b"OFF\n\0"), None);
        assert_eq!(first_line(b"# nothing\n"), None);
    }
}
