//! What a reconstruction tells of what it has found.

use crate::cli::terminal::text::{grouped, number, place};
use crate::pipeline::reconstruct::Reconstruction;
use crate::pipeline::topology::Removed;

/// The surface in a line.
fn describe_surface(found: &Reconstruction) -> String {
    let m = &found.measures;
    let (pieces, area, triangles) = (m.components, number(m.area), grouped(m.triangles));
    match found.trimmed {
        Some(trimmed) if !m.is_closed() => format!(
            "open surface in {pieces} pieces: area {area}, its rim {} long, {} cut off where no points are, {triangles} triangles",
            number(m.rim),
            number(trimmed)
        ),
        _ => {
            let surface = if m.is_closed() { "closed" } else { "OPEN" };
            format!(
                "{surface} surface in {pieces} pieces: volume {}, area {area}, {triangles} triangles",
                number(m.volume)
            )
        }
    }
}

/// What was found, in lines.
pub(super) fn describe_found(found: &Reconstruction) -> String {
    let m = &found.measures;
    let mut lines = vec![describe_surface(found)];
    lines.extend(found.hausdorff.map(|h| {
        let lost = match found.lost_points {
            0 => String::new(),
            lost => format!("; {} of them more than a voxel", grouped(lost)),
        };
        format!("points off the surface: {} in the mean, {} at most{lost}", number(h.mean), number(h.max))
    }));
    if found.sheet_points > 0 {
        lines.push(format!("sheets without an inside: {} points, held as thin shells", grouped(found.sheet_points)));
    }
    lines.extend(found.noise.deviation.filter(|_| found.noise.moved > 0).map(|deviation| {
        format!(
            "noise of the points: {}; {} of them moved onto their surface",
            number(deviation),
            grouped(found.noise.moved)
        )
    }));
    lines.extend(found.hole.map(|hole| {
        let at = place(hole.place, 0.1 * hole.width);
        format!("largest hole of the cloud: {} wide, at {at}", number(hole.width))
    }));
    if let Some(cap) = found.caps.first() {
        let share = 100.0 * found.caps.iter().map(|cap| cap.area).sum::<f64>() / m.area;
        lines.push(format!(
            "holes closed without points: {}, {} % of the surface; the widest {} wide, at {}",
            grouped(found.caps.len() as u64),
            number(share),
            number(cap.width),
            place(cap.place, 0.1 * cap.width)
        ));
    }
    lines.extend(found.removed.and_then(removed));
    lines.push(match found.evolution.steps {
        0 => "no time steps: the surface is told by the tangent planes of the points".into(),
        steps => {
            format!(
                "start at {} from the points; {steps} steps, ended by {}",
                number(found.beta),
                found.evolution.stopped_by
            )
        }
    });
    lines.join("\n") + "\n"
}

/// What was taken away of the surface; none where nothing was.
fn removed(Removed { handles, tunnels, widest, crumbs }: Removed) -> Option<String> {
    let count = |count: u64, one: &str, more: &str| {
        (count > 0).then(|| format!("{} {}", grouped(count), if count == 1 { one } else { more }))
    };
    let counts = [count(handles, "handle cut", "handles cut"), count(tunnels, "tunnel filled", "tunnels filled")];
    let mut said: Vec<String> = counts.into_iter().flatten().collect();
    if let Some(last) = said.last_mut() {
        *last = format!("{last} (at most {} wide)", number(widest));
    }
    said.extend(count(crumbs, "crumb dropped", "crumbs dropped"));
    (!said.is_empty()).then(|| format!("taken away, for no points speak for it: {}", said.join(", ")))
}
