//! The list of jobs as it is written: tables, keys and values of TOML, each with its line.

use std::ops::Range;
use std::path::{Path, PathBuf};

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::problems::Problems;
use crate::error::{Error, Result};

/// The list.
#[derive(Debug)]
pub(crate) struct Manifest {
    /// What paths in it are relative to.
    pub(crate) folder: PathBuf,
    pub(crate) entries: Vec<Entry>,
}

/// One `[[items]]`, with the defaults that it does not override.
#[derive(Clone, Debug)]
pub(crate) struct Entry {
    pub(crate) line: usize,
    pub(crate) keys: Vec<Key>,
}

/// A key and its value.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Key {
    pub(crate) name: String,
    pub(crate) given: Given,
    pub(crate) line: usize,
    /// It stands under `[defaults]`.
    pub(crate) is_default: bool,
}

/// What a key is given.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Given {
    Flag(bool),
    Number(String),
    Text(String),
    List(Vec<Given>),
}

impl Entry {
    pub(crate) fn key(&self, name: &str) -> Option<&Key> {
        self.keys.iter().find(|key| key.name == name)
    }
}

impl Given {
    /// As it is told to people, and compared.
    pub(crate) fn told(&self) -> String {
        match self {
            Self::Flag(is_set) => is_set.to_string(),
            Self::Number(text) | Self::Text(text) => text.clone(),
            Self::List(all) => format!("[{}]", all.iter().map(Self::told).collect::<Vec<_>>().join(", ")),
        }
    }

    /// The same with the name of an item in place of `{stem}`.
    pub(crate) fn with_stem(&self, stem: &str) -> Self {
        match self {
            Self::Text(text) => Self::Text(text.replace("{stem}", stem)),
            Self::List(all) => Self::List(all.iter().map(|given| given.with_stem(stem)).collect()),
            other => other.clone(),
        }
    }
}

/// The lines of a text.
struct Lines<'a>(&'a str);

impl Lines<'_> {
    fn of(&self, span: &Range<usize>) -> usize {
        self.0.get(..span.start).unwrap_or(self.0).matches('\n').count() + 1
    }
}

/// Reads the list; what is wrong with its form is put with the problems.
///
/// # Errors
/// When the file cannot be read.
pub(crate) fn read(path: &Path, problems: &mut Problems) -> Result<Manifest> {
    let text = std::fs::read_to_string(path).map_err(|error| {
        Error::input(format!("cannot be read as a list of jobs: {error}")).caused_by(error).at(path)
    })?;
    let lines = Lines(&text);
    let (document, errors) = DeTable::parse_recoverable(&text);
    for error in &errors {
        let line = error.span().map_or(1, |span| lines.of(&span));
        problems.add(line, error.message().replace('\n', ", "));
    }
    let mut defaults = Vec::new();
    let mut tables = Vec::new();
    for (name, value) in document.get_ref() {
        let line = lines.of(&name.span());
        match (name.get_ref().as_ref(), value.get_ref()) {
            ("defaults", DeValue::Table(table)) => defaults = keys(table, true, &lines, problems),
            ("items", DeValue::Array(all)) => {
                for one in all {
                    match one.get_ref() {
                        DeValue::Table(table) => tables.push((lines.of(&one.span()), table)),
                        _ => problems.add(lines.of(&one.span()), "an item is a table; write [[items]] above its keys"),
                    }
                }
            }
            ("defaults", _) => problems.add(line, "defaults is a table; write [defaults] above its keys"),
            ("items", _) => problems.add(line, "items are tables; write [[items]] above the keys of each"),
            (other, _) => problems.add(line, format!("unknown key `{other}`; a list has [defaults] and [[items]]")),
        }
    }
    if tables.is_empty() && problems.is_empty() {
        problems
            .add(1, "there is no item; write [[items]] and below it images = \"STACK.tif\" and points = \"MARKS.csv\"");
    }
    let entries = tables.into_iter().map(|(line, table)| {
        let own = keys(table, false, &lines, problems);
        let rest: Vec<Key> =
            defaults.iter().filter(|key| own.iter().all(|other| other.name != key.name)).cloned().collect();
        Entry { line, keys: [rest, own].concat() }
    });
    Ok(Manifest { entries: entries.collect(), folder: path.parent().map(Path::to_path_buf).unwrap_or_default() })
}

fn keys(table: &DeTable<'_>, is_default: bool, lines: &Lines<'_>, problems: &mut Problems) -> Vec<Key> {
    let mut found = Vec::new();
    for (name, value) in table {
        let line = lines.of(&name.span());
        match given(value) {
            Some(given) => found.push(Key { name: name.get_ref().to_string(), given, line, is_default }),
            None => problems.add(
                line,
                format!(
                    "`{}` is a {}; give true, a number, a text or a list",
                    name.get_ref(),
                    value.get_ref().type_str()
                ),
            ),
        }
    }
    found.sort_by_key(|key| key.line);
    found
}

fn given(value: &Spanned<DeValue<'_>>) -> Option<Given> {
    match value.get_ref() {
        DeValue::String(text) => Some(Given::Text(text.to_string())),
        DeValue::Integer(number) => {
            i128::from_str_radix(number.as_str(), number.radix()).ok().map(|number| Given::Number(number.to_string()))
        }
        // As numbers are printed, so that 0.30 and 0.3 are the same.
        DeValue::Float(number) => number.as_str().parse::<f64>().ok().map(|number| Given::Number(number.to_string())),
        DeValue::Boolean(is_set) => Some(Given::Flag(*is_set)),
        DeValue::Array(all) => all.iter().map(given).collect::<Option<Vec<_>>>().map(Given::List),
        DeValue::Datetime(_) | DeValue::Table(_) => None,
    }
}
