//! What the surfaces between labels measure, and the labels themselves, as tables for other programs.

use std::collections::BTreeMap;
use std::fmt::Write;

use crate::kernel::surface::{LabelMeasures, Pair};

/// The pairs as CSV with a header; label 0 is what has none.
pub(super) fn pairs_csv(pairs: &[Pair]) -> String {
    let mut text = String::from(
        "label_low,label_high,area,triangles,x_min,y_min,z_min,x_max,y_max,z_max,distance_min,distance_max,\
         contact_area,mean_curvature,thickness\n",
    );
    for pair in pairs {
        let [low, high] = pair.labels;
        let numbers: Vec<String> =
            pair.extent.iter().flatten().chain(&pair.distance).map(ToString::to_string).collect();
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "{low},{high},{},{},{},{},{},{}",
            pair.area,
            pair.triangles,
            numbers.join(","),
            pair.contact_area,
            pair.mean_curvature(),
            pair.thickness
        );
    }
    text
}

/// The labels as CSV with a header; what an open surface does not tell is left empty.
pub(super) fn labels_csv(labels: &[LabelMeasures], voxels: &BTreeMap<u32, u64>) -> String {
    let mut text = String::from("label,voxels,volume,area,contact_area,mean_curvature,thickness\n");
    let told = |value: Option<f64>| value.map_or(String::new(), |value| value.to_string());
    for found in labels {
        let _ = writeln!(
            text,
            "{},{},{},{},{},{},{}",
            found.label,
            voxels.get(&found.label).copied().unwrap_or(0),
            told(found.volume),
            found.area,
            found.contact_area,
            found.mean_curvature,
            told(found.thickness)
        );
    }
    text
}
