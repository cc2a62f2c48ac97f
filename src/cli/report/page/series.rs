//! The page of a series: volumes over time, slices through some times, a table of all objects at all times, and the pages of single
//! times.

use std::path::Path;

use serde_json::Value;

use super::document::{command_line, whole_page};
use super::evidence::{Evidence, Measure, Root};
use super::html::Html;
use super::picture::Picture;
use super::settings::{settings, told};
use super::{plots, slices, warnings};
use crate::cli::report::series::{Row, Whole, at};
use crate::cli::terminal::text::{duration, number};
use crate::error::Result;
use crate::exec::Stage;
use crate::grid::{DataSets, Geometry};
use crate::kernel::image::picture::palette::label_color;

/// Objects in a chart, the largest.
const MOST_CURVES: usize = 24;
/// Rows of the table.
const MOST_ROWS: usize = 400;
const HEAD: [&str; 9] = [
    "time",
    "object",
    "volume",
    "area",
    "marks off, mean",
    "marks off, largest",
    "marks of time",
    "moved by (x, y, z)",
    "",
];

/// Times whose objects are missing that are named, at most.
const MOST_NAMED: usize = 30;

/// Slices through a time.
pub(crate) struct Slices {
    pub(crate) time: u32,
    pub(crate) pictures: Vec<Picture>,
}

/// Slices through the store of a time, with the outlines of its objects and the marks that these were made from.
///
/// # Errors
/// When the store cannot be read.
pub(crate) fn slices_of(
    stage: &Stage<'_>,
    store: &Path,
    marks: &DataSets,
    geometry: &Geometry,
) -> Result<Vec<Picture>> {
    let centre = geometry.position(geometry.shape.map(|n| n / 2));
    slices::slices(stage, store, &evidence(marks, centre))
}

fn evidence(marks: &DataSets, centre: [f64; 3]) -> Evidence<'_> {
    Evidence { root: Root::Image, measure: Measure::ToMarks, sources: marks, centre, points: "marks" }
}

/// The whole page; `page_of` is the page of a time, from where this one lies, where it has one.
///
/// # Errors
/// When a chart cannot be drawn.
pub(crate) fn page(
    whole: &Whole<'_>,
    typed: &[String],
    of_times: &[Slices],
    page_of: &dyn Fn(u32) -> Option<String>,
) -> Result<String> {
    let report = whole.report();
    let image = told(&report["settings"]["image"]);
    let title = format!("strandline segment: {} over time", image.rsplit('/').next().unwrap_or_default());
    let rows: Vec<Row> = whole.times.iter().flat_map(crate::cli::report::series::TimeReport::rows).collect();
    let charts = charts(whole, &rows, report["grid"]["unit"].as_str())?;
    Ok(whole_page(&title, |page| {
        page.element("h1", &[], &title);
        summary(page, whole, &report);
        for line in warnings::lines(&whole.notes) {
            page.element("p", &[("class", "warning")], &line);
        }
        missing(page, &rows);
        page.element("h2", &[], "Run");
        page.element("p", &[("class", "faint")], "The command as it was typed; a click selects it.");
        page.element("pre", &[], &command_line(typed));
        page.element("h2", &[], "Volumes over time");
        page.within("div", &[("class", "figures few")], |page| {
            for chart in &charts {
                page.within("figure", &[], |figure| figure.raw(chart));
            }
        });
        table(page, rows);
        put_slices(page, whole, of_times);
        page.element("h2", &[], "Times");
        page.within("p", &[], |page| {
            page.text("Slices, surfaces and all numbers of single times: ");
            for (time, address) in whole.times.iter().filter_map(|time| Some((time.time, page_of(time.time)?))) {
                page.element("a", &[("href", &*address)], &time.to_string());
                page.text(" ");
            }
        });
        page.element("h2", &[], "Settings");
        settings(page, &report, typed);
    }))
}

fn summary(page: &mut Html, whole: &Whole<'_>, report: &Value) {
    let unit = report["grid"]["unit"].as_str().unwrap_or("units of length");
    let (times, version) = (whole.chosen, told(&report["version"]));
    let (last, took) = (times.end - 1, duration(whole.seconds));
    page.element(
        "p",
        &[("class", "faint")],
        &format!(
            "strandline {version}; times {} to {last}, counted from 0, {took}. Lengths in {unit}; areas and volumes in its square \
             and cube. All numbers are in report.json and volumes.csv beside this page.",
            times.start
        ),
    );
}

/// Says at which times objects have no surface.
fn missing(page: &mut Html, rows: &[Row]) {
    let mut times: Vec<u32> = rows.iter().filter(|row| row.found.is_none()).map(|row| row.time).collect();
    times.dedup();
    if times.is_empty() {
        return;
    }
    let named: Vec<String> = times.iter().take(MOST_NAMED).map(ToString::to_string).collect();
    let more = times.len().saturating_sub(MOST_NAMED);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    let which = if times.len() == 1 { "time" } else { "times" };
    let text = format!("Surfaces are missing at {which} {}{more}: the table says why.", named.join(", "));
    page.element("p", &[("class", "warning")], &text);
}

fn put_slices(page: &mut Html, whole: &Whole<'_>, of_times: &[Slices]) {
    if of_times.is_empty() {
        return;
    }
    page.element("h2", &[], "Slices");
    let none = DataSets::default();
    page.element("p", &[("class", "faint")], &slices::explained(&evidence(&none, [0.0; 3])));
    for Slices { time, pictures } in of_times {
        let unit = whole.axis.unit.as_deref().unwrap_or_default();
        let of_clock = at(*time, whole.axis).map_or(String::new(), |at| format!(" ({} {unit})", number(at)));
        page.element("h3", &[], &format!("Time {time}{of_clock}"));
        page.within("div", &[("class", "figures")], |page| pictures.iter().for_each(|picture| picture.put(page)));
    }
}

/// A chart of volumes; the largest objects where there are many.
fn charts(whole: &Whole<'_>, rows: &[Row], unit: Option<&str>) -> Result<Vec<String>> {
    let mut curves: Vec<(u64, Vec<(f64, f64)>)> = Vec::new();
    for row in rows {
        let volume = row.found.as_ref().and_then(|found| found["volume"].as_f64());
        let (Some(object), Some(volume)) = (row.object, volume) else { continue };
        let place = (at(row.time, whole.axis).unwrap_or(f64::from(row.time)), volume);
        match curves.iter_mut().find(|(known, _)| *known == object) {
            Some((_, curve)) => curve.push(place),
            None => curves.push((object, vec![place])),
        }
    }
    let largest = |curve: &[(f64, f64)]| curve.iter().map(|(_, volume)| *volume).fold(0.0, f64::max);
    curves.sort_by(|(_, a), (_, b)| largest(b).total_cmp(&largest(a)));
    curves.truncate(MOST_CURVES);
    if curves.is_empty() {
        return Ok(Vec::new());
    }
    let drawn: Vec<plots::Curve> =
        curves.into_iter().map(|(object, curve)| (curve, label_color(u32::try_from(object).unwrap_or(0)))).collect();
    let time = whole.axis.unit.as_ref().map_or("time".into(), |unit| format!("time ({unit})"));
    let volume = unit.map_or("volume".into(), |unit| format!("volume ({unit} cubed)"));
    Ok(vec![plots::over_time(&drawn, [&time, &volume])?])
}

fn table(page: &mut Html, rows: Vec<Row>) {
    let all = rows.len();
    let mut lines = vec![HEAD.map(String::from).to_vec()];
    for row in rows.into_iter().take(MOST_ROWS) {
        let found = row.found.unwrap_or_default();
        let shift: Vec<String> = row.origin["shift_xyz"].as_array().into_iter().flatten().map(told).collect();
        let or_dash = |value: &Value| if value.is_null() { "-".into() } else { told(value) };
        lines.push(vec![
            row.time.to_string(),
            row.object.map_or("-".into(), |object| object.to_string()),
            or_dash(&found["volume"]),
            or_dash(&found["area"]),
            or_dash(&found["hausdorff"]["mean"]),
            or_dash(&found["hausdorff"]["max"]),
            or_dash(&row.origin["marks_from"]),
            shift.join(", "),
            row.reason.map_or(String::new(), |reason| format!("refused: {reason}")),
        ]);
    }
    page.table(&lines);
    if all > MOST_ROWS {
        page.element("p", &[], &format!("{} more rows are in volumes.csv.", all - MOST_ROWS));
    }
}
