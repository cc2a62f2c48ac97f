//! What files of checkpoints are called. What has another name in their folder is somebody's own, and stays.

use std::fs;
use std::path::Path;

/// How the names of manifests end.
const MANIFEST: &str = ".checkpoint";
/// Those of fields, and of files of the output.
const FIELD: &str = ".bricks";
const LINK: &str = ".shard";
/// Digits of a number, at least.
const DIGITS: usize = 6;

pub(super) fn manifest_name(number: u64) -> String {
    format!("{number:0DIGITS$}{MANIFEST}")
}

/// The `n`-th field of a checkpoint.
pub(super) fn field_name(number: u64, n: usize) -> String {
    format!("{number:0DIGITS$}-{n}{FIELD}")
}

/// The `n`-th file of the output, which came with that checkpoint.
pub(super) fn link_name(number: u64, n: usize) -> String {
    format!("{number:0DIGITS$}-{n}{LINK}")
}

/// The numbers of the manifests in a folder, ascending.
pub(super) fn numbers(folder: &Path) -> Vec<u64> {
    let names = names(folder);
    let mut numbers: Vec<u64> = names.iter().filter_map(|name| name.strip_suffix(MANIFEST)?.parse().ok()).collect();
    numbers.sort_unstable();
    numbers
}

/// The names in a folder that are those of checkpoints.
pub(super) fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let files = entries.filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_file()));
    files.filter_map(|entry| entry.file_name().into_string().ok()).filter(|name| is_ours(name)).collect()
}

fn is_ours(name: &str) -> bool {
    let is_number = |digits: &str| !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit());
    let is_long = |number: &str| number.len() >= DIGITS && is_number(number);
    let part = name.strip_suffix(FIELD).or_else(|| name.strip_suffix(LINK)).and_then(|stem| stem.split_once('-'));
    part.is_some_and(|(number, n)| is_long(number) && is_number(n)) || name.strip_suffix(MANIFEST).is_some_and(is_long)
}
