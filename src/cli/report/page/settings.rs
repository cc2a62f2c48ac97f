//! The settings of a run as a table: what each is, whether it was given, and why it is what it is where nobody gave it.

use serde_json::Value;

use super::html::Html;
use crate::cli::terminal::text::{bytes, number};

/// Settings that are inputs and outputs, which the page tells elsewhere.
const NAMES: [&str; 7] = ["image", "points", "seeds", "sources", "cloud", "output", "scratch"];

/// Why settings are what they are where nobody gave them, and what is shown of one that has no value of its own.
const REASONS: [(&str, &str, &str); 15] = [
    ("delta", "", "a tenth of the smallest spacing: curvature smooths what is smaller than a voxel, and no more"),
    ("tau", "", "half of the smallest spacing: a step moves the surface by half a voxel at most"),
    ("epsilon", "", "a hundredth for each smallest spacing: gradients below count as flat"),
    ("rho", AUTOMATIC, "for each object, from how sure the image and the marks are; see what was found"),
    ("sigma", AUTOMATIC, "for each object, from what the image shows of it"),
    ("beta", AUTOMATIC, "how far from the points the surface starts was found; see what was found"),
    ("image_model", "", "what border the image shows is found from the grey values across each object's marks"),
    ("start", "", "the shape of the outlines where there are any, else a flood from outside"),
    ("crop_xyz", "", "the whole image"),
    ("axes", AUTOMATIC, "as the file says"),
    ("image_index", AUTOMATIC, "the file's first image"),
    ("image_type", "", "as the file says"),
    ("iterations", AUTOMATIC, "as many as it takes until nothing changes"),
    ("max_distance", "no limit", "every voxel gets its distance"),
    ("brick", "", "from the method and the size of the grid"),
];
const AUTOMATIC: &str = "automatic";

/// The table of the report's settings; `typed` is the command line.
pub(super) fn settings(page: &mut Html, report: &Value, typed: &[String]) {
    let mut rows = vec![["setting", "value", "why"].map(String::from).to_vec()];
    let all = report["settings"].as_object().into_iter().flatten();
    for (name, value) in all.filter(|(name, _)| !NAMES.contains(&name.as_str())) {
        let found = REASONS.iter().find(|(of, ..)| of == name && !is_chosen(name, value));
        let why = match found {
            _ if is_given(name, typed) => "given".into(),
            Some((.., reason)) => format!("automatic: {reason}"),
            None if value.is_null() => "not asked for".into(),
            None => "default".into(),
        };
        let shown = found.map(|(_, shown, _)| *shown).filter(|shown| value.is_null() && !shown.is_empty());
        let shown = shown.map_or_else(|| told(value), str::to_owned);
        rows.push(vec![name.replace('_', " "), shown, why]);
    }
    let memory = report["memory_budget_bytes"].as_u64().unwrap_or(0);
    for (name, value, reason) in [
        ("memory", bytes(memory), "automatic: half of what the machine, or the group that the run is in, may use"),
        ("threads", told(&report["threads"]), "automatic: one for each core"),
    ] {
        let why = if is_given(name, typed) { "given" } else { reason };
        rows.push([name, &value, why].map(String::from).to_vec());
    }
    page.table(&rows);
}

/// Whether a setting that may choose by itself does not.
fn is_chosen(name: &str, value: &Value) -> bool {
    ["image_model", "start"].contains(&name) && value != "auto"
}

/// Whether the flag of a setting was typed.
fn is_given(name: &str, typed: &[String]) -> bool {
    let flag = match name {
        "crop_xyz" => "--crop".into(),
        "image_model" => "--image".into(),
        "stop" | "tol" => format!("--{name}"),
        _ => format!("--{}", name.replace('_', "-")),
    };
    typed.iter().any(|word| word.strip_prefix(&flag).is_some_and(|rest| rest.is_empty() || rest.starts_with('=')))
}

/// A value as people read it.
pub(super) fn told(value: &Value) -> String {
    match value {
        Value::Null => "none".into(),
        Value::Bool(true) => "yes".into(),
        Value::Bool(false) => "no".into(),
        Value::Number(n) if n.is_f64() => n.as_f64().map_or(String::new(), number),
        Value::Array(all) => all.iter().map(told).collect::<Vec<_>>().join(", "),
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flags_are_known_by_their_names() {
        let typed = ["strandline", "segment", "--max-steps=9", "--tau", "2", "--crop", "0:9"].map(String::from);
        for (name, given) in [("max_steps", true), ("tau", true), ("crop_xyz", true), ("tol", false), ("max", false)] {
            assert_eq!(is_given(name, &typed), given, "{name}");
        }
    }
}
