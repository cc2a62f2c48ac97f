//! Tables on stdout after a run: what each stage cost, what each object is. At most 100 columns wide.

use std::fmt::Write;

use crate::cli::terminal::text::{grouped, number, place};
use crate::exec::StageReport;
use crate::pipeline::segment::Outcome;

/// Rows of a table on a terminal; what has more is whole in the report.
pub(crate) const MOST_ROWS: usize = 10;
/// Stages that are told one by one; of more those of a kind are told as one.
const MOST_STAGES: usize = 30;

/// The first lines of many, and how many more there are where.
pub(crate) fn cut(mut lines: Vec<String>, of: &str, place: &str) -> Vec<String> {
    let all = lines.len();
    // One line more takes no more room than to say that there is one.
    if all > MOST_ROWS + 1 {
        lines.truncate(MOST_ROWS);
        lines.push(format!("... {} more {of} {place}", grouped((all - MOST_ROWS) as u64)));
    }
    lines
}

/// Where all that a run found is told, for a run with these outputs.
pub(crate) fn whole_in(store: bool, report: bool, table: &str) -> String {
    match (store, report) {
        (true, _) if !table.is_empty() => format!("in report.json and {table}"),
        (true, _) => "in report.json".into(),
        (false, true) => "in the report".into(),
        (false, false) => "(--report FILE or an output has them all)".into(),
    }
}

/// The stages of a run; those of many objects summed up by kind.
pub(crate) fn stages(reports: &[StageReport]) -> String {
    rows_of(&summed(reports))
}

/// The stages of a run where they are few; of many those of a kind as one.
pub(crate) fn summed(reports: &[StageReport]) -> Vec<StageReport> {
    if reports.len() <= MOST_STAGES {
        return reports.to_vec();
    }
    let mut kinds: Vec<(String, usize, StageReport)> = Vec::new();
    for stage in reports {
        let kind = stage.name.trim_end_matches(|c: char| c.is_ascii_digit()).trim_end();
        match kinds.iter_mut().find(|(name, ..)| name == kind) {
            Some((_, times, sum)) => {
                *times += 1;
                sum.seconds += stage.seconds;
                sum.voxels += stage.voxels;
                sum.brick_loads += stage.brick_loads;
                sum.bytes_read += stage.bytes_read;
                sum.bytes_written += stage.bytes_written;
                sum.peak_rss_bytes = sum.peak_rss_bytes.max(stage.peak_rss_bytes);
            }
            None => kinds.push((kind.into(), 1, stage.clone())),
        }
    }
    let named = |(name, times, sum): (String, usize, StageReport)| {
        let name = if times > 1 { format!("{name}, {times} times") } else { sum.name.clone() };
        StageReport { name, ..sum }
    };
    kinds.into_iter().map(named).collect()
}

fn rows_of(reports: &[StageReport]) -> String {
    let mut rows = vec![["stage", "seconds", "voxels", "Mvoxel/s", "brick loads", "peak MiB"].map(String::from)];
    for stage in reports {
        let rate = stage.voxels as f64 / 1e6 / stage.seconds.max(1e-9);
        // A time that is printed as zero tells no rate.
        let has_rate = stage.voxels > 0 && stage.seconds >= 0.005;
        rows.push([
            stage.name.clone(),
            format!("{:.2}", stage.seconds),
            grouped(stage.voxels),
            if has_rate { format!("{rate:.2}") } else { "-".into() },
            grouped(stage.brick_loads),
            (stage.peak_rss_bytes >> 20).to_string(),
        ]);
    }
    aligned(&rows)
}

/// The objects: their surfaces, then how they were solved.
pub(crate) fn objects(outcome: &Outcome, whole_in: &str) -> String {
    let unit = outcome.geometry.unit.as_deref().unwrap_or("voxel spacings without a unit");
    let mut surfaces = vec![
        ["object", "label voxels", "volume", "area", "surface", "pieces", "marks off, mean", "largest"]
            .map(String::from),
    ];
    let mut solver = vec![
        ["object", "points", "beta", "largest hole", "at x, y, z", "image", "steps", "ended by"].map(String::from),
    ];
    let all = outcome.objects.len();
    let shown = if all > MOST_ROWS + 1 { MOST_ROWS } else { all };
    for object in &outcome.objects[..shown] {
        let distance = |of: fn(&crate::kernel::surface::Hausdorff) -> f64| {
            object.hausdorff.as_ref().map_or("-".into(), |h| number(of(h)))
        };
        surfaces.push([
            object.label.to_string(),
            grouped(outcome.label_voxels.get(&object.label).copied().unwrap_or(0)),
            number(object.measures.volume),
            number(object.measures.area),
            if object.measures.is_closed() { "closed".into() } else { "OPEN".into() },
            object.measures.components.to_string(),
            distance(|h| h.mean),
            distance(|h| h.max),
        ]);
        solver.push([
            object.label.to_string(),
            grouped(object.cloud_points),
            number(object.beta),
            object.hole.map_or("-".into(), |hole| number(hole.width)),
            object.hole.map_or("-".into(), |hole| place(hole.place, 0.1 * hole.width)),
            object.image_model.to_string(),
            object.evolution.steps.to_string(),
            object.evolution.stopped_by.to_string(),
        ]);
    }
    let neighbours = neighbours(outcome);
    let more = match all - shown {
        0 => String::new(),
        more => format!("... {} more objects {whole_in}\n", grouped(more as u64)),
    };
    format!(
        "{}\n{}{more}{neighbours}(lengths, areas and volumes in {unit}, squared and cubed)\n",
        aligned(&surfaces),
        aligned(&solver)
    )
}

/// What neighbours claimed together, and the gaps between them; nothing of a single object.
fn neighbours(outcome: &Outcome) -> String {
    if outcome.objects.len() < 2 {
        return String::new();
    }
    let found = &outcome.neighbours;
    let contacts = outcome.contacts.iter().filter(|contact| contact.labels[0] > 0).count();
    let mut text = format!("\n{} voxels claimed by several neighbours, {contacts} contacts", grouped(found.contested));
    if let Some(width) = found.gap_width {
        let (filled, moved) = (grouped(found.filled), grouped(found.moved));
        let _ = write!(text, "; gaps up to {}: {filled} voxels, {moved} moved", number(width));
    }
    text + "\n"
}

/// Columns two blanks apart: the first flush left, the others flush right.
pub(super) fn aligned<const N: usize>(rows: &[[String; N]]) -> String {
    let widths: [usize; N] = std::array::from_fn(|c| rows.iter().map(|row| row[c].chars().count()).max().unwrap_or(0));
    let mut text = String::new();
    for row in rows {
        let mut line = format!("{:<width$}", row[0], width = widths[0]);
        for (cell, width) in row.iter().zip(widths).skip(1) {
            let _ = write!(line, "  {cell:>width$}");
        }
        text.push_str(line.trim_end());
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_tables_are_cut() {
        let lines = |n: usize| (0..n).map(|k| format!("label {k}")).collect::<Vec<_>>();
        for n in [0, 1, 10, 11] {
            assert_eq!(cut(lines(n), "labels", "in report.json"), lines(n));
        }
        let cut = cut(lines(1500), "labels", &whole_in(true, false, ""));
        assert_eq!((cut.len(), &*cut[9], &*cut[10]), (11, "label 9", "... 1 490 more labels in report.json"));
    }

    #[test]
    fn stages_of_many_objects_are_summed_up() {
        let named = |name: String| StageReport { name, seconds: 1.5, voxels: 7, ..StageReport::default() };
        let all: Vec<StageReport> = std::iter::once(named("read stack".into()))
            .chain((1..=40).flat_map(|n| [named(format!("level set {n}")), named(format!("write u {n}"))]))
            .collect();
        let text = stages(&all);
        assert_eq!(text.lines().count(), 4, "{text}");
        let line = text.lines().find(|line| line.starts_with("level set, 40 times")).unwrap();
        assert!(line.contains("60.00") && line.contains("280"), "{line}");
        assert_eq!(stages(&all[..5]).lines().count(), 6);
    }

    #[test]
    fn the_widest_stages_fit_a_hundred_columns() {
        let wide = StageReport {
            name: "presmoothing 1234567890".into(),
            seconds: 123_456.78,
            voxels: 1_000_000_000_000,
            brick_loads: 1_000_000_000,
            peak_rss_bytes: 1 << 40,
            ..StageReport::default()
        };
        let text = stages(&[wide, StageReport { name: "band".into(), ..StageReport::default() }]);
        assert!(text.lines().all(|line| line.chars().count() <= 100), "{text}");
        let quick = StageReport { name: "faces".into(), seconds: 1e-6, voxels: 793_600, ..StageReport::default() };
        assert_eq!(stages(&[quick]).lines().nth(1).unwrap().split_whitespace().nth(4), Some("-"));
        let ends: Vec<usize> = text.lines().map(|line| line.chars().count()).collect();
        assert_eq!(ends[0], ends[1]);
        assert!(text.lines().nth(2).unwrap().starts_with("band   "));
    }
}
