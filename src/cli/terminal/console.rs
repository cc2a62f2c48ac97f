//! What the user hears while a run goes on, on stderr: bars on a terminal, plain lines now and then elsewhere.
//!
//! A bar never lies: a stage without a known number of steps, or with more of them than it announced, shows counts and
//! no percentage. Stages may begin while another is open; they share one bar then.

use std::io::{IsTerminal, Write, stderr};
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use serde_json::json;

use super::log;
use super::text::{duration, grouped};
use crate::cli::args::common::{LogArg, OutputArgs};
use crate::error::one_line;
use crate::exec::{Comm, Outlook, Progress};

/// Notes that are said; the report has all.
const MOST_NOTES: usize = 20;
const BETWEEN_LINES: Duration = Duration::from_secs(5);
const BETWEEN_DRAWINGS: Duration = Duration::from_millis(200);

/// How much is said.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Voice {
    /// Nothing.
    Quiet,
    /// How far the run is, and notes.
    Normal,
    /// Each stage as it ends, too.
    Verbose,
    /// All of it, as lines of JSON.
    Json,
}

impl Voice {
    /// What the two flags ask for.
    pub(crate) fn of(quiet: bool, verbose: bool) -> Self {
        match (quiet, verbose) {
            (true, _) => Self::Quiet,
            (_, true) => Self::Verbose,
            _ => Self::Normal,
        }
    }

    /// What they ask for where events may be lines of JSON.
    pub(crate) fn told(log: LogArg, quiet: bool, verbose: bool) -> Self {
        match log {
            LogArg::Text => Self::of(quiet, verbose),
            LogArg::Json if quiet => Self::Quiet,
            LogArg::Json => Self::Json,
        }
    }

    /// What the flags of a run ask for of a rank: the first one speaks for all.
    pub(crate) fn of_rank(comm: &dyn Comm, output: &OutputArgs) -> Self {
        if comm.rank() == 0 { Self::of_run(output) } else { Self::Quiet }
    }

    /// What the flags of a run ask for.
    pub(crate) fn of_run(output: &OutputArgs) -> Self {
        Self::told(output.log, output.quiet, output.verbose)
    }
}

/// The user's side of a run.
pub(crate) struct Console {
    voice: Voice,
    terminal: bool,
    started: Instant,
    steps: AtomicU64,
    /// When the next plain line is due, in milliseconds since the start.
    due: AtomicU64,
    open: Mutex<Open>,
    notes: Mutex<Vec<String>>,
    /// What runs before this one have said.
    said: Vec<String>,
    outlook: OnceLock<Arc<Outlook>>,
}

/// The stages that are open.
#[derive(Default)]
struct Open {
    names: Vec<String>,
    ended: usize,
    total: u64,
    since: Option<Instant>,
    bar: Option<ProgressBar>,
    /// True while the bar shows a percentage.
    measured: bool,
}

impl Console {
    pub(crate) fn new(voice: Voice) -> Self {
        Self {
            voice,
            terminal: stderr().is_terminal(),
            started: Instant::now(),
            steps: AtomicU64::new(0),
            due: AtomicU64::new(BETWEEN_LINES.as_millis() as u64),
            open: Mutex::default(),
            notes: Mutex::default(),
            said: Vec::new(),
            outlook: OnceLock::new(),
        }
    }

    /// That of one of several runs of a kind: what those before it have noted is kept, and not said once more.
    pub(crate) fn after(voice: Voice, said: Vec<String>) -> Self {
        Self { said, ..Self::new(voice) }
    }

    /// True when settings and stages are to be told.
    pub(crate) fn is_verbose(&self) -> bool {
        self.voice == Voice::Verbose
    }

    /// One line on stderr that is no note: what is about to be done.
    pub(crate) fn say(&self, line: &str) {
        match self.voice {
            Voice::Quiet => {}
            Voice::Json => log::event("message", json!({ "text": line })),
            _ => draw_line(&self.lock(), line),
        }
    }

    /// Seconds that are left of the run, as far as that can be told.
    fn left(&self) -> Option<f64> {
        self.outlook.get().and_then(|outlook| outlook.left())
    }

    fn left_in_words(&self) -> String {
        self.left().map_or(String::new(), |left| format!("  about {} left", duration(left)))
    }

    /// What was noted so far, for the report.
    pub(crate) fn notes(&self) -> Vec<String> {
        self.notes.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Takes away what is drawn; for runs that end within a stage.
    pub(crate) fn clear(&self) {
        let mut open = self.lock();
        if let Some(bar) = open.bar.take() {
            bar.finish_and_clear();
        }
        *open = Open::default();
    }

    fn lock(&self) -> MutexGuard<'_, Open> {
        self.open.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether there is no bar to draw.
    fn is_plain(&self) -> bool {
        !self.terminal || matches!(self.voice, Voice::Quiet | Voice::Json)
    }

    fn plain_line(&self) {
        let open = self.lock();
        let Some(since) = open.since else { return };
        let steps = self.steps.load(Relaxed);
        if self.voice == Voice::Json {
            let total = (open.total > 0).then_some(open.total);
            let done = self.outlook.get().map(|outlook| outlook.done());
            let what = json!({
                "stage": open.names.join(", "), "steps": steps, "total": total, "done": done, "left": self.left(),
                "seconds": self.started.elapsed().as_secs_f64(),
            });
            return log::event("progress", what);
        }
        let far = if open.total > 0 && steps <= open.total {
            format!("{:3} %", 100 * steps / open.total)
        } else {
            format!("{} steps", grouped(steps))
        };
        let (names, took) = (open.names.join(", "), duration(since.elapsed().as_secs_f64()));
        draw_line(&open, &format!("{names}  {far}  {took}{}", self.left_in_words()));
    }
}

/// Writes a line above the bar, if one is drawn.
fn draw_line(open: &Open, line: &str) {
    let write = || {
        // Nobody is left to tell when stderr is closed.
        let _ = writeln!(stderr(), "{line}");
    };
    match &open.bar {
        Some(bar) => bar.suspend(write),
        None => write(),
    }
}

fn measured() -> ProgressStyle {
    ProgressStyle::with_template("{msg:24} {bar:40} {percent:>3} %  {elapsed}{prefix}")
        .unwrap_or_else(|_| ProgressStyle::default_bar())
}

fn counting() -> ProgressStyle {
    ProgressStyle::with_template("{msg:24} {spinner} {human_pos} steps  {elapsed}{prefix}")
        .unwrap_or_else(|_| ProgressStyle::default_spinner())
}

impl Progress for Console {
    fn look_out(&self, outlook: &Arc<Outlook>) {
        // A console is that of one run.
        let _ = self.outlook.set(outlook.clone());
    }

    fn begin(&self, name: &str, total: u64) {
        let mut open = self.lock();
        open.names.push(name.into());
        if open.names.len() > 1 {
            // What several stages have to do together is known only if it is known of each.
            open.total = if open.total > 0 && total > 0 { open.total + total } else { 0 };
        } else {
            open.total = total;
            open.since = Some(Instant::now());
            self.steps.store(0, Relaxed);
        }
        if self.voice == Voice::Json {
            log::event("begin", json!({ "stage": name, "seconds": self.started.elapsed().as_secs_f64() }));
        }
        if self.is_plain() {
            return;
        }
        open.measured = open.total > 0;
        let length = open.measured.then_some(open.total);
        let style = if open.measured { measured() } else { counting() };
        let bar = open.bar.get_or_insert_with(|| {
            let bar = ProgressBar::with_draw_target(length, ProgressDrawTarget::stderr());
            bar.enable_steady_tick(BETWEEN_DRAWINGS);
            bar
        });
        bar.set_style(style);
        let names = open.names.join(", ");
        if let Some(bar) = &open.bar {
            bar.set_message(names);
        }
    }

    fn advance(&self, steps: u64) {
        let now = self.steps.fetch_add(steps, Relaxed) + steps;
        if self.voice == Voice::Quiet {
            return;
        }
        if !self.is_plain() {
            // Drawing is left to the bar's own clock; the count is handed over now and then.
            if now.is_multiple_of(8) || steps > 1 {
                let mut open = self.lock();
                if open.measured && now > open.total {
                    open.measured = false;
                    if let Some(bar) = &open.bar {
                        bar.set_style(counting());
                        bar.unset_length();
                    }
                }
                if let Some(bar) = &open.bar {
                    bar.set_position(now);
                    bar.set_prefix(self.left_in_words());
                }
            }
            return;
        }
        let elapsed = self.started.elapsed().as_millis() as u64;
        let due = self.due.load(Relaxed);
        let next = elapsed + BETWEEN_LINES.as_millis() as u64;
        if elapsed >= due && self.due.compare_exchange(due, next, Relaxed, Relaxed).is_ok() {
            self.plain_line();
        }
    }

    fn note(&self, line: &str) {
        let before = {
            let mut notes = self.notes.lock().unwrap_or_else(PoisonError::into_inner);
            notes.push(line.into());
            notes.len() - 1
        };
        if self.said.iter().any(|said| said == line) {
            return;
        }
        if before == MOST_NOTES && self.voice != Voice::Json {
            self.say("more notes are in the report alone");
        }
        if self.voice == Voice::Json {
            log::event("note", json!({ "text": line }));
        } else if self.voice != Voice::Quiet && before < MOST_NOTES {
            draw_line(&self.lock(), &format!("note: {}", one_line(line.into())));
        }
    }

    fn end(&self) {
        let mut open = self.lock();
        open.ended += 1;
        if open.ended < open.names.len() {
            return;
        }
        if let Some(bar) = open.bar.take() {
            bar.finish_and_clear();
        }
        let ended = std::mem::take(&mut *open);
        if let Some(since) = ended.since.filter(|_| self.voice == Voice::Json) {
            log::event("end", json!({ "stage": ended.names.join(", "), "took": since.elapsed().as_secs_f64() }));
        }
        if let Some(since) = ended.since.filter(|_| self.voice == Voice::Verbose) {
            let seconds = since.elapsed().as_secs_f64();
            draw_line(&open, &format!("{}  done  {seconds:.1} s", ended.names.join(", ")));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_that_overlap_are_one_until_all_have_ended() {
        let console = Console::new(Voice::Quiet);
        console.begin("a", 10);
        console.begin("b", 0);
        assert_eq!(console.lock().total, 0, "a total that is not known makes the sum unknown");
        console.advance(3);
        console.end();
        assert_eq!(console.lock().names, ["a", "b"]);
        console.end();
        assert!(console.lock().names.is_empty());
        console.begin("c", 5);
        assert_eq!((console.lock().total, console.steps.load(Relaxed)), (5, 0));
        console.note("told");
        assert_eq!(console.notes(), ["told"]);
    }
}
