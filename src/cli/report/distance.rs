//! What `distance` and `middle` tell: on the console, and in the report with every setting.

use std::collections::BTreeMap;

use serde::Serialize;

use super::run_report::SimplifiedCopy;
use super::table::cut;
use crate::cli::args::distance::MiddleChoice;
use crate::cli::args::distance::{DistanceJobArgs, PrecisionArg};
use crate::cli::terminal::text::{grouped, number};
use crate::grid::Geometry;
use crate::job::resources::Resources;
use crate::kernel::distance::state::neighbours::Neighbours;
use crate::kernel::surface::{LabelMeasures, Pair};
use crate::pipeline::distance::{DistanceFound, DistanceSettings, Init, Schedule};
use crate::pipeline::middle::{LabelMode, MiddleFound, SurfaceKind};
use crate::pipeline::output::viewer_mesh::Simplified;

/// What was found, in some lines; `whole_in` says where all labels are told, `pairs_in` all pairs of them.
pub(crate) fn describe_found(found: &Found, whole_in: &str, pairs_in: &str) -> String {
    let of = found.quantity.as_ref().map_or("distance", |told| told.quantity);
    let unit = found.quantity.as_ref().map_or(String::new(), |told| format!(" ({})", told.quantity_unit));
    let mut lines = vec![format!(
        "largest {of} {}{unit}; {} voxels fixed by sources, {} not reached",
        number(found.max),
        grouped(found.fixed_voxels),
        grouped(found.unlabelled_voxels)
    )];
    let triangles = found.triangle_distances;
    lines.extend(triangles.map(|n| format!("{} distances to triangles were computed to fix voxels", grouped(n))));
    // In the order of the numbers: as text 10 comes before 2.
    let mut labels: Vec<_> = found.label_voxels.iter().collect();
    labels.sort_by_key(|(label, _)| label.parse::<u64>().unwrap_or(u64::MAX));
    let labels = labels.into_iter().map(|(label, n)| format!("label {label}: {} voxels", grouped(*n))).collect();
    lines.extend(cut(labels, "labels", whole_in));
    lines.extend(found.middle.iter().flat_map(|middle| describe_middle(middle, pairs_in)));
    lines.join("\n") + "\n"
}

fn describe_middle(middle: &Middle, pairs_in: &str) -> Vec<String> {
    let volume = middle.volume.map_or(String::new(), |volume| format!("closed, volume {}, ", number(volume)));
    let mut lines = vec![format!(
        "surface: {volume}area {}, {} triangles in {} pieces",
        number(middle.area),
        grouped(middle.triangles),
        middle.components
    )];
    let pairs = middle.pairs.iter().map(|pair| {
        format!(
            "labels {} and {}: area {}, from {} to {} off both",
            pair.labels[0],
            pair.labels[1],
            number(pair.area),
            number(pair.distance.min),
            number(pair.distance.max)
        )
    });
    lines.extend(cut(pairs.collect(), "pairs of labels", pairs_in));
    lines
}

/// Every setting, also those that nobody gave; lengths physical.
#[derive(Debug, Serialize)]
pub(crate) struct Settings {
    sources: Vec<String>,
    output: Option<String>,
    compress: &'static str,
    ome: &'static str,
    method: &'static str,
    schedule: &'static str,
    neighbours: u32,
    iterations: Option<u32>,
    init: &'static str,
    precision: &'static str,
    max_distance: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    surface: Option<&'static str>,
    signed: bool,
    labels: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    exact_labels: Option<bool>,
    closest_point: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    exact: Option<bool>,
    /// The image that times are asked for through; null where distances are.
    #[serde(skip_serializing_if = "Option::is_none")]
    speed: Option<Speed>,
    brick: i64,
    scratch: String,
}

/// The image of speeds, where there is one.
#[derive(Debug, Serialize)]
struct Speed(Option<String>);

impl Settings {
    pub(crate) fn new(
        args: &DistanceJobArgs,
        middle: Option<&MiddleChoice>,
        settings: &DistanceSettings,
        resources: &Resources,
    ) -> Self {
        let (schedule, iterations) = match settings.schedule {
            Schedule::Front => ("front", None),
            Schedule::Sweep { iterations } => ("sweep", Some(iterations)),
        };
        Self {
            sources: args.sources.iter().map(|path| path.display().to_string()).collect(),
            output: args.job.output.store().map(|path| path.display().to_string()),
            compress: args.job.output.compress.name(),
            ome: args.job.output.ome.name(),
            method: settings.method.name(),
            schedule,
            neighbours: match settings.neighbours {
                Neighbours::Faces => 6,
                Neighbours::All => 26,
            },
            iterations,
            init: match settings.init {
                Init::Cell => "cell",
                Init::Contiguous => "contiguous",
                Init::Grid => "grid",
            },
            precision: match args.job.field.precision {
                PrecisionArg::F16 => "f16",
                PrecisionArg::F32 => "f32",
                PrecisionArg::F64 => "f64",
            },
            max_distance: settings.farthest,
            surface: middle.map(|choice| match choice.surface {
                SurfaceKind::Exact => "exact",
                SurfaceKind::Labels => "labels",
            }),
            signed: settings.signed,
            labels: settings.labels || middle.is_some(),
            exact_labels: middle.map(|choice| choice.labels == LabelMode::Exact),
            closest_point: settings.closest_point,
            exact: middle.is_none().then_some(settings.exact),
            speed: middle.is_none().then(|| Speed(args.speed.as_ref().map(|path| path.display().to_string()))),
            brick: settings.brick,
            scratch: resources.scratch.display().to_string(),
        }
    }
}

/// What was found.
#[derive(Debug, Serialize)]
pub(crate) struct Found {
    /// What the field holds, where that is no distance.
    #[serde(flatten)]
    quantity: Option<Quantity>,
    max: f64,
    fixed_voxels: u64,
    unlabelled_voxels: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    triangle_distances: Option<u64>,
    label_voxels: BTreeMap<String, u64>,
    #[serde(flatten)]
    middle: Option<Middle>,
}

/// What a field holds, and in which unit.
#[derive(Debug, Serialize)]
struct Quantity {
    quantity: &'static str,
    quantity_unit: String,
}

impl Found {
    pub(crate) fn new(found: &DistanceFound) -> Self {
        Self {
            quantity: None,
            max: found.max,
            fixed_voxels: found.fixed_voxels,
            unlabelled_voxels: found.unlabelled_voxels,
            triangle_distances: found.triangle_distances,
            label_voxels: found.label_voxels.iter().map(|(label, n)| (label.to_string(), *n)).collect(),
            middle: None,
        }
    }

    pub(crate) fn of_middle(found: &MiddleFound, sets: usize) -> Self {
        Self { middle: Some(Middle::new(found, sets)), ..Self::new(&found.distance) }
    }

    /// The same of times through an image on a grid.
    pub(crate) fn timed(self, geometry: &Geometry) -> Self {
        let length = geometry.unit.as_deref().unwrap_or("unit of length");
        let quantity_unit = format!("{length} / unit of the speeds");
        Self { quantity: Some(Quantity { quantity: "travel time", quantity_unit }), ..self }
    }

    /// With the copy of a large surface.
    pub(crate) fn with_copy(mut self, copy: Option<Simplified>) -> Self {
        if let Some(middle) = &mut self.middle {
            middle.simplified = copy.map(Into::into);
        }
        self
    }
}

/// The surfaces between labels.
#[derive(Debug, Serialize)]
struct Middle {
    /// Of the closed surface around one of two sets; null where it is open or there are more.
    volume: Option<f64>,
    area: f64,
    /// Null where there are more than two sets: their surfaces meet along lines.
    closed: Option<bool>,
    components: u64,
    triangles: u64,
    /// The copy of a large surface.
    simplified: Option<SimplifiedCopy>,
    pairs: Vec<PairReport>,
    labels: Vec<LabelReport>,
}

/// The surface between two labels.
#[derive(Debug, Serialize)]
pub(crate) struct PairReport {
    pub(crate) labels: [u32; 2],
    pub(crate) area: f64,
    /// Of what of it lies between voxels that touch.
    contact_area: f64,
    triangles: u64,
    lowest_xyz: [f64; 3],
    highest_xyz: [f64; 3],
    /// To the two sets.
    distance: Range,
    /// Of the gap between the two sets.
    thickness: Range,
    /// Positive where the first label bulges into the second.
    mean_curvature: f64,
}

/// What a label measures.
#[derive(Debug, Serialize)]
pub(crate) struct LabelReport {
    pub(crate) label: u32,
    /// Null where its surface is open.
    volume: Option<f64>,
    area: f64,
    contact_area: f64,
    /// Positive where it is convex.
    mean_curvature: f64,
    /// The mean length of chords through it; null where its surface is open.
    thickness: Option<f64>,
}

#[derive(Debug, Serialize)]
struct Range {
    min: f64,
    max: f64,
}

impl Middle {
    fn new(found: &MiddleFound, sets: usize) -> Self {
        let measures = &found.measures;
        let closed = (sets == 2).then(|| measures.is_closed() && measures.triangles > 0);
        Self {
            volume: (closed == Some(true)).then(|| measures.volume.abs()),
            area: measures.area,
            closed,
            components: measures.components,
            triangles: measures.triangles,
            simplified: None,
            pairs: found.pairs.iter().map(PairReport::new).collect(),
            labels: found.labels.iter().map(LabelReport::new).collect(),
        }
    }
}

impl LabelReport {
    pub(crate) fn new(found: &LabelMeasures) -> Self {
        Self {
            label: found.label,
            volume: found.volume,
            area: found.area,
            contact_area: found.contact_area,
            mean_curvature: found.mean_curvature,
            thickness: found.thickness,
        }
    }

    /// In a few words.
    pub(crate) fn described(&self) -> String {
        let volume = self.volume.map_or(String::new(), |volume| format!("volume {}, ", number(volume)));
        format!("{volume}area {}, {} of it in contact", number(self.area), number(self.contact_area))
    }
}

impl PairReport {
    pub(crate) fn new(pair: &Pair) -> Self {
        let [min, max] = pair.distance;
        Self {
            labels: pair.labels,
            area: pair.area,
            contact_area: pair.contact_area,
            triangles: pair.triangles,
            lowest_xyz: pair.extent[0],
            highest_xyz: pair.extent[1],
            distance: Range { min, max },
            thickness: Range { min: 2.0 * min, max: 2.0 * max },
            mean_curvature: pair.mean_curvature(),
        }
    }
}
