//! OBJ (Wavefront, Advanced Visualizer manual, appendix B): vertices `v x y z`, polygons `f`, text.
//!
//! A corner is `v`, `v/vt`, `v//vn` or `v/vt/vn`; vertices count from 1, or from -1 backwards to those already read.
//! Everything else (normals, textures, groups, lines, points, materials) is left aside, and so are faces of one or two
//! corners, with a note. Coordinates are f64.

use std::io::BufRead;

use super::{Faces, first_line, mesh_or_cloud, position};
use crate::error::{Error, Result};
use crate::grid::refuse_too_many;
use crate::io::geometry::read::input::Input;
use crate::io::geometry::read::source::Source;
use crate::io::text::{LONGEST_LINE, Lines, quoted};

/// The words that the first line of an OBJ file may start with.
const KEYWORDS: [&str; 12] = ["v", "vn", "vt", "vp", "f", "l", "p", "o", "g", "s", "mtllib", "usemtl"];

/// True for what starts like an OBJ file.
pub(crate) fn is_obj(head: &[u8]) -> bool {
    let Some(line) = first_line(head) else { return false };
    let words: Vec<&str> = line.split_whitespace().collect();
    // A table may call a column `s` or `v`; it then names x, y and z beside it.
    let is_table = ["x", "y", "z"].iter().all(|name| words.iter().any(|word| word.eq_ignore_ascii_case(name)));
    words.first().is_some_and(|first| KEYWORDS.contains(first)) && !is_table
}

/// Reads a mesh, or a cloud where the file has no faces.
pub(crate) fn read(input: &mut Input) -> Result<Source> {
    let mut lines = Lines::after(0, &mut input.reader);
    // Corners that do not exist are told by their line, once all vertices are known.
    let mut shape = Shape { vertices: Vec::new(), faces: Faces::new(u64::MAX), highest: None };
    while let Some(text) = whole_line(&mut lines)? {
        shape.take(&text, lines.number)?;
    }
    let Shape { vertices, faces, highest } = shape;
    if let Some((vertex, line)) = highest.filter(|(vertex, _)| *vertex as usize >= vertices.len()) {
        return Err(no_vertex(&(u64::from(vertex) + 1).to_string(), line, vertices.len()));
    }
    let triangles = faces.finish(&vertices, &mut input.notes);
    mesh_or_cloud(vertices, triangles)
}

/// The next line that says something, joined with those that it goes on in by a backslash at its end.
fn whole_line<R: BufRead>(lines: &mut Lines<'_, R>) -> Result<Option<String>> {
    let Some(mut text) = lines.advance_to_words()? else { return Ok(None) };
    while text.ends_with('\\') {
        text.pop();
        let number = lines.number;
        let Some(more) = lines.advance()? else {
            return Err(Error::input(format!("ends after line {number}, which goes on; the file is cut off")));
        };
        text.push(' ');
        text.push_str(more.split('#').next().unwrap_or_default().trim());
        if text.len() as u64 > LONGEST_LINE {
            return Err(Error::input(format!("line {number} goes on for more than {LONGEST_LINE} bytes; divide it")));
        }
    }
    Ok(Some(text))
}

/// What has been read so far.
#[derive(Debug)]
struct Shape {
    vertices: Vec<[f64; 3]>,
    faces: Faces,
    /// The highest vertex that a face names, counted from 0, and the first line that does; it may come later.
    highest: Option<(u32, u64)>,
}

impl Shape {
    /// Takes what a line says.
    fn take(&mut self, text: &str, line: u64) -> Result<()> {
        let mut words = text.split_whitespace();
        match words.next() {
            Some("v") => {
                self.vertices.push(position(words, line)?);
                refuse_too_many("vertices", self.vertices.len() as u64)
            }
            Some("f") => self.face(words, line),
            Some(word) if !word.starts_with(|c: char| c.is_ascii_alphabetic()) => {
                Err(Error::input(format!("line {line}, {}, is not understood as OBJ; delete or mend it", quoted(text))))
            }
            _ => Ok(()),
        }
    }

    fn face<'a>(&mut self, words: impl Iterator<Item = &'a str>, line: u64) -> Result<()> {
        let known = self.vertices.len();
        for word in words {
            let vertex = corner(word, line, known)?;
            if self.highest.is_none_or(|(highest, _)| vertex > highest) {
                self.highest = Some((vertex, line));
            }
            self.faces
                .push_index(vertex)
                .map_err(|error| Error::input(format!("line {line}: {error}")).caused_by(error))?;
        }
        self.faces.end(|| format!("line {line}"));
        Ok(())
    }
}

/// The vertex that a corner names, counted from 0; `known` vertices have been read.
fn corner(word: &str, line: u64, known: usize) -> Result<u32> {
    let name = word.split('/').next().unwrap_or_default();
    let number: i64 = name.parse().map_err(|_| {
        Error::input(format!("line {line}: {} is no corner of a face; give v, v/vt/vn or v//vn", quoted(word)))
    })?;
    let counted = if number > 0 { number.checked_sub(1) } else { number.checked_add(known as i64) };
    let vertex = counted.filter(|_| number != 0).and_then(|v| u32::try_from(v).ok());
    vertex.ok_or_else(|| no_vertex(name, line, known))
}

fn no_vertex(name: &str, line: u64, count: usize) -> Error {
    Error::input(format!("line {line} names vertex {}, but vertices go from 1 to {count}", quoted(name)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_starts_an_obj_file() {
        for text in ["v 1 2 3\n", "# made\n\nmtllib a.mtl\nv 0 0 0\n", "o name\n", "f 1 2 3\n"] {
            assert!(is_obj(text.as_bytes()), "{text:?}");
        }
        for text in ["1 2 3\n", "s x y z\n1 2 3 4\n", "x y z\n", "v\0 1 2 3\n", "OFF\n", "", "v,x,y\n"] {
            assert!(!is_obj(text.as_bytes()), "{text:?}");
        }
    }

    #[test]
    fn corners_count_from_one_or_backwards() {
        assert_eq!(corner("7", 1, 9).unwrap(), 6);
        assert_eq!(corner("7/8/9", 1, 0).unwrap(), 6);
        assert_eq!(corner("-1//2", 1, 9).unwrap(), 8);
        assert_eq!(corner("-9/3", 1, 9).unwrap(), 0);
        for word in ["0", "-10", "4294967297", "-9223372036854775808", "99999999999999999999", "", "/1", "a", "1.5"] {
            let message = corner(word, 5, 9).unwrap_err().to_string();
            assert!(message.contains("line 5"), "{word}: {message}");
        }
    }
}
