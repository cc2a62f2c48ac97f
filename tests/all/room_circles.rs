//! Rooms within rooms: among the files and folders of one folder of `src/` nobody is named by what he names.
//!
//! Reads the paths after `crate::` and `super::` in every file but `mod.rs`, which joins what lies beside it; tests at
//! the end of a file may name what they like. A folder holds one kind of thing: [`MOST_FILES`] at most.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use crate::layering::{Token, blank_comments_and_strings, source_files, tokens};

/// More files than this and a folder holds more than one kind of thing.
const MOST_FILES: usize = 16;

/// Who names whom in one folder, each with a line that says where.
type Named = BTreeMap<String, BTreeMap<String, String>>;

/// For every folder, by its path with `/`, who names whom; `sources` are paths relative to `src/` with their texts.
fn folders(sources: &[(String, String)]) -> BTreeMap<String, Named> {
    let modules: BTreeSet<String> = sources
        .iter()
        .flat_map(|(path, _)| {
            let module = module(path).join("/");
            let folder = path.rsplit_once('/').map_or(String::new(), |(folder, _)| folder.into());
            [module, folder]
        })
        .collect();
    let mut folders: BTreeMap<String, Named> = BTreeMap::new();
    for (path, text) in sources.iter().filter(|(path, _)| !path.ends_with("mod.rs")) {
        let code = blank_comments_and_strings(text);
        let own = module(path);
        for (line, named) in paths(&without_tests(tokens(&code)), &own) {
            let same = own.iter().zip(&named).take_while(|(a, b)| a == b).count();
            if same == 0 || same >= own.len().min(named.len()) || !modules.contains(&named[..=same].join("/")) {
                continue;
            }
            let folder = folders.entry(own[..same].join("/")).or_default();
            let told = format!("{path}:{line} names {}", named.join("::"));
            folder.entry(own[same].clone()).or_default().entry(named[same].clone()).or_insert(told);
        }
    }
    folders
}

/// The module of a file.
fn module(path: &str) -> Vec<String> {
    let path = path.trim_end_matches(".rs").trim_end_matches("/mod");
    path.split('/').map(String::from).collect()
}

fn without_tests(mut tokens: Vec<Token<'_>>) -> Vec<Token<'_>> {
    let tests = tokens.windows(3).position(|w| [w[0].word, w[1].word, w[2].word] == ["mod", "tests", "{"]);
    tokens.truncate(tests.unwrap_or(tokens.len()));
    tokens
}

/// Every path through the crate's root or the module above, from the root, with its line.
fn paths(tokens: &[Token<'_>], own: &[String]) -> Vec<(usize, Vec<String>)> {
    let mut found = Vec::new();
    for (at, token) in tokens.iter().enumerate() {
        let root = match token.word {
            "crate" => &[],
            "super" => &own[..own.len() - 1],
            _ => continue,
        };
        if is_path(tokens, at + 1) {
            branches(tokens, at + 3, root.to_vec(), &mut found);
        }
    }
    found
}

fn is_path(tokens: &[Token<'_>], at: usize) -> bool {
    tokens.get(at..at + 2).is_some_and(|two| two.iter().all(|token| token.word == ":"))
}

/// Puts all paths that begin with `before` and go on at `at` into `found`; returns where they end.
fn branches(tokens: &[Token<'_>], at: usize, before: Vec<String>, found: &mut Vec<(usize, Vec<String>)>) -> usize {
    let Some(first) = tokens.get(at) else { return at };
    if first.word != "{" {
        let path = [before, vec![first.word.to_string()]].concat();
        if is_path(tokens, at + 1) {
            return branches(tokens, at + 3, path, found);
        }
        found.push((first.line, path));
        return at + 1;
    }
    let mut at = at + 1;
    while tokens.get(at).is_some_and(|token| token.word != "}") {
        at = match tokens[at].word {
            "," => at + 1,
            "as" => at + 2,
            _ => branches(tokens, at, before.clone(), found),
        };
    }
    at + 1
}

/// Those that are left when everybody who names nobody that is left is taken away, again and again.
fn circle(named: &Named) -> Vec<&String> {
    let mut left = named.clone();
    loop {
        let done: Vec<String> = left
            .iter()
            .filter(|(_, others)| others.keys().all(|o| !left.contains_key(o)))
            .map(|(n, _)| n.clone())
            .collect();
        if done.is_empty() {
            return left.keys().filter_map(|name| named.get_key_value(name).map(|(name, _)| name)).collect();
        }
        left.retain(|name, _| !done.contains(name));
    }
}

fn violations(sources: &[(String, String)]) -> Vec<String> {
    let mut found = Vec::new();
    for (folder, named) in folders(sources) {
        let circle = circle(&named);
        for name in &circle {
            let others = named[*name].iter().filter(|(other, _)| circle.contains(other));
            found.extend(others.map(|(_, told)| format!("{folder}: {told}")));
        }
    }
    found
}

#[test]
fn no_room_has_a_circle() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let relative = |file: &Path| file.strip_prefix(&src).unwrap().to_str().unwrap().replace('\\', "/");
    let sources: Vec<(String, String)> =
        source_files(&src).iter().map(|file| (relative(file), fs::read_to_string(file).unwrap())).collect();
    assert!(folders(&sources).len() > 10, "hardly any folder was seen");
    let found = violations(&sources);
    assert!(found.is_empty(), "{} in circles:\n{}", found.len(), found.join("\n"));
}

#[test]
fn no_folder_is_crowded() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files: BTreeMap<&Path, usize> = BTreeMap::new();
    let sources = source_files(&src);
    sources.iter().filter_map(|file| file.parent()).for_each(|folder| *files.entry(folder).or_default() += 1);
    let crowded: Vec<_> = files.iter().filter(|(_, count)| **count > MOST_FILES).collect();
    assert!(crowded.is_empty(), "{crowded:?}");
}

fn said(files: &[(&str, &str)]) -> usize {
    let sources: Vec<_> = files.iter().map(|(path, text)| (path.to_string(), text.to_string())).collect();
    violations(&sources).len()
}

#[test]
fn circles_are_caught_in_every_spelling() {
    for naming in
        ["use super::b::B;", "use crate::room::b::B;", "use crate::room::{c, b::{B, C}};", "fn f() { super::b::g() }"]
    {
        assert_eq!(said(&[("room/a.rs", naming), ("room/b.rs", "use super::a::A;")]), 2, "{naming}");
        assert_eq!(said(&[("room/a.rs", naming), ("room/b/d.rs", "use crate::room::a::A;")]), 2, "{naming}");
    }
    let three = [("r/a.rs", "use super::b::B;"), ("r/b.rs", "use super::c::C;"), ("r/c.rs", "use super::a::A;")];
    assert_eq!((said(&three), said(&three[..2])), (3, 0));
    // What joins a room names all of it; a test may; an item of the room's own is no file.
    assert_eq!(said(&[("r/mod.rs", "pub use a::A;"), ("r/a.rs", "use super::A;")]), 0);
    assert_eq!(
        said(&[
            ("r/a.rs", "use super::b::B;"),
            ("r/b.rs", "mod tests { use super::super::a::A; use crate::r::a::A; }")
        ]),
        0
    );
}
