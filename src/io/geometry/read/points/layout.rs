//! What kind of table a text holds: told from the lines before its numbers.
//!
//! Before a header there may be comments, titles as Imaris writes them, and the line `sep=;` that spreadsheets take as
//! their separator. Numbers may follow a line that says how many they are (`.pts`), or a comment that names them.

use super::columns::is_number;
use super::csv;
use super::names::Columns;
use crate::error::{Error, Result};
use crate::io::text::refuse_bare_returns;

/// Lines that are no header and no numbers, at most.
const MOST_TITLES: usize = 12;

/// What stands between the fields of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Separator {
    /// One such character.
    Char(char),
    /// Any number of blanks and tabs.
    Blanks,
}

impl Separator {
    fn of(line: &str) -> Self {
        let by_blanks: Vec<&str> = line.split_whitespace().collect();
        if by_blanks.len() > 2 && line.contains(',') && !line.contains(';') && by_blanks.iter().all(|f| is_number(f)) {
            return Self::Blanks;
        }
        let found = [';', '\t', ','].into_iter().find(|&c| line.contains(c));
        match found {
            // Tabs often stand in tables that are aligned by blanks too; numbers hold neither.
            Some('\t') if starts_with_number(line) => {
                if by_blanks.len() > 2 && by_blanks[..3].iter().all(|field| is_number(field)) {
                    Self::Blanks
                } else if line.contains(',') && by_blanks[0].ends_with(',') {
                    Self::Char(',')
                } else {
                    Self::Blanks
                }
            }
            Some(c) => Self::Char(c),
            None => Self::Blanks,
        }
    }

    /// The fields of a line.
    pub(crate) fn split(self, line: &str) -> Vec<&str> {
        match self {
            Self::Char(c) => line.split(c).map(str::trim).collect(),
            Self::Blanks => line.split_whitespace().collect(),
        }
    }
}

/// How to read a table.
#[derive(Debug, PartialEq)]
pub(crate) enum Layout {
    /// Lines of numbers from `first_line` on (counted from 1); `counted` where the line before says how many.
    Xyz { separator: Separator, columns: Columns, first_line: u64, counted: Option<u64> },
    /// Quoted fields are possible; the columns are named in `header_line`.
    Csv { separator: char, columns: Columns, header_line: u64 },
}

impl Layout {
    /// The layout of a text that starts with `head`; none when it holds comments and blanks alone.
    ///
    /// A comment right before the numbers may be their header, as `numpy.savetxt` writes it: where it names x, y
    /// and z it decides, since otherwise an object number might pass for a coordinate.
    pub(crate) fn of(head: &[u8]) -> Result<Option<Self>> {
        let head = String::from_utf8_lossy(head);
        let mut last_comment = "";
        let mut told = None;
        // The line that looks most like a header says best what is missing.
        let mut complaint: Option<(usize, Error)> = None;
        let mut titles = 0;
        let lines: Vec<&str> = head.split('\n').collect();
        for (number, &line) in (1..).zip(&lines) {
            let text = uncommented(line).trim();
            if text.is_empty() {
                last_comment = if line.trim().is_empty() { last_comment } else { line.trim() };
                continue;
            }
            if let Some(separator) = separator_line(text) {
                told = Some(separator);
                continue;
            }
            let separator = told.map_or_else(|| Separator::of(text), Separator::Char);
            if holds_numbers(text, separator, last_comment) {
                if let Some((_, complaint)) = complaint {
                    return Err(complaint);
                }
                return Ok(Some(Self::numbers(text, separator, number, last_comment, &lines[number as usize..])));
            }
            match Self::header(line, text, separator, number) {
                Ok(layout) => return Ok(Some(layout)),
                Err(error) => {
                    let fields = separator.split(text).len();
                    if complaint.as_ref().is_none_or(|(most, _)| fields > *most) {
                        complaint = Some((fields, error));
                    }
                }
            }
            titles += 1;
            if titles > MOST_TITLES {
                break;
            }
        }
        complaint.map_or(Ok(None), |(_, complaint)| Err(complaint))
    }

    /// The layout of lines of numbers, of which `text` is the first.
    fn numbers(text: &str, separator: Separator, number: u64, comment: &str, after: &[&str]) -> Self {
        let alone = |text: &str| text.split_whitespace().count() == 1;
        if let (true, Ok(count)) = (alone(text), text.parse::<u64>()) {
            let next =
                after.iter().map(|line| uncommented(line).trim()).find(|text| !text.is_empty()).unwrap_or_default();
            if !next.is_empty() && (!alone(next) || Separator::of(next) != Separator::Blanks) {
                let separator = Separator::of(next);
                let rows: Vec<Vec<&str>> = after.iter().take(3).map(|line| separator.split(line)).collect();
                let numbered = |(n, row): (usize, &Vec<&str>)| row.len() == 5 && row[0].parse() == Ok(n);
                let is_mesh = count > 3 && rows.iter().enumerate().all(numbered);
                let columns = if is_mesh { Columns::MORPHOGRAPHX } else { Columns::FIRST_THREE };
                return Self::Xyz { separator, columns, first_line: number + 1, counted: Some(count) };
            }
        }
        let columns = commented(comment, separator).unwrap_or(Columns::FIRST_THREE);
        Self::Xyz { separator, columns, first_line: number, counted: None }
    }

    fn header(line: &str, text: &str, separator: Separator, number: u64) -> Result<Self> {
        match separator {
            Separator::Char(separator) => Self::csv(line.trim_end_matches('\r'), separator, number),
            Separator::Blanks => named(&separator.split(text), number).map(|columns| Self::Xyz {
                separator,
                columns,
                first_line: number + 1,
                counted: None,
            }),
        }
    }

    fn csv(header: &str, separator: char, number: u64) -> Result<Self> {
        refuse_bare_returns(header, number)?;
        let names = csv::split(header, separator).ok_or_else(|| csv::unclosed(number, header))?;
        let columns = named(&names.iter().map(AsRef::as_ref).collect::<Vec<_>>(), number)?;
        Ok(Self::Csv { separator, columns, header_line: number })
    }
}

/// The columns that a comment names, also as 3D Slicer does: `# columns = id,x,y,z`.
fn commented(comment: &str, separator: Separator) -> Option<Columns> {
    let names = comment.trim_start_matches(['#', '/', ' ']);
    let names = names.strip_prefix("columns").map_or(names, |rest| rest.trim_start().trim_start_matches(['=', ':']));
    [Separator::of(names), separator].into_iter().find_map(|s| Columns::named(&s.split(names)).ok())
}

/// True for a line of numbers: in its first fields, or where a comment before it names the coordinates.
fn holds_numbers(text: &str, separator: Separator, comment: &str) -> bool {
    let fields = separator.split(text);
    let are_numbers =
        |columns: [usize; 3]| columns.into_iter().all(|n| fields.get(n).is_some_and(|field| is_number(field)));
    starts_with_number(text)
        || are_numbers([0, 1, 2])
        || commented(comment, separator).is_some_and(|columns| are_numbers(columns.position))
}

fn named(names: &[&str], line: u64) -> Result<Columns> {
    Columns::named(names).map_err(|error| Error::input(format!("line {line} {error}")).caused_by(error))
}

/// The separator that a line `sep=;` tells.
fn separator_line(text: &str) -> Option<char> {
    let text = text.trim_matches('"');
    let told = text.get(..4).filter(|start| start.eq_ignore_ascii_case("sep=")).map(|_| &text[4..])?;
    match told {
        // A tab at the end of the line is trimmed away.
        "" => Some('\t'),
        told => told.chars().next().filter(|_| told.chars().count() == 1),
    }
}

/// The first line that is no comment, and its number, where it holds no number at its start, no fields between
/// separators and names no coordinate: then the text is no table of points.
pub(crate) fn foreign_line(head: &[u8]) -> Option<(u64, String)> {
    if matches!(Layout::of(head), Ok(Some(_))) {
        return None;
    }
    let head = String::from_utf8_lossy(head);
    let mut lines = (1..).zip(head.split('\n')).map(|(number, line)| (number, uncommented(line).trim()));
    let (number, text) = lines.find(|(_, text)| !text.is_empty())?;
    let is_coordinate = |name: &str| {
        let name = name.trim_matches('"').to_lowercase();
        ["x", "y", "z"].contains(&name.as_str()) || name.starts_with("axis-")
    };
    let names_one = text.split([' ', '\t', ',', ';']).any(is_coordinate);
    let fields = [',', ';', '\t'].map(|separator| text.split(separator).count()).into_iter().max().unwrap_or(0);
    (!starts_with_number(text) && !names_one && fields < 3).then(|| (number, text.to_owned()))
}

/// A line up to its comment, which starts at `#` or, at the start of a line, at `//`.
pub(crate) fn uncommented(line: &str) -> &str {
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

    fn xyz(separator: Separator, first_line: u64) -> Layout {
        Layout::Xyz { separator, columns: Columns::FIRST_THREE, first_line, counted: None }
    }

    #[test]
    fn numbers_and_headers_are_told_apart() {
        assert_eq!(layout("# made by hand\n\n 1 2 3\n"), xyz(Separator::Blanks, 3));
        assert_eq!(layout("-1.5e3,2,3"), xyz(Separator::Char(','), 1));
        assert_eq!(layout("1\t2 3"), xyz(Separator::Blanks, 1));
        assert_eq!(layout("1,5 2,5 3,5"), xyz(Separator::Blanks, 1));
        assert_eq!(layout("1,\t2,\t3"), xyz(Separator::Char(','), 1));
        for (text, line) in [("// X Y Z\r\n1 2 3\r\n", 2), ("x y  z\n1 2 3", 2)] {
            let columns = Columns::named(&["x", "y", "z"]).unwrap();
            let separator = Separator::Blanks;
            assert_eq!(layout(text), Layout::Xyz { separator, columns, first_line: line, counted: None });
        }
        let columns = Columns::named(&["x", "y", "z"]).unwrap();
        for (text, header_line) in [("#\nX;Y;Z\n1,5;2;3", 2), ("sep=;\nX;Y;Z\n1,5;2;3", 2), ("\nTitle\n===\nx;y;z", 4)]
        {
            assert_eq!(layout(text), Layout::Csv { separator: ';', columns: columns.clone(), header_line });
        }
        assert_eq!(Layout::of(b"# nothing\n\n").unwrap(), None);
    }

    #[test]
    fn a_commented_header_counts() {
        let columns = Columns::named(&["object", "x", "y", "z"]).unwrap();
        let separator = Separator::Char(',');
        let expected = Layout::Xyz { separator, columns, first_line: 2, counted: None };
        assert_eq!(layout("# object,x,y,z\n1,0.5,2,3"), expected);
        assert_eq!(layout("# columns = object,x,y,z\n1,0.5,2,3"), expected);
    }

    #[test]
    fn a_count_stands_before_the_numbers() {
        let separator = Separator::Blanks;
        let columns = Columns::FIRST_THREE;
        assert_eq!(
            layout("2\n1 2 3 9\n4 5 6 9\n"),
            Layout::Xyz { separator, columns, first_line: 2, counted: Some(2) }
        );
        let mesh = "4\n0 1 2 3 7\n1 4 5 6 7\n2 4 5 6 7\n3 4 5 6 7\n0 2 1 2\n";
        let columns = Columns::MORPHOGRAPHX;
        assert_eq!(layout(mesh), Layout::Xyz { separator, columns, first_line: 2, counted: Some(4) });
    }
}
