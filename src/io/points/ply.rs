//! The vertices of a PLY file (Turk 1994), text or binary in either byte order; other elements are passed over.

use std::io::{self, BufRead, Read};

use super::ply_header::{Element, Encoding, Header, Scalar};
use super::{LONGEST_LINE, next_line, quoted, unreadable};
use crate::error::{Error, Result};
use crate::grid::PointCloud;

/// Bytes of the pieces in which vertices are read.
const PIECE: usize = 1 << 20;

/// Reads the vertices; `length` is that of the whole file in bytes, where it is known.
pub(super) fn read(reader: &mut impl BufRead, length: Option<u64>) -> Result<PointCloud> {
    let header = Header::read(reader)?;
    let Some(at) = header.elements.iter().position(|e| e.name == "vertex") else {
        return Err(Error::input("is a PLY file without vertices; give one with an element 'vertex'"));
    };
    let (before, vertex) = (&header.elements[..at], &header.elements[at]);
    let place = places(vertex)?;
    refuse_overlong(&header, at, length)?;
    let mut cloud = PointCloud::default();
    if length.is_some() {
        cloud.positions.reserve_exact(vertex.count as usize);
    }
    if header.encoding == Encoding::Ascii {
        read_text(reader, &header, before, vertex, place, &mut cloud)?;
    } else {
        before.iter().try_for_each(|e| skip_element(reader, e, header.encoding))?;
        read_binary(reader, vertex, header.encoding, place, &mut cloud)?;
    }
    Ok(cloud)
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

/// Refuses a header that declares more than the file can hold, before any memory is taken for it.
fn refuse_overlong(header: &Header, vertex: usize, length: Option<u64>) -> Result<()> {
    let Some(length) = length else { return Ok(()) };
    // The last number of a text file needs no line end.
    let rest = length.saturating_sub(header.bytes).saturating_add(1);
    let needed = header.elements[..=vertex].iter().try_fold(0_u64, |sum, element| {
        element.count.checked_mul(element.least_bytes(header.encoding)).and_then(|bytes| sum.checked_add(bytes))
    });
    if needed.is_none_or(|needed| needed > rest) {
        return Err(Error::input(format!(
            "declares {} vertices but has {} bytes after its header, too few for them; the file is cut off or damaged",
            header.elements[vertex].count,
            rest - 1
        )));
    }
    Ok(())
}

fn push(cloud: &mut PointCloud, position: [f64; 3]) -> Result<()> {
    if position.iter().all(|x| x.is_finite()) {
        cloud.positions.push(position);
        return Ok(());
    }
    let number = cloud.positions.len();
    Err(Error::input(format!(
        "vertex {number} (counted from 0) has a coordinate that is not finite; delete the vertex"
    )))
}

/// Vertices of a text file: an element a line.
fn read_text(
    reader: &mut impl BufRead,
    header: &Header,
    before: &[Element],
    vertex: &Element,
    place: [usize; 3],
    cloud: &mut PointCloud,
) -> Result<()> {
    let mut number = header.lines;
    let mut line = Vec::new();
    let mut skipped = before.iter().fold(0_u64, |sum, e| sum.saturating_add(e.count));
    while cloud.positions.len() as u64 != vertex.count {
        number += 1;
        if !next_line(reader, &mut line, LONGEST_LINE, number)? {
            return Err(cut_off(cloud.positions.len(), vertex.count));
        }
        let text = String::from_utf8_lossy(&line);
        if text.trim().is_empty() {
            continue;
        }
        if skipped > 0 {
            skipped -= 1;
            continue;
        }
        let position = position_in(&text, vertex, place)
            .ok_or_else(|| Error::input(format!("line {number}, {}, is not a vertex as declared", quoted(&text))))?;
        push(cloud, position).map_err(|error| Error::input(format!("line {number}: {error}")))?;
    }
    Ok(())
}

/// The position in a line, when it has just the numbers that the vertex declares.
fn position_in(line: &str, vertex: &Element, place: [usize; 3]) -> Option<[f64; 3]> {
    let mut words = line.split_whitespace();
    let mut position = [0.0; 3];
    for (i, property) in vertex.properties.iter().enumerate() {
        let value: f64 = words.next()?.parse().ok()?;
        if property.list.is_some() {
            let length = value as usize;
            if length > 0 {
                words.nth(length - 1)?;
            }
        }
        if let Some(axis) = place.iter().position(|&p| p == i) {
            position[axis] = value;
        }
    }
    words.next().is_none().then_some(position)
}

/// Vertices of a binary file.
fn read_binary(
    reader: &mut impl BufRead,
    vertex: &Element,
    encoding: Encoding,
    place: [usize; 3],
    cloud: &mut PointCloud,
) -> Result<()> {
    if !vertex.has_fixed_size() {
        return read_binary_with_lists(reader, vertex, encoding, place, cloud);
    }
    let offset = |at: usize| vertex.properties[..at].iter().map(|p| p.item.size()).sum::<usize>();
    let fields = place.map(|at| (offset(at), vertex.properties[at].item));
    let stride = offset(vertex.properties.len());
    let mut piece = vec![0; stride * (PIECE / stride).max(1)];
    let mut left = vertex.count;
    while left > 0 {
        let rows = left.min((piece.len() / stride) as u64);
        let bytes = &mut piece[..rows as usize * stride];
        reader.read_exact(bytes).map_err(|e| cut_off_by(&e, cloud.positions.len(), vertex.count))?;
        for row in bytes.chunks_exact(stride) {
            let position = fields.map(|(at, item)| item.decode(&row[at..at + item.size()], encoding));
            push(cloud, position)?;
        }
        left -= rows;
    }
    Ok(())
}

fn read_binary_with_lists(
    reader: &mut impl BufRead,
    vertex: &Element,
    encoding: Encoding,
    place: [usize; 3],
    cloud: &mut PointCloud,
) -> Result<()> {
    for _ in 0..vertex.count {
        let mut position = [0.0; 3];
        for (i, property) in vertex.properties.iter().enumerate() {
            if let Some(length) = property.list {
                skip_list(reader, length, property.item, encoding)?;
            } else {
                let value = number(reader, property.item, encoding)?;
                if let Some(axis) = place.iter().position(|&p| p == i) {
                    position[axis] = value;
                }
            }
        }
        push(cloud, position)?;
    }
    Ok(())
}

/// Passes over all elements of one kind in a binary file.
fn skip_element(reader: &mut impl BufRead, element: &Element, encoding: Encoding) -> Result<()> {
    if element.has_fixed_size() {
        return skip(reader, element.count.saturating_mul(element.least_bytes(encoding)));
    }
    for _ in 0..element.count {
        for property in &element.properties {
            match property.list {
                Some(length) => skip_list(reader, length, property.item, encoding)?,
                None => skip(reader, property.item.size() as u64)?,
            }
        }
    }
    Ok(())
}

fn skip_list(reader: &mut impl BufRead, length: Scalar, item: Scalar, encoding: Encoding) -> Result<()> {
    let length = number(reader, length, encoding)?;
    // Out of range lengths saturate, and then pass the end of the file.
    skip(reader, (length as u64).saturating_mul(item.size() as u64))
}

fn number(reader: &mut impl BufRead, scalar: Scalar, encoding: Encoding) -> Result<f64> {
    let mut bytes = [0; 8];
    let bytes = &mut bytes[..scalar.size()];
    reader.read_exact(bytes).map_err(|e| ends_early(&e))?;
    Ok(scalar.decode(bytes, encoding))
}

fn skip(reader: &mut impl BufRead, bytes: u64) -> Result<()> {
    let skipped = io::copy(&mut reader.by_ref().take(bytes), &mut io::sink()).map_err(|e| unreadable(&e))?;
    if skipped < bytes { Err(ends_early(&io::ErrorKind::UnexpectedEof.into())) } else { Ok(()) }
}

fn ends_early(error: &io::Error) -> Error {
    if error.kind() == io::ErrorKind::UnexpectedEof {
        Error::input("ends before all elements that its PLY header declares; the file is cut off or damaged")
    } else {
        unreadable(error)
    }
}

fn cut_off(read: usize, declared: u64) -> Error {
    Error::input(format!("declares {declared} vertices but ends after {read}; the file is cut off or damaged"))
}

fn cut_off_by(error: &io::Error, read: usize, declared: u64) -> Error {
    if error.kind() == io::ErrorKind::UnexpectedEof { cut_off(read, declared) } else { unreadable(error) }
}
