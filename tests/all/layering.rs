//! The rooms of `docs/architecture.md`, as a table that fails the build.
//!
//! Reads every file under `src/` and takes the first segment after every `crate::`, braces opened, comments and string
//! contents left out. A room may name itself and the rooms below it. Beside that each room has words that it may not
//! use, and every file opens with a `//!` head and stays under [`LONGEST_FILE`] lines. It does not see what macros of
//! other crates expand to. The unit cases below hold the checker to what it must catch.

use std::fs;
use std::path::{Path, PathBuf};

/// More lines than this and a file does more than one thing.
const LONGEST_FILE: usize = 450;

/// Each room with its floor; a room may name rooms on lower floors only.
const ROOMS: &[(&str, u8)] = &[
    ("error", 0),
    ("grid", 1),
    ("tile", 2),
    ("store", 2),
    ("kernel", 3),
    ("exec", 3),
    ("io", 3),
    ("pipeline", 4),
    ("job", 5),
    ("view", 5),
    ("cli", 6),
];

/// Words that only the named rooms may use.
const RESERVED: &[(&str, &[&str])] =
    &[("rayon", &["exec"]), ("unsafe", &["store"]), ("memmap2", &["store"]), ("mpi::", &["exec"])];

/// Words that the named room may not use.
const FORBIDDEN: &[(&str, &[&str])] = &[
    (
        "kernel",
        &["std::fs", "std::thread", "std::io", "println!", "eprintln!", "print!", "eprint!", "crossbeam_channel"],
    ),
    ("io", &["std::thread", "thread::spawn", "thread::scope"]),
    ("tile", &["std::fs", "std::thread", "println!", "eprintln!"]),
    ("grid", &["std::fs", "std::thread", "println!", "eprintln!"]),
];

/// Everything wrong with one file; `path` is relative to `src/`, with `/` between its parts.
fn violations(path: &str, text: &str) -> Vec<String> {
    let code = blank_comments_and_strings(text);
    let tokens = tokens(&code);
    let room = path.split('/').next().unwrap_or(path).trim_end_matches(".rs");
    let mut found = Vec::new();
    if !text.starts_with("//!") {
        found.push(format!("{path}: does not open with a `//!` head"));
    }
    if text.lines().count() > LONGEST_FILE {
        found.push(format!("{path}: {} lines, more than {LONGEST_FILE}", text.lines().count()));
    }
    if uses(&tokens, "super::super") {
        found.push(format!("{path}: `super::super`; name the room through `crate::`"));
    }
    // The crate's own root joins the rooms and is in none of them; `main.rs` stands above them all.
    if !matches!(path, "lib.rs" | "main.rs") {
        found.extend(wrong_rooms(path, room, &tokens));
    }
    found.extend(wrong_words(path, room, &tokens));
    found
}

/// Rooms that `room` names and may not.
fn wrong_rooms(path: &str, room: &str, tokens: &[Token]) -> Vec<String> {
    let Some(floor) = floor_of(room) else {
        return vec![format!("{path}: `{room}` is not in the table of rooms")];
    };
    let mut found = Vec::new();
    for named in segments_after(tokens, "crate").chain(rooms_beside(path, tokens)) {
        match floor_of(named.word) {
            _ if named.word == room => {}
            Some(other) if other < floor => {}
            Some(_) => found.push(format!("{path}:{}: `{room}` names `{}`", named.line, named.word)),
            None => found.push(format!("{path}:{}: `crate::{}` is no room", named.line, named.word)),
        }
    }
    found
}

/// Rooms named through `super::` by a file whose parent module is the crate's root.
fn rooms_beside<'a>(path: &str, tokens: &[Token<'a>]) -> Vec<Token<'a>> {
    let parent_is_root = match path.split_once('/') {
        Some((_, file)) => file == "mod.rs",
        None => true,
    };
    segments_after(tokens, "super").filter(|token| parent_is_root && floor_of(token.word).is_some()).collect()
}

/// Words in the file that its room may not use.
fn wrong_words(path: &str, room: &str, tokens: &[Token]) -> Vec<String> {
    let reserved = RESERVED.iter().filter(|(_, homes)| !homes.contains(&room)).map(|(word, _)| *word);
    let forbidden = FORBIDDEN.iter().filter(|(of, _)| *of == room).flat_map(|(_, words)| words.iter().copied());
    reserved.chain(forbidden).filter(|word| uses(tokens, word)).map(|word| format!("{path}: uses `{word}`")).collect()
}

fn floor_of(room: &str) -> Option<u8> {
    ROOMS.iter().find(|(name, _)| *name == room).map(|(_, floor)| *floor)
}

/// A word or one punctuation mark of the source.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Token<'a> {
    pub(crate) word: &'a str,
    pub(crate) line: usize,
}

pub(crate) fn tokens(code: &str) -> Vec<Token<'_>> {
    let mut found = Vec::new();
    for (index, text) in code.lines().enumerate() {
        let mut rest = text;
        while let Some(first) = rest.chars().next() {
            let word_end = rest.find(|c: char| !is_word(c)).unwrap_or(rest.len());
            let end = if is_word(first) { word_end } else { first.len_utf8() };
            if !first.is_whitespace() {
                found.push(Token { word: &rest[..end], line: index + 1 });
            }
            rest = &rest[end..];
        }
    }
    found
}

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// Whether the tokens name `wanted`: a word, a path of two segments (braces opened), or a macro with its `!`.
fn uses(tokens: &[Token], wanted: &str) -> bool {
    if let Some((root, member)) = wanted.split_once("::") {
        return segments_after(tokens, root).any(|token| member.is_empty() || token.word == member);
    }
    let (name, bang) = wanted.strip_suffix('!').map_or((wanted, false), |name| (name, true));
    let next_is_bang = |at: usize| tokens.get(at + 1).is_some_and(|token| token.word == "!");
    tokens.iter().enumerate().any(|(at, token)| token.word == name && (!bang || next_is_bang(at)))
}

/// The first segment of every path that starts with `root::`, of all branches where braces follow.
fn segments_after<'a>(tokens: &[Token<'a>], root: &str) -> impl Iterator<Item = Token<'a>> {
    let starts = tokens
        .windows(3)
        .enumerate()
        .filter(move |(_, window)| window[0].word == root && window[1].word == ":" && window[2].word == ":");
    starts.flat_map(|(at, _)| first_segments(tokens, at + 3))
}

/// The first segment at `start`, or the first segments of all branches of the braces that open there.
fn first_segments<'a>(tokens: &[Token<'a>], start: usize) -> Vec<Token<'a>> {
    let Some(first) = tokens.get(start) else { return Vec::new() };
    if first.word != "{" {
        return vec![*first];
    }
    let (mut found, mut depth, mut branch_begins) = (Vec::new(), 0, false);
    for token in &tokens[start..] {
        match token.word {
            "{" => {
                depth += 1;
                branch_begins = depth == 1;
            }
            "}" => depth -= 1,
            "," => branch_begins = depth == 1,
            _ if branch_begins => {
                found.push(*token);
                branch_begins = false;
            }
            _ => {}
        }
        if depth == 0 {
            break;
        }
    }
    found
}

/// The source with comments and the contents of string and character literals turned to spaces; line breaks stay.
pub(crate) fn blank_comments_and_strings(text: &str) -> String {
    let chars: Vec<char> = text.chars().collect();
    let mut code = String::with_capacity(text.len());
    let mut at = 0;
    while at < chars.len() {
        let end = skipped_to(&chars, at);
        if end == at {
            code.push(chars[at]);
            at += 1;
        } else {
            code.extend(chars[at..end].iter().map(|&c| if c == '\n' { '\n' } else { ' ' }));
            at = end;
        }
    }
    code
}

/// The end of the comment or literal that starts at `at`; `at` itself when none does.
fn skipped_to(chars: &[char], at: usize) -> usize {
    let rest = &chars[at..];
    match rest {
        ['/', '/', ..] => at + rest.iter().position(|&c| c == '\n').unwrap_or(rest.len()),
        ['/', '*', ..] => at + block_comment_length(rest),
        ['"', ..] => at + string_length(rest),
        ['r', '"' | '#', ..] if at == 0 || !is_word(chars[at - 1]) || chars[at - 1] == 'b' => {
            at + raw_string_length(rest)
        }
        ['\'', '\\', ..] => at + 3 + rest[3.min(rest.len())..].iter().position(|&c| c == '\'').map_or(0, |n| n + 1),
        ['\'', _, '\'', ..] => at + 3,
        _ => at,
    }
    .min(chars.len())
}

fn block_comment_length(rest: &[char]) -> usize {
    let (mut at, mut depth) = (0, 0);
    while at < rest.len() {
        match rest[at..] {
            ['/', '*', ..] => (depth, at) = (depth + 1, at + 2),
            ['*', '/', ..] => (depth, at) = (depth - 1, at + 2),
            _ => at += 1,
        }
        if depth == 0 {
            break;
        }
    }
    at
}

fn string_length(rest: &[char]) -> usize {
    let mut at = 1;
    while at < rest.len() && rest[at] != '"' {
        at += if rest[at] == '\\' { 2 } else { 1 };
    }
    at + 1
}

/// The length of `r"..."`, `r#"..."#`; 0 for a raw identifier such as `r#type`.
fn raw_string_length(rest: &[char]) -> usize {
    let hashes = rest[1..].iter().take_while(|&&c| c == '#').count();
    if rest.get(1 + hashes) != Some(&'"') {
        return 0;
    }
    let close: Vec<char> = std::iter::once('"').chain(std::iter::repeat_n('#', hashes)).collect();
    let body = hashes + 2;
    rest[body..].windows(close.len()).position(|window| window == close).map_or(rest.len(), |n| body + n + close.len())
}

pub(crate) fn source_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).expect("src/ is readable") {
        let path = entry.expect("src/ is readable").path();
        if path.is_dir() {
            files.extend(source_files(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
    files.sort();
    files
}

#[test]
fn every_source_file_keeps_to_its_room() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let files = source_files(&src);
    assert!(files.len() > 10, "only {} files found under {}", files.len(), src.display());
    let found: Vec<String> = files
        .iter()
        .flat_map(|file| {
            let path = file.strip_prefix(&src).unwrap().to_str().unwrap().replace('\\', "/");
            violations(&path, &fs::read_to_string(file).unwrap())
        })
        .collect();
    assert!(found.is_empty(), "{} violations:\n{}", found.len(), found.join("\n"));
}

#[test]
fn every_room_of_the_table_exists() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    for (room, _) in ROOMS {
        assert!(src.join(room).is_dir() || src.join(format!("{room}.rs")).is_file(), "no room {room}");
    }
}

/// What the checker says of `code` in a file with a proper head.
fn said(path: &str, code: &str) -> String {
    violations(path, &format!("//! Head.\n{code}\n")).join("; ")
}

#[test]
fn names_of_rooms_above_are_caught_in_every_spelling() {
    for code in [
        "use crate::exec::Budget;",
        "use crate::{grid::Box3, exec};",
        "use crate::{\n    grid::{Box3, BrickGrid},\n    exec::{self, Budget},\n};",
        "use crate::{error::{Error}, pipeline::segment::{run, stop}};",
        "fn f() { crate::cli::run(); }",
        "pub(crate) use crate :: exec :: Budget;",
        "use crate::io as formats;",
        "macro_rules! m { () => { $crate::exec::f() } }",
        "/* a \"quote */ use crate::exec::Budget;",
        "const Q: char = '\"'; use crate::exec::Budget;",
        "const Q: char = '\\''; use crate::exec::Budget;",
        "const Q: &[u8] = br#\"a\"b\"#; use crate::exec::Budget;",
        "fn f<'a>(x: &'a str) { crate::exec::g(x) }",
    ] {
        assert!(said("kernel/sor.rs", code).contains("`kernel` names `"), "not caught: {code}");
    }
    assert_eq!(said("store/a.rs", "use crate::{\n    exec,\n};"), "store/a.rs:3: `store` names `exec`");
    assert!(said("tile/a.rs", "use crate::store::BrickArray;").contains("`tile` names `store`"));
    assert!(said("error.rs", "use crate::grid::Box3;").contains("`error` names `grid`"));
    assert!(said("error.rs", "use super::grid::Box3;").contains("`error` names `grid`"));
    assert!(said("grid/mod.rs", "use super::{error, exec::f};").contains("`grid` names `exec`"));
    assert!(said("io/a.rs", "use crate::BrickArray;").contains("is no room"));
    assert!(said("helpers/a.rs", "").contains("not in the table"));
}

#[test]
fn names_of_rooms_below_and_harmless_text_pass() {
    for (path, code) in [
        ("kernel/level_set/sor.rs", "use crate::{error::Result, grid::{self, Box3}, kernel::image::heat};"),
        ("pipeline/segment.rs", "use crate::{exec, io, kernel, store, tile};"),
        ("kernel/a.rs", "// use crate::exec::Budget;\n/// See [`crate::exec`]; println! is not here.\nfn f() {}"),
        ("kernel/a.rs", "/* crate::exec /* nested */ rayon */ const S: &str = \"crate::exec \\\" unsafe rayon\";"),
        ("kernel/a.rs", "const S: &str = r#\"crate::exec \" rayon\"#;"),
        ("grid/a.rs", "pub(crate) fn f(r#type: u8) {} pub(in crate::grid) fn g() {}"),
        ("exec/a.rs", "use rayon::prelude::*;"),
        ("store/a.rs", "fn f() { unsafe { g() } }"),
        ("io/a.rs", "use std::fs::File;"),
        ("io/a.rs", "mod tests { use super::*; use super::exec; }"),
        ("kernel/mod.rs", "use super::grid::Box3;"),
        ("main.rs", "fn main() { strandline::cli::main() }"),
    ] {
        assert_eq!(said(path, code), "", "{code}");
    }
}

#[test]
fn words_that_a_room_may_not_use_are_caught() {
    for (path, code, word) in [
        ("kernel/a.rs", "use rayon::prelude::*;", "rayon"),
        ("pipeline/a.rs", "fn f() { rayon::join(a, b); }", "rayon"),
        ("kernel/a.rs", "use std::fs;", "std::fs"),
        ("kernel/a.rs", "use std::{\n    fmt,\n    fs::{self, File},\n};", "std::fs"),
        ("kernel/a.rs", "fn f() { std :: thread :: yield_now(); }", "std::thread"),
        ("kernel/a.rs", "fn f() { println!(\"x\"); }", "println!"),
        ("io/a.rs", "use std::thread;", "std::thread"),
        ("io/a.rs", "fn f() { std::thread::spawn(g); }", "std::thread"),
        ("io/a.rs", "use memmap2::Mmap;", "memmap2"),
        ("exec/a.rs", "fn f() { unsafe { g() } }", "unsafe"),
        ("lib.rs", "fn f() { unsafe { g() } }", "unsafe"),
        ("pipeline/a.rs", "use mpi::traits::*;", "mpi::"),
        ("grid/a.rs", "use super::super::exec;", "super::super"),
        ("grid/a.rs", "use super::{super::exec, a};", "super::super"),
    ] {
        assert!(said(path, code).contains(&format!("`{word}`")), "not caught: {path}: {code}");
    }
    // `unsafe_code` and the like are other words.
    assert_eq!(said("grid/a.rs", "#![deny(unsafe_code)]"), "");
}

#[test]
fn long_files_and_missing_heads_are_caught() {
    let lines = |n: usize| format!("//! Head.\n{}", "fn f() {}\n".repeat(n - 1));
    assert!(violations("grid/a.rs", &lines(LONGEST_FILE)).is_empty());
    assert!(violations("grid/a.rs", &lines(LONGEST_FILE + 1))[0].contains("451 lines"));
    assert!(violations("grid/a.rs", "use std::fmt;\n//! Late head.\n")[0].contains("head"));
}
