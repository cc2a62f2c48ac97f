//! The items of a list: globs opened, names given, flags read by the command line; and what keeps them from running.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

use super::flags::{Flags, Kind};
use super::manifest::{Entry, Given, Key, Manifest};
use super::problems::Problems;
use crate::job::resources::check_threads;

/// Keys that are no flags.
const NO_FLAGS: [&str; 4] = ["command", "name", "images", "sources"];
/// Flags that say what a run may use; results do not depend on them.
const RESOURCES: [&str; 3] = ["memory", "threads", "scratch"];

/// A run that is to be made.
#[derive(Clone, Debug)]
pub(crate) struct Item {
    /// What its store and log are called, without their endings.
    pub(crate) name: String,
    pub(crate) kind: Kind,
    /// Flags, without those that batch gives.
    pub(crate) words: Vec<OsString>,
    /// What it works on.
    pub(crate) inputs: Vec<PathBuf>,
    /// All files that it reads, as they are written in the list and as they are opened.
    pub(crate) files: Vec<(String, PathBuf)>,
    /// Files that it writes beside its store.
    pub(crate) writes: Vec<PathBuf>,
    /// All that decides its result, by the list's words.
    pub(crate) settings: BTreeMap<String, String>,
    /// What it gets, where the list says so.
    pub(crate) memory: Option<u64>,
    pub(crate) threads: Option<usize>,
    pub(crate) scratch: Option<PathBuf>,
}

/// All items of a list, by name; `output` is where results go, which is no input.
pub(crate) fn items(manifest: &Manifest, output: &Path, problems: &mut Problems) -> Vec<Item> {
    let (mut found, mut names, mut written) = (Vec::new(), BTreeMap::new(), BTreeMap::new());
    for entry in &manifest.entries {
        let maker = Maker { manifest, entry, output };
        for item in maker.items(problems) {
            if let Some(other) = names.insert(item.name.clone(), entry.line) {
                let text = format!("two items are called {}, the other of line {other}; give one a `name`", item.name);
                problems.add(entry.line, text);
            }
            for path in item.writes.clone() {
                if let Some(other) = written.insert(path.clone(), item.name.clone()) {
                    let path = path.display();
                    problems
                        .add(entry.line, format!("{path} is written by {other} and {}; put {{stem}} in it", item.name));
                }
            }
            found.push(item);
        }
    }
    found.sort_by(|a, b| a.name.cmp(&b.name));
    found
}

struct Maker<'a> {
    manifest: &'a Manifest,
    entry: &'a Entry,
    output: &'a Path,
}

impl Maker<'_> {
    /// The items of an entry.
    fn items(&self, problems: &mut Problems) -> Vec<Item> {
        let (entry, line) = (self.entry, self.entry.line);
        let kind = match entry.key("command").map(|key| (&key.given, key.line)) {
            Some((Given::Text(name), at)) => Kind::named(name).map_err(|text| (at, text)),
            Some((_, at)) => Err((at, "`command` is a text".into())),
            None => Err((line, "the item has no `command`; give one here or under [defaults]".into())),
        };
        let kind = match kind {
            Ok(kind) => kind,
            Err((at, text)) => {
                problems.add(at, text);
                return Vec::new();
            }
        };
        let flags = Flags::of(kind);
        let keys = self.check_keys(&flags, kind, problems);
        let Some(key) = entry.key(kind.inputs()) else {
            problems.add(line, format!("the item has no `{}`, which {} works on", kind.inputs(), kind.name()));
            return Vec::new();
        };
        let groups = match self.groups(kind, &key.given) {
            Ok(groups) => groups,
            Err(texts) => {
                for text in texts {
                    problems.add(key.line, text);
                }
                return Vec::new();
            }
        };
        groups.iter().filter_map(|group| self.item((kind, &flags, &keys), group, problems)).collect()
    }

    /// The keys that are flags of this command. Defaults that are for other commands than this item's own are none.
    fn flag_keys(&self, kind: Kind) -> impl Iterator<Item = &Key> {
        let has_own_command = self.entry.key("command").is_some_and(|key| !key.is_default);
        let is_for_others = move |key: &Key| {
            let knows = |kind: Kind| Flags::of(kind).knows(&key.name);
            key.is_default && has_own_command && !knows(kind) && Kind::ALL.into_iter().any(knows)
        };
        self.entry.keys.iter().filter(move |key| !NO_FLAGS.contains(&key.name.as_str()) && !is_for_others(key))
    }

    /// The flags that are right by themselves; the others are told.
    fn check_keys(&self, flags: &Flags, kind: Kind, problems: &mut Problems) -> Vec<&Key> {
        let other = if kind == Kind::Segment { "sources" } else { "images" };
        if let Some(key) = self.entry.key(other).filter(|key| !key.is_default) {
            problems.add(key.line, format!("{} works on `{}`, not on `{other}`", kind.name(), kind.inputs()));
        }
        let mut right = Vec::new();
        for key in self.flag_keys(kind) {
            let words = match flags.words(&key.name, &key.given.with_stem("stem"), &self.manifest.folder) {
                // Once for all commands that the defaults are for.
                Err(_) if key.is_default && Kind::ALL.into_iter().all(|kind| Flags::of(kind).is_unknown(&key.name)) => {
                    Err(format!("unknown key `{}`; no command has such a flag", key.name))
                }
                words => words,
            };
            match words.and_then(|words| flags.wrong_alone(&words).map_or(Ok(()), Err)) {
                Ok(()) => right.push(key),
                Err(text) => problems.add(key.line, text),
            }
        }
        right
    }

    /// What each item works on, as it is written, relative to the list.
    fn groups(&self, kind: Kind, given: &Given) -> Result<Vec<Vec<String>>, Vec<String>> {
        let name = kind.inputs();
        let all = match given {
            Given::Text(text) => return Ok(self.matches(text)?.into_iter().map(|path| vec![path]).collect()),
            Given::List(all) if !all.is_empty() => all,
            _ => return Err(vec![format!("`{name}` is a path, a glob, or a list of these")]),
        };
        let is_nested = all.iter().any(|given| matches!(given, Given::List(_)));
        if is_nested {
            return self.nested(kind, all);
        }
        let texts: Option<Vec<&str>> = all.iter().map(text).collect();
        let texts = texts.ok_or_else(|| vec![format!("`{name}` is a path, a glob, or a list of these")])?;
        let (found, wrong) = self.all_matches(&texts);
        let has_glob = texts.iter().any(|text| self.is_glob(text));
        if !wrong.is_empty() {
            Err(wrong)
        } else if kind.takes_several() && !has_glob {
            Ok(vec![found])
        } else {
            Ok(found.into_iter().map(|path| vec![path]).collect())
        }
    }

    /// Lists in a list: each is an item with all its sources.
    fn nested(&self, kind: Kind, all: &[Given]) -> Result<Vec<Vec<String>>, Vec<String>> {
        if !kind.takes_several() {
            return Err(vec![format!("{} works on one file an item; give one list of paths", kind.name())]);
        }
        let (mut groups, mut wrong) = (Vec::new(), Vec::new());
        for given in all {
            let texts = match given {
                Given::List(sources) => sources.iter().map(text).collect::<Option<Vec<_>>>(),
                other => text(other).map(|text| vec![text]),
            };
            match texts.filter(|texts| !texts.is_empty()) {
                Some(texts) => {
                    let (found, more) = self.all_matches(&texts);
                    groups.push(found);
                    wrong.extend(more);
                }
                None => wrong.push("`sources` of several items is a list of lists of paths".into()),
            }
        }
        if wrong.is_empty() { Ok(groups) } else { Err(wrong) }
    }

    fn all_matches(&self, texts: &[&str]) -> (Vec<String>, Vec<String>) {
        let (mut found, mut wrong) = (Vec::new(), Vec::new());
        for text in texts {
            match self.matches(text) {
                Ok(paths) => found.extend(paths),
                Err(texts) => wrong.extend(texts),
            }
        }
        (found, wrong)
    }

    /// Whether a text is a pattern, and no file's own name.
    fn is_glob(&self, text: &str) -> bool {
        text.contains(['*', '?', '[']) && !self.manifest.folder.join(text).exists()
    }

    /// What a path or a glob names, relative to the list.
    fn matches(&self, text: &str) -> Result<Vec<String>, Vec<String>> {
        let folder = &self.manifest.folder;
        if text == "-" {
            return Err(vec!["- is standard input, which items of a batch have not; name a file".into()]);
        }
        if !self.is_glob(text) {
            let there = folder.join(text);
            return if !text.is_empty() && there.exists() {
                Ok(vec![text.into()])
            } else {
                Err(vec![format!("{text} is not there")])
            };
        }
        let is_absolute = Path::new(text).is_absolute();
        let escaped = glob::Pattern::escape(&folder.to_string_lossy());
        let pattern = if is_absolute || escaped.is_empty() { text.into() } else { format!("{escaped}/{text}") };
        let options = glob::MatchOptions { require_literal_leading_dot: true, ..glob::MatchOptions::new() };
        let paths = glob::glob_with(&pattern, options).map_err(|error| vec![format!("{text} is no glob: {error}")])?;
        let output = self.output.canonicalize().ok();
        // What the batch has written is not its input.
        let is_output = |path: &Path| {
            let place = path.canonicalize().ok();
            let Some((output, place)) = output.as_ref().zip(place.as_deref()) else { return false };
            let state = place.file_stem().map(|stem| output.join(".batch").join(stem).with_added_extension("json"));
            place.parent() == Some(output) && state.is_some_and(|state| state.exists())
        };
        let found: Vec<String> = paths
            .filter_map(Result::ok)
            .filter(|path| !is_output(path))
            .map(
                |path| {
                    if is_absolute { path } else { path.strip_prefix(folder).map(Path::to_path_buf).unwrap_or(path) }
                },
            )
            .map(|path| path.to_string_lossy().into_owned())
            .collect();
        if found.is_empty() { Err(vec![format!("{text} matches nothing")]) } else { Ok(found) }
    }

    fn item(
        &self,
        (kind, flags, keys): (Kind, &Flags, &[&Key]),
        group: &[String],
        problems: &mut Problems,
    ) -> Option<Item> {
        let (entry, folder) = (self.entry, &self.manifest.folder);
        let stem = stem(&group[0]);
        let name = match entry.key("name").map(|key| (&key.given, key.line)) {
            Some((Given::Text(name), at)) => checked_name(&name.replace("{stem}", &stem)).map_err(|text| (at, text)),
            Some((_, at)) => Err((at, "`name` is a text".into())),
            None => checked_name(&stem).map_err(|text| (entry.line, text)),
        };
        let name = name.map_err(|(at, text)| problems.add(at, text)).ok()?;
        let inputs: Vec<PathBuf> = group.iter().map(|path| folder.join(path)).collect();
        let (mut words, mut of_resources) = (Vec::new(), Vec::new());
        let mut settings =
            BTreeMap::from([("command".into(), kind.name().into()), (kind.inputs().into(), group.join(", "))]);
        for key in keys {
            let given = key.given.with_stem(&stem);
            // What is wrong was told with the keys.
            let more = flags.words(&key.name, &given, folder).ok()?;
            if RESOURCES.contains(&key.name.as_str()) {
                of_resources.extend(more);
                continue;
            }
            if !more.is_empty() {
                settings.insert(key.name.clone(), given.told());
            }
            words.extend(more);
        }
        let all: Vec<OsString> = words.iter().chain(&of_resources).cloned().collect();
        let read = match flags.read_all(&all, &inputs) {
            Ok(read) => read,
            Err(text) => {
                problems.add(entry.line, text);
                return None;
            }
        };
        for path in read.files.iter().filter(|path| !path.exists()) {
            let line =
                entry.keys.iter().find(|key| names(&key.given.with_stem(&stem), path, folder)).map(|key| key.line);
            problems.add(line.unwrap_or(entry.line), format!("{} is not there", path.display()));
        }
        let as_written = |path: &PathBuf| path.strip_prefix(folder).unwrap_or(path).to_string_lossy().into_owned();
        let files = read.files.iter().map(|path| (as_written(path), path.clone())).collect();
        let (resources, writes) = (read.resources, read.writes);
        let (memory, threads, scratch) = (resources.memory, resources.threads, resources.scratch);
        if let Some(Err(error)) = threads.map(check_threads) {
            let line = entry.keys.iter().find(|key| key.name == "threads").map(|key| key.line);
            problems.add(line.unwrap_or(entry.line), error.to_string());
            return None;
        }
        Some(Item { name, kind, words, inputs, files, writes, settings, memory, threads, scratch })
    }
}

fn text(given: &Given) -> Option<&str> {
    if let Given::Text(text) = given { Some(text) } else { None }
}

/// Whether a value names a file.
fn names(given: &Given, path: &Path, folder: &Path) -> bool {
    match given {
        Given::Text(text) => folder.join(text) == path,
        Given::List(all) => all.iter().any(|given| names(given, path, folder)),
        _ => false,
    }
}

/// A file's name without its ending; that of OME files are two.
pub(crate) fn stem(path: &str) -> String {
    let name = Path::new(path).file_name().map_or_else(|| path.into(), |name| name.to_string_lossy().into_owned());
    let whole = name.rsplit_once('.').map_or(name.as_str(), |(stem, _)| if stem.is_empty() { &name } else { stem });
    let is_ome = whole.len() > 4 && whole.to_ascii_lowercase().ends_with(".ome");
    whole[..whole.len() - if is_ome { 4 } else { 0 }].to_owned()
}

/// A name that files can have.
fn checked_name(name: &str) -> Result<String, String> {
    let is_odd = name.is_empty() || name.starts_with(['.', '-']) || name.contains(|c: char| c == '/' || c.is_control());
    if is_odd {
        return Err(format!(
            "'{name}' cannot be the name of a store; give `name` without / that does not begin with . or -"
        ));
    }
    Ok(name.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stems_are_names_without_endings() {
        for (path, wanted) in [
            ("a/b.tif", "b"),
            ("b.ome.tif", "b"),
            ("b.OME.TIFF", "b"),
            ("b.c.tif", "b.c"),
            ("slices", "slices"),
            ("x.zarr", "x"),
            ("../in.d/x", "x"),
            (".hidden", ".hidden"),
        ] {
            assert_eq!(stem(path), wanted, "{path}");
        }
    }
}
