//! `summary.csv`, `summary.json` and `summary.html`: a row for each item and object, made of what is kept of items alone. So
//! they are the same in whatever order items ended, and whichever shards ran them.

use std::io::Write;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use serde::Serialize;

use super::page;
use super::rows::{Counts, Row, csv, rows};
use super::state::{Folder, Stage, State};
use crate::cli::args::batch::Shard;
use crate::cli::outputs::files::write_whole;
use crate::error::{Error, Result};

/// The share of the time that goes into summaries at most, but for the last ones.
const SHARE: u32 = 20;

#[derive(Serialize)]
struct Whole<'a> {
    version: &'static str,
    items: Counts,
    rows: &'a [Row],
}

/// All items of a run, and what is known of each.
pub(crate) struct Summary {
    folder: Folder,
    name: String,
    items: Vec<(String, Option<State>)>,
    /// When it was written last, and how long that took.
    written: Option<(Instant, Duration)>,
}

impl Summary {
    /// Of these items, with what is known of them.
    pub(crate) fn new(folder: &Folder, shard: Option<Shard>, items: impl Iterator<Item = String>) -> Self {
        let name = match shard {
            Some(Shard { number, of }) => format!("summary-{number}-of-{of}"),
            None => "summary".into(),
        };
        let items = items.map(|name| (folder.state(&name), name)).map(|(state, name)| (name, state)).collect();
        Self { folder: folder.clone(), name, items, written: None }
    }

    /// Hears what came of the item at a place.
    pub(crate) fn set(&mut self, place: usize, state: &State) {
        self.items[place].1 = Some(state.clone());
    }

    pub(crate) fn counts(&self) -> Counts {
        let mut counts = Counts::default();
        for (_, state) in &self.items {
            match state.as_ref().map_or(Stage::Skipped, |state| state.stage) {
                Stage::Done => counts.done += 1,
                Stage::Failed => counts.failed += 1,
                Stage::Skipped => counts.skipped += 1,
                Stage::Interrupted => counts.interrupted += 1,
            }
        }
        counts
    }

    /// Items that failed, with their reasons.
    pub(crate) fn failures(&self) -> Vec<String> {
        let failed = self.items.iter().filter_map(|(name, state)| Some((name, state.as_ref()?)));
        let failed = failed.filter(|(_, state)| state.stage == Stage::Failed);
        failed.map(|(name, state)| format!("{name}: {}", state.reason.as_deref().unwrap_or_default())).collect()
    }

    /// Where it is for people to look at.
    pub(crate) fn page(&self) -> PathBuf {
        self.path("html")
    }

    fn path(&self, ending: &str) -> PathBuf {
        self.folder.0.join(format!("{}.{ending}", self.name))
    }

    /// Writes it unless that would take more than a small share of the time.
    ///
    /// # Errors
    /// When it cannot be written.
    pub(crate) fn write_now_and_then(&mut self) -> Result<()> {
        match self.written {
            Some((at, took)) if at.elapsed() < SHARE * took => Ok(()),
            _ => self.write(),
        }
    }

    /// Writes all three files, each whole or not at all.
    ///
    /// # Errors
    /// When one cannot be written.
    pub(crate) fn write(&mut self) -> Result<()> {
        let began = Instant::now();
        let rows: Vec<Row> = self.items.iter().flat_map(|(name, state)| rows(name, state.as_ref())).collect();
        let whole = Whole { version: env!("CARGO_PKG_VERSION"), items: self.counts(), rows: &rows };
        let json = serde_json::to_string_pretty(&whole)
            .map_err(|error| Error::failed(format!("the summary cannot be told: {error}")).caused_by(error))?;
        let page = page::page(&self.folder, &rows, &whole.items);
        for (ending, text) in [("csv", csv(&rows)), ("json", json + "\n"), ("html", page)] {
            let path = self.path(ending);
            write_whole(&path, true, |file| file.write_all(text.as_bytes()))
                .map_err(|error| Error::from_io("the summary cannot be written", &error).at(&path))?;
        }
        self.written = Some((Instant::now(), began.elapsed()));
        Ok(())
    }
}
