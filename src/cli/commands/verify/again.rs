//! The run that wrote a store, once more: its command line as the report keeps it, with another output, and with other threads,
//! memory and bricks where these change no bit (docs/architecture.md, "The same bits everywhere").

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use serde_json::Value;

use crate::cli::args::verify::VerifyArgs;
use crate::cli::inputs::typed::{Given, Typed};
use crate::cli::terminal::console::Console;
use crate::error::{Error, Result};
use crate::exec::{Cancel, Engine, Progress};
use crate::io::geometry::read::sources::is_standard_input;
use crate::job::resources::folder_of;
use crate::pipeline::verify::{Check, report_of, same_results};
use crate::store::HiddenFolder;

/// How a command line begins to name the folder of temporary files.
const SCRATCH: &str = "--scratch=";
/// Flags that are given anew or that change what is written beside the results.
const OURS: [&str; 16] = [
    "output",
    "overwrite",
    "live",
    "report",
    "mesh",
    "picture",
    "dry_run",
    "quiet",
    "verbose",
    "log",
    "threads",
    "memory",
    "brick",
    "resume",
    "checkpoint",
    "checkpoint_every",
];
/// Between two looks at the child.
const BETWEEN_LOOKS: Duration = Duration::from_millis(20);

/// A run that can be made again.
pub(super) struct Again {
    store: PathBuf,
    report: Value,
    line: Vec<OsString>,
}

impl Again {
    /// What wrote the store.
    ///
    /// # Errors
    /// When the report names no command, or an input is gone.
    pub(super) fn of(store: &Path) -> Result<Self> {
        let report = report_of(store)?;
        inputs_are_there(&report, store)?;
        let line = command_line(&report, store)?;
        Ok(Self { store: store.canonicalize().unwrap_or_else(|_| store.to_path_buf()), report, line })
    }
}

/// Runs what wrote the store once more and compares.
pub(super) fn rerun(
    again: Again,
    args: &VerifyArgs,
    engine: &Engine,
    cancel: &Cancel,
    console: &Console,
) -> Result<Check> {
    let Again { store, report, line } = again;
    let folder = args.scratch.as_deref().unwrap_or_else(|| folder_of(&store));
    let beside = HiddenFolder::create(folder)
        .map_err(|e| Error::from_io("the second run has no folder; name one with --scratch", &e).at(folder))?;
    let again = beside.path().join("again.zarr");
    let layout = Layout::other_than(&report, args);
    match run(line.clone(), &layout, &again, cancel) {
        // Half of the memory may be too little; then it is what it was.
        Err(error) if error.exit_code() == 2 && args.memory.is_none() => {
            run(line, &Layout { memory: None, ..layout.clone() }, &again, cancel)?;
            console.note("the second run has the memory of the first: half of it was too little");
        }
        done => done?,
    }
    let mut check = same_results(engine, &store, &again)?;
    check.told += &layout.told();
    Ok(check)
}

/// What a run is given that changes no bit.
#[derive(Clone, Debug)]
struct Layout {
    threads: u64,
    memory: Option<u64>,
    /// None where the size of bricks may change last places.
    brick: Option<i64>,
    /// Where it puts temporary files; none where the first run did.
    scratch: Option<PathBuf>,
}

impl Layout {
    fn other_than(report: &Value, args: &VerifyArgs) -> Self {
        let threads = if report["threads"] == 1 { 2 } else { 1 };
        let half = report["memory_budget_bytes"].as_u64().map(|bytes| bytes / 2);
        // Solutions of an Eikonal equation depend in their last places on the bricks, those of a level set do not.
        let is_free = matches!(report["command"].as_str(), Some("segment" | "demo" | "reconstruct"));
        let brick = if report["settings"]["brick"] == 32 { 64 } else { 32 };
        let threads = args.threads.map_or(threads, |threads| threads as u64);
        let scratch = args.scratch.clone();
        Self { threads, memory: args.memory.or(half), brick: is_free.then_some(brick), scratch }
    }

    fn told(&self) -> String {
        let brick = self.brick.map_or(String::new(), |brick| format!(", --brick {brick}"));
        format!("; the second run had --threads {}{brick}", self.threads)
    }
}

/// Says which input is gone before a run says it in its own words.
fn inputs_are_there(report: &Value, store: &Path) -> Result<()> {
    if report["command"] == "demo" {
        return Ok(());
    }
    let settings = &report["settings"];
    let lists = ["points", "sources"].iter().flat_map(|key| settings[key].as_array().into_iter().flatten());
    let single = ["image", "cloud", "speed"].iter().map(|key| &settings[key]);
    for name in lists.chain(single).filter_map(Value::as_str) {
        let path = Path::new(name);
        if is_standard_input(path) {
            return Err(Error::input("read the standard input, which cannot be read again").at(store));
        }
        if !path.exists() {
            let what = format!(
                "the input {name} is not there any more, or not seen from this folder; --rerun is to be given where the \
                 command was"
            );
            return Err(Error::input(what).at(store));
        }
    }
    Ok(())
}

/// The arguments of the command as it was typed, without those that are given anew.
fn command_line(report: &Value, store: &Path) -> Result<Vec<OsString>> {
    let typed: Vec<&str> = report["arguments"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
    let unknown = |error: &dyn std::fmt::Display| {
        let first = error.to_string().lines().next().unwrap_or_default().to_owned();
        Error::input(format!("the command in its report.json is not understood: {first}")).at(store)
    };
    let Typed { command, given } = Typed::read(&typed).map_err(|error| unknown(&error))?;
    if report["command"] != *command {
        return Err(unknown(&"it is not the one that the report is of"));
    }
    let (mut line, mut inputs) = (vec![OsString::from(command)], Vec::new());
    for Given { id, flag, takes_values, values, .. } in given {
        match flag {
            _ if OURS.contains(&id.as_str()) => {}
            None => inputs.extend(values),
            Some(flag) if takes_values => line.extend(values.iter().map(|value| {
                let mut word = OsString::from(format!("--{flag}="));
                word.push(value);
                word
            })),
            Some(flag) => line.push(format!("--{flag}").into()),
        }
    }
    line.push("--".into());
    line.extend(inputs);
    Ok(line)
}

/// Runs this program; what it says when it fails is the error.
fn run(mut line: Vec<OsString>, layout: &Layout, output: &Path, cancel: &Cancel) -> Result<()> {
    let program: PathBuf =
        std::env::current_exe().map_err(|e| Error::from_io("this program is not found again", &e))?;
    let mut output_flag = OsString::from("--output=");
    output_flag.push(output);
    let mut flags = vec![output_flag, format!("--threads={}", layout.threads).into(), "--quiet".into()];
    flags.extend(layout.memory.map(|bytes| format!("--memory={bytes}").into()));
    flags.extend(layout.brick.map(|brick| format!("--brick={brick}").into()));
    if let Some(scratch) = &layout.scratch {
        line.retain(|word| !word.to_string_lossy().starts_with(SCRATCH));
        let mut flag = OsString::from(SCRATCH);
        flag.push(scratch);
        flags.push(flag);
    }
    line.splice(1..1, flags);
    let failed = |e: std::io::Error| Error::from_io("the second run cannot be started", &e);
    let said = tempfile::tempfile().map_err(failed)?;
    let heard = said.try_clone().map_err(failed)?;
    let mut child = Command::new(program)
        .args(line)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::from(said))
        .spawn()
        .map_err(failed)?;
    let status = loop {
        if let Some(status) = child.try_wait().map_err(failed)? {
            break status;
        }
        if let Err(error) = cancel.check() {
            end(&mut child);
            return Err(error);
        }
        std::thread::sleep(BETWEEN_LOOKS);
    };
    if status.success() || status.code() == Some(3) {
        return Ok(());
    }
    let text = words(heard);
    let what = format!("the second run failed: {}", text.trim().trim_start_matches("strandline: "));
    Err(if status.code() == Some(2) { Error::input(what) } else { Error::failed(what) })
}

fn words(mut file: std::fs::File) -> String {
    use std::io::{Read, Seek, SeekFrom};
    let mut text = Vec::new();
    // Without its words the failure is told all the same.
    let _ = file.seek(SeekFrom::Start(0)).and_then(|_| file.read_to_end(&mut text));
    String::from_utf8_lossy(&text).into_owned()
}

fn end(child: &mut Child) {
    // It may have ended meanwhile.
    let _ = child.kill();
    let _ = child.wait();
}
