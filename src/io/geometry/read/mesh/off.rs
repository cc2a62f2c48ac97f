//! OFF (Object File Format, Geomview manual, section 4.2.5): counts, vertices, polygons, as text.
//!
//! `OFF`, or with letters before it for what follows each position (`ST`, `C`, `N`, in any order: programs differ), which
//! is left aside as colours of faces are. Comments start at `#`. One vertex or face a line; the counts may stand on the
//! first line, also without a blank before them (as in `ModelNet`). Coordinates are f64. Four or n dimensions and the
//! binary form are refused. The word may be missing, as the manual has it: then counts, vertices and faces must follow each
//! other as they do in no table of points, and it is told.

use std::io::BufRead;

use super::{Faces, first_line, mesh_or_cloud, position};
use crate::error::{Error, Result};
use crate::grid::refuse_too_many;
use crate::io::geometry::read::input::{HEAD, Input};
use crate::io::geometry::read::source::Source;
use crate::io::text::{Lines, quoted};

/// The fewest bytes of a vertex and of a face: `0 0 0`, `0` for a face without corners, and a line end.
const LEAST: [u64; 2] = [6, 2];

/// True for what starts like an OFF file, with or without its first word.
pub(crate) fn is_off(head: &[u8]) -> bool {
    has_keyword(head) || is_without_keyword(head)
}

fn has_keyword(head: &[u8]) -> bool {
    // The binary form has the same first line.
    let text = &head[..head.iter().position(|&byte| byte == 0).unwrap_or(head.len())];
    let line = first_line(text).or_else(|| first_line(text.split(|&byte| byte == b'\n').next()?));
    line.is_some_and(|line| line.split_whitespace().next().is_some_and(|word| keyword(word).is_some()))
}

/// True for what starts with a line of two or three counts, as OFF without its first word does.
pub(crate) fn starts_with_counts(head: &[u8]) -> bool {
    let text = String::from_utf8_lossy(head);
    let mut lines = text.split('\n').map(|line| line.split('#').next().unwrap_or_default().trim());
    lines.find(|line| !line.is_empty()).and_then(numbers_of).is_some_and(|counts| !counts.contains(&0))
}

/// True for two or three counts, as many lines of three numbers or more as the first says, and nothing but faces after
/// them, one of three corners at least.
fn is_without_keyword(head: &[u8]) -> bool {
    let text = String::from_utf8_lossy(head);
    let words = |line: &'_ str| line.split('#').next().unwrap_or_default().trim().to_owned();
    let mut lines: Vec<String> = text.split('\n').map(words).collect();
    // The last line may go on.
    if head.len() as u64 >= HEAD - 3 {
        lines.pop();
    }
    let mut lines = lines.iter().filter(|line| !line.is_empty());
    let Some([vertices, faces]) = lines.next().and_then(|line| numbers_of(line)) else { return false };
    if vertices == 0 || faces == 0 || vertices > head.len() as u64 {
        return false;
    }
    let is_vertex = |line: &String| {
        let mut numbers = line.split_whitespace().map(str::parse::<f64>);
        (0..3).all(|_| matches!(numbers.next(), Some(Ok(_))))
    };
    let corners = |line: &String| {
        let mut words = line.split_whitespace().map(|word| word.parse::<u64>().ok());
        let count = words.next().flatten()?;
        let named = words.by_ref().take(count as usize).filter(|corner| corner.is_some_and(|n| n < vertices)).count();
        (count > 0 && named as u64 == count).then_some(count)
    };
    if !(0..vertices).all(|_| lines.next().is_some_and(is_vertex)) {
        return false;
    }
    let faces: Option<Vec<u64>> = lines.take(faces as usize).map(corners).collect();
    faces.is_some_and(|corners| corners.iter().any(|&count| count > 2))
}

/// The numbers of vertices and faces in a line that holds these, and perhaps that of edges.
fn numbers_of(line: &str) -> Option<[u64; 2]> {
    let numbers: Option<Vec<u64>> = line.split_whitespace().map(|word| word.parse().ok()).collect();
    match numbers.as_deref() {
        // The number of edges, the third, means nothing, and some programs leave it out.
        Some(&[vertices, faces] | &[vertices, faces, _]) => Some([vertices, faces]),
        _ => None,
    }
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
pub(crate) fn read(input: &mut Input) -> Result<Source> {
    let length = input.length;
    let is_named = has_keyword(input.head()?);
    let mut lines = Lines::after(0, &mut input.reader);
    let [vertex_count, face_count] = counts(&mut lines, is_named)?;
    refuse_too_many("vertices", vertex_count)?;
    let needed = vertex_count.saturating_mul(LEAST[0]).saturating_add(face_count.saturating_mul(LEAST[1]));
    // The last line needs no end.
    if let Some(length) = length.filter(|length| needed > length.saturating_add(1)) {
        return Err(Error::input(format!(
            "declares {vertex_count} vertices and {face_count} faces but has {length} bytes, too few for them; the \
             file is cut off or damaged"
        )));
    }
    if !is_named {
        input.notes.push(format!(
            "is read as OFF without its first word: a mesh, not points, for its lines are {vertex_count} vertices and \
             {face_count} faces, as the first one says"
        ));
    }
    let mut vertices = Vec::new();
    while (vertices.len() as u64) < vertex_count {
        let line = element(&mut lines, "vertices", vertex_count, vertices.len() as u64)?;
        vertices.push(position(line.split_whitespace(), lines.number)?);
    }
    let mut faces = Faces::new(vertex_count);
    for n in 0..face_count {
        let line = element(&mut lines, "faces", face_count, n)?;
        face(&line, &mut faces)
            .map_err(|error| Error::input(format!("line {}: {error}", lines.number)).caused_by(error))?;
        faces.end(|| format!("line {}", lines.number));
    }
    input.note_rest(&format!("the {face_count} faces that it declares"))?;
    let triangles = faces.finish(&vertices, &mut input.notes);
    mesh_or_cloud(vertices, triangles)
}

/// The numbers of vertices and faces, in the header or on the line after it.
fn counts<R: BufRead>(lines: &mut Lines<'_, R>, is_named: bool) -> Result<[u64; 2]> {
    let header = lines.advance_to_words()?.unwrap_or_default();
    if let Some(numbers) = numbers_of(&header).filter(|_| !is_named) {
        return Ok(numbers);
    }
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
    numbers_of(&line).ok_or_else(|| {
        Error::input(format!(
            "line {}, {}, should hold the numbers of vertices, faces and edges",
            lines.number,
            quoted(&line)
        ))
    })
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

    #[test]
    fn what_is_off_without_its_first_word() {
        let corners = "0 0 0\n1 0 0\n0 1 0\n";
        for text in [
            format!("3 1 0\n{corners}3 0 1 2\n"),
            format!("# made\n\n3 1\r\n{corners}3 0 1 2 255 0 0\r\n\n"),
            format!("3 2 0\n{corners}2 0 1\n3 2 1 0"),
        ] {
            assert!(is_off(text.as_bytes()), "{text:?}");
        }
        for text in [
            corners.to_owned(),
            format!("3 0 0\n{corners}"),
            format!("3 1 0\n{corners}"),
            // A corner that is none, lines of points, a line too many before the faces.
            format!("3 1 0\n{corners}3 0 1 3\n"),
            format!("3 2 0\n{corners}2 0 1\n1 1 1\n"),
            format!("3 1 0\n{corners}{corners}3 0 1 2\n"),
            format!("3 1 0 7\n{corners}3 0 1 2\n"),
            format!("3.0 1 0\n{corners}3 0 1 2\n"),
        ] {
            assert!(!is_off(text.as_bytes()), "{text:?}");
        }
    }
}
