//! What each rank of a run did: beside the report's figures, which are those of the first.

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::exec::{Engine, peak_resident};
use crate::store::checkpoint::{pack, unpack};

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
        let sum = |of: fn(&crate::exec::StageReport) -> u64| reports.iter().map(of).sum();
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

/// What all ranks did, in their order; nothing where there is one. All ranks ask.
///
/// # Errors
/// When another rank is gone.
pub(crate) fn gather_ranks(engine: &Engine) -> Result<Vec<RankReport>> {
    if engine.comm().ranks() == 1 {
        return Ok(Vec::new());
    }
    let fault = |error: std::io::Error| Error::failed(format!("what a rank did cannot be told: {error}"));
    let told = pack(&RankReport::of(engine)).map_err(fault)?;
    engine.comm().gather(told)?.iter().map(|bytes| unpack(bytes).map_err(fault)).collect()
}
