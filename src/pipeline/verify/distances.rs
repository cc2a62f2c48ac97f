//! What `distance` and `middle` wrote, among itself: distances against the closest points that are stored beside them, labels and
//! their borders, and what the report counts.

use std::collections::BTreeMap;

use serde_json::Value;

use super::found::{Check, at};
use super::structure::Image;
use super::voxels::{EDGE, read};
use crate::error::Result;
use crate::exec::{Engine, Workers};
use crate::grid::Box3;
use crate::kernel::distance::features::closest_distance::{Off, Slack, first_off};
use crate::kernel::image::difference::{first_difference, same_number};
use crate::kernel::image::labels;

/// The images of a distance.
struct Images<'a> {
    distance: &'a Image,
    nearest: Option<&'a Image>,
    border: Option<&'a Image>,
    closest: Option<[&'a Image; 3]>,
    /// Whether a distance is that to the closest point, up to rounding.
    is_euclidean: bool,
    /// The last place of its type.
    eps: f64,
    farthest: Option<f64>,
}

/// What is wrong in a part, and what is counted.
#[derive(Default)]
struct Part {
    found: Check,
    counts: BTreeMap<u32, u64>,
    max: f64,
    /// Voxels without a distance.
    unreached: u64,
}

/// Compares the images of a distance.
///
/// # Errors
/// When the run is interrupted.
pub(super) fn check(engine: &Engine, images: &[Image], report: &Value) -> Result<Check> {
    let mut found = Check::new("distances, labels, closest points");
    let image = |group: &str| images.iter().find(|image| image.group == group);
    let Some(distance) = image("") else {
        found.wrong("the distance is missing, or cannot be read");
        return Ok(found);
    };
    let [x, y, z] = ["x", "y", "z"].map(|axis| image(&format!("closest-point/{axis}")));
    let settings = &report["settings"];
    let of = Images {
        distance,
        nearest: image("labels/nearest"),
        border: image("labels/border"),
        closest: x.zip(y).zip(z).map(|((x, y), z)| [x, y, z]),
        is_euclidean: matches!(settings["method"].as_str(), Some("vdt" | "dp")),
        eps: if distance.reader.levels()[0].element == "float16" { 1e-3 } else { 1e-6 },
        farthest: settings["max_distance"].as_f64(),
    };
    for (is_wanted, has, group) in [
        (&settings["labels"], of.nearest.is_some(), "labels/nearest"),
        (&settings["closest_point"], of.closest.is_some(), "closest-point"),
    ] {
        if *is_wanted == true && !has {
            found.wrong_in(group, "is missing, or cannot be read");
        }
    }
    let parts: Vec<Box3> = distance.reader.levels()[0].geometry.domain().tiles([EDGE; 3]).collect();
    let stage = engine.stage("distances", parts.len() as u64);
    let judged = stage.run(&parts, &Workers::none(), |(), part| Ok(of.judge(part)))?;
    stage.finish();
    let mut all = Part::default();
    for part in judged {
        found.take(part.found);
        part.counts.into_iter().for_each(|(label, n)| *all.counts.entry(label).or_default() += n);
        all.max = all.max.max(part.max);
        all.unreached += part.unreached;
    }
    of.count(&all, &report["result"], &mut found);
    found.told = of.told();
    Ok(found)
}

impl Images<'_> {
    fn told(&self) -> String {
        let mut told = vec!["largest value"];
        told.extend(self.nearest.map(|_| "voxels of each label"));
        told.extend(self.border.map(|_| "borders of labels"));
        told.extend(self.closest.map(|_| {
            // A solution of the Eikonal equation is near that, and not it.
            if self.is_euclidean { "distances to the closest points" } else { "closest points are not compared" }
        }));
        told.join(", ")
    }

    fn judge(&self, part: &Box3) -> Part {
        let mut judged = Part::default();
        let found = &mut judged.found;
        let Some(distances) = read::<f64>(self.distance, 0, part, found) else { return judged };
        judged.unreached = distances.iter().filter(|d| !d.is_finite()).count() as u64;
        judged.max = distances.iter().map(|d| d.abs()).filter(|d| d.is_finite()).fold(0.0, f64::max);
        if let Some(nearest) = self.nearest {
            let Some(values) = read::<u32>(nearest, 0, part, found) else { return judged };
            judged.counts = labels::count(&values);
            self.compare_border(nearest, part, found);
        }
        self.compare_closest(part, &distances, found);
        judged
    }

    fn compare_border(&self, nearest: &Image, part: &Box3, found: &mut Check) {
        let Some(border) = self.border else { return };
        let around = part.grow(1).intersect(&nearest.reader.levels()[0].geometry.domain());
        let Some(values) = read::<u32>(nearest, 0, &around, found) else { return };
        let Some(stored) = read::<u32>(border, 0, part, found) else { return };
        let mut expected = vec![0; part.len()];
        labels::border(&values, &around, part, &mut expected);
        if let Some((place, _)) = first_difference(&stored, &expected, u32::eq) {
            let voxel = part.voxel_at(place);
            let text = format!("is {} where the labels around make it {}", stored[place], expected[place]);
            found.add(at(border.file(0, voxel), voxel, text));
        }
    }

    /// A distance is that to its closest point, where the method keeps sources.
    fn compare_closest(&self, part: &Box3, distances: &[f64], found: &mut Check) {
        let Some(images) = self.closest.filter(|_| self.is_euclidean) else { return };
        let geometry = &self.distance.reader.levels()[0].geometry;
        let [Some(x), Some(y), Some(z)] = images.map(|image| read::<f64>(image, 0, part, found)) else { return };
        let slack = Slack { relative: self.eps, farthest: self.farthest.unwrap_or(f64::INFINITY) };
        if let Some(Off { place, point, away }) = first_off(geometry, part, distances, &[x, y, z], slack) {
            let voxel = part.voxel_at(place);
            let text = format!("is {}, and its closest point {point:?} is {away} away", distances[place]);
            found.add(at(self.distance.file(0, voxel), voxel, text));
        }
    }

    fn count(&self, all: &Part, result: &Value, found: &mut Check) {
        if !result["max"].as_f64().is_some_and(|told| same_number(told, all.max)) {
            found.wrong_in(
                "report.json",
                format!("says that the largest distance is {}; it is {}", result["max"], all.max),
            );
        }
        if result["unlabelled_voxels"] != all.unreached {
            let (told, is) = (&result["unlabelled_voxels"], all.unreached);
            found.wrong_in("report.json", format!("says that {told} voxels have no distance; {is} have none"));
        }
        if self.nearest.is_none() {
            return;
        }
        let told: BTreeMap<u32, u64> = (result["label_voxels"].as_object().into_iter().flatten())
            .filter_map(|(label, n)| Some((label.parse().ok()?, n.as_u64()?)))
            .filter(|(_, n)| *n > 0)
            .collect();
        if told != all.counts {
            found.wrong_in("report.json", format!("says that labels have {told:?} voxels; they have {:?}", all.counts));
        }
    }
}
