//! OFF (Object File Format, Geomview manual, section 4.2.5): counts, vertices, polygons, as text.
//!
//! `OFF`, or with letters before it for what follows each position (`ST`, `C`, `N`, in any order: programs differ), which
//! is left aside as colours of faces are. Comments start at `#`. One vertex or face a line; the counts may stand on the
//! first line, also without a blank before them (as in `ModelNet`). Coordinates are f64. Four or n dimensions and the
//! binary form are refused.

use std::io::BufRead;

use super::{Faces, first_line, mesh_or_cloud, position};
use crate::error::{Error, Result};
use crate::grid::refuse_too_many;
use crate::io::input::Input;
use crate::io::sources::Source;
use crate::io::text::{Lines, quoted};

/// The fewest bytes of a vertex and of a face: `0 0 0`, `0` for a face without corners, and a line end.
const LEAST: [u64; 2] = [6, 2];

/// True for what starts like an OFF file.
pub(in crate::io) fn is_off(head: &[u8]) -> bool {
    // The binary form has the same first line.
    let text = &head[..head.iter().position(|&byte| byte == 0).unwrap_or(head.len())];
    let line = first_line(text).or_else(|| first_line(text.split(|&byte| byte == b'\n').next()?));
    line.is_some_and(|line| line.split_whitespace().next().is_some_and(|word| keyword(word).is_some()))
}

/// A keyword cut in what stands before `OFF` and the number that may stand right after it.
fn keyword(word: &str) -> Option<(&str, &str)> {
    let (prefix, number) = word.split_once("OFF")?;
    let mut rest = prefix.to_owned();
    for part in ["ST", "C", "N", "4", "n"] {
        rest = rest.replacen(part, "", 1);
    }
    let is_number = number.bytes().all(|byte| byte.is_ascii_digit());
    (rest.is_empty() && is_number).then_some((prefix, number))
}

/// Reads a mesh, or a cloud where the file has no faces.
pub(in crate::io) fn read(input: &mut Input) -> Result<Source> {
    let length = input.length;
    let mut lines = Lines::after(0, &mut input.reader);
    let [vertex_count, face_count] = counts(&mut lines)?;
    refuse_too_many("vertices", vertex_count)?;
    let needed = vertex_count.saturating_mul(LEAST[0]).saturating_add(face_count.saturating_mul(LEAST[1]));
    // The last line needs no end.
    if let Some(length) = length.filter(|length| needed > length.saturating_add(1)) {
        return Err(Error::input(format!(
            "declares {vertex_count} vertices and {face_count} faces but has {length} bytes, too few for them; the \
             file is cut off or damaged"
        )));
    }
    let mut vertices = Vec::new();
    while (vertices.len() as u64) < vertex_count {
        let line = element(&mut lines, "vertices", vertex_count, vertices.len() as u64)?;
        vertices.push(position(line.split_whitespace(), lines.number)?);
    }
    let mut faces = Faces::new(vertex_count);
    for n in 0..face_count {
        let line = element(&mut lines, "faces", face_count, n)?;
        face(&line, &mut faces).map_err(|error| Error::input(format!("line {}: {error}", lines.number)))?;
        faces.end(|| format!("line {}", lines.number));
    }
    input.tell_rest(&format!("the {face_count} faces that it declares"))?;
    let triangles = faces.finish(&vertices, &mut input.notes);
    mesh_or_cloud(vertices, triangles)
}

/// The numbers of vertices and faces, in the header or on the line after it.
fn counts<R: BufRead>(lines: &mut Lines<'_, R>) -> Result<[u64; 2]> {
    let header = lines.advance_to_words()?.unwrap_or_default();
    let mut words = header.split_whitespace();
    let first = words.next().unwrap_or_default();
    let Some((_, glued)) = keyword(first).filter(|(prefix, _)| !prefix.contains(['4', 'n'])) else {
        return Err(Error::input(format!(
            "is OFF of a kind that is not read, {}; give three dimensions",
            quoted(first)
        )));
    };
    let glued = Some(glued).filter(|number| !number.is_empty());
    let mut line = glued.into_iter().chain(words).collect::<Vec<_>>().join(" ");
    if line.eq_ignore_ascii_case("BINARY") {
        return Err(Error::input("is binary OFF, which is not read; save it as text or as PLY"));
    }
    if line.is_empty() {
        line = lines.advance_to_words()?.ok_or_else(|| Error::input("is OFF without counts; the file is cut off"))?;
    }
    let numbers: Option<Vec<u64>> = line.split_whitespace().map(|word| word.parse().ok()).collect();
    match numbers.as_deref() {
        // The number of edges, the third, means nothing, and some programs leave it out.
        Some(&[vertices, faces] | &[vertices, faces, _]) => Ok([vertices, faces]),
        _ => Err(Error::input(format!(
            "line {}, {}, should hold the numbers of vertices, faces and edges",
            lines.number,
            quoted(&line)
        ))),
    }
}

/// The line of the next vertex or face, of which `read` have been read.
fn element<R: BufRead>(lines: &mut Lines<'_, R>, what: &str, declared: u64, read: u64) -> Result<String> {
    lines.advance_to_words()?.ok_or_else(|| {
        Error::input(format!("declares {declared} {what} but ends after {read}; the file is cut off or damaged"))
    })
}

/// A face: how many corners, the corners, and perhaps a colour.
fn face(line: &str, faces: &mut Faces) -> Result<()> {
    let unlike = || Error::input(format!("{} is no face: give how many corners, then the corners", quoted(line)));
    let mut words = line.split_whitespace();
    let corners: u64 = words.next().and_then(|word| word.parse().ok()).ok_or_else(unlike)?;
    for _ in 0..corners {
        let vertex: f64 = words.next().and_then(|word| word.parse().ok()).ok_or_else(unlike)?;
        faces.push(vertex)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_starts_an_off_file() {
        for text in [
            "OFF\n3 1 0\n",
            "# a\n\nCOFF 3 1\n",
            "STCN4nOFF\n",
            "NCSTOFF\n",
            "NOFF",
            "OFF BINARY\n\0\0\0\x08",
            "OFF8 12 0\n",
            "\t COFF8 12 0 # a\r\n",
        ] {
            assert!(is_off(text.as_bytes()), "{text:?}");
        }
        for text in
            ["off\n", "NNOFF\n", "OFFICE\n", "OFF8x\n", "TSOFF\n", "x y z\n", "1 2 3\n", "", "\0OFF\n", "LIST\n"]
        {
            assert!(!is_off(text.as_bytes()), "{text:?}");
        }
    }
}
