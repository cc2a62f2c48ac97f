//! Runs of the program by itself: an item that crashes or runs out of memory takes nothing with it. Each is in a process group of
//! its own, so that a terminal's Ctrl-C reaches the batch alone, and ends when the batch does.

use std::ffi::OsString;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, WaitId, WaitIdOptions, kill_process, waitid};

use super::list::items::Item;
use crate::cli::terminal::parent::PARENT;

/// Of a log so many bytes at its end are looked at for why a run failed.
const LOG_END: u64 = 1 << 16;
/// How the program's own errors begin.
const ERROR: &str = "strandline: ";

/// Runs that go on, and since when.
static RUNNING: Mutex<Vec<(Pid, Instant)>> = Mutex::new(Vec::new());
/// After so long a process listens to signals that would end it else.
const LISTENS: Duration = Duration::from_secs(1);

/// What an item may use.
#[derive(Clone, Debug)]
pub(crate) struct Allowed {
    pub(crate) memory: u64,
    pub(crate) threads: usize,
    pub(crate) scratch: Option<PathBuf>,
}

/// What a run of an item finds of earlier ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Before {
    Nothing,
    /// What it is to replace.
    Replaced,
    /// Checkpoints of the same run, which was ended.
    Resumed,
}

/// The command line of an item. What replaces a store, and what else a further try is to do other than the first one, is said
/// here and nowhere else.
pub(crate) fn arguments(item: &Item, store: &Path, allowed: &Allowed, before: Before) -> Vec<OsString> {
    let with = |flag: &str, value: &Path| {
        let mut word = OsString::from(flag);
        word.push(value);
        word
    };
    let mut all = vec![OsString::from(item.kind.name())];
    all.extend(item.words.iter().cloned());
    all.push(format!("--memory={}", allowed.memory).into());
    all.push(format!("--threads={}", allowed.threads).into());
    all.extend(item.scratch.as_ref().or(allowed.scratch.as_ref()).map(|folder| with("--scratch=", folder)));
    all.push(with("--output=", store));
    match before {
        Before::Nothing => {}
        Before::Replaced => all.push("--overwrite".into()),
        Before::Resumed => all.push("--resume".into()),
    }
    all
}

/// The program with these arguments, before what an item works on.
fn command(arguments: &[OsString], item: &Item) -> io::Result<Command> {
    let mut command = Command::new(std::env::current_exe()?);
    command.args(arguments).arg("--").args(&item.inputs);
    command.stdin(Stdio::null()).process_group(0).env(PARENT, std::process::id().to_string());
    Ok(command)
}

/// Opens the log of an item for itself alone; none where another batch has it. Whoever runs the item has it locked, as long as
/// it runs.
pub(crate) fn open_log(path: &Path) -> io::Result<Option<File>> {
    let log = OpenOptions::new().create(true).truncate(false).read(true).append(true).open(path)?;
    match log.try_lock() {
        Err(TryLockError::WouldBlock) => return Ok(None),
        // A disk without locks has none for others either.
        Ok(()) | Err(TryLockError::Error(_)) => {}
    }
    Ok(Some(log))
}

/// Says in the log of an item that is not run why not; whether that is the batch's own now. One that others have, or that holds
/// what is not `own`, stays as it is.
pub(crate) fn log_refusal(path: &Path, own: bool, reason: &str) -> io::Result<bool> {
    let Some(mut log) = open_log(path)? else { return Ok(own) };
    if !own && log.metadata()?.len() > 0 {
        return Ok(false);
    }
    log.set_len(0)?;
    writeln!(log, "{ERROR}{reason}")?;
    Ok(true)
}

/// Starts a run that tells all it does in its log. It ends with the thread that calls this.
pub(crate) fn start(item: &Item, arguments: &[OsString], mut log: File) -> io::Result<Child> {
    log.set_len(0)?;
    let shown = arguments.iter().map(|word| word.to_string_lossy()).collect::<Vec<_>>().join(" ");
    let inputs = item.inputs.iter().map(|path| path.to_string_lossy()).collect::<Vec<_>>().join(" ");
    writeln!(log, "$ strandline {shown} --verbose -- {inputs}")?;
    let told = log.try_clone()?;
    let mut command = command(&[arguments, &["--verbose".into()]].concat(), item)?;
    spawn(command.stdout(told).stderr(log))
}

/// Asks a run what it would take; returns what it said on stderr, events in JSON.
pub(crate) fn ask(item: &Item, arguments: &[OsString]) -> io::Result<(ExitStatus, String)> {
    let more = ["--dry-run", "--log=json"].map(OsString::from);
    let mut command = command(&[arguments, &more].concat(), item)?;
    let mut child = spawn(command.stdout(Stdio::null()).stderr(Stdio::piped()))?;
    let mut said = Vec::new();
    if let Some(mut stderr) = child.stderr.take() {
        stderr.read_to_end(&mut said)?;
    }
    Ok((wait(&mut child)?, String::from_utf8_lossy(&said).into_owned()))
}

fn spawn(command: &mut Command) -> io::Result<Child> {
    let mut running = RUNNING.lock().unwrap_or_else(PoisonError::into_inner);
    let child = command.spawn()?;
    running.extend(Pid::from_raw(child.id() as i32).map(|pid| (pid, Instant::now())));
    Ok(child)
}

/// Waits until a run has ended.
pub(crate) fn wait(child: &mut Child) -> io::Result<ExitStatus> {
    if let Some(pid) = Pid::from_raw(child.id() as i32) {
        // Its number is its own until it is waited for; nobody may be sent a signal under it after that.
        while matches!(
            waitid(WaitId::Pid(pid), WaitIdOptions::EXITED | WaitIdOptions::NOWAIT),
            Err(rustix::io::Errno::INTR)
        ) {}
        let mut running = RUNNING.lock().unwrap_or_else(PoisonError::into_inner);
        running.retain(|(other, _)| *other != pid);
        return child.wait();
    }
    child.wait()
}

/// Sends all runs that go on a signal.
pub(crate) fn signal_all(signal: Signal) {
    for (pid, _) in RUNNING.lock().unwrap_or_else(PoisonError::into_inner).iter() {
        // One that ends by itself at this moment needs none.
        let _ = kill_process(*pid, signal);
    }
}

/// Asks all runs that go on for a checkpoint. One that has just begun has nothing to put by.
pub(crate) fn ask_for_checkpoints() {
    let running = RUNNING.lock().unwrap_or_else(PoisonError::into_inner);
    for (pid, _) in running.iter().filter(|(_, since)| since.elapsed() >= LISTENS) {
        let _ = kill_process(*pid, Signal::USR1);
    }
}

/// The most memory that a run has had so far, bytes.
pub(crate) fn peak(id: u32) -> Option<u64> {
    let text = fs::read_to_string(format!("/proc/{id}/status")).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.split_whitespace().next()?.parse::<u64>().ok()? << 10)
}

/// The exit code of a run, as a shell has it.
pub(crate) fn code(status: ExitStatus) -> i32 {
    status.code().or(status.signal().map(|signal| 128 + signal)).unwrap_or(1)
}

/// Why a run failed, by its log.
pub(crate) fn reason(status: ExitStatus, log: &Path) -> String {
    if let Some(signal) = status.signal() {
        let memory = if signal == Signal::KILL.as_raw() { ", as the system does where memory runs out" } else { "" };
        return format!("was ended by signal {signal}{memory}; {} tells how far it was", log.display());
    }
    let text = end_of(log).unwrap_or_default();
    let from = text.rfind(&format!("\n{ERROR}")).map(|at| at + 1).or_else(|| text.starts_with(ERROR).then_some(0));
    match from {
        Some(at) => text[at + ERROR.len()..].trim_end().replace('\n', "; "),
        None => format!("ended with code {}; {} tells how far it was", code(status), log.display()),
    }
}

fn end_of(log: &Path) -> io::Result<String> {
    let mut file = File::open(log)?;
    let length = file.metadata()?.len();
    file.seek(SeekFrom::Start(length.saturating_sub(LOG_END)))?;
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes)?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}
