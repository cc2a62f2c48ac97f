//! What the surfaces between labels measure, as a table for other programs.

use std::fmt::Write;

use crate::kernel::surface::Pair;

/// The pairs as CSV with a header.
pub(super) fn csv(pairs: &[Pair]) -> String {
    let mut text = String::from(
        "label_low,label_high,area,triangles,x_min,y_min,z_min,x_max,y_max,z_max,distance_min,distance_max\n",
    );
    for pair in pairs {
        let [low, high] = pair.labels;
        let numbers: Vec<String> =
            pair.extent.iter().flatten().chain(&pair.distance).map(ToString::to_string).collect();
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{low},{high},{},{},{}", pair.area, pair.triangles, numbers.join(","));
    }
    text
}
