//! What kind of table a text holds: told from its first line that is no comment.

use super::columns::Columns;
use super::csv;
use crate::error::{Error, Result};
use crate::io::text::refuse_bare_returns;

/// What stands between the fields of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Separator {
    /// One such character.
    Char(char),
    /// Any number of blanks and tabs.
    Blanks,
}

impl Separator {
    fn of(line: &str) -> Self {
        let found = [';', '\t', ','].into_iter().find(|&c| line.contains(c));
        match found {
            // Tabs often stand in tables that are aligned by blanks too; numbers hold neither.
            Some('\t') if starts_with_number(line) => Self::Blanks,
            Some(c) => Self::Char(c),
            None => Self::Blanks,
        }
    }

    /// The fields of a line.
    pub(super) fn split(self, line: &str) -> Vec<&str> {
        match self {
            Self::Char(c) => line.split(c).map(str::trim).collect(),
            Self::Blanks => line.split_whitespace().collect(),
        }
    }
}

/// How to read a table.
#[derive(Debug, PartialEq)]
pub(super) enum Layout {
    /// Lines of numbers from `first_line` on (counted from 1).
    Xyz { separator: Separator, columns: Columns, first_line: u64 },
    /// Quoted fields are possible; the columns are named in `header_line`.
    Csv { separator: char, columns: Columns, header_line: u64 },
}

impl Layout {
    /// The layout of a text that starts with `head`; none when it holds comments and blanks alone.
    ///
    /// A comment right before the numbers may be their header, as `numpy.savetxt` writes it: where it names x, y
    /// and z it decides, since otherwise an object number might pass for a coordinate.
    pub(super) fn of(head: &[u8]) -> Result<Option<Self>> {
        let head = String::from_utf8_lossy(head);
        let mut last_comment = "";
        for (number, line) in (1..).zip(head.split('\n')) {
            let text = uncommented(line).trim();
            if text.is_empty() {
                last_comment = if line.trim().is_empty() { last_comment } else { line.trim() };
                continue;
            }
            let separator = Separator::of(text);
            if starts_with_number(text) {
                let names = separator.split(last_comment.trim_start_matches(['#', '/', ' ']));
                let columns = Columns::named(&names).unwrap_or(Columns::FIRST_THREE);
                return Ok(Some(Self::Xyz { separator, columns, first_line: number }));
            }
            return match separator {
                Separator::Char(separator) => Self::csv(line.trim_end_matches('\r'), separator, number),
                Separator::Blanks => named(&separator.split(text), number).map(|columns| Self::Xyz {
                    separator,
                    columns,
                    first_line: number + 1,
                }),
            }
            .map(Some);
        }
        Ok(None)
    }

    fn csv(header: &str, separator: char, number: u64) -> Result<Self> {
        refuse_bare_returns(header, number)?;
        let names = csv::split(header, separator).ok_or_else(|| csv::unclosed(number, header))?;
        let columns = named(&names.iter().map(AsRef::as_ref).collect::<Vec<_>>(), number)?;
        Ok(Self::Csv { separator, columns, header_line: number })
    }
}

fn named(names: &[&str], line: u64) -> Result<Columns> {
    Columns::named(names).map_err(|error| Error::input(format!("line {line} {error}")))
}

/// The first line that is no comment, and its number, where it holds no number at its start and names no coordinate:
/// then the text is no table of points.
pub(in crate::io) fn foreign_line(head: &[u8]) -> Option<(u64, String)> {
    let head = String::from_utf8_lossy(head);
    let mut lines = (1..).zip(head.split('\n')).map(|(number, line)| (number, uncommented(line).trim()));
    let (number, text) = lines.find(|(_, text)| !text.is_empty())?;
    let is_coordinate = |name: &str| {
        let name = name.trim_matches('"').to_lowercase();
        ["x", "y", "z"].contains(&name.as_str()) || name.starts_with("axis-")
    };
    let names_one = text.split([' ', '\t', ',', ';']).any(is_coordinate);
    (!starts_with_number(text) && !names_one).then(|| (number, text.to_owned()))
}

/// A line up to its comment, which starts at `#` or, at the start of a line, at `//`.
pub(super) fn uncommented(line: &str) -> &str {
    if line.trim_start().starts_with("//") { "" } else { line.split('#').next().unwrap_or_default() }
}

fn starts_with_number(line: &str) -> bool {
    let first = line.split([' ', '\t', ',', ';']).find(|field| !field.is_empty());
    first.is_some_and(|field| field.parse::<f64>().is_ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layout(text: &str) -> Layout {
        Layout::of(text.as_bytes()).unwrap().unwrap()
    }

    #[test]
    fn numbers_and_headers_are_told_apart() {
        let xyz = |separator, first_line| Layout::Xyz { separator, columns: Columns::FIRST_THREE, first_line };
        assert_eq!(layout("# made by hand\n\n 1 2 3\n"), xyz(Separator::Blanks, 3));
        assert_eq!(layout("-1.5e3,2,3"), xyz(Separator::Char(','), 1));
        assert_eq!(layout("1\t2 3"), xyz(Separator::Blanks, 1));
        assert_eq!(layout("// X Y Z\r\n1 2 3\r\n"), xyz(Separator::Blanks, 2));
        assert_eq!(layout("x y  z\n1 2 3"), xyz(Separator::Blanks, 2));
        let csv = Layout::Csv { separator: ';', columns: Columns::FIRST_THREE, header_line: 2 };
        assert_eq!(layout("#\nX;Y;Z\n1,5;2;3"), csv);
        assert_eq!(Layout::of(b"# nothing\n\n").unwrap(), None);
    }

    #[test]
    fn a_commented_header_counts() {
        let columns = Columns::named(&["object", "x", "y", "z"]).unwrap();
        assert_eq!(
            layout("# object,x,y,z\n1,0.5,2,3"),
            Layout::Xyz { separator: Separator::Char(','), columns, first_line: 2 }
        );
    }
}
