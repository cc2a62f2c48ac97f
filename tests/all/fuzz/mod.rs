//! Readers on damaged inputs: what is read or refused in one sentence, and never a panic, for any content.
//!
//! `scripts/fuzz_readers` runs [`worker`] for as long as it is told, in a process with little memory, and puts inputs at
//! which a reader failed into `tests/kept`, from where they are read again with every run of the tests.

mod costly;
mod json;
mod mutate;
mod packed;
mod readers;
mod seeds;
mod tags;
mod words;

use std::cell::RefCell;
use std::collections::BTreeSet;
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use strandline::error::Error;

use crate::common::random::Random;
use crate::common::stores;
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

fn remove<'a>(folder: &Path, names: impl Iterator<Item = &'a String>) {
    for name in names {
        fs::remove_file(folder.join(name)).expect("a file of the input");
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

/// What tells faults apart: the place of a panic, or the end of the sentence, which names no file, without its numbers.
fn kind(fault: &str) -> String {
    let place = fault.split(" | ").next().unwrap_or(fault);
    if fault.starts_with("panicked") {
        place.to_owned()
    } else {
        let end = place.rsplit(": ").next().unwrap_or(place);
        end.chars().filter(char::is_ascii_alphabetic).take(60).collect()
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

/// No more kinds of faults are told of a run: one cause may show in many sentences.
const MOST_FAULTS: usize = 20;

/// What takes longer is told, though it is no fault.
const SLOW: Duration = Duration::from_secs(2);

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
            let (lost, new) = self.damage(&seed);
            remove(&input, lost.iter());
            write(&input, &new);
            let started = Instant::now();
            let found = fault(self.reader, &input);
            let took = started.elapsed();
            if took > SLOW.max(self.slowest) {
                let place = self.folder.join("found").join(format!("slow-{:016x}", self.random.next()));
                write(&place, &stores::contents(&input));
                println!("slow {} {:.3} s", place.display(), took.as_secs_f64());
            }
            self.slowest = self.slowest.max(took);
            *count += 1;
            if let Some(fault) = found.filter(|fault| self.known.len() < MOST_FAULTS && self.known.insert(kind(fault)))
            {
                let place = self.folder.join("found").join(format!("{}-{:016x}", self.reader.name, self.random.next()));
                write(&place, &stores::contents(&input));
                println!("fault {} {fault}", place.display());
            }
            remove(&input, new.iter().map(|(name, _)| name));
            let is_changed = |name: &String| lost.contains(name) || new.iter().any(|(n, _)| n == name);
            seed.iter().filter(|(name, _)| is_changed(name)).for_each(|file| write(&input, std::slice::from_ref(file)));
        }
    }

    /// What an input loses, and what it gets: mostly one file in place of itself, at times several, or under another name.
    fn damage(&mut self, seed: &Files) -> (Vec<String>, Files) {
        let random = &mut self.random;
        let files = if random.below(4) == 0 { 1 + random.below(3) } else { 1 };
        let (mut lost, mut new) = (BTreeSet::new(), Files::new());
        for _ in 0..files {
            let (name, whole) = &seed[random.below(seed.len())];
            if !lost.insert(name.clone()) {
                continue;
            }
            let other = &self.seeds[random.below(self.seeds.len())];
            let other = &other[random.below(other.len())].1;
            match random.below(16) {
                0 if seed.len() > 1 => {}
                1 => new.push((renamed(name, random), whole.clone())),
                _ => new.push((name.clone(), mutate(whole, other, random))),
            }
        }
        // A new name may be that of another file, or of a folder.
        let holds = |name: &str, other: &str| {
            other.strip_prefix(name).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
        };
        let is_free = |name: &String| lost.contains(name) || !seed.iter().any(|(other, _)| holds(name, other));
        new.retain(|(name, _)| is_free(name));
        new.sort();
        new.dedup_by(|a, b| a.0 == b.0);
        (lost.into_iter().collect(), new)
    }
}

/// Another name in the same folder.
fn renamed(name: &str, random: &mut Random) -> String {
    let (folder, last) = name.rsplit_once('/').map_or(("", name), |(folder, last)| (folder, last));
    let damaged = mutate::mutate_blindly(last.as_bytes(), b"c00_z01_t2.tif", random);
    let text: String =
        String::from_utf8_lossy(&damaged).chars().filter(|c| !matches!(c, '/' | '\0')).take(60).collect();
    let text = if matches!(text.as_str(), "" | "." | "..") { "0".to_owned() } else { text };
    if folder.is_empty() { text } else { format!("{folder}/{text}") }
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
