//! The vertices of a PLY file: their positions, `[x, y, z]`; other properties are passed over, and
//! said to be no numbers where they are none.

use std::io::{self, BufRead};

use super::body::Body;
use super::header::{Element, Encoding, Property, Scalar};
use crate::error::{Error, Result};
use crate::grid::refuse_too_many;
use crate::io::geometry::read::mesh::number;
use crate::io::text::{quoted, unreadable};

/// Bytes of the pieces in which vertices are read.
const PIECE: usize = 1 << 20;

/// The vertices of a file.
#[derive(Debug, Default)]
pub(crate) struct Vertices {
    pub positions: Vec<[f64; 3]>,
    /// How many have a property beside their position that is no number, as a normal of no length has none.
    undefined: u64,
    /// The first property that was.
    property: Option<usize>,
}

impl Vertices {
    /// Takes a vertex, and which of its other properties is no number.
    fn push(&mut self, position: [f64; 3], undefined: Option<usize>) -> Result<()> {
        if position.iter().any(|x| !x.is_finite()) {
            let number = self.positions.len();
            return Err(Error::input(format!(
                "vertex {number} (counted from 0) has a coordinate that is not finite; delete the vertex"
            )));
        }
        self.positions.push(position);
        self.undefined += u64::from(undefined.is_some());
        self.property = self.property.or(undefined);
        Ok(())
    }

    /// What is said of properties that are no numbers.
    fn note(&self, vertex: &Element) -> Option<String> {
        let name = &vertex.properties[self.property?].name;
        let (undefined, all) = (self.undefined, self.positions.len());
        Some(format!(
            "{undefined} of {all} vertices have properties that are no numbers, as {name}; only x, y and z are read"
        ))
    }
}

/// Reads the vertices; `fits` says that the file is known to be long enough for them, `notes` gets what is odd about them.
pub(crate) fn read<R: BufRead>(
    body: &mut Body<'_, R>,
    vertex: &Element,
    fits: bool,
    notes: &mut Vec<String>,
) -> Result<Vec<[f64; 3]>> {
    let place = places(vertex)?;
    refuse_too_many("vertices", vertex.count)?;
    let mut found = Vertices::default();
    if fits {
        found.positions.reserve_exact(vertex.count as usize);
    }
    if body.encoding == Encoding::Ascii {
        read_text(body, vertex, place, &mut found)?;
    } else if vertex.has_fixed_size() {
        read_binary(body, vertex, place, &mut found)?;
    } else {
        read_binary_with_lists(body, vertex, place, &mut found)?;
    }
    notes.extend(found.note(vertex));
    Ok(found.positions)
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

/// Vertices of a text file: one a line.
fn read_text<R: BufRead>(
    body: &mut Body<'_, R>,
    vertex: &Element,
    place: [usize; 3],
    found: &mut Vertices,
) -> Result<()> {
    while found.positions.len() as u64 != vertex.count {
        let text = body.element_line()?.ok_or_else(|| cut_off(found.positions.len(), vertex.count))?;
        let number = body.line;
        let (position, undefined) = vertex_in(&text, vertex, place)
            .ok_or_else(|| Error::input(format!("line {number}, {}, is not a vertex as declared", quoted(&text))))?;
        found
            .push(position, undefined)
            .map_err(|error| Error::input(format!("line {number}: {error}")).caused_by(error))?;
    }
    Ok(())
}

/// The position in a line, when it has just as many words as the vertex declares numbers, and the first other property that
/// is no number. Of these only the lengths of lists need to be: normals that could not be computed are written in many ways.
fn vertex_in(line: &str, vertex: &Element, place: [usize; 3]) -> Option<([f64; 3], Option<usize>)> {
    let mut words = line.split_whitespace();
    let (mut position, mut undefined) = ([0.0; 3], None);
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
        } else if undefined.is_none() && !is_written_in_digits(word) {
            undefined = Some(i);
        }
    }
    words.next().is_none().then_some((position, undefined))
}

/// Whether a word can be a number: nan, -nan(ind), -1.#IND and their like have other letters.
fn is_written_in_digits(word: &str) -> bool {
    word.bytes().all(|byte| byte.is_ascii_digit() || b"+-.eE".contains(&byte))
}

/// Vertices of a binary file that all have the same number of bytes.
fn read_binary<R: BufRead>(
    body: &mut Body<'_, R>,
    vertex: &Element,
    place: [usize; 3],
    found: &mut Vertices,
) -> Result<()> {
    let offset = |at: usize| vertex.properties[..at].iter().map(|p| p.item.size()).sum::<usize>();
    let fields = place.map(|at| (offset(at), vertex.properties[at].item));
    let is_other = |(i, p): &(usize, &Property)| {
        !place.contains(i) && p.list.is_none() && matches!(p.item, Scalar::F32 | Scalar::F64)
    };
    let others = vertex.properties.iter().enumerate().filter(is_other);
    let others: Vec<(usize, usize, Scalar)> = others.map(|(i, p)| (i, offset(i), p.item)).collect();
    let stride = offset(vertex.properties.len());
    let mut piece = vec![0; stride * (PIECE / stride).max(1)];
    let mut left = vertex.count;
    while left > 0 {
        let rows = left.min((piece.len() / stride) as u64);
        let bytes = &mut piece[..rows as usize * stride];
        body.reader.read_exact(bytes).map_err(|e| cut_off_by(&e, found.positions.len(), vertex.count))?;
        for row in bytes.chunks_exact(stride) {
            let decoded = |at: usize, item: Scalar| item.decode(&row[at..at + item.size()], body.encoding);
            let undefined = others.iter().find(|(_, at, item)| !decoded(*at, *item).is_finite());
            found.push(fields.map(|(at, item)| decoded(at, item)), undefined.map(|(i, ..)| *i))?;
        }
        left -= rows;
    }
    Ok(())
}

fn read_binary_with_lists<R: BufRead>(
    body: &mut Body<'_, R>,
    vertex: &Element,
    place: [usize; 3],
    found: &mut Vertices,
) -> Result<()> {
    for _ in 0..vertex.count {
        let (mut position, mut undefined) = ([0.0; 3], None);
        for (i, property) in vertex.properties.iter().enumerate() {
            if let Some(length) = property.list {
                body.skip_list(length, property.item)?;
            } else {
                let value = body.number(property.item)?;
                if let Some(axis) = place.iter().position(|&p| p == i) {
                    position[axis] = value;
                } else if undefined.is_none() && !value.is_finite() {
                    undefined = Some(i);
                }
            }
        }
        found.push(position, undefined)?;
    }
    Ok(())
}

fn cut_off(read: usize, declared: u64) -> Error {
    Error::input(format!("declares {declared} vertices but ends after {read}; the file is cut off or damaged"))
}

fn cut_off_by(error: &io::Error, read: usize, declared: u64) -> Error {
    if error.kind() == io::ErrorKind::UnexpectedEof { cut_off(read, declared) } else { unreadable(error) }
}
