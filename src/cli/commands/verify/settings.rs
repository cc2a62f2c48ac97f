//! Whether a store's report tells of the run that made it: what that was asked for, and what its inputs held, as it put it down
//! itself (`identity`), against the command line of the report and the inputs as they are now.

use std::collections::BTreeMap;
use std::path::Path;

use serde_json::Value;

use crate::cli::inputs::identity::identity;
use crate::cli::inputs::typed::Typed;
use crate::error::Result;
use crate::pipeline::verify::{Check, report_of};

/// Makes the check; none where there is no report, which other checks tell.
///
/// # Errors
/// When an input that is there cannot be read.
pub(super) fn check(store: &Path) -> Result<Option<Check>> {
    let Ok(report) = report_of(store) else { return Ok(None) };
    let mut found = Check::new("settings");
    let then: BTreeMap<String, String> = serde_json::from_value(report["fingerprint"].clone()).unwrap_or_default();
    if then.is_empty() {
        found.also("the run put nothing down of its inputs, as with --checkpoint off: not compared");
        return Ok(Some(found));
    }
    let typed: Vec<String> = serde_json::from_value(report["arguments"].clone()).unwrap_or_default();
    let Ok(Typed { given, .. }) = Typed::read(&typed) else {
        found.wrong_in("report.json", "has arguments that are no command line of strandline");
        return Ok(Some(found));
    };
    let Some(now) = identity(&typed)? else {
        found.also("an input can be read once only: not compared");
        return Ok(Some(found));
    };
    let mut now: BTreeMap<String, String> = now.into_iter().collect();
    // That of the program which made it, not of this one.
    now.extend(report["version"].as_str().map(|version| ("the version".into(), version.into())));
    let names = then.keys().chain(now.keys().filter(|name| !then.contains_key(*name)));
    let mut others = Vec::new();
    for name in names.filter(|name| then.get(*name) != now.get(*name)) {
        let of = |known: &BTreeMap<String, String>| known.get(name).map_or("nothing", String::as_str).to_owned();
        let is_input = given.iter().any(|given| given.is_path && given.name() == *name);
        match (then.contains_key(name) && now.contains_key(name), is_input) {
            (true, true) => others.push(of(&then)),
            _ => found.wrong_in(
                "report.json",
                format!("has {name} {} in its arguments; the run was made with {}", of(&now), of(&then)),
            ),
        }
    }
    found.also(&told(&report, then.len(), &others));
    Ok(Some(found))
}

fn told(report: &Value, all: usize, others: &[String]) -> String {
    let command = report["command"].as_str().unwrap_or_default();
    let same = format!("{} of {all} facts of the {command} that made it", all - others.len());
    if others.is_empty() {
        return same;
    }
    format!("{same}; no longer there or with other contents, seen from this folder: {}", others.join(", "))
}
