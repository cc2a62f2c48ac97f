//! What was found, as tables: of a segmentation a row for each object, of other runs a row for each number.

use serde_json::Value;

use super::html::Html;
use super::settings::told;
use crate::cli::terminal::text::grouped;

/// Rows that a page shows of many; `report.json` has all.
const MOST_ROWS: usize = 200;

/// So many objects are columns of a table, more of them rows.
const MOST_COLUMNS: usize = 3;

/// What the report's `result` says.
pub(super) fn found(page: &mut Html, result: &Value) {
    if let Some(objects) = result["objects"].as_array() {
        if objects.len() > MOST_COLUMNS {
            rows(page, objects.iter().map(object).collect(), &OBJECT);
        } else {
            few(page, &objects.iter().map(object).collect::<Vec<_>>());
        }
        let refused = result["refused"].as_array().into_iter().flatten();
        for refused in refused {
            page.element("p", &[("class", "warning")], &told(&refused["reason"]));
        }
        return;
    }
    let plain = |(name, value): (&String, &Value)| {
        let is_list = value.is_array() || value.is_object();
        (!is_list && !value.is_null()).then(|| vec![name.replace('_', " "), counted(value)])
    };
    let mut lines: Vec<Vec<String>> = result.as_object().into_iter().flatten().filter_map(plain).collect();
    let within = |name: &str, part: &str, called: &str| {
        let value = &result[name][part];
        (!value.is_null()).then(|| vec![called.to_owned(), counted(value)])
    };
    lines.extend(within("hausdorff", "mean", "points off the surface, mean"));
    lines.extend(within("hausdorff", "max", "points off the surface, largest"));
    lines.extend(within("hole", "width", "largest hole of the cloud, wide"));
    lines.extend(within("hole", "place_xyz", "that hole, at x, y, z"));
    rows(page, lines, &["what", "value"]);
    if let Some(pairs) = result["pairs"].as_array() {
        let of = |pair: &Value| {
            let range = |name: &str| format!("{} to {}", told(&pair[name]["min"]), told(&pair[name]["max"]));
            vec![told(&pair["labels"]), told(&pair["area"]), counted(&pair["triangles"]), range("thickness")]
        };
        rows(page, pairs.iter().map(of).collect(), &["labels", "area", "triangles", "thickness"]);
    }
    if let Some(labels) = result["label_voxels"].as_object().filter(|labels| !labels.is_empty()) {
        let mut labels: Vec<(u64, &Value)> =
            labels.iter().map(|(label, n)| (label.parse().unwrap_or(u64::MAX), n)).collect();
        labels.sort_by_key(|(label, _)| *label);
        let of = |(label, n): (u64, &Value)| vec![label.to_string(), counted(n)];
        rows(page, labels.into_iter().map(of).collect(), &["label", "voxels"]);
    }
}

const OBJECT: [&str; 12] = [
    "object",
    "volume",
    "area",
    "surface",
    "marks off, mean",
    "marks off, largest",
    "marks off by more than a voxel",
    "border in the image",
    "weights (marks, image)",
    "steps",
    "off outlines that are left out: mean, nine of ten within",
    "mark next",
];

/// The row of an object.
fn object(object: &Value) -> Vec<String> {
    let state = match (object["closed"].as_bool(), object["components"].as_u64()) {
        (Some(true), Some(1)) => "closed".into(),
        (Some(true), Some(n)) => format!("closed, {n} pieces"),
        (_, n) => format!("OPEN, {} pieces", n.unwrap_or(0)),
    };
    let check = &object["cross_validation"];
    let next = &check["next_slice"];
    let unchecked = "not checked (--cross-validate)";
    let or_dash = |is_there: bool, text: String| if is_there { text } else { "-".into() };
    vec![
        told(&object["label"]),
        told(&object["volume"]),
        told(&object["area"]),
        state,
        or_dash(object["hausdorff"].is_object(), told(&object["hausdorff"]["mean"])),
        or_dash(object["hausdorff"].is_object(), told(&object["hausdorff"]["max"])),
        counted(&object["marks_off"]),
        told(&object["image_model"]),
        format!("{}, {}", told(&object["theta"]), told(&object["rho"])),
        format!("{}, ended by {}", told(&object["time_steps"]), told(&object["stopped_by"])),
        if check.is_object() { format!("{}, {}", told(&check["mean"]), told(&check["p90"])) } else { unchecked.into() },
        or_dash(next.is_object(), format!("slice {} across {}", told(&next["slice"]), told(&next["axis"]))),
    ]
}

/// A table with a column for each object.
fn few(page: &mut Html, objects: &[Vec<String>]) {
    let name = |o: &Vec<String>| if objects.len() > 1 { format!("object {}", o[0]) } else { String::new() };
    let mut rows: Vec<Vec<String>> = vec![std::iter::once(String::new()).chain(objects.iter().map(name)).collect()];
    let line = |n: usize| std::iter::once(OBJECT[n].to_owned()).chain(objects.iter().map(|o| o[n].clone())).collect();
    rows.extend((usize::from(objects.len() > 1)..OBJECT.len()).map(line));
    page.table(&rows);
}

fn counted(value: &Value) -> String {
    value.as_u64().map_or_else(|| told(value), grouped)
}

fn rows(page: &mut Html, mut rows: Vec<Vec<String>>, head: &[&str]) {
    if rows.is_empty() {
        return;
    }
    let all = rows.len();
    rows.truncate(MOST_ROWS);
    rows.insert(0, head.iter().map(ToString::to_string).collect());
    page.table(&rows);
    if all > MOST_ROWS {
        let more = grouped((all - MOST_ROWS) as u64);
        page.element("p", &[], &format!("{more} more are in report.json."));
    }
}
