//! Small jobs side by side: each on one thread at a time where all cores are busy with others, instead of one after the
//! other on all cores, which a small job cannot keep busy.

use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

use super::engine::Engine;
use crate::error::Result;

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
        let reports: Vec<Mutex<Vec<_>>> = items.iter().map(|_| Mutex::default()).collect();
        let numbered: Vec<(usize, &I)> = items.iter().enumerate().collect();
        let mut results = Vec::with_capacity(items.len());
        for chunk in numbered.chunks(most) {
            self.check()?;
            let done = self.in_pool(|| {
                let each = chunk.par_iter().with_max_len(1).map(|&(n, item)| {
                    let own = self.beside();
                    let result = work(&own, item);
                    *reports[n].lock().unwrap_or_else(PoisonError::into_inner) = own.reports();
                    result
                });
                each.collect::<Vec<Result<R>>>()
            });
            results.extend(done);
        }
        for own in reports {
            self.take_reports(own.into_inner().unwrap_or_else(PoisonError::into_inner));
        }
        results.into_iter().collect()
    }
}
