//! `strandline batch`: reads the list, finds what is to be run and why, runs it, and sums up what came of it.

use std::path::Path;

use crate::cli::args::batch::BatchArgs;
use crate::cli::batch::asked::Asked;
use crate::cli::batch::child::log_refusal;
use crate::cli::batch::list::items::{Item, items};
use crate::cli::batch::list::problems::Problems;
use crate::cli::batch::list::{init, manifest};
use crate::cli::batch::page::{seconds, told};
use crate::cli::batch::plan::{Plan, Pool, Refused, each, plans, pool_share};
use crate::cli::batch::schedule::{Schedule, check_own, is_replacing};
use crate::cli::batch::share::Waiting;
use crate::cli::batch::state::{Folder, Stage, State, reasons};
use crate::cli::batch::summary::Summary;
use crate::cli::batch::tell::Teller;
use crate::cli::print;
use crate::cli::report::table::cut;
use crate::cli::terminal::console::Voice;
use crate::cli::terminal::text::bytes;
use crate::error::{Error, Result};
use crate::job::resources::Resources;

/// An item that is to be run: its place, and why.
type Due = (usize, Vec<String>);
/// What an item would take, or why it will not run; none where the end was asked for before.
type Answer = Option<std::result::Result<Plan, Refused>>;

/// Runs the command.
pub(crate) fn run(args: &BatchArgs) -> Result<()> {
    if let Some(folder) = &args.init {
        return begin_list(folder, args.quiet);
    }
    let (Some(jobs), Some(output)) = (&args.jobs, &args.output) else {
        return Err(Error::usage("give JOBS.toml and -o DIR, or --init FOLDER"));
    };
    if output.as_os_str() == "none" {
        return Err(Error::usage(
            "a batch keeps its results and what it knows of them in a folder; name one with -o (./none if it is to be called that)",
        ));
    }
    let mut problems = Problems::default();
    let list = manifest::read(jobs, &mut problems)?;
    let all = items(&list, output, &mut problems);
    problems.refuse(jobs)?;
    if output.exists() && !output.is_dir() {
        return Err(Error::usage("is no folder; results go into one").at(output));
    }
    let mine = |(place, item)| args.shard.is_none_or(|shard| shard.has(place)).then_some(item);
    let items: Vec<Item> = all.into_iter().enumerate().filter_map(mine).collect();
    let voice = Voice::told(args.log, args.quiet, false);
    let teller = Teller::new(voice, items.iter().map(|item| item.name.chars().count()));
    let batch = Batch { args, folder: Folder(output.clone()), items, teller };
    if args.summary { batch.sum_up() } else { batch.run() }
}

fn begin_list(folder: &Path, quiet: bool) -> Result<()> {
    let (path, with, without) = init::write(folder)?;
    let rest = if without > 0 { format!("; {without} stacks have no points of their name") } else { String::new() };
    if quiet { Ok(()) } else { print(&format!("{}: {with} items{rest}\n", path.display())) }
}

/// The items of a list that fall to this run.
struct Batch<'a> {
    args: &'a BatchArgs,
    folder: Folder,
    items: Vec<Item>,
    teller: Teller,
}

impl Batch<'_> {
    fn summary(&self) -> Summary {
        Summary::new(&self.folder, self.args.shard, self.items.iter().map(|item| item.name.clone()))
    }

    /// `--summary`: what is done so far.
    fn sum_up(&self) -> Result<()> {
        if !self.folder.0.is_dir() {
            return Err(Error::usage("is not there; nothing was run into it yet").at(&self.folder.0));
        }
        let mut summary = self.summary();
        summary.write()?;
        self.end(&summary)
    }

    fn run(&self) -> Result<()> {
        let is_dry = self.args.dry_run;
        let asked = Asked::listen()?;
        if !is_dry {
            self.folder.make()?;
        }
        // Files of a run that only looks go nowhere, but have to be named in a folder that is there.
        let output = self.folder.0.ancestors().find(|folder| folder.is_dir()).unwrap_or(Path::new(".")).to_path_buf();
        let scratch = self.args.scratch.as_deref();
        let asks = Resources::new(self.args.memory, self.args.threads, scratch, Some(&output.join("x")))?;
        let memory = asks.memory.saturating_sub(pool_share()).max(1);
        let pool = Pool { memory, threads: asks.threads, scratch: self.args.scratch.clone() };
        let due = self.due(&pool, !is_dry, &asked)?;
        let owned: Vec<_> = due.iter().map(|(place, _)| check_own(&self.folder, &self.items[*place])).collect();
        let to_ask: Vec<(&Item, bool)> = due
            .iter()
            .zip(&owned)
            .filter(|(_, own)| own.is_ok())
            .map(|((place, _), _)| (&self.items[*place], is_replacing(&self.folder, &self.items[*place])))
            .collect();
        let mut answers = plans(&to_ask, &output, &pool, &asked).into_iter();
        let answers: Vec<Answer> = owned
            .into_iter()
            .map(|own| match own {
                Ok(()) => answers.next().flatten(),
                Err(refused) => Some(Err(refused)),
            })
            .collect();
        if is_dry {
            return self.print_plan(&due, &answers, &pool).and_then(|()| interrupted(&asked));
        }
        self.run_due(&due, answers, &pool, &asked)
    }

    /// The items that are to be run.
    fn due(&self, pool: &Pool, keeps: bool, asked: &Asked) -> Result<Vec<Due>> {
        let folder = &self.folder;
        let found = each(&self.items, pool.threads, asked, |item| reasons(folder, item, keeps, asked.flag()));
        let mut due = Vec::new();
        for (place, why) in found.into_iter().enumerate() {
            let why = why.transpose()?.unwrap_or_default();
            if !why.is_empty() {
                due.push((place, why));
            }
        }
        Ok(due)
    }

    fn run_due(&self, due: &[Due], answers: Vec<Answer>, pool: &Pool, asked: &Asked) -> Result<()> {
        let (mut summary, all) = (self.summary(), due.len());
        if self.items.len() > all {
            self.teller.say(&format!("{} of {} items are done already", self.items.len() - all, self.items.len()));
        }
        let mut waiting = Vec::new();
        let mut ended = 0;
        for ((place, _), answer) in due.iter().zip(answers) {
            let item = &self.items[*place];
            match answer {
                Some(Ok(plan)) => {
                    waiting.push(Waiting { place: *place, plan, memory: item.memory, threads: item.threads });
                }
                Some(Err(refused)) => {
                    ended += 1;
                    let state = self.refused(item, &refused)?;
                    summary.set(*place, &state);
                    self.teller.ended(&item.name, &state, [ended, all], 0.0);
                }
                None => {}
            }
        }
        // The longest first; of equal ones by name, so that a run is like the one before.
        waiting.sort_by(|a, b| b.plan.seconds.total_cmp(&a.plan.seconds).then(a.place.cmp(&b.place)));
        self.teller.expect(waiting.iter().map(|one| (one.place, one.plan.seconds)));
        let schedule = Schedule::new((&self.folder, &self.items), pool, (asked, &self.teller), waiting);
        schedule.run(|place, state, left| {
            ended += 1;
            summary.set(place, state);
            self.teller.ended(&self.items[place].name, state, [ended, all], left);
            summary.write_now_and_then()
        })?;
        summary.write()?;
        interrupted(asked)?;
        self.end(&summary)
    }

    /// Keeps why an item was not run, and says it in its log.
    fn refused(&self, item: &Item, refused: &Refused) -> Result<State> {
        let before = self.folder.state(&item.name);
        let is_lost = before.as_ref().is_some_and(|before| before.is_unreadable);
        let mut state = State::begun(item, before);
        (state.stage, state.code, state.reason) = (Stage::Failed, Some(refused.code), Some(refused.reason.clone()));
        // What cannot be read stays until somebody has looked at it: what lies beside it would be nobody's else.
        if is_lost && check_own(&self.folder, item).is_err() {
            return Ok(state);
        }
        // What is no log, or cannot be written, is left; the summaries tell the reason too.
        let (log, is_own) = (self.folder.log(&item.name), state.owns || state.logged);
        state.logged = log_refusal(&log, is_own, &refused.reason).unwrap_or(state.logged);
        self.folder.keep(&item.name, &state)?;
        Ok(state)
    }

    /// Tells on stdout how many items are what.
    fn end(&self, summary: &Summary) -> Result<()> {
        let counts = summary.counts();
        if !self.args.quiet {
            print(&format!("{}; {}\n", told(&counts), summary.page().display()))?;
        }
        let all = self.items.len();
        if counts.done == all {
            return Ok(());
        }
        if counts.failed == 0 {
            return Err(Error::partly(format!(
                "{} of {all} items are not done yet; the same command runs them",
                all - counts.done
            )));
        }
        let place = format!("in {}", summary.page().with_extension("csv").display());
        let reasons = cut(summary.failures(), "items", &place);
        Err(Error::partly(format!("{} of {all} items failed: {}", counts.failed, reasons.join("\n"))))
    }

    /// `--dry-run`: what would run, and why.
    fn print_plan(&self, due: &[Due], answers: &[Answer], pool: &Pool) -> Result<()> {
        let (mut lines, mut failing) = (Vec::new(), 0);
        let (mut disk, mut time, mut least) = (0u64, 0.0, 0u64);
        for ((place, why), answer) in due.iter().zip(answers) {
            let (name, why) = (&self.items[*place].name, why.join("; "));
            match answer {
                Some(Ok(plan)) => {
                    (disk, time, least) = (disk.saturating_add(plan.disk), time + plan.seconds, least.max(plan.least));
                    let (memory, room) = (bytes(plan.least), bytes(plan.disk));
                    lines.push(format!(
                        "{name}: {why}; memory {memory} at least, disk up to {room}, about {}\n",
                        seconds(plan.seconds)
                    ));
                }
                Some(Err(refused)) => {
                    failing += 1;
                    lines.push(format!("{name}: {why}; would fail: {}\n", refused.reason));
                }
                None => {}
            }
        }
        let done = self.items.len() - due.len();
        lines.push(format!(
            "{} of {} items would run, {failing} of them would fail, {done} are done; memory {} at least of {}, disk up to {}, about {} with {} threads\n",
            due.len(),
            self.items.len(),
            bytes(least),
            bytes(pool.memory),
            bytes(disk),
            seconds(time / pool.threads as f64),
            pool.threads
        ));
        print(&lines.concat())?;
        match failing {
            0 => Ok(()),
            _ => Err(Error::partly(format!("{failing} of {} items would fail", self.items.len()))),
        }
    }
}

/// An error where a signal has asked for the end.
fn interrupted(asked: &Asked) -> Result<()> {
    asked.signal().map_or(Ok(()), |signal| Err(Error::interrupted(signal)))
}
