//! Lines of a name and a value, as `info` prints them.

use super::table::cut;
use crate::error::one_line;

/// Names and what is told of them.
pub(crate) type Lines = Vec<(String, String)>;

pub(crate) fn table(lines: &Lines) -> String {
    let width = lines.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0);
    let told = |(name, value): &(String, String)| one_line(format!("{name:<width$}  {value}"));
    let (objects, others): (Vec<_>, Vec<_>) = lines.iter().partition(|(name, _)| name.starts_with("object "));
    let objects = cut(objects.into_iter().map(told).collect(), "objects", "(--json tells all)");
    others.into_iter().map(told).chain(objects).fold(String::new(), |text, line| text + &line + "\n")
}

pub(crate) fn line(name: &str, value: impl Into<String>) -> (String, String) {
    (name.into(), value.into())
}
