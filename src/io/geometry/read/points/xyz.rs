//! XYZ: a point a line, its coordinates first or as a header says, further columns (normals, colours) left aside.
//!
//! Where a line before the numbers says how many they are, these are read and no more; another such line, as scanners
//! write one for each of their places, starts the next ones.

use std::io::BufRead;

use super::columns::Rows;
use super::layout::{Separator, uncommented};
use super::names::Columns;
use crate::error::{Error, Result};
use crate::io::geometry::read::point_file::PointFile;
use crate::io::text::{next_line, refuse_bare_returns};

/// Reads the points from `first_line` on, counted from 1.
pub(crate) fn read(
    text: &mut impl BufRead,
    separator: Separator,
    columns: Columns,
    first_line: u64,
    mut counted: Option<u64>,
) -> Result<PointFile> {
    let mut rows = Rows::new(columns);
    let mut counts = None;
    let mut bytes = Vec::new();
    let mut number = 1;
    while next_line(text, &mut bytes, number)? {
        let line = String::from_utf8_lossy(&bytes);
        refuse_bare_returns(&line, number)?;
        let line = uncommented(&line).trim();
        if number >= first_line && !line.is_empty() {
            if counted.is_some_and(|counted| rows.len() as u64 == counted) {
                let Ok(more) = line.parse::<u64>() else { break };
                counted = counted.map(|before| before.saturating_add(more));
            } else {
                if rows.len() == 0 && counted.is_none() {
                    counts = off_counts(line);
                }
                rows.push(number, &separator.split(line))?;
            }
        }
        number += 1;
    }
    if let Some(counted) = counted.filter(|&counted| (rows.len() as u64) < counted) {
        return Err(Error::input(format!(
            "says that it has {counted} points and ends after {}: is it cut off?",
            rows.len()
        )));
    }
    let lines = rows.len() as u64;
    let mut file = rows.finish();
    let all_counted = |[vertices, faces]: &[u64; 2]| vertices.saturating_add(*faces).saturating_add(1) == lines;
    if let Some([vertices, faces]) = counts.filter(all_counted) {
        file.notes.push(format!(
            "all of its {lines} lines are taken as points, the first one too, though it counts the others as OFF does, \
             {vertices} vertices and {faces} faces; if it is such a file, write OFF above it"
        ));
    }
    Ok(file)
}

/// The fewest vertices that are taken for a count of lines: of fewer points the first one may happen to tell how many
/// follow.
const FEWEST_VERTICES: u64 = 4;

/// The numbers of vertices and faces where a line may be the first of an OFF file without its keyword.
fn off_counts(line: &str) -> Option<[u64; 2]> {
    let counts: Option<Vec<u64>> = line.split_whitespace().map(|word| word.parse().ok()).collect();
    match counts.as_deref() {
        Some(&[vertices, faces, _]) if vertices >= FEWEST_VERTICES => Some([vertices, faces]),
        _ => None,
    }
}
