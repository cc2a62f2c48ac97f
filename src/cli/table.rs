//! Tables on stdout after a run: what each stage cost, what each object is. At most 100 columns wide.

use std::fmt::Write;

use super::text::{grouped, number, place};
use crate::exec::StageReport;
use crate::pipeline::segment::Outcome;

/// The stages of a run.
pub(super) fn stages(reports: &[StageReport]) -> String {
    let mut rows = vec![["stage", "seconds", "voxels", "Mvoxel/s", "brick loads", "peak MiB"].map(String::from)];
    for stage in reports {
        let rate = stage.voxels as f64 / 1e6 / stage.seconds.max(1e-9);
        rows.push([
            stage.name.clone(),
            format!("{:.2}", stage.seconds),
            grouped(stage.voxels),
            if stage.voxels > 0 { format!("{rate:.2}") } else { "-".into() },
            grouped(stage.brick_loads),
            (stage.peak_rss_bytes >> 20).to_string(),
        ]);
    }
    aligned(&rows)
}

/// The objects: their surfaces, then how they were solved.
pub(super) fn objects(outcome: &Outcome) -> String {
    let unit = outcome.geometry.unit.as_deref().unwrap_or("voxel spacings without a unit");
    let mut surfaces = vec![
        ["object", "label voxels", "volume", "area", "surface", "pieces", "marks off, mean", "largest"]
            .map(String::from),
    ];
    let mut solver = vec![
        ["object", "points", "beta", "largest hole", "at x, y, z", "image", "steps", "ended by"].map(String::from),
    ];
    for object in &outcome.objects {
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
            object.image_model.into(),
            object.evolution.steps.to_string(),
            object.evolution.stopped_by.into(),
        ]);
    }
    let neighbours = neighbours(outcome);
    format!(
        "{}\n{}{neighbours}(lengths, areas and volumes in {unit}, squared and cubed)\n",
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
fn aligned<const N: usize>(rows: &[[String; N]]) -> String {
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
        let ends: Vec<usize> = text.lines().map(|line| line.chars().count()).collect();
        assert_eq!(ends[0], ends[1]);
        assert!(text.lines().nth(2).unwrap().starts_with("band   "));
    }
}
