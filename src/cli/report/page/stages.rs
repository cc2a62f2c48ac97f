//! What each stage of a run cost, as a table.

use super::html::Html;
use crate::cli::report::table::summed;
use crate::cli::terminal::text::{bytes, grouped};
use crate::exec::StageReport;

pub(super) fn stages(page: &mut Html, reports: &[StageReport]) {
    let head = ["stage", "seconds", "voxels", "Mvoxel/s", "bytes read", "bytes written", "brick loads", "peak memory"];
    let mut rows = vec![head.map(String::from).to_vec()];
    for stage in summed(reports) {
        let rate = stage.voxels as f64 / 1e6 / stage.seconds.max(1e-9);
        rows.push(vec![
            stage.name.clone(),
            format!("{:.2}", stage.seconds),
            grouped(stage.voxels),
            if stage.voxels > 0 { format!("{rate:.2}") } else { "-".into() },
            bytes(stage.bytes_read),
            bytes(stage.bytes_written),
            grouped(stage.brick_loads),
            bytes(stage.peak_rss_bytes),
        ]);
    }
    page.table(&rows);
}
