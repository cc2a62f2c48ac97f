//! What summaries tell, as rows: one for each item and object; and as comma-separated values.

use serde::Serialize;

use super::state::{Object, Stage, State};
use crate::cli::report::csv::quoted;

/// A row. Volume, area and distances physical.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Row {
    pub(crate) item: String,
    pub(crate) object: Option<u64>,
    /// Of an item of one time of an image, or of several.
    pub(crate) time: Option<u64>,
    pub(crate) state: &'static str,
    pub(crate) exit_code: Option<i32>,
    pub(crate) reason: Option<String>,
    pub(crate) volume: Option<f64>,
    pub(crate) area: Option<f64>,
    pub(crate) marks_mean: Option<f64>,
    pub(crate) marks_max: Option<f64>,
    pub(crate) seconds: Option<f64>,
    pub(crate) peak_memory_bytes: Option<u64>,
}

/// How many items are what.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub(crate) struct Counts {
    pub(crate) done: usize,
    pub(crate) failed: usize,
    pub(crate) skipped: usize,
    pub(crate) interrupted: usize,
}

/// The rows of an item: one for each object, or one alone.
pub(super) fn rows(name: &str, state: Option<&State>) -> Vec<Row> {
    let stage = state.map_or(Stage::Skipped, |state| state.stage);
    let whole = Row {
        item: name.into(),
        object: None,
        // The one time that an item was asked for; of several each object has its own.
        time: state.and_then(|state| state.settings.get("time")?.parse().ok()),
        state: stage.name(),
        exit_code: state.and_then(|state| state.code),
        reason: state.and_then(|state| state.reason.clone()),
        volume: None,
        area: None,
        marks_mean: None,
        marks_max: None,
        seconds: state.and_then(|state| state.seconds),
        peak_memory_bytes: state.and_then(|state| state.peak),
    };
    let objects = state.map_or(&[][..], |state| &state.objects);
    if objects.is_empty() {
        return vec![whole];
    }
    let row = |object: &Object| Row {
        object: object.label,
        time: object.time.or(whole.time),
        // Of a run that failed in part the objects that it found are done.
        state: if object.reason.is_some() { Stage::Failed.name() } else { Stage::Done.name() },
        reason: object.reason.clone(),
        volume: object.volume,
        area: object.area,
        marks_mean: object.marks_mean,
        marks_max: object.marks_max,
        ..whole.clone()
    };
    objects.iter().map(row).collect()
}

/// Values between commas, with a heading; none is empty.
pub(super) fn csv(rows: &[Row]) -> String {
    let mut text = String::from(
        "item,object,time,state,exit_code,reason,volume,area,marks_mean,marks_max,seconds,peak_memory_bytes\n",
    );
    for row in rows {
        let cells = [
            quoted(&row.item),
            cell(row.object),
            cell(row.time),
            row.state.into(),
            cell(row.exit_code),
            row.reason.as_deref().map_or(String::new(), quoted),
            cell(row.volume),
            cell(row.area),
            cell(row.marks_mean),
            cell(row.marks_max),
            cell(row.seconds),
            cell(row.peak_memory_bytes),
        ];
        text.push_str(&cells.join(","));
        text.push('\n');
    }
    text
}

/// A value as a cell.
fn cell<T: ToString>(value: Option<T>) -> String {
    value.map_or(String::new(), |value| value.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_keep_what_is_in_them() {
        let mut row = rows("x,y", None).remove(0);
        row.volume = Some(0.1);
        assert!(csv(&[row]).ends_with("\n\"x,y\",,,skipped,,,0.1,,,,,\n"));
    }
}
