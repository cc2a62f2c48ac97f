//! How far a run is: the share of it that is done, and the seconds that are left, as far as can be told.
//!
//! A run has a plan: its stages, and the seconds that each is thought to take on some machine. What the stages that are over took
//! says how fast this machine is; of those under way counts what they have done of their steps, or else their time.

use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// The share of a stage under way that is told at most: what takes longer than was thought is nearly over, never over.
const NEARLY: f64 = 0.95;

/// The stages of a run in their order, each with the seconds that it is thought to take.
pub type Plan = Vec<(String, f64)>;

/// What a run has behind it and before it.
#[derive(Debug)]
pub struct Outlook {
    begun: Instant,
    stages: Mutex<Vec<Planned>>,
    /// What was told: the share that is done does not fall, whatever is learned of the pace.
    told: Mutex<f64>,
}

/// A stage of the plan.
#[derive(Debug)]
struct Planned {
    name: String,
    seconds: f64,
    state: State,
}

#[derive(Debug)]
enum State {
    Waiting,
    Running(Arc<Running>),
    Over,
}

/// A stage under way.
#[derive(Debug)]
pub(in crate::exec) struct Running {
    since: Instant,
    steps: AtomicU64,
    /// 0 where it is not known.
    total: AtomicU64,
}

impl Running {
    /// Steps were done.
    pub(in crate::exec) fn advance(&self, steps: u64) {
        self.steps.fetch_add(steps, Relaxed);
    }

    /// The stage has so many steps.
    pub(in crate::exec) fn expect(&self, total: u64) {
        self.total.store(total, Relaxed);
    }

    /// The share of the stage that is done, where it counts its steps.
    fn done(&self) -> Option<f64> {
        let (steps, total) = (self.steps.load(Relaxed), self.total.load(Relaxed));
        (total > 0 && steps > 0).then(|| (steps as f64 / total as f64).min(NEARLY))
    }
}

impl Default for Outlook {
    fn default() -> Self {
        Self { begun: Instant::now(), stages: Mutex::default(), told: Mutex::default() }
    }
}

impl Outlook {
    /// Tells what the run is going to do.
    pub fn expect(&self, plan: Plan) {
        let waiting = |(name, seconds)| Planned { name, seconds, state: State::Waiting };
        *self.stages() = plan.into_iter().map(waiting).collect();
    }

    /// A stage begins; of several with that name, the next.
    pub(in crate::exec) fn begin(&self, name: &str, total: u64) -> Option<Arc<Running>> {
        let mut stages = self.stages();
        let planned = stages.iter_mut().find(|stage| stage.name == name && matches!(stage.state, State::Waiting))?;
        let running =
            Arc::new(Running { since: Instant::now(), steps: AtomicU64::new(0), total: AtomicU64::new(total) });
        planned.state = State::Running(running.clone());
        Some(running)
    }

    /// A stage is over.
    pub(in crate::exec) fn end(&self, running: &Arc<Running>) {
        let is_it = |stage: &&mut Planned| matches!(&stage.state, State::Running(other) if Arc::ptr_eq(other, running));
        if let Some(stage) = self.stages().iter_mut().find(is_it) {
            stage.state = State::Over;
        }
    }

    /// The share of the run that is done, 0 to 1, never 1; 0 for a run without a plan.
    #[must_use]
    pub fn done(&self) -> f64 {
        let mut told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
        *told = told.max(self.done_at(Instant::now()));
        *told
    }

    /// The seconds that are left, where something is done that tells how fast the run is.
    #[must_use]
    pub fn left(&self) -> Option<f64> {
        self.left_at(Instant::now())
    }

    fn done_at(&self, now: Instant) -> f64 {
        let gone = now.duration_since(self.begun).as_secs_f64();
        self.left_at(now).map_or(0.0, |left| gone / (gone + left.max(LEAST_LEFT)))
    }

    /// Stages under way go on as they went, by their steps or else as all went; those that wait go as all went.
    fn left_at(&self, now: Instant) -> Option<f64> {
        let stages = self.stages();
        let seconds = |state: fn(&State) -> bool| -> f64 {
            stages.iter().filter(|stage| state(&stage.state)).map(|stage| stage.seconds).sum()
        };
        let (over, waiting) = (seconds(|s| matches!(s, State::Over)), seconds(|s| matches!(s, State::Waiting)));
        let running = || stages.iter().filter_map(|stage| Some((stage.seconds, stage.running()?)));
        let since = |running: &Running| now.duration_since(running.since).as_secs_f64();
        // How much longer than planned all takes that is over; and once it counts steps, what is under way.
        let before = running().map(|(_, running)| since(running)).fold(0.0, f64::max);
        let gone = now.duration_since(self.begun).as_secs_f64();
        let counted: Vec<(f64, f64)> =
            running().filter_map(|(seconds, running)| Some((seconds * running.done()?, since(running)))).collect();
        let planned = over + counted.iter().map(|(planned, _)| planned).sum::<f64>();
        let took = gone - if counted.is_empty() { before } else { 0.0 };
        let all = over + waiting + running().map(|(seconds, _)| seconds).sum::<f64>();
        let slower = if planned > PART * all { took / planned } else { 1.0 };
        let under_way = running().map(|(seconds, running)| {
            let elapsed = since(running);
            match running.done() {
                Some(done) => elapsed * (1.0 - done) / done,
                None => (seconds * slower - elapsed).max((1.0 - NEARLY) * elapsed),
            }
        });
        // What runs at the same time ends with the last.
        (all > 0.0 && gone > 0.0).then(|| under_way.fold(0.0, f64::max) + waiting * slower)
    }

    fn stages(&self) -> MutexGuard<'_, Vec<Planned>> {
        self.stages.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Planned {
    fn running(&self) -> Option<&Running> {
        match &self.state {
            State::Running(running) => Some(running),
            _ => None,
        }
    }
}

/// The part of a plan that has to be over before it tells the machine's pace.
const PART: f64 = 0.05;
/// Seconds that are always thought to be left: of a run that is not over.
const LEAST_LEFT: f64 = 0.1;

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn what_is_over_tells_the_pace_of_what_is_left() {
        let outlook = Outlook::default();
        outlook.expect(vec![("read".into(), 1.0), ("solve".into(), 3.0), ("write".into(), 1.0)]);
        let at = |seconds: f64| outlook.begun + Duration::from_secs_f64(seconds);
        assert_eq!(outlook.done_at(at(0.0)), 0.0);
        assert_eq!(outlook.left_at(at(0.5)), Some(5.0), "nothing tells that the plan is wrong");
        let read = outlook.begin("read", 0).unwrap();
        outlook.end(&read);
        assert!(outlook.begin("something else", 0).is_none());
        let solve = outlook.begin("solve", 100).unwrap();
        solve.advance(50);
        // Half of the second stage took some ten seconds, and 2.5 seconds of the plan as well: the last takes four.
        let left = outlook.left_at(at(10.0)).unwrap();
        assert!((left - 14.0).abs() < 0.01, "{left}");
        assert!((outlook.done_at(at(10.0)) - 10.0 / 24.0).abs() < 1e-3);
        outlook.end(&solve);
        let write = outlook.begin("write", 0).unwrap();
        assert!(outlook.begin("write", 0).is_none(), "it is planned once");
        // However long the last stage takes, the run is not over.
        assert!(outlook.done_at(at(1e6)) < 1.0);
        outlook.end(&write);
        assert!(outlook.done_at(at(20.0)) < 1.0);
    }

    #[test]
    fn a_run_without_a_plan_tells_nothing() {
        let outlook = Outlook::default();
        assert_eq!((outlook.done(), outlook.left()), (0.0, None));
    }
}
