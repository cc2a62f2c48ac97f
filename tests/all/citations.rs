//! What source files cite of `docs/algorithms.md` is there.
//!
//! A citation is `docs/algorithms.md, "Heading"`, which may be broken over two lines of a comment.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

const PAGE: &str = "docs/algorithms.md";

/// The text of all comments and code in one line, without the marks that begin comment lines.
fn flattened(text: &str) -> String {
    let line = |line: &str| {
        let line = line.trim();
        let comment = ["//!", "///", "//", "#"].iter().find_map(|mark| line.strip_prefix(mark));
        comment.unwrap_or(line).trim().to_owned()
    };
    text.lines().map(line).collect::<Vec<_>>().join(" ")
}

/// The headings that a file cites; a citation without one is an error.
fn cited(text: &str) -> Result<Vec<String>, String> {
    let flat = flattened(text);
    let found = flat.match_indices(PAGE).map(|(at, page)| {
        let rest = &flat[at + page.len()..];
        let heading = rest.strip_prefix(", \"").and_then(|rest| Some(rest.split_once('"')?.0.to_owned()));
        heading.ok_or_else(|| format!("a citation without a heading: {}", rest.chars().take(60).collect::<String>()))
    });
    found.collect()
}

fn headings(page: &str) -> BTreeSet<String> {
    let heading = |line: &str| Some(line.strip_prefix('#')?.trim_start_matches('#').trim().to_owned());
    page.lines().filter_map(heading).collect()
}

fn rust_files(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder of the project") {
        let path = entry.expect("a folder of the project").path();
        if path.is_dir() {
            rust_files(&path, files);
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            files.push(path);
        }
    }
}

#[test]
fn every_heading_that_is_cited_exists() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let headings = headings(&fs::read_to_string(root.join(PAGE)).expect("the page is part of the project"));
    let mut files = Vec::new();
    for folder in ["src", "tests", "benches"] {
        rust_files(&root.join(folder), &mut files);
    }
    let (mut wrong, mut count) = (Vec::new(), 0);
    for path in files.iter().filter(|path| !path.ends_with(file!())) {
        match cited(&fs::read_to_string(path).expect("a source file")) {
            Ok(found) => {
                count += found.len();
                let missing = found.into_iter().filter(|heading| !headings.contains(heading));
                wrong.extend(missing.map(|heading| format!("{}: no heading \"{heading}\"", path.display())));
            }
            Err(what) => wrong.push(format!("{}: {what}", path.display())),
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(count >= 40, "only {count} citations found");
}

#[test]
fn citations_are_found_across_lines_and_told_without_a_heading() {
    let broken = "//! Head (docs/algorithms.md, \"Two\n//! words\").\nfn f() {}\n";
    assert_eq!(cited(broken), Ok(vec!["Two words".to_owned()]));
    assert!(cited("/// As docs/algorithms.md says.").is_err());
    assert!(!headings("# A\n## Two words\n").contains("Two"));
}
