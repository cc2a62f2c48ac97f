//! The vertices of a PLY file: their positions, `[x, y, z]`; other properties are passed over.

use std::io::{self, BufRead};

use super::body::Body;
use super::header::{Element, Encoding};
use crate::error::{Error, Result};
use crate::grid::refuse_too_many;
use crate::io::geometry::read::mesh::number;
use crate::io::text::{quoted, unreadable};

/// Bytes of the pieces in which vertices are read.
const PIECE: usize = 1 << 20;

/// Reads the vertices; `fits` says that the file is known to be long enough for them.
pub(crate) fn read<R: BufRead>(body: &mut Body<'_, R>, vertex: &Element, fits: bool) -> Result<Vec<[f64; 3]>> {
    let place = places(vertex)?;
    refuse_too_many("vertices", vertex.count)?;
    let mut positions = Vec::new();
    if fits {
        positions.reserve_exact(vertex.count as usize);
    }
    if body.encoding == Encoding::Ascii {
        read_text(body, vertex, place, &mut positions)?;
    } else if vertex.has_fixed_size() {
        read_binary(body, vertex, place, &mut positions)?;
    } else {
        read_binary_with_lists(body, vertex, place, &mut positions)?;
    }
    Ok(positions)
}

/// The places of x, y and z among the properties of a vertex.
fn places(vertex: &Element) -> Result<[usize; 3]> {
    let mut found = [0; 3];
    for (place, name) in found.iter_mut().zip(["x", "y", "z"]) {
        *place = vertex.properties.iter().position(|p| p.name == name && p.list.is_none()).ok_or_else(|| {
            Error::input(format!("is a PLY file whose vertices have no number {name}; they need x, y and z"))
        })?;
    }
    Ok(found)
}

fn push(positions: &mut Vec<[f64; 3]>, position: [f64; 3]) -> Result<()> {
    if position.iter().all(|x| x.is_finite()) {
        positions.push(position);
        return Ok(());
    }
    let number = positions.len();
    Err(Error::input(format!(
        "vertex {number} (counted from 0) has a coordinate that is not finite; delete the vertex"
    )))
}

/// Vertices of a text file: one a line.
fn read_text<R: BufRead>(
    body: &mut Body<'_, R>,
    vertex: &Element,
    place: [usize; 3],
    positions: &mut Vec<[f64; 3]>,
) -> Result<()> {
    while positions.len() as u64 != vertex.count {
        let text = body.element_line()?.ok_or_else(|| cut_off(positions.len(), vertex.count))?;
        let number = body.line;
        let position = position_in(&text, vertex, place)
            .ok_or_else(|| Error::input(format!("line {number}, {}, is not a vertex as declared", quoted(&text))))?;
        push(positions, position).map_err(|error| Error::input(format!("line {number}: {error}")).caused_by(error))?;
    }
    Ok(())
}

/// The position in a line, when it has just as many words as the vertex declares numbers. Of the others only the lengths
/// of lists need to be numbers: normals that could not be computed are written in many ways.
fn position_in(line: &str, vertex: &Element, place: [usize; 3]) -> Option<[f64; 3]> {
    let mut words = line.split_whitespace();
    let mut position = [0.0; 3];
    for (i, property) in vertex.properties.iter().enumerate() {
        let word = words.next()?;
        if property.list.is_some() {
            let length = number(word)? as usize;
            if length > 0 {
                words.nth(length - 1)?;
            }
        }
        if let Some(axis) = place.iter().position(|&p| p == i) {
            position[axis] = number(word)?;
        }
    }
    words.next().is_none().then_some(position)
}

/// Vertices of a binary file that all have the same number of bytes.
fn read_binary<R: BufRead>(
    body: &mut Body<'_, R>,
    vertex: &Element,
    place: [usize; 3],
    positions: &mut Vec<[f64; 3]>,
) -> Result<()> {
    let offset = |at: usize| vertex.properties[..at].iter().map(|p| p.item.size()).sum::<usize>();
    let fields = place.map(|at| (offset(at), vertex.properties[at].item));
    let stride = offset(vertex.properties.len());
    let mut piece = vec![0; stride * (PIECE / stride).max(1)];
    let mut left = vertex.count;
    while left > 0 {
        let rows = left.min((piece.len() / stride) as u64);
        let bytes = &mut piece[..rows as usize * stride];
        body.reader.read_exact(bytes).map_err(|e| cut_off_by(&e, positions.len(), vertex.count))?;
        for row in bytes.chunks_exact(stride) {
            let position = fields.map(|(at, item)| item.decode(&row[at..at + item.size()], body.encoding));
            push(positions, position)?;
        }
        left -= rows;
    }
    Ok(())
}

fn read_binary_with_lists<R: BufRead>(
    body: &mut Body<'_, R>,
    vertex: &Element,
    place: [usize; 3],
    positions: &mut Vec<[f64; 3]>,
) -> Result<()> {
    for _ in 0..vertex.count {
        let mut position = [0.0; 3];
        for (i, property) in vertex.properties.iter().enumerate() {
            if let Some(length) = property.list {
                body.skip_list(length, property.item)?;
            } else {
                let value = body.number(property.item)?;
                if let Some(axis) = place.iter().position(|&p| p == i) {
                    position[axis] = value;
                }
            }
        }
        push(positions, position)?;
    }
    Ok(())
}

fn cut_off(read: usize, declared: u64) -> Error {
    Error::input(format!("declares {declared} vertices but ends after {read}; the file is cut off or damaged"))
}

fn cut_off_by(error: &io::Error, read: usize, declared: u64) -> Error {
    if error.kind() == io::ErrorKind::UnexpectedEof { cut_off(read, declared) } else { unreadable(error) }
}
