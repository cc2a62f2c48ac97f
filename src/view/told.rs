//! What the page's line says beside the state of a run: whose page it is, where the reports are, and what cannot be shown.

use serde_json::{Value, json};

use super::choice::{Chosen, name_in_address};
use super::listing::{file_name, quoted};
use super::shown::{Series, Shown};

/// The page of a run, in its store, and that of a batch, beside its stores.
const REPORT: &str = "report.html";
pub(super) const BATCH: &str = "summary.html";
/// Times that are named, at most.
const MOST_TIMES: usize = 12;

/// A report.
pub(super) struct Report {
    /// The store that it is of; none of that of a batch.
    root: Option<String>,
    title: String,
    /// Its address on the server.
    pub(super) address: String,
}

/// All reports. Of a batch its own comes first.
pub(super) fn reports(shown: &Shown) -> Vec<Report> {
    let own = shown.beside.as_ref().filter(|folder| folder.root().join(BATCH).is_file());
    let own = own.map(|_| Report { root: None, title: "summary".into(), address: format!("/data/{BATCH}") });
    let holding = shown.roots.iter().filter(|(_, folder)| folder.root().join(REPORT).is_file());
    let of_stores = holding.map(|(name, _)| Report {
        root: Some(name.clone()),
        title: if shown.roots.len() == 1 { "report".into() } else { format!("report of {name}") },
        address: format!("/data/{}/{REPORT}", name_in_address(name)),
    });
    own.into_iter().chain(of_stores).collect()
}

/// The links of the page: the report of its store, and that of the batch.
pub(super) fn links(chosen: &Chosen<'_>) -> Value {
    let is_of_it = |report: &Report| report.root.as_deref().is_none_or(|root| root == chosen.root);
    let link = |report: Report| json!({ "title": report.title, "address": report.address });
    reports(chosen.shown).into_iter().filter(is_of_it).map(link).collect()
}

/// What is there and not to be seen.
pub(super) fn notes(chosen: &Chosen<'_>) -> Vec<String> {
    let shown = chosen.shown;
    let series = shown.series.iter().filter(|series| chosen.has(&series.root));
    let fields = match chosen.fields_aside() {
        0 => None,
        1 => Some("1 more field is in the list of layers (upper right)".to_owned()),
        n => Some(format!("{n} more fields are in the list of layers (upper right)")),
    };
    let others = chosen.leaves_others_out().then(|| {
        format!("layers are those of {} alone; the other {} stores are chosen here", chosen.root, shown.roots.len() - 1)
    });
    let marks = shown.marks.iter().find(|marks| chosen.has(&marks.root) && marks.places.len() < marks.of);
    let marks = marks.map(|marks| format!("{} of {} marks are drawn", marks.places.len(), marks.of));
    let of_store = fields.into_iter().chain(marks).chain(series.map(|series| of_series(shown, series)));
    others.into_iter().chain(of_store).chain(shown.faults.iter().cloned()).collect()
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
