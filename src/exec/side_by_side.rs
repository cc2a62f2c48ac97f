//! Small jobs side by side: each on one thread at a time where all cores are busy with others, instead of one after the
//! other on all cores, which a small job cannot keep busy.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

use super::engine::Engine;
use super::progress::report::StageReport;
use crate::error::Result;

/// What became of an item, and what its stages cost.
type Done<R> = (Result<R>, Vec<StageReport>);

impl Engine {
    /// Does `work` for each item, `most` at a time, each with an engine that shares this one's threads, window and
    /// signals. Results, and the reports of stages, come in the order of the items.
    ///
    /// # Errors
    /// The signal that ended the run, or the first failure in the order of the items.
    pub fn side_by_side<I, R>(
        &self,
        items: &[I],
        most: usize,
        work: impl Fn(&Engine, &I) -> Result<R> + Sync,
    ) -> Result<Vec<R>>
    where
        I: Sync,
        R: Send,
    {
        if most < 2 || items.len() < 2 {
            return items.iter().map(|item| work(self, item)).collect();
        }
        // Each job takes the next item when it is done with one: items take unequal times.
        let next = AtomicUsize::new(0);
        let done: Vec<Mutex<Option<Done<R>>>> = items.iter().map(|_| Mutex::default()).collect();
        let job = || {
            loop {
                let n = next.fetch_add(1, Ordering::Relaxed);
                let Some(item) = items.get(n) else { return };
                let own = self.beside();
                let result = self.check().and_then(|()| work(&own, item));
                *done[n].lock().unwrap_or_else(PoisonError::into_inner) = Some((result, own.reports()));
            }
        };
        self.in_pool(|| (0..most.min(items.len())).into_par_iter().with_max_len(1).for_each(|_| job()));
        let mut results = Vec::with_capacity(items.len());
        for (result, reports) in done.into_iter().filter_map(|d| d.into_inner().unwrap_or_else(PoisonError::into_inner))
        {
            self.take_reports(reports);
            results.push(result);
        }
        results.into_iter().collect()
    }
}
