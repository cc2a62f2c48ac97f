//! Labels against level sets: whose voxel one is, looked up in the functions of all objects.
//!
//! An object claims the voxels where its u is at least 1/2. A voxel that nobody claims has no label, one that one object claims has
//! its label, and of several claimants one has it: the first, last or largest where `--overlap` asked for that; which of them else
//! follows from how deep the voxel lies in each (`crate::pipeline::segment::neighbours::overlaps`), which is not computed once more.
//! Where gaps were shared out, voxels that have another label than their claimant are counted and compared with what the report
//! counts.

use std::collections::BTreeMap;

use serde_json::Value;

use super::found::{Check, at};
use super::structure::Image;
use super::voxels::{EDGE, read};
use crate::error::Result;
use crate::exec::{Engine, Workers};
use crate::grid::Box3;
use crate::kernel::image::labels::{self, Claims};

/// An object's level set, where it lies in the label image.
struct Object<'a> {
    label: u32,
    u: &'a Image,
    /// Its first voxel in those of the label image.
    first: [i64; 3],
    /// As the report says it.
    volume: f64,
}

/// What is wrong in a part, and what is counted.
#[derive(Default)]
struct Part {
    found: Check,
    counts: BTreeMap<u32, u64>,
    /// Voxels that nobody claims and that have a label; that others claim; that several claim.
    filled: u64,
    moved: u64,
    several: u64,
}

/// Compares the image `labels/segmentation` with the level sets of a segmentation, and both with its report.
///
/// # Errors
/// When the run is interrupted.
pub(super) fn check(engine: &Engine, images: &[Image], report: &Value) -> Result<Check> {
    let mut found = Check::new("labels against level sets");
    let Some(image) = images.iter().find(|image| image.group == "labels/segmentation") else {
        found.wrong_in("labels/segmentation", "is missing, or cannot be read");
        return Ok(found);
    };
    let mut objects = objects(images, image, report, &mut found);
    let overlap = report["settings"]["overlap"].as_str().unwrap_or_default();
    // Those that win come last, as they are painted.
    match overlap {
        "first" => objects.sort_by_key(|object| std::cmp::Reverse(object.label)),
        "larger" => objects.sort_by(|a, b| a.volume.total_cmp(&b.volume).then(a.label.cmp(&b.label))),
        _ => objects.sort_by_key(|object| object.label),
    }
    let decided = matches!(overlap, "first" | "last" | "larger");
    let fills = !report["settings"]["fill_gaps"].is_null();
    let parts: Vec<Box3> = image.reader.levels()[0].geometry.domain().tiles([EDGE; 3]).collect();
    let stage = engine.stage("labels against level sets", parts.len() as u64);
    let judged = stage.run(&parts, &Workers::none(), |(), part| Ok(judge(image, &objects, part, decided, fills)))?;
    stage.finish();
    let mut all = Part::default();
    for part in judged {
        found.take(part.found);
        part.counts.into_iter().for_each(|(label, n)| *all.counts.entry(label).or_default() += n);
        (all.filled, all.moved, all.several) =
            (all.filled + part.filled, all.moved + part.moved, all.several + part.several);
    }
    count(&all, report, fills, &mut found);
    found.told = format!("{} objects, every voxel", objects.len());
    if all.several > 0 && !decided {
        found.also(&format!("; which of several objects has it is not decided for {} voxels", all.several));
    }
    if fills {
        found.also(&format!("; of voxels in gaps that were shared out only the number, {}", all.filled + all.moved));
    }
    Ok(found)
}

/// The level sets that the report names objects for.
fn objects<'a>(images: &'a [Image], labels: &Image, report: &Value, found: &mut Check) -> Vec<Object<'a>> {
    let told = report["result"]["objects"].as_array().map_or(&[][..], Vec::as_slice);
    let grid = &labels.reader.levels()[0].geometry;
    let mut objects = Vec::new();
    for object in told {
        let Some(label) = object["label"].as_u64().and_then(|label| u32::try_from(label).ok()) else { continue };
        let own = format!("levelset/object-{label}");
        let has_group = |group: &str| images.iter().find(|image| image.group == group);
        let Some(u) = has_group(&own).or_else(|| has_group("levelset").filter(|_| told.len() == 1)) else {
            found.wrong_in(own, "is missing, or cannot be read");
            continue;
        };
        let place = grid.to_voxels(u.reader.levels()[0].geometry.origin);
        let volume = object["volume"].as_f64().unwrap_or_default();
        objects.push(Object { label, u, first: place.map(|v| v.round() as i64), volume });
    }
    for image in images.iter().filter(|image| image.group.starts_with("levelset")) {
        if !objects.iter().any(|object| object.u.group == image.group) {
            found.wrong_in(&image.group, "is the level set of no object that the report names");
        }
    }
    objects
}

/// Compares a part of the label image.
fn judge(image: &Image, objects: &[Object<'_>], part: &Box3, decided: bool, fills: bool) -> Part {
    let mut judged = Part::default();
    let Some(labels) = read::<u32>(image, 0, part, &mut judged.found) else { return judged };
    judged.counts = labels::count(&labels);
    let mut claims = vec![Claims::default(); part.len()];
    for object in objects {
        let domain = object.u.reader.levels()[0].geometry.domain().translate(object.first);
        let shared = domain.intersect(part);
        if shared.is_empty() {
            continue;
        }
        let own = shared.translate(object.first.map(|v| -v));
        let Some(u) = read::<f32>(object.u, 0, &own, &mut judged.found) else { return judged };
        labels::claim(&u, &shared, object.label, part, &labels, &mut claims);
    }
    for (place, (&label, &Claims { count, last, own })) in labels.iter().zip(&claims).enumerate() {
        judged.several += u64::from(count > 1);
        let due = (count < 2 || decided).then_some(last);
        if due.map_or(own, |due| due == label) {
            continue;
        }
        if fills && label > 0 {
            (judged.filled, judged.moved) =
                (judged.filled + u64::from(count == 0), judged.moved + u64::from(count > 0));
            continue;
        }
        let voxel = part.voxel_at(place);
        let claimed = match (count, due) {
            (0, _) => "no level set claims it".to_owned(),
            (1, _) => format!("the level set of object {last} alone claims it"),
            (_, Some(due)) => format!("object {due} is the one of {count} that it belongs to"),
            _ => format!("it belongs to one of {count} others"),
        };
        judged.found.add(at(image.file(0, voxel), voxel, format!("has the label {label}, and {claimed}")));
    }
    judged
}

/// Compares what was counted with the report.
fn count(all: &Part, report: &Value, fills: bool, found: &mut Check) {
    let result = &report["result"];
    let told = result["label_voxels"].as_object();
    for (label, n) in &all.counts {
        let told = told.and_then(|told| told.get(&label.to_string())).and_then(Value::as_u64);
        if told != Some(*n) {
            let told = told.map_or("nothing".into(), |told| told.to_string());
            found.wrong_in("report.json", format!("says {told} of the voxels of label {label}; there are {n}"));
        }
    }
    for (label, n) in told.into_iter().flatten().filter(|(_, n)| n.as_u64() != Some(0)) {
        if !label.parse().is_ok_and(|label: u32| all.counts.contains_key(&label)) {
            found.wrong_in("report.json", format!("says that label {label} has {n} voxels; there are none"));
        }
    }
    for object in result["objects"].as_array().into_iter().flatten() {
        let label = object["label"].as_u64().unwrap_or(0);
        let n = u32::try_from(label).ok().and_then(|label| all.counts.get(&label)).copied().unwrap_or(0);
        if object["voxels"] != n {
            let told = &object["voxels"];
            found.wrong_in("report.json", format!("says that object {label} has {told} voxels; there are {n}"));
        }
    }
    let told = |name: &str| result["neighbours"][name].as_u64().unwrap_or(0);
    let (filled, moved) = (told("filled_voxels"), told("moved_voxels"));
    if fills && (all.filled > filled + moved || all.moved > moved) {
        let text = format!(
            "{} voxels of gaps and {} of other objects have labels that no level set gives them; the report counts {filled} and {moved}",
            all.filled, all.moved
        );
        found.wrong_in("labels/segmentation", text);
    }
}
