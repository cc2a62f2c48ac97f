//! `StageReport`: the record of what a stage cost.

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
