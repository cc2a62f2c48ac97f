//! The faces of a PLY file: polygons by the numbers of their corners, and strips of triangles.

use std::io::BufRead;

use super::body::Body;
use super::header::{Element, Encoding, Scalar};
use crate::error::{Error, Result};
use crate::io::geometry::read::mesh::{Faces, number};
use crate::io::text::quoted;

/// What takes the numbers of a list in their order.
trait Corners {
    fn take(&mut self, vertex: f64) -> Result<()>;

    /// The list ends, which stands at `place`.
    fn end(&mut self, place: &dyn Fn() -> String);
}

impl Corners for Faces {
    fn take(&mut self, vertex: f64) -> Result<()> {
        self.push(vertex)
    }

    fn end(&mut self, place: &dyn Fn() -> String) {
        Faces::end(self, place);
    }
}

/// Strips of triangles: every second one of them turns the other way round in its list.
struct Strips<'f> {
    faces: &'f mut Faces,
    /// The two vertices before, as far as the strip has any.
    before: [Option<f64>; 2],
    is_odd: bool,
}

impl Strips<'_> {
    fn restart(&mut self) {
        (self.before, self.is_odd) = ([None; 2], false);
    }
}

impl Corners for Strips<'_> {
    fn take(&mut self, vertex: f64) -> Result<()> {
        if vertex == -1.0 {
            self.restart();
            return Ok(());
        }
        if let [Some(a), Some(b)] = self.before {
            // A vertex that is repeated joins two strips and is no triangle.
            if a != b && b != vertex && a != vertex {
                let corners = if self.is_odd { [b, a, vertex] } else { [a, b, vertex] };
                corners.into_iter().try_for_each(|corner| self.faces.push(corner))?;
                self.faces.end(String::new);
            }
            self.is_odd = !self.is_odd;
        }
        self.before = [self.before[1], Some(vertex)];
        Ok(())
    }

    fn end(&mut self, _: &dyn Fn() -> String) {
        self.restart();
    }
}

/// Reads an element of faces or of strips.
pub(crate) fn read<R: BufRead>(body: &mut Body<'_, R>, element: &Element, faces: &mut Faces) -> Result<()> {
    let corners = element
        .properties
        .iter()
        .position(|p| ["vertex_indices", "vertex_index"].contains(&p.name.as_str()) && p.list.is_some());
    let Some(corners) = corners else {
        return Err(Error::input("is a PLY file whose faces have no list vertex_indices; write the file anew"));
    };
    if element.name == "tristrips" {
        read_lists(body, element, corners, &mut Strips { faces, before: [None; 2], is_odd: false })
    } else {
        read_lists(body, element, corners, faces)
    }
}

fn read_lists<R: BufRead>(
    body: &mut Body<'_, R>,
    face: &Element,
    corners: usize,
    into: &mut impl Corners,
) -> Result<()> {
    for number in 0..face.count {
        if body.encoding == Encoding::Ascii {
            let line = body.element_line()?.ok_or_else(|| {
                Error::input(format!(
                    "declares {} faces but ends after {number}; the file is cut off or damaged",
                    face.count
                ))
            })?;
            text_face(&line, face, corners, into)
                .map_err(|error| Error::input(format!("line {}: {error}", body.line)).caused_by(error))?;
            into.end(&|| format!("line {}", body.line));
        } else {
            let numbered = |error| Error::input(format!("face {number} (counted from 0): {error}")).caused_by(error);
            binary_face(body, face, corners, into).map_err(numbered)?;
            into.end(&|| format!("face {number} (counted from 0)"));
        }
    }
    Ok(())
}

/// The corners in a line, which must hold just as many words as the face declares numbers.
fn text_face(line: &str, face: &Element, corners: usize, into: &mut impl Corners) -> Result<()> {
    let unlike = || Error::input(format!("{} is not a face as declared", quoted(line)));
    let mut words = line.split_whitespace();
    let mut next = || words.next().ok_or_else(unlike);
    for (i, property) in face.properties.iter().enumerate() {
        let word = next()?;
        let items = if property.list.is_some() { length(number(word).ok_or_else(unlike)?)? } else { 0 };
        for _ in 0..items {
            let item = next()?;
            if i == corners {
                into.take(number(item).ok_or_else(unlike)?)?;
            }
        }
    }
    if words.next().is_some() { Err(unlike()) } else { Ok(()) }
}

fn binary_face<R: BufRead>(
    body: &mut Body<'_, R>,
    face: &Element,
    corners: usize,
    into: &mut impl Corners,
) -> Result<()> {
    for (i, property) in face.properties.iter().enumerate() {
        match property.list {
            Some(count) if i == corners => read_corners(body, count, property.item, into)?,
            Some(count) => body.skip_list(count, property.item)?,
            None => drop(body.number(property.item)?),
        }
    }
    Ok(())
}

fn read_corners<R: BufRead>(
    body: &mut Body<'_, R>,
    count: Scalar,
    item: Scalar,
    into: &mut impl Corners,
) -> Result<()> {
    let count = length(body.number(count)?)?;
    (0..count).try_for_each(|_| into.take(body.number(item)?))
}

/// The length of a list.
fn length(value: f64) -> Result<u64> {
    if value >= 0.0 && value.fract() == 0.0 {
        return Ok(value as u64);
    }
    Err(Error::input(format!("{value} is no length of a list; the file is damaged")))
}
