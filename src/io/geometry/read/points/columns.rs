//! The points gathered from the lines of a table.

use std::collections::HashSet;

use super::corner::{Corner, ShapeKind};
use super::names::{Columns, Form};
use super::shapes;
use crate::error::{Error, Result};
use crate::grid::PointCloud;
use crate::io::geometry::read::point_file::{PointFile, Scale};
use crate::io::geometry::read::point_units::Unit;
use crate::io::text::quoted;

/// Lines of a header after its names, at most: `TrackMate` writes three.
const MORE_HEADER_LINES: u32 = 4;
/// First columns that count so many lines are row numbers.
const COUNTED: usize = 4;

/// What stands between the whole and the decimals of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Decimals {
    Point,
    Comma,
}

/// Points gathered line by line.
#[derive(Debug)]
pub(crate) struct Rows {
    columns: Columns,
    /// The line that set how many fields a line has, and that number.
    model: Option<(u64, usize)>,
    cloud: PointCloud,
    corners: Vec<Corner>,
    times: Vec<i64>,
    /// The sign of decimals, and the line that used it first.
    decimals: Option<(Decimals, u64)>,
    /// Whether the first column of more than three has counted the lines so far, and from which number.
    counted_from: Option<i64>,
    header_lines: u32,
    /// The unit that a line named first.
    unit: Option<String>,
    /// The different whole numbers of a column that may tell objects; none once it holds something else.
    labels: Option<HashSet<i64>>,
}

impl Rows {
    pub(crate) fn new(columns: Columns) -> Self {
        Self {
            columns,
            model: None,
            cloud: PointCloud::default(),
            corners: Vec::new(),
            times: Vec::new(),
            decimals: None,
            counted_from: None,
            header_lines: 0,
            unit: None,
            labels: Some(HashSet::new()),
        }
    }

    /// How many points there are.
    pub(crate) fn len(&self) -> usize {
        self.cloud.len()
    }

    /// Tells from the header how many fields each line has.
    pub(crate) fn set_model(&mut self, line: u64, fields: usize) {
        self.model = Some((line, fields));
    }

    /// Takes the point in the fields of a line; a line of empty fields is none.
    pub(crate) fn push(&mut self, line: u64, fields: &[&str]) -> Result<()> {
        if fields.iter().all(|field| field.trim().is_empty()) || self.is_header(fields) {
            return Ok(());
        }
        let (model_line, wanted) = *self.model.get_or_insert((line, fields.len()));
        // Spreadsheets end lines by empty fields.
        let filled = fields.iter().rposition(|field| !field.trim().is_empty()).map_or(0, |last| last + 1);
        if fields.len() < wanted || filled > wanted {
            return Err(Error::input(format!(
                "line {line} has {} columns where line {model_line} has {wanted}; complete the line or delete it",
                fields.len()
            )));
        }
        let mut position = [0.0; 3];
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            let field = fields.get(self.columns.position[axis]).ok_or_else(|| too_few(line, wanted))?;
            position[axis] = self.coordinate(field, name, line)? - self.columns.scales[axis].first();
        }
        // A comment may name columns that the lines do not have.
        if let Some((column, what)) = self.columns.others().find(|&(column, _)| column >= fields.len()) {
            return Err(Error::input(format!(
                "line {line} has {wanted} columns, and the header names column {} as {what}; complete the line or correct \
                 the header",
                column + 1
            )));
        }
        self.take_numbers(line, fields)?;
        self.count(fields);
        self.cloud.positions.push(position);
        Ok(())
    }

    /// The other columns of a line.
    fn take_numbers(&mut self, line: u64, fields: &[&str]) -> Result<()> {
        if let Some(column) = self.columns.object {
            self.cloud.objects.push(object(fields[column], line)?);
        }
        if let Some(column) = self.columns.contour {
            self.cloud.contours.push(number_of(
                fields[column],
                "contour",
                "contours are named by whole numbers",
                line,
            )?);
        }
        if let Some((column, _)) = self.columns.label {
            self.labels =
                self.labels.take().zip(fields.get(column).and_then(|field| whole(field))).map(|(mut labels, label)| {
                    labels.insert(label);
                    labels
                });
        }
        if let Some((column, first)) = self.columns.time {
            let time = number_of(fields[column], "the time", "times are whole numbers", line)?;
            self.times.push(time.saturating_sub(first));
        }
        if self.columns.form == Form::NapariShapes {
            let vertex = self
                .columns
                .vertex
                .map(|column| number_of(fields[column], "vertex-index", "corners are numbered by whole numbers", line));
            let kind = self.columns.shape.map_or(ShapeKind::Closed, |column| {
                match fields[column].trim().to_lowercase().as_str() {
                    "ellipse" => ShapeKind::Ellipse,
                    "path" | "line" => ShapeKind::Open,
                    _ => ShapeKind::Closed,
                }
            });
            self.corners.push(Corner { vertex: vertex.transpose()?, kind });
        }
        if let Some(column) = self.columns.unit {
            let unit = fields[column].trim();
            let first = self.unit.get_or_insert_with(|| unit.to_owned());
            if first != unit {
                let (first, unit) = (quoted(first), quoted(unit));
                return Err(Error::input(format!("line {line}: the unit is {unit} and {first} before; use one")));
            }
        }
        Ok(())
    }

    /// Lines that go on with the header: names in words, and the units.
    fn is_header(&mut self, fields: &[&str]) -> bool {
        let more =
            self.columns.form == Form::TrackMate && self.cloud.is_empty() && self.header_lines < MORE_HEADER_LINES;
        let field = |axis: usize| fields.get(self.columns.position[axis]).map_or("", |field| field.trim());
        if !more || (0..3).any(|axis| number(field(axis)).is_some()) {
            return false;
        }
        let units = [0, 1, 2].map(|axis| Unit::of(field(axis)));
        for (axis, unit) in units.into_iter().enumerate() {
            match unit {
                Some(Unit::Length(length)) => self.columns.units[axis] = Some(length),
                Some(Unit::Voxels) => self.columns.scales[axis] = Scale::Voxels,
                None => {}
            }
        }
        self.header_lines += 1;
        true
    }

    /// Looks whether the first column counts the lines.
    fn count(&mut self, fields: &[&str]) {
        let rows = self.cloud.len() as i64;
        let first = if fields.len() > 3 { whole(fields[0]) } else { None };
        self.counted_from = match rows {
            0 => first.filter(|first| (0..=1).contains(first)),
            _ => self.counted_from.filter(|from| first == Some(from + rows)),
        };
    }

    /// A finite coordinate.
    fn coordinate(&mut self, field: &str, name: &str, line: u64) -> Result<f64> {
        let field = field.trim();
        let (value, decimals) = number(field).ok_or_else(|| {
            let has_thousands = field.contains(',') && (field.contains('.') || field.matches(',').count() > 1)
                || field.chars().any(char::is_whitespace) && field.chars().all(|c| !c.is_alphabetic());
            let hint = match (has_thousands, field.contains(',')) {
                (true, _) => "; write it without signs between thousands and with a point before decimals",
                (false, true) => "; write decimals with a point",
                (false, false) => "; give a number",
            };
            Error::input(format!("line {line}: {name} is {}, which is not a number{hint}", quoted(field)))
        })?;
        if let Some(decimals) = decimals {
            let (first, first_line) = *self.decimals.get_or_insert((decimals, line));
            if first != decimals {
                return Err(Error::input(format!(
                    "line {line}: {name} is {}, while line {first_line} has the other sign of decimals; write all of \
                     them with a point",
                    quoted(field)
                )));
            }
        }
        if value.is_finite() {
            Ok(value)
        } else {
            Err(Error::input(format!(
                "line {line}: {name} is {}, which is not finite; delete the point",
                quoted(field)
            )))
        }
    }

    pub(crate) fn finish(self) -> PointFile {
        let Self { columns, mut cloud, mut times, labels, .. } = self;
        let mut notes = Vec::new();
        // Numbers that come again are no row numbers.
        let of_objects = |labels: &HashSet<i64>| labels.len() > 1 && 2 * labels.len() <= cloud.len();
        if let (Some((_, name)), Some(labels)) = (columns.label, labels.filter(of_objects)) {
            notes.push(format!(
                "its column {name} holds {} different numbers and is left aside; name it object if it tells the objects",
                labels.len()
            ));
        }
        let mut form = columns.form;
        if form == Form::ImageJ && times.iter().min().is_some_and(|&first| first < 0) {
            // ImageJ counts frames from 1: a table with a frame 0 is another program's.
            for time in &mut times {
                *time += 1;
            }
            form = Form::Named;
        }
        if columns.form == Form::NapariShapes {
            (cloud, notes) = shapes::drawn(&cloud, &self.corners, &mut times);
        }
        if self.decimals.is_some_and(|(decimals, _)| decimals == Decimals::Comma) {
            notes.push("numbers are read with decimal commas".into());
        }
        if columns.form == Form::FirstThree && self.counted_from.is_some() && cloud.len() >= COUNTED {
            notes.push(
                "the first column, taken as x, counts the lines; name the columns in a first line x, y, z".into(),
            );
        }
        let (mut units, mut scales) = (columns.units, columns.scales);
        if let Some(unit) = self.unit.as_deref().and_then(Unit::of) {
            match unit {
                Unit::Length(length) => units = [Some(length); 3],
                Unit::Voxels => scales = [Scale::Voxels; 3],
            }
        }
        PointFile { cloud, form: form.name().into(), scales, units, times, notes }
    }
}

impl Form {
    /// What a file of this form is called.
    fn name(self) -> &'static str {
        match self {
            Self::Named => "table of points",
            Self::FirstThree => "three numbers a line",
            Self::NapariPoints => "points of napari",
            Self::NapariShapes => "shapes of napari",
            Self::TrackMate => "spots of TrackMate",
            Self::Imaris => "positions of Imaris",
            Self::ImageJ => "results table of ImageJ",
            Self::Regions => "regions of scikit-image",
            Self::MorphoGraphX => "mesh of MorphoGraphX",
        }
    }
}

fn too_few(line: u64, found: usize) -> Error {
    let noun = if found == 1 { "column" } else { "columns" };
    Error::input(format!("line {line} has {found} {noun}; a point needs x, y and z"))
}

/// A number, and what sign it has before its decimals; a comma alone stands there too.
fn number(field: &str) -> Option<(f64, Option<Decimals>)> {
    let field = field.trim();
    if let Ok(value) = field.parse() {
        return Some((value, field.contains('.').then_some(Decimals::Point)));
    }
    let is_decimal = field.matches(',').count() == 1 && !field.contains('.') && !field.ends_with(',');
    let value = is_decimal.then(|| field.replace(',', ".").parse().ok()).flatten()?;
    Some((value, Some(Decimals::Comma)))
}

/// True for what is read as a number.
pub(crate) fn is_number(field: &str) -> bool {
    number(field).is_some()
}

/// A positive whole number, also when written as 2.0.
fn object(field: &str, line: u64) -> Result<u32> {
    let value = whole(field).and_then(|v| u32::try_from(v).ok()).filter(|&v| v > 0);
    value.ok_or_else(|| {
        Error::input(format!("line {line}: object is {}; objects are numbered 1, 2, 3 and so on", quoted(field)))
    })
}

fn number_of(field: &str, name: &str, rule: &str, line: u64) -> Result<i64> {
    whole(field).ok_or_else(|| Error::input(format!("line {line}: {name} is {}; {rule}", quoted(field))))
}

fn whole(field: &str) -> Option<i64> {
    let field = field.trim();
    let from_real = || {
        let exact_up_to = (1_i64 << 53) as f64;
        let (value, _) = number(field)?;
        (value.fract() == 0.0 && value.abs() <= exact_up_to).then_some(value as i64)
    };
    field.parse().ok().or_else(from_real)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_numbers() {
        for (text, value) in [
            ("7", Some(7)),
            (" 2.0 ", Some(2)),
            ("2,0", Some(2)),
            ("1e3", Some(1000)),
            ("2.5", None),
            ("", None),
            ("1e300", None),
        ] {
            assert_eq!(whole(text), value, "{text}");
        }
        assert_eq!(object("4294967295", 1).unwrap(), u32::MAX);
        assert!(object("4294967296", 1).is_err() && object("0", 1).is_err() && object("-1", 1).is_err());
    }

    #[test]
    fn a_comma_alone_is_a_decimal_one() {
        assert_eq!(number("-1,5e2"), Some((-150.0, Some(Decimals::Comma))));
        assert_eq!(number("1.5"), Some((1.5, Some(Decimals::Point))));
        assert_eq!(number("7"), Some((7.0, None)));
        assert!(["1.234,5", "1,234,567", ",", "1,", "a,b"].into_iter().all(|text| number(text).is_none()));
    }
}
