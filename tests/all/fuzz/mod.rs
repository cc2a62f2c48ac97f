//! Readers on damaged inputs: what is read or refused in one sentence, and never a panic, for any content.
//!
//! `scripts/fuzz_readers` runs [`worker`] for as long as it is told, in a process with little memory, and puts inputs at
//! which a reader failed into `tests/kept`, from where they are read again with every run of the tests.

mod mutate;
mod readers;

use std::cell::RefCell;
use std::collections::BTreeSet;
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use strandline::error::Error;

use crate::common::random::Random;
use crate::tiff_hostile::{LIMITED, rerun_limited};
use mutate::mutate;
use readers::{Files, READERS, Reader};

thread_local! {
    /// Place and words of the last panic of this thread.
    static PANIC: RefCell<String> = const { RefCell::new(String::new()) };
}

fn write(folder: &Path, files: &[(String, Vec<u8>)]) {
    for (name, bytes) in files {
        let path = folder.join(name);
        fs::create_dir_all(path.parent().expect("a file in the folder")).expect("room for an input");
        fs::write(path, bytes).expect("room for an input");
    }
}

/// What is wrong with how the reader took an input; none where it was read or refused well.
fn fault(reader: &Reader, folder: &Path) -> Option<String> {
    match catch_unwind(AssertUnwindSafe(|| (reader.read)(folder))) {
        Err(_) => Some(format!("panicked at {}", PANIC.with_borrow(Clone::clone))),
        Ok(Err(error)) => {
            let text = error.to_string();
            if text.trim().is_empty() || text.contains('\n') {
                return Some(format!("refused in other than one line: {text:?}"));
            }
            let is_wrong = reader.blames_input && error.exit_code() != 2;
            is_wrong.then(|| format!("refused with exit code {}: {text}", error.exit_code()))
        }
        Ok(Ok(())) => None,
    }
}

/// What tells faults apart: the place of a panic, or the sentence without its numbers.
fn kind(fault: &str) -> String {
    let place = fault.split(" | ").next().unwrap_or(fault);
    if fault.starts_with("panicked") {
        place.to_owned()
    } else {
        place.chars().filter(char::is_ascii_alphabetic).take(60).collect()
    }
}

/// Remembers panics in place of printing each of thousands.
fn remember_panics() {
    std::panic::set_hook(Box::new(|info| {
        let place = info.location().map_or_else(String::new, |at| format!("{}:{}", at.file(), at.line()));
        let words = info.payload_as_str().unwrap_or_default().replace('\n', " ");
        PANIC.with_borrow_mut(|last| *last = format!("{place} | {words}"));
    }));
}

/// A run of damaged inputs of one reader.
struct Run<'a> {
    reader: &'a Reader,
    seeds: Vec<Files>,
    /// Where the input lies that is being read, and where those are put at which the reader failed.
    folder: PathBuf,
    known: BTreeSet<String>,
    random: Random,
    slowest: Duration,
}

impl Run<'_> {
    /// Lays a whole input out, and reads some damaged forms of it.
    fn round(&mut self, count: &mut u64) {
        let input = self.folder.join("input");
        let seed = self.seeds[self.random.below(self.seeds.len())].clone();
        let _ = fs::remove_dir_all(&input);
        write(&input, &seed);
        for _ in 0..50 {
            let (name, whole) = &seed[self.random.below(seed.len())];
            let other = &self.seeds[self.random.below(self.seeds.len())];
            let other = &other[self.random.below(other.len())].1;
            let damaged = mutate(whole, other, &mut self.random);
            fs::write(input.join(name), &damaged).expect("room for an input");
            let started = Instant::now();
            let found = fault(self.reader, &input);
            self.slowest = self.slowest.max(started.elapsed());
            *count += 1;
            if let Some(fault) = found.filter(|fault| self.known.insert(kind(fault))) {
                let files: Files = seed
                    .iter()
                    .map(|(n, b)| (n.clone(), if n == name { damaged.clone() } else { b.clone() }))
                    .collect();
                let place = self.folder.join("found").join(format!("{}-{:016x}", self.reader.name, self.random.next()));
                write(&place, &files);
                println!("fault {} {fault}", place.display());
            }
            fs::write(input.join(name), whole).expect("room for an input");
        }
    }
}

/// What `scripts/fuzz_readers` runs: reader, seconds, seed, a folder to work in and perhaps one of further files come by
/// variables.
#[test]
#[ignore = "runs as long as scripts/fuzz_readers says"]
fn worker() {
    let told = |name: &str| std::env::var(format!("STRANDLINE_FUZZ_{name}")).ok();
    let name = told("READER").expect("a reader");
    let seconds: u64 = told("SECONDS").and_then(|text| text.parse().ok()).expect("seconds");
    let folder = PathBuf::from(told("FOLDER").expect("a folder"));
    let reader = READERS.iter().find(|reader| reader.name == name).expect("a reader of this name");
    let seeds = reader.seeds(told("SEEDS").as_deref().map(Path::new));
    let random = Random(told("SEED").and_then(|text| text.parse().ok()).expect("a seed"));
    remember_panics();
    let (started, mut count) = (Instant::now(), 0);
    let mut run = Run { reader, seeds, folder, known: BTreeSet::new(), random, slowest: Duration::ZERO };
    while started.elapsed() < Duration::from_secs(seconds) {
        run.round(&mut count);
        fs::write(run.folder.join("count"), count.to_string()).expect("room for a number");
    }
    println!("slowest {:.3}", run.slowest.as_secs_f64());
}

/// A reader that fails in each way that is no good.
#[test]
fn what_is_wrong_with_a_reader_is_told() {
    let reader = |read| Reader { name: "bad", endings: &[], seeds_of: Vec::new, read, blames_input: true };
    let said = |read: fn(&Path) -> strandline::error::Result<()>| fault(&reader(read), Path::new("nowhere"));
    assert!(said(|_| panic!("a panic that is meant")).is_some_and(|fault| fault.starts_with("panicked")));
    assert!(said(|_| Err(Error::partly("two\nlines"))).is_some_and(|fault| fault.contains("one line")));
    assert!(said(|_| Err(Error::failed("no fault of the input"))).is_some_and(|fault| fault.contains("exit code 1")));
    assert_eq!(said(|_| Err(Error::input("is no mesh"))), None);
    assert_eq!(said(|_| Ok(())), None);
}

/// Whole inputs are read: damage starts from what readers take.
#[test]
fn seeds_are_read_and_a_little_damage_does_no_harm() {
    let folder = tempfile::tempdir().expect("room");
    for reader in READERS {
        let seeds = reader.seeds(None);
        let is_read = |(n, files): (usize, &Files)| {
            let place = folder.path().join(format!("{}-{n}", reader.name));
            write(&place, files);
            (reader.read)(&place).is_ok()
        };
        let count = seeds.iter().enumerate().filter(|seed| is_read(*seed)).count();
        // Some are dialects that are refused.
        assert!(count >= 3, "{}: {count} of {} whole inputs are read", reader.name, seeds.len());
        let place = folder.path().join(reader.name);
        let (random, known) = (Random(1), BTreeSet::new());
        let mut run = Run { reader, seeds, folder: place.clone(), known, random, slowest: Duration::ZERO };
        let mut count = 0;
        while count < 400 {
            run.round(&mut count);
        }
        assert!(run.known.is_empty(), "{}: {:?}, kept in {}", reader.name, run.known, place.display());
    }
}

/// Inputs at which a reader once failed, in 1 GiB.
#[test]
fn inputs_that_were_kept_are_read_or_refused() {
    if std::env::var_os(LIMITED).is_none() {
        return rerun_limited("fuzz::inputs_that_were_kept_are_read_or_refused");
    }
    let kept = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/kept");
    let mut wrong = Vec::new();
    let folders = fs::read_dir(&kept).into_iter().flatten().flatten().map(|entry| entry.path());
    for folder in folders.filter(|path| path.is_dir()) {
        let name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let reader = READERS.iter().find(|reader| name.split('-').next() == Some(reader.name));
        let reader = reader.unwrap_or_else(|| panic!("{name} is of no reader"));
        wrong.extend(fault(reader, &folder).map(|fault| format!("{name}: {fault}")));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
