//! The text form of STL: solids of facets, each a loop of three lines `vertex x y z`. Coordinates are f64. A last solid
//! that nothing ends is read, with a note, when its last facet is whole.

use std::io::BufRead;

use super::position;
use crate::error::{Error, Result};
use crate::io::geometry::read::input::Input;
use crate::io::text::{Lines, quoted};

/// The lines of a facet after its first, without their numbers.
const FACET: [&str; 6] = ["outer", "vertex", "vertex", "vertex", "endloop", "endfacet"];

/// Reads the corners of all facets of all solids, three a facet.
pub(crate) fn read(input: &mut Input) -> Result<Vec<[f64; 3]>> {
    let mut lines = Lines::after(0, &mut input.reader);
    let mut corners = Vec::new();
    let mut is_open = false;
    while let Some(line) = next_words(&mut lines)? {
        match line.split_whitespace().next().map(str::to_ascii_lowercase).as_deref() {
            Some("solid") if !is_open => is_open = true,
            Some("endsolid") if is_open => is_open = false,
            Some("facet") if is_open => facet(&mut lines, &mut corners)?,
            _ => return Err(unlike(if is_open { "facet or endsolid" } else { "solid" }, &line, lines.number)),
        }
    }
    let last = lines.number;
    if is_open && !corners.is_empty() {
        input.notes.push(format!("ends after line {last} without endsolid; it may be cut off"));
    } else if is_open {
        return Err(Error::input(format!("ends after line {last} without endsolid; the file is cut off")));
    }
    Ok(corners)
}

fn facet<R: BufRead>(lines: &mut Lines<'_, R>, corners: &mut Vec<[f64; 3]>) -> Result<()> {
    for expected in FACET {
        let Some(line) = next_words(lines)? else {
            return Err(Error::input(format!("ends inside a facet, after line {}; the file is cut off", lines.number)));
        };
        let mut words = line.split_whitespace();
        if !words.next().is_some_and(|word| word.eq_ignore_ascii_case(expected)) {
            return Err(unlike(expected, &line, lines.number));
        }
        if expected == "vertex" {
            corners.push(position(words, lines.number)?);
        }
    }
    Ok(())
}

/// The next line that is not blank. STL has no comments: a name may hold any character.
fn next_words<R: BufRead>(lines: &mut Lines<'_, R>) -> Result<Option<String>> {
    while let Some(line) = lines.advance()? {
        if !line.trim().is_empty() {
            return Ok(Some(line.trim().to_owned()));
        }
    }
    Ok(None)
}

fn unlike(expected: &str, line: &str, number: u64) -> Error {
    Error::input(format!(
        "line {number} is {} where an STL file needs {expected}; mend it or write it anew",
        quoted(line)
    ))
}
