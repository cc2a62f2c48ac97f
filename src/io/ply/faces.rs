//! The faces of a PLY file: polygons by the numbers of their corners, cut into fans of triangles.

use std::io::BufRead;

use super::body::Body;
use super::header::{Element, Encoding, Scalar};
use crate::error::{Error, Result};
use crate::io::mesh::Fan;
use crate::io::text::quoted;

/// Reads the faces as triangles whose corners are all below `vertices`.
pub(super) fn read<R: BufRead>(body: &mut Body<'_, R>, face: &Element, vertices: u64) -> Result<Vec<[u32; 3]>> {
    let corners = face
        .properties
        .iter()
        .position(|p| ["vertex_indices", "vertex_index"].contains(&p.name.as_str()) && p.list.is_some());
    let Some(corners) = corners else {
        return Err(Error::input("is a PLY file whose faces have no list vertex_indices; write the file anew"));
    };
    let mut triangles = Vec::new();
    for number in 0..face.count {
        let mut fan = Fan::new(&mut triangles, vertices);
        if body.encoding == Encoding::Ascii {
            let line = body.element_line()?.ok_or_else(|| {
                Error::input(format!(
                    "declares {} faces but ends after {number}; the file is cut off or damaged",
                    face.count
                ))
            })?;
            text_face(&line, face, corners, &mut fan)
                .and_then(|()| fan.finish())
                .map_err(|error| Error::input(format!("line {}: {error}", body.line)))?;
        } else {
            let numbered = |error| Error::input(format!("face {number} (counted from 0): {error}"));
            binary_face(body, face, corners, &mut fan).map_err(numbered)?;
            fan.finish().map_err(numbered)?;
        }
    }
    Ok(triangles)
}

/// The corners in a line, which must hold just the numbers that the face declares.
fn text_face(line: &str, face: &Element, corners: usize, fan: &mut Fan<'_>) -> Result<()> {
    let unlike = || Error::input(format!("{} is not a face as declared", quoted(line)));
    let mut words = line.split_whitespace().map(|word| word.parse::<f64>().map_err(|_| unlike()));
    let mut next = || words.next().unwrap_or_else(|| Err(unlike()));
    for (i, property) in face.properties.iter().enumerate() {
        let value = next()?;
        let items = if property.list.is_some() { length(value)? } else { 0 };
        for _ in 0..items {
            let item = next()?;
            if i == corners {
                fan.push(item)?;
            }
        }
    }
    if words.next().is_some() { Err(unlike()) } else { Ok(()) }
}

fn binary_face<R: BufRead>(body: &mut Body<'_, R>, face: &Element, corners: usize, fan: &mut Fan<'_>) -> Result<()> {
    for (i, property) in face.properties.iter().enumerate() {
        match property.list {
            Some(count) if i == corners => read_corners(body, count, property.item, fan)?,
            Some(count) => body.skip_list(count, property.item)?,
            None => drop(body.number(property.item)?),
        }
    }
    Ok(())
}

fn read_corners<R: BufRead>(body: &mut Body<'_, R>, count: Scalar, item: Scalar, fan: &mut Fan<'_>) -> Result<()> {
    let count = length(body.number(count)?)?;
    (0..count).try_for_each(|_| fan.push(body.number(item)?))
}

/// The length of a list.
fn length(value: f64) -> Result<u64> {
    if value >= 0.0 && value.fract() == 0.0 {
        return Ok(value as u64);
    }
    Err(Error::input(format!("{value} is no length of a list; the file is damaged")))
}
