//! CSV (RFC 4180, also with semicolons or tabs): the first line that is no comment names the columns.
//!
//! Unlike in the RFC a quoted field ends on its line: points need none that go on, and a quote that is never
//! closed is then told with its line instead of swallowing the rest of the file.

use std::borrow::Cow;
use std::io::BufRead;

use super::columns::Rows;
use super::names::Columns;
use crate::error::{Error, Result};
use crate::io::geometry::read::point_file::PointFile;
use crate::io::text::{next_line, quoted, refuse_bare_returns};

/// Reads the points after the header, which stands in `header_line`, counted from 1.
pub(crate) fn read(text: &mut impl BufRead, separator: char, columns: Columns, header_line: u64) -> Result<PointFile> {
    let mut rows = Rows::new(columns);
    let mut bytes = Vec::new();
    let mut number = 1;
    while next_line(text, &mut bytes, number)? {
        let line = String::from_utf8_lossy(&bytes);
        refuse_bare_returns(&line, number)?;
        let line = line.trim_end_matches(['\r', '\n']);
        if number >= header_line && !line.trim().is_empty() && !line.starts_with('#') {
            let fields = split(line, separator).ok_or_else(|| unclosed(number, line))?;
            let fields: Vec<&str> = fields.iter().map(AsRef::as_ref).collect();
            if number == header_line {
                rows.set_model(number, fields.len());
            } else {
                rows.push(number, &fields)?;
            }
        }
        number += 1;
    }
    Ok(rows.finish())
}

/// The fields of a line; none when a quote is not closed or something follows it.
pub(crate) fn split(line: &str, separator: char) -> Option<Vec<Cow<'_, str>>> {
    if !line.contains('"') {
        return Some(line.split(separator).map(Cow::Borrowed).collect());
    }
    let mut fields = Vec::new();
    let mut rest = line;
    loop {
        let (field, after) = if let Some(inner) = rest.trim_start_matches(' ').strip_prefix('"') {
            quoted_field(inner)?
        } else {
            let (field, after) = rest.split_at(rest.find(separator).unwrap_or(rest.len()));
            (Cow::Borrowed(field), after)
        };
        fields.push(field);
        if after.is_empty() {
            return Some(fields);
        }
        rest = after.strip_prefix(separator)?;
    }
}

/// The field up to its closing quote, two quotes standing for one, and what follows it.
fn quoted_field(inner: &str) -> Option<(Cow<'_, str>, &str)> {
    let mut field = String::new();
    let mut rest = inner;
    loop {
        let (part, after) = rest.split_once('"')?;
        field.push_str(part);
        match after.strip_prefix('"') {
            Some(more) => {
                field.push('"');
                rest = more;
            }
            None => return Some((Cow::Owned(field), after.trim_start_matches(' '))),
        }
    }
}

pub(crate) fn unclosed(number: u64, line: &str) -> Error {
    Error::input(format!("line {number}, {}, has a quote without its closing one; close it", quoted(line)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_and_quotes() {
        let fields = |line| split(line, ',').map(|f| f.iter().map(ToString::to_string).collect::<Vec<_>>());
        let some = |expected: &[&str]| Some(expected.iter().map(ToString::to_string).collect::<Vec<_>>());
        assert_eq!(fields("a,,b "), some(&["a", "", "b "]));
        assert_eq!(fields(r#""a,b", "say ""x""" ,c"#), some(&["a,b", "say \"x\"", "c"]));
        assert_eq!(fields("5\",6"), some(&["5\"", "6"]));
        assert_eq!(fields(r#""a,b"#), None);
        assert_eq!(fields(r#""a"b,c"#), None);
        assert_eq!(fields(r#""a","#), some(&["a", ""]));
    }
}
