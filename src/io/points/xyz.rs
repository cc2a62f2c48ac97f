//! XYZ: a point a line, its coordinates first or as a header says, further columns (normals, colours) left aside.
//!
//! Where a line before the numbers says how many they are, these are read and no more; another such line, as scanners
//! write one for each of their places, starts the next ones.

use std::io::BufRead;

use super::PointFile;
use super::columns::Rows;
use super::layout::{Separator, uncommented};
use super::names::Columns;
use crate::error::{Error, Result};
use crate::io::text::{next_line, refuse_bare_returns};

/// Reads the points from `first_line` on, counted from 1.
pub(super) fn read(
    text: &mut impl BufRead,
    separator: Separator,
    columns: Columns,
    first_line: u64,
    mut counted: Option<u64>,
) -> Result<PointFile> {
    let mut rows = Rows::new(columns);
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
                rows.push(number, &separator.split(line))?;
            }
        }
        number += 1;
    }
    match counted.filter(|&counted| (rows.len() as u64) < counted) {
        Some(counted) => Err(Error::input(format!(
            "says that it has {counted} points and ends after {}: is it cut off?",
            rows.len()
        ))),
        None => Ok(rows.finish()),
    }
}
