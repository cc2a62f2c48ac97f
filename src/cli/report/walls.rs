//! What `middle` tells of the walls between the labels of a volume: on the console, and in the report with every setting.

use std::collections::BTreeMap;

use serde::Serialize;

use super::distance::{LabelReport, PairReport};
use super::run_report::SimplifiedCopy;
use super::table::cut;
use crate::cli::args::distance::DistanceJobArgs;
use crate::cli::terminal::text::{grouped, number};
use crate::job::resources::Resources;
use crate::pipeline::middle::{WallsFound, WallsSettings};
use crate::pipeline::output::viewer_mesh::Simplified;

/// Every setting, also those that nobody gave.
#[derive(Debug, Serialize)]
pub(crate) struct Settings {
    sources: Vec<String>,
    output: Option<String>,
    compress: &'static str,
    ome: &'static str,
    surface: &'static str,
    background: bool,
    scratch: String,
}

impl Settings {
    pub(crate) fn new(args: &DistanceJobArgs, settings: WallsSettings, resources: &Resources) -> Self {
        Self {
            sources: args.sources.iter().map(|path| path.display().to_string()).collect(),
            output: args.job.output.store().map(|path| path.display().to_string()),
            compress: args.job.output.compress.name(),
            ome: args.job.output.ome.name(),
            surface: "walls",
            background: settings.background,
            scratch: resources.scratch.display().to_string(),
        }
    }
}

/// What was found.
#[derive(Debug, Serialize)]
pub(crate) struct Found {
    label_voxels: BTreeMap<String, u64>,
    /// Within the surface where it is closed as a whole; null where it is open, or parts of it meet along lines.
    volume: Option<f64>,
    area: f64,
    closed: bool,
    components: u64,
    triangles: u64,
    /// The copy of a large surface.
    simplified: Option<SimplifiedCopy>,
    pairs: Vec<PairReport>,
    labels: Vec<LabelReport>,
}

impl Found {
    pub(crate) fn new(found: &WallsFound) -> Self {
        let measures = &found.measures;
        let closed = measures.is_closed() && measures.triangles > 0;
        let label_voxels = found.label_voxels.iter().map(|(label, n)| (label.to_string(), *n)).collect();
        Self {
            label_voxels,
            volume: closed.then(|| measures.volume.abs()),
            area: measures.area,
            closed,
            components: measures.components,
            triangles: measures.triangles,
            simplified: None,
            pairs: found.pairs.iter().map(PairReport::new).collect(),
            labels: found.labels.iter().map(LabelReport::new).collect(),
        }
    }

    /// With the copy of a large surface.
    pub(crate) fn with_copy(self, copy: Option<Simplified>) -> Self {
        Self { simplified: copy.map(Into::into), ..self }
    }
}

/// What was found, in some lines; `labels_in` says where all labels are told, `pairs_in` all pairs of them.
pub(crate) fn describe_found(found: &Found, labels_in: &str, pairs_in: &str) -> String {
    let mut lines = vec![format!(
        "surface: area {}, {} triangles in {} pieces",
        number(found.area),
        grouped(found.triangles),
        found.components
    )];
    let labels = found.labels.iter().map(|label| {
        let voxels = found.label_voxels.get(&label.label.to_string()).copied().unwrap_or(0);
        format!("label {}: {} voxels, {}", label.label, grouped(voxels), label.described())
    });
    lines.extend(cut(labels.collect(), "labels", labels_in));
    let pairs = found.pairs.iter().map(|pair| match pair.labels {
        [0, label] => format!("label {label} and no label: area {}", number(pair.area)),
        [low, high] => format!("labels {low} and {high}: area {}", number(pair.area)),
    });
    lines.extend(cut(pairs.collect(), "pairs of labels", pairs_in));
    lines.join("\n") + "\n"
}
