//! What each rank of a run did, beside the report's figures, which count all of them.

use serde::{Deserialize, Serialize};

use crate::error::Result;
use crate::exec::{Engine, StageReport, gather_records, peak_resident};

/// What one rank did.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct RankReport {
    rank: usize,
    threads: usize,
    /// Bricks computed, each time counted, and those that were not resident when they were used.
    bricks: u64,
    brick_loads: u64,
    bytes_read: u64,
    bytes_written: u64,
    /// To other ranks.
    bytes_sent: u64,
    messages: u64,
    seconds_waiting: f64,
    peak_rss_bytes: u64,
}

impl RankReport {
    fn of(engine: &Engine) -> Self {
        let (comm, reports) = (engine.comm(), engine.reports());
        let sum = |of: fn(&StageReport) -> u64| reports.iter().map(of).sum();
        let traffic = comm.traffic();
        Self {
            rank: comm.rank(),
            threads: engine.threads(),
            bricks: sum(|stage| stage.bricks),
            brick_loads: sum(|stage| stage.brick_loads),
            bytes_read: sum(|stage| stage.bytes_read),
            bytes_written: sum(|stage| stage.bytes_written),
            bytes_sent: traffic.bytes_sent,
            messages: traffic.messages,
            seconds_waiting: traffic.seconds_waiting,
            peak_rss_bytes: peak_resident(),
        }
    }
}

/// What all ranks did, in their order, and counts it in the engine's stages on the first; nothing where there is one rank. All
/// ranks ask.
///
/// # Errors
/// When another rank is gone.
pub(crate) fn gather_ranks(engine: &Engine) -> Result<Vec<RankReport>> {
    let comm = engine.comm();
    if comm.ranks() == 1 {
        return Ok(Vec::new());
    }
    let mut ranks = Vec::new();
    for (rank, (report, stages)) in
        gather_records(comm, &(RankReport::of(engine), engine.reports()))?.into_iter().enumerate()
    {
        if rank != comm.rank() {
            engine.count_rank(&stages);
        }
        ranks.push(report);
    }
    Ok(ranks)
}
