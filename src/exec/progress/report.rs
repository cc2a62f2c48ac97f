//! `StageReport`: the record of what a stage cost.

use std::sync::{Mutex, MutexGuard, PoisonError};

use serde::{Deserialize, Serialize};

/// What one stage of a run cost.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StageReport {
    /// What was done.
    pub name: String,
    /// Wall time.
    pub seconds: f64,
    /// Bricks that were not resident when they were used.
    pub brick_loads: u64,
    /// Bricks computed, each time counted.
    pub bricks: u64,
    /// Voxels the stage worked on.
    pub voxels: u64,
    /// Bytes read out of bricks and faces.
    pub bytes_read: u64,
    /// Bytes written into bricks and faces.
    pub bytes_written: u64,
    /// Passes, sweeps or solver iterations, whatever the stage repeats.
    pub iterations: u64,
    /// What was left when the stage stopped; 0 where nothing is iterated.
    pub residual: f64,
    /// The most memory the process has had resident when the stage ended.
    pub peak_rss_bytes: u64,
}

/// What the finished stages of a run cost, in the order in which they ended.
#[derive(Debug, Default)]
pub(in crate::exec) struct Reports(Mutex<Vec<StageReport>>);

impl Reports {
    pub(in crate::exec) fn add(&self, reports: impl IntoIterator<Item = StageReport>) {
        self.all().extend(reports);
    }

    pub(in crate::exec) fn copied(&self) -> Vec<StageReport> {
        self.all().clone()
    }

    /// Counts what another rank did in the same stages.
    pub(in crate::exec) fn count_rank(&self, done: &[StageReport]) {
        let mut all = self.all();
        let (known, mut counted) = (all.len(), vec![false; all.len()]);
        for other in done {
            let same = (0..known).find(|&n| !counted[n] && all[n].name == other.name);
            let Some(same) = same else {
                all.push(other.clone());
                continue;
            };
            counted[same] = true;
            let own = &mut all[same];
            own.bricks += other.bricks;
            own.brick_loads += other.brick_loads;
            own.bytes_read += other.bytes_read;
            own.bytes_written += other.bytes_written;
            own.seconds = own.seconds.max(other.seconds);
            own.peak_rss_bytes = own.peak_rss_bytes.max(other.peak_rss_bytes);
        }
    }

    fn all(&self) -> MutexGuard<'_, Vec<StageReport>> {
        // A list of figures is whole whatever thread was lost while holding it.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
