//! Which columns of a table hold what, and the points gathered from its lines.

use crate::error::{Error, Result};
use crate::grid::PointCloud;
use crate::io::text::quoted;

/// The places of the columns that matter, counted from 0.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Columns {
    /// Columns of x, y and z.
    position: [usize; 3],
    object: Option<usize>,
    contour: Option<usize>,
}

impl Columns {
    /// x, y, z first and nothing else of use.
    pub(super) const FIRST_THREE: Self = Self { position: [0, 1, 2], object: None, contour: None };

    /// Finds the columns by the names in a header; upper and lower case are the same.
    pub(super) fn named(names: &[&str]) -> Result<Self> {
        let names: Vec<String> = names.iter().map(|n| n.trim().trim_matches('"').to_lowercase()).collect();
        if names.iter().any(|n| n == "axis-3") {
            return Err(Error::input("names more than three axes; keep axis-0, axis-1, axis-2 (z, y, x) of one time"));
        }
        let napari = ["axis-2", "axis-1", "axis-0"];
        let has = |wanted: &str| names.iter().any(|n| n == wanted);
        let wanted =
            if napari.into_iter().all(has) && !["x", "y", "z"].into_iter().all(has) { napari } else { ["x", "y", "z"] };
        let missing: Vec<&str> = wanted.into_iter().filter(|n| !has(n)).collect();
        if !missing.is_empty() {
            return Err(Error::input(format!(
                "names the columns {} but not {}; needed are x, y, z",
                quoted(&names.join(", ")),
                missing.join(", ")
            )));
        }
        let mut position = [0; 3];
        for (place, name) in position.iter_mut().zip(wanted) {
            *place = one_column(&names, name)?.unwrap_or_default();
        }
        Ok(Self { position, object: one_column(&names, "object")?, contour: one_column(&names, "contour")? })
    }
}

/// The column of that name, where there is one.
fn one_column(names: &[String], name: &str) -> Result<Option<usize>> {
    let mut places = (0..names.len()).filter(|&i| names[i] == name);
    let first = places.next();
    match places.next() {
        None => Ok(first),
        Some(_) => Err(Error::input(format!("names the column {name} twice; leave one"))),
    }
}

/// Points gathered line by line.
#[derive(Debug)]
pub(super) struct Rows {
    columns: Columns,
    /// The line that set how many fields a line has, and that number.
    model: Option<(u64, usize)>,
    cloud: PointCloud,
}

impl Rows {
    pub(super) fn new(columns: Columns) -> Self {
        Self { columns, model: None, cloud: PointCloud::default() }
    }

    /// Tells from the header how many fields each line has.
    pub(super) fn set_model(&mut self, line: u64, fields: usize) {
        self.model = Some((line, fields));
    }

    /// Takes the point in the fields of a line; a line of empty fields is none.
    pub(super) fn push(&mut self, line: u64, fields: &[&str]) -> Result<()> {
        if fields.iter().all(|field| field.trim().is_empty()) {
            return Ok(());
        }
        let (model_line, wanted) = *self.model.get_or_insert((line, fields.len()));
        if fields.len() != wanted {
            return Err(Error::input(format!(
                "line {line} has {} columns where line {model_line} has {wanted}; complete the line or delete it",
                fields.len()
            )));
        }
        let mut position = [0.0; 3];
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            let field = fields.get(self.columns.position[axis]).ok_or_else(|| too_few(line, wanted))?;
            position[axis] = coordinate(field, name, line)?;
        }
        if let Some(column) = self.columns.object {
            self.cloud.objects.push(object(fields[column], line)?);
        }
        if let Some(column) = self.columns.contour {
            self.cloud.contours.push(contour(fields[column], line)?);
        }
        self.cloud.positions.push(position);
        Ok(())
    }

    pub(super) fn finish(self) -> PointCloud {
        self.cloud
    }
}

fn too_few(line: u64, found: usize) -> Error {
    let noun = if found == 1 { "column" } else { "columns" };
    Error::input(format!("line {line} has {found} {noun}; a point needs x, y and z"))
}

/// A finite coordinate.
fn coordinate(field: &str, name: &str, line: u64) -> Result<f64> {
    let field = field.trim();
    let value: f64 = field.parse().map_err(|_| {
        let hint = if field.contains(',') { "; write decimals with a point" } else { "; give a number" };
        Error::input(format!("line {line}: {name} is {}, which is not a number{hint}", quoted(field)))
    })?;
    if value.is_finite() {
        Ok(value)
    } else {
        Err(Error::input(format!("line {line}: {name} is {}, which is not finite; delete the point", quoted(field))))
    }
}

/// A positive whole number, also when written as 2.0.
fn object(field: &str, line: u64) -> Result<u32> {
    let value = whole(field).and_then(|v| u32::try_from(v).ok()).filter(|&v| v > 0);
    value.ok_or_else(|| {
        Error::input(format!("line {line}: object is {}; objects are numbered 1, 2, 3 and so on", quoted(field)))
    })
}

fn contour(field: &str, line: u64) -> Result<i64> {
    whole(field).ok_or_else(|| {
        Error::input(format!("line {line}: contour is {}; contours are named by whole numbers", quoted(field)))
    })
}

fn whole(field: &str) -> Option<i64> {
    let field = field.trim();
    let from_real = || {
        let exact_up_to = (1_i64 << 53) as f64;
        let value: f64 = field.parse().ok()?;
        (value.fract() == 0.0 && value.abs() <= exact_up_to).then_some(value as i64)
    };
    field.parse().ok().or_else(from_real)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_found_in_any_order_and_case() {
        let found = Columns::named(&["Object", " Z ", "note", "\"Y\"", "X"]).unwrap();
        assert_eq!(found, Columns { position: [4, 3, 1], object: Some(0), contour: None });
        let napari = Columns::named(&["index", "axis-0", "axis-1", "axis-2"]).unwrap();
        assert_eq!(napari, Columns { position: [3, 2, 1], object: None, contour: None });
    }

    #[test]
    fn unusable_headers_are_refused() {
        for (names, reason) in [
            (&["a", "x"][..], "not y, z"),
            (&["x", "y", "z", "X"], "twice"),
            (&["x", "y", "z", "object", "object"], "twice"),
            (&["axis-0", "axis-1", "axis-2", "axis-3"], "axes"),
            (&["axis-0", "axis-1"], "not x, y, z"),
        ] {
            let message = Columns::named(names).unwrap_err().to_string();
            assert!(message.contains(reason), "{message}");
        }
    }

    #[test]
    fn whole_numbers() {
        for (text, value) in
            [("7", Some(7)), (" 2.0 ", Some(2)), ("1e3", Some(1000)), ("2.5", None), ("", None), ("1e300", None)]
        {
            assert_eq!(whole(text), value, "{text}");
        }
        assert_eq!(object("4294967295", 1).unwrap(), u32::MAX);
        assert!(object("4294967296", 1).is_err() && object("0", 1).is_err() && object("-1", 1).is_err());
    }
}
