//! The report of a series: what the reports of its times say, joined; its table over time, as a file and for the terminal.

use std::fmt::Write;
use std::ops::Range;

use serde_json::{Map, Value, json};

use crate::cli::inputs::over_time::Asked;
use crate::cli::report::csv;
use crate::cli::report::table::aligned;
use crate::cli::terminal::text::number;
use crate::io::ome_zarr::TimeAxis;

/// Rows of the table on a terminal.
const MOST_ROWS: usize = 60;
/// What of stages is summed over times.
const SUMMED: [&str; 7] = ["seconds", "voxels", "brick_loads", "bricks", "bytes_read", "bytes_written", "iterations"];

/// A time of a series, and what came of it.
pub(crate) struct TimeReport {
    /// The image's time, counted from 0.
    pub(crate) time: u32,
    /// The report of its run; none where nothing of it could be solved.
    pub(crate) report: Option<Value>,
    /// Why nothing of it could be.
    pub(crate) reason: Option<String>,
    /// Where nothing could be, the objects that were asked for, and where their marks are from.
    pub(crate) asked: Vec<Asked>,
}

/// An object at a time.
#[derive(Clone, Debug)]
pub(crate) struct Row {
    pub(crate) time: u32,
    pub(crate) object: Option<u64>,
    /// What was found of it; none where it was refused.
    pub(crate) found: Option<Value>,
    pub(crate) reason: Option<String>,
    /// Where its marks are from, as reports tell that.
    pub(crate) origin: Value,
}

impl TimeReport {
    /// A time with the report of its run.
    pub(crate) fn solved(time: u32, report: Value) -> Self {
        Self { time, report: Some(report), reason: None, asked: Vec::new() }
    }

    /// What came of all objects, in order of their labels.
    pub(crate) fn rows(&self) -> Vec<Row> {
        let time = self.time;
        let (found, refused) = match &self.report {
            Some(report) => (list(&report["result"]["objects"]), list(&report["result"]["refused"])),
            None => (Vec::new(), self.refused()),
        };
        let found = found.into_iter().map(|object| Row {
            time,
            object: object["label"].as_u64(),
            reason: None,
            origin: object.clone(),
            found: Some(object),
        });
        let refused = refused.into_iter().map(|object| Row {
            time,
            object: object["label"].as_u64(),
            found: None,
            reason: object["reason"].as_str().map(ToOwned::to_owned),
            origin: object,
        });
        let mut rows: Vec<Row> = found.chain(refused).collect();
        rows.sort_by_key(|row| row.object);
        rows
    }

    /// The objects of a time of which nothing could be solved, as reports list those that were refused.
    fn refused(&self) -> Vec<Value> {
        let told = |from: &Asked| {
            let mut told = json!({ "label": from.object, "reason": self.reason });
            if let (Value::Object(told), Ok(Value::Object(origin))) = (&mut told, serde_json::to_value(from.origin)) {
                told.extend(origin);
            }
            told
        };
        self.asked.iter().map(told).collect()
    }

    /// The time as the report of the series lists it.
    fn told(&self, axis: &TimeAxis) -> Value {
        let mut told = Map::new();
        told.insert("time".into(), json!(self.time));
        told.insert("at".into(), json!(at(self.time, axis)));
        told.insert("reason".into(), json!(self.reason));
        if let Some(report) = &self.report {
            for key in ["seconds", "peak_rss_bytes", "notes"] {
                told.insert(key.into(), report[key].clone());
            }
            // Of one object everything stands in the list, too.
            let lists = ["objects", "refused", "label_voxels", "neighbours", "contacts"];
            told.extend(lists.map(|key| (key.to_owned(), report["result"][key].clone())));
        } else {
            told.insert("refused".into(), self.refused().into());
        }
        let state = match (&self.report, self.rows().iter().any(|row| row.reason.is_some())) {
            (None, _) => "refused",
            (_, true) => "partly",
            _ => "done",
        };
        told.insert("state".into(), json!(state));
        told.into()
    }
}

fn list(value: &Value) -> Vec<Value> {
    value.as_array().cloned().unwrap_or_default()
}

/// The time in the unit of the axis, where it has one.
pub(crate) fn at(time: u32, axis: &TimeAxis) -> Option<f64> {
    axis.unit.as_ref().map(|_| f64::from(time) * axis.step)
}

/// What is said of the whole run.
pub(crate) struct Whole<'a> {
    pub(crate) times: &'a [TimeReport],
    pub(crate) chosen: &'a Range<u32>,
    pub(crate) axis: &'a TimeAxis,
    pub(crate) output: Option<String>,
    pub(crate) notes: Vec<String>,
    pub(crate) seconds: f64,
}

impl Whole<'_> {
    /// The report of the series: that of its first time, with all times in its result.
    pub(crate) fn report(&self) -> Value {
        let reports = || self.times.iter().filter_map(|time| time.report.as_ref());
        let mut whole = reports().next().cloned().unwrap_or_default();
        let peak = reports().filter_map(|report| report["peak_rss_bytes"].as_u64()).max();
        let axis = self.axis;
        whole["settings"]["time"] = json!(format!("{}:{}", self.chosen.start, self.chosen.end));
        whole["settings"]["output"] = json!(self.output);
        whole["grid"]["times"] = json!(self.chosen.len());
        whole["grid"]["time_first"] = json!(axis.first);
        whole["grid"]["time_step"] = json!(axis.step);
        whole["grid"]["time_unit"] = json!(axis.unit);
        whole["peak_rss_bytes"] = json!(peak);
        whole["seconds"] = json!(self.seconds);
        whole["notes"] = json!(self.notes);
        whole["stages"] = stages(reports());
        let times: Vec<Value> = self.times.iter().map(|time| time.told(axis)).collect();
        whole["result"] = json!({ "times": times });
        whole
    }

    /// `volumes.csv`: a row for each object at each time; physical, times in the unit of the axis where it has one.
    pub(crate) fn table(&self) -> String {
        let mut text = String::from(
            "t,time,object,state,volume,area,voxels,centroid_x,centroid_y,centroid_z,marks_from,shift_x,shift_y,shift_z,\
             reason\n",
        );
        for row in self.times.iter().flat_map(TimeReport::rows) {
            let found = row.found.clone().unwrap_or_default();
            let cell = |value: &Value| if value.is_number() { value.to_string() } else { String::new() };
            let triple = |of: &Value| (0..3).map(|a| cell(&of[a])).collect::<Vec<_>>().join(",");
            // A string takes whatever is written.
            let _ = writeln!(
                text,
                "{},{},{},{},{},{},{},{},{},{},{}",
                row.time,
                at(row.time, self.axis).map_or(String::new(), |at| at.to_string()),
                row.object.map_or(String::new(), |object| object.to_string()),
                if row.found.is_some() { "done" } else { "refused" },
                cell(&found["volume"]),
                cell(&found["area"]),
                cell(&found["voxels"]),
                triple(&found["centroid_xyz"]),
                cell(&row.origin["marks_from"]),
                triple(&row.origin["shift_xyz"]),
                row.reason.as_deref().map_or(String::new(), csv::quoted),
            );
        }
        text
    }

    /// The same for the terminal.
    pub(crate) fn told(&self, whole_in: &str) -> String {
        let mut rows = vec![
            ["time", "object", "volume", "area", "marks off, mean", "largest", "marks of time", "moved by"]
                .map(String::from),
        ];
        let all: Vec<Row> = self.times.iter().flat_map(TimeReport::rows).collect();
        for row in all.iter().take(MOST_ROWS) {
            let found = row.found.clone().unwrap_or_default();
            let value = |value: &Value| value.as_f64().map_or("-".into(), number);
            let shift: Vec<f64> = (0..3).filter_map(|a| row.origin["shift_xyz"][a].as_f64()).collect();
            rows.push([
                row.time.to_string(),
                row.object.map_or("-".into(), |object| object.to_string()),
                if row.found.is_some() { value(&found["volume"]) } else { "REFUSED".into() },
                value(&found["area"]),
                value(&found["hausdorff"]["mean"]),
                value(&found["hausdorff"]["max"]),
                value(&row.origin["marks_from"]),
                if shift.len() == 3 { number(shift.iter().map(|v| v * v).sum::<f64>().sqrt()) } else { "-".into() },
            ]);
        }
        let more = match all.len().saturating_sub(MOST_ROWS) {
            0 => String::new(),
            more => format!("... {more} more rows {whole_in}\n"),
        };
        format!("{}{more}", aligned(&rows))
    }
}

/// The stages of all times, those of a name as one.
fn stages<'a>(reports: impl Iterator<Item = &'a Value>) -> Value {
    let mut all: Vec<Value> = Vec::new();
    for stage in reports.flat_map(|report| report["stages"].as_array().into_iter().flatten()) {
        let Some(sum) = all.iter_mut().find(|sum| sum["name"] == stage["name"]) else {
            all.push(stage.clone());
            continue;
        };
        for key in SUMMED {
            sum[key] = match (sum[key].as_u64(), stage[key].as_u64()) {
                (Some(a), Some(b)) => json!(a + b),
                _ => json!(sum[key].as_f64().unwrap_or(0.0) + stage[key].as_f64().unwrap_or(0.0)),
            };
        }
        sum["peak_rss_bytes"] = json!(sum["peak_rss_bytes"].as_u64().max(stage["peak_rss_bytes"].as_u64()));
    }
    all.into()
}
