//! The engine of a rank for what it does without the others.

use std::ops::Deref;

use super::engine::Engine;

/// An engine of one rank alone, which shares all else with that of a rank of several. Its stages are counted as those of that one when
/// it goes.
pub(crate) struct ByItself<'a> {
    of: &'a Engine,
    /// None where the rank is alone anyway.
    own: Option<Engine>,
}

impl Engine {
    /// This engine for what a rank does by itself, without the others: most often what all ranks do alike, of which a rank of several
    /// puts nothing by.
    pub(crate) fn by_itself(&self) -> ByItself<'_> {
        ByItself { of: self, own: (self.comm().ranks() > 1).then(|| self.without_others(false)) }
    }

    /// The same for what this rank alone does, in stages that no other has by these names: it puts by what it solves.
    pub(crate) fn alone(&self) -> ByItself<'_> {
        ByItself { of: self, own: (self.comm().ranks() > 1).then(|| self.without_others(true)) }
    }
}

impl Deref for ByItself<'_> {
    type Target = Engine;

    fn deref(&self) -> &Engine {
        self.own.as_ref().unwrap_or(self.of)
    }
}

impl Drop for ByItself<'_> {
    fn drop(&mut self) {
        if let Some(own) = &self.own {
            self.of.take_reports(own.reports());
        }
    }
}
