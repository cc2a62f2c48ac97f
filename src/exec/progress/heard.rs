//! `Progress`: who wants to know how far a run is. The command line draws bars; tests and libraries stay silent.

use std::sync::Arc;

use super::outlook::Outlook;

/// Hears how stages begin, advance and end. Called from one thread at a time, `advance` from many.
pub trait Progress: Send + Sync {
    /// A stage begins; it has about `total` steps, 0 when that is not known.
    fn begin(&self, name: &str, total: u64);

    /// `steps` more steps are done.
    fn advance(&self, steps: u64);

    /// Something the user should know now, one line.
    fn note(&self, line: &str);

    /// The stage is over.
    fn end(&self);

    /// A run begins, whose outlook this is.
    fn look_out(&self, _outlook: &Arc<Outlook>) {}
}

/// Hears nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Progress for Silent {
    fn begin(&self, _name: &str, _total: u64) {}
    fn advance(&self, _steps: u64) {}
    fn note(&self, _line: &str) {}
    fn end(&self) {}
}

/// What one of several ranks tells: its steps, which are part of a stage that all of them work on.
pub(in crate::exec) struct OfRank(pub(in crate::exec) Arc<dyn Progress>);

impl Progress for OfRank {
    fn begin(&self, _name: &str, _total: u64) {}
    fn advance(&self, steps: u64) {
        self.0.advance(steps);
    }
    fn note(&self, line: &str) {
        self.0.note(line);
    }
    fn end(&self) {}
}
