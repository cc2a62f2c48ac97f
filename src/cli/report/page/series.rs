//! The page of a series: volumes over time, a table of all objects at all times, and the pages of single times.

use serde_json::Value;

use super::document::{command_line, whole_page};
use super::html::Html;
use super::settings::{settings, told};
use super::{plots, warnings};
use crate::cli::report::series::{Row, Whole, at};
use crate::cli::terminal::text::duration;
use crate::error::Result;
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

/// The whole page; `page_of` is the page of a time, from where this one lies, where it has one.
///
/// # Errors
/// When a chart cannot be drawn.
pub(crate) fn page(whole: &Whole<'_>, typed: &[String], page_of: &dyn Fn(u32) -> Option<String>) -> Result<String> {
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
        let shift: Vec<String> = found["shift_xyz"].as_array().into_iter().flatten().map(told).collect();
        let or_dash = |value: &Value| if value.is_null() { "-".into() } else { told(value) };
        lines.push(vec![
            row.time.to_string(),
            row.object.map_or("-".into(), |object| object.to_string()),
            or_dash(&found["volume"]),
            or_dash(&found["area"]),
            or_dash(&found["hausdorff"]["mean"]),
            or_dash(&found["hausdorff"]["max"]),
            or_dash(&found["marks_from"]),
            shift.join(", "),
            row.reason.map_or(String::new(), |reason| format!("refused: {reason}")),
        ]);
    }
    page.table(&lines);
    if all > MOST_ROWS {
        page.element("p", &[], &format!("{} more rows are in volumes.csv.", all - MOST_ROWS));
    }
}
