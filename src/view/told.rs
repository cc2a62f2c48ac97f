//! What the page's line says beside the state of a run: whose page it is, where the reports are, and what cannot be shown.

use percent_encoding::{NON_ALPHANUMERIC, utf8_percent_encode};
use serde_json::{Value, json};

use super::listing::{file_name, quoted};
use super::shown::{Series, Shown};

/// The page of a run, in its store, and that of a batch, beside its stores.
const REPORT: &str = "report.html";
pub(super) const BATCH: &str = "summary.html";
/// Reports that are linked, at most.
const MOST: usize = 4;
/// Notes that a line has room for.
const MOST_NOTES: usize = 3;
/// Times that are named, at most.
const MOST_TIMES: usize = 12;

/// The addresses of reports on the server, and what each is called. Of a batch its own comes first.
pub(super) fn reports(shown: &Shown) -> Vec<(String, String)> {
    let own = shown.beside.as_ref().filter(|folder| folder.root().join(BATCH).is_file());
    let own = own.map(|_| ("summary".to_owned(), format!("/data/{BATCH}")));
    let holding = shown.roots.iter().filter(|(_, folder)| folder.root().join(REPORT).is_file());
    let of_stores = holding.map(|(name, _)| {
        let title = if shown.roots.len() == 1 { "report".into() } else { format!("report of {name}") };
        (title, format!("/data/{}/{REPORT}", utf8_percent_encode(name, NON_ALPHANUMERIC)))
    });
    own.into_iter().chain(of_stores).collect()
}

/// The links of the page.
pub(super) fn links(shown: &Shown) -> Value {
    let link = |(title, address): (String, String)| json!({ "title": title, "address": address });
    reports(shown).into_iter().take(MOST).map(link).collect()
}

/// What is there and not to be seen.
pub(super) fn notes(shown: &Shown) -> Vec<String> {
    let faults = shown.faults.iter().cloned();
    faults.chain(shown.series.iter().map(|series| of_series(shown, series))).take(MOST_NOTES).collect()
}

/// Surfaces of single times, which the page cannot tell from each other.
fn of_series(shown: &Shown, series: &Series) -> String {
    let of = if shown.roots.len() > 1 { format!("{}: ", series.root) } else { String::new() };
    let Some(first) = series.with_surfaces.first() else { return format!("{of}no time has a surface") };
    let missing: Vec<u32> = series.times.clone().filter(|time| !series.with_surfaces.contains(time)).collect();
    let without = match missing.len() {
        0 => String::new(),
        n => {
            let named: Vec<String> = missing.iter().take(MOST_TIMES).map(ToString::to_string).collect();
            let more = if n > MOST_TIMES { format!(" and {} more", n - MOST_TIMES) } else { String::new() };
            format!("no surface of {} {}{more}; ", if n == 1 { "time" } else { "times" }, named.join(", "))
        }
    };
    let root = shown.roots.iter().find(|(name, _)| *name == series.root);
    // As it was typed, or in the folder that was.
    let store = root
        .filter(|_| shown.beside.is_some())
        .map_or_else(|| shown.path().to_path_buf(), |(_, folder)| shown.path().join(file_name(folder.root())));
    let of_time = quoted(&store.join(format!("meshes/t{first:04}")));
    format!("{of}{without}surfaces of single times are not drawn here, strandline view {of_time} draws them")
}
