//! XYZ: a point a line, its coordinates first or as a header says, further columns (normals, colours) left aside.

use std::io::BufRead;

use super::columns::{Columns, Rows};
use super::layout::{Separator, uncommented};
use crate::error::Result;
use crate::grid::PointCloud;
use crate::io::text::{next_line, refuse_bare_returns};

/// Reads the points from `first_line` on, counted from 1.
pub(super) fn read(
    text: &mut impl BufRead,
    separator: Separator,
    columns: Columns,
    first_line: u64,
) -> Result<PointCloud> {
    let mut rows = Rows::new(columns);
    let mut bytes = Vec::new();
    let mut number = 1;
    while next_line(text, &mut bytes, number)? {
        let line = String::from_utf8_lossy(&bytes);
        refuse_bare_returns(&line, number)?;
        let line = uncommented(&line).trim();
        if number >= first_line && !line.is_empty() {
            rows.push(number, &separator.split(line))?;
        }
        number += 1;
    }
    Ok(rows.finish())
}
