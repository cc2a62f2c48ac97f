//! What is known of an item from earlier runs, in `DIR/.batch/NAME.json`: with what it was run, and what came of it.

use std::collections::BTreeMap;
use std::fs;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::content::{Input, Looks, changed};
use super::list::items::Item;
use crate::cli::outputs::files::write_whole;
use crate::error::{Error, Result};
use crate::io::ome_zarr::{CHECKSUMS, first_misfit};

/// The version whose results are in a folder.
const VERSION: &str = env!("CARGO_PKG_VERSION");

/// How far an item is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Stage {
    Done,
    Failed,
    /// Not run yet.
    Skipped,
    /// Begun, and not ended by itself: also what stands there while it runs.
    Interrupted,
}

impl Stage {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Done => "done",
            Self::Failed => "failed",
            Self::Skipped => "skipped",
            Self::Interrupted => "interrupted",
        }
    }
}

/// An object that a run found, or failed to find. Volume, area and distances physical.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Object {
    pub(crate) label: Option<u64>,
    /// The time of the image, counted from 0, where it has several that were asked for.
    #[serde(default)]
    pub(crate) time: Option<u64>,
    /// Why there is none.
    pub(crate) reason: Option<String>,
    pub(crate) volume: Option<f64>,
    pub(crate) area: Option<f64>,
    pub(crate) marks_mean: Option<f64>,
    pub(crate) marks_max: Option<f64>,
}

/// What is known of an item.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct State {
    pub(crate) version: String,
    pub(crate) settings: BTreeMap<String, String>,
    pub(crate) inputs: Vec<Input>,
    #[serde(rename = "state")]
    pub(crate) stage: Stage,
    pub(crate) code: Option<i32>,
    pub(crate) reason: Option<String>,
    /// Seconds of its last run, and the most bytes of memory it had.
    pub(crate) seconds: Option<f64>,
    pub(crate) peak: Option<u64>,
    /// Bytes and threads that it was given.
    pub(crate) memory: Option<u64>,
    pub(crate) threads: Option<usize>,
    /// Whether a store of its name is this batch's own.
    pub(crate) owns: bool,
    /// Whether its log is, where no run of it was begun.
    #[serde(default)]
    pub(crate) logged: bool,
    /// Files beside the store that runs of it have made.
    #[serde(default)]
    pub(crate) made: Vec<PathBuf>,
    pub(crate) objects: Vec<Object>,
    /// What was known cannot be read: all else here is what is told of that.
    #[serde(skip)]
    pub(crate) is_unreadable: bool,
}

/// The folder of results.
#[derive(Clone, Debug)]
pub(crate) struct Folder(pub(crate) PathBuf);

impl Folder {
    /// Makes it, with its place for states.
    ///
    /// # Errors
    /// When it cannot be made.
    pub(crate) fn make(&self) -> Result<()> {
        fs::create_dir_all(self.0.join(".batch"))
            .map_err(|error| Error::from_io("cannot be made as the folder of results", &error).at(&self.0))
    }

    pub(crate) fn store(&self, item: &str) -> PathBuf {
        self.0.join(format!("{item}.zarr"))
    }

    pub(crate) fn log(&self, item: &str) -> PathBuf {
        self.0.join(format!("{item}.log"))
    }

    /// A small picture of what was found.
    pub(crate) fn picture(&self, item: &str) -> PathBuf {
        self.0.join(".batch").join(format!("{item}.png"))
    }

    fn path(&self, item: &str) -> PathBuf {
        self.0.join(".batch").join(format!("{item}.json"))
    }

    /// What is known of an item, if anything.
    pub(crate) fn state(&self, item: &str) -> Option<State> {
        let path = self.path(item);
        let read = match fs::read(&path) {
            Err(error) if error.kind() == ErrorKind::NotFound => return None,
            Ok(bytes) => serde_json::from_slice(&bytes).map_err(|error| error.to_string()),
            Err(error) => Err(error.to_string()),
        };
        Some(read.unwrap_or_else(|error| State::unreadable(&self.lost(item, &path, &error))))
    }

    /// What to do where it is not known what a batch made of an item.
    fn lost(&self, item: &str, path: &Path, error: &str) -> String {
        let (path, store, log) = (path.display(), self.store(item), self.log(item));
        format!(
            "{path} cannot be read, so it is not known whether {} and {} are this batch's own: {error}; remove these three, and the item runs anew",
            store.display(),
            log.display()
        )
    }

    /// Keeps what is known of an item.
    ///
    /// # Errors
    /// When it cannot be written.
    pub(crate) fn keep(&self, item: &str, state: &State) -> Result<()> {
        let path = self.path(item);
        let fault = |error: std::io::Error| Error::from_io("the state of an item cannot be kept", &error).at(&path);
        let text = serde_json::to_vec_pretty(state).map_err(|error| fault(error.into()))?;
        write_whole(&path, true, |file| file.write_all(&text)).map_err(fault)
    }
}

impl State {
    /// An item that is about to be run; what earlier runs made stays this batch's own.
    pub(crate) fn begun(item: &Item, before: Option<Self>) -> Self {
        let (owns, logged, made) =
            before.map_or((false, false, Vec::new()), |before| (before.owns, before.logged, before.made));
        Self { settings: item.settings.clone(), owns, logged, made, ..Self::of(Stage::Interrupted) }
    }

    /// Nothing but a stage.
    fn of(stage: Stage) -> Self {
        Self {
            version: VERSION.into(),
            settings: BTreeMap::new(),
            inputs: Vec::new(),
            stage,
            code: None,
            reason: None,
            seconds: None,
            peak: None,
            memory: None,
            threads: None,
            owns: false,
            logged: false,
            made: Vec::new(),
            objects: Vec::new(),
            is_unreadable: false,
        }
    }

    /// An item of which a batch kept something that cannot be read any more.
    fn unreadable(why: &str) -> Self {
        Self { code: Some(2), reason: Some(why.into()), is_unreadable: true, ..Self::of(Stage::Failed) }
    }

    /// What changed between this run of an item and one that is to be made.
    pub(crate) fn changed_settings(&self, item: &Item) -> Vec<String> {
        let mut why = Vec::new();
        if self.version != VERSION {
            why.push(format!("version changed from {} to {VERSION}", self.version));
        }
        let names: std::collections::BTreeSet<&String> = self.settings.keys().chain(item.settings.keys()).collect();
        for name in names {
            let (was, is) = (self.settings.get(name), item.settings.get(name));
            if was != is {
                let told = |value: Option<&String>| value.map_or_else(|| "its default".into(), Clone::clone);
                why.push(format!("{name} changed from {} to {}", told(was), told(is)));
            }
        }
        why
    }
}

/// Why an item is to be run: nothing where it is done already. Times of inputs that hold what they held are kept if `keeps`.
pub(crate) fn reasons(folder: &Folder, item: &Item, keeps: bool, stop: &AtomicBool) -> Result<Vec<String>> {
    let Some(state) = folder.state(&item.name) else { return Ok(vec!["missing".into()]) };
    match state.stage {
        Stage::Failed if state.is_unreadable => return Ok(vec!["what was known of it cannot be read".into()]),
        Stage::Failed => return Ok(vec!["failed before".into()]),
        Stage::Interrupted => return Ok(vec!["interrupted before".into()]),
        Stage::Skipped => return Ok(vec!["missing".into()]),
        Stage::Done => {}
    }
    if !is_whole(&folder.store(&item.name)) {
        return Ok(vec!["missing: its store is gone".into()]);
    }
    if let Some(path) = misfit(&folder.store(&item.name)) {
        return Ok(vec![format!("damaged: {path} in its store is gone or has another length")]);
    }
    let mut why = state.changed_settings(item);
    let (names, now) = changed(&item.files, &state.inputs, stop);
    let is_other_list = now.iter().map(|input| &input.path).ne(state.inputs.iter().map(|input| &input.path));
    // Other files than before are a setting that changed, and told as such.
    if !is_other_list {
        why.extend(names.into_iter().map(|name| format!("{name} changed")));
    }
    if keeps && why.is_empty() && now != state.inputs {
        folder.keep(&item.name, &State { inputs: now, ..state })?;
    }
    Ok(why)
}

/// What is known of an item that another batch has done meanwhile, as its inputs are now.
pub(crate) fn done_meanwhile(folder: &Folder, item: &Item) -> Option<State> {
    let store = folder.store(&item.name);
    let is_there = is_whole(&store) && misfit(&store).is_none();
    let state = folder.state(&item.name).filter(|state| state.stage == Stage::Done && is_there)?;
    let is_same = |(name, path): &(String, PathBuf)| {
        let was = state.inputs.iter().find(|input| input.path == *name && input.hash.is_some());
        was.is_some_and(|was| Looks::of(path).is_ok_and(|now| now == was.looks))
    };
    (state.changed_settings(item).is_empty() && item.files.iter().all(is_same)).then_some(state)
}

/// Whether a store is there, under its name.
fn is_whole(store: &Path) -> bool {
    store.join("report.json").is_file()
}

/// What in a store is not as it was written, as far as is seen without reading it (`strandline verify` does).
fn misfit(store: &Path) -> Option<String> {
    first_misfit(store).unwrap_or_else(|_| Some(CHECKSUMS.into()))
}

/// What a run reports of its result, its seconds and its memory; none where there is no report.
pub(crate) fn reported(store: &Path) -> Option<(Vec<Object>, f64, u64)> {
    let report: Value = serde_json::from_slice(&fs::read(store.join("report.json")).ok()?).ok()?;
    let result = &report["result"];
    let one = |time: Option<u64>, object: &Value| Object {
        label: object["label"].as_u64(),
        time,
        reason: object["reason"].as_str().map(str::to_owned),
        volume: object["volume"].as_f64(),
        area: object["area"].as_f64(),
        marks_mean: object["hausdorff"]["mean"].as_f64(),
        marks_max: object["hausdorff"]["max"].as_f64(),
    };
    let all = |time: Option<u64>, result: &Value| -> Vec<Object> {
        let of = |name: &str| result[name].as_array().into_iter().flatten();
        of("objects").chain(of("refused")).map(|object| one(time, object)).collect()
    };
    // A time of which nothing could be solved has a reason and no objects.
    let at_time = |told: &Value| {
        let time = told["time"].as_u64();
        let objects = all(time, told);
        if objects.is_empty() { vec![one(time, told)] } else { objects }
    };
    // Of other commands the result is what was found.
    let whole = || (!result["objects"].is_array()).then(|| one(None, result));
    let mut objects: Vec<Object> = match result["times"].as_array() {
        Some(times) => times.iter().flat_map(at_time).collect(),
        None => all(None, result).into_iter().chain(whole()).collect(),
    };
    objects.sort_by_key(|object| (object.time, object.label));
    Some((objects, report["seconds"].as_f64()?, report["peak_rss_bytes"].as_u64()?))
}
