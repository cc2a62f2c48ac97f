//! Where the page looks when it opens.

use serde_json::{Map, Value, json};

use crate::view::described::{Axis, Image};
use crate::view::mesh;
use crate::view::shown::MeshFile;

/// Looks at meshes alone, whose numbers have no unit, so that they fill the page.
pub(super) fn place_meshes<'m>(meshes: impl Iterator<Item = &'m MeshFile>, state: &mut Map<String, Value>) {
    // A page that only waits for a store.
    let Some((low, high)) = meshes.filter_map(mesh::bounds).reduce(joined) else { return };
    let longest = (0..3).map(|a| high[a] - low[a]).fold(0.0, f64::max);
    let extent = if longest > 0.0 { longest } else { 1.0 };
    // As small a unit as an image would have voxels: positions are told in whole ones.
    let unit = extent / 512.0;
    let dimensions: Map<String, Value> =
        ["x", "y", "z"].map(|name| (name.to_owned(), json!([unit, ""]))).into_iter().collect();
    let middle: Vec<f64> = (0..3).map(|a| f64::midpoint(low[a], high[a]) / unit).collect();
    state.insert("dimensions".into(), Value::Object(dimensions));
    state.insert("position".into(), json!(middle));
    state.insert("crossSectionScale".into(), json!(512.0 / 450.0));
    state.insert("projectionScale".into(), json!(1.6 * 512.0));
}

/// The corners of a box around two boxes.
fn joined((a, b): ([f64; 3], [f64; 3]), (c, d): ([f64; 3], [f64; 3])) -> ([f64; 3], [f64; 3]) {
    (std::array::from_fn(|n| a[n].min(c[n])), std::array::from_fn(|n| b[n].max(d[n])))
}

/// Looks at the middle of an image, so that it fills the page; where it has times, at one in the middle, in which its marks lie.
pub(super) fn place(image: &Image, state: &mut Map<String, Value>) {
    let named = |names: &'static [&str]| image.axes.iter().rev().filter(|axis| names.contains(&axis.name.as_str()));
    let space: Vec<&Axis> = named(&["x", "y", "z"]).collect();
    let time = || named(&["t"]);
    let dimensions: Map<String, Value> =
        space.iter().copied().chain(time()).map(|axis| (axis.name.clone(), dimension(axis))).collect();
    let first = |axis: &Axis| axis.origin / axis.spacing;
    let middle = space.iter().map(|axis| first(axis) + 0.5 * axis.voxels as f64);
    let whole = time().map(|axis| first(axis) + (axis.voxels.saturating_sub(1) / 2) as f64);
    let longest = space.iter().map(|axis| axis.voxels as f64 * axis.spacing).fold(0.0, f64::max);
    let unit = space.first().map_or(1.0, |axis| axis.spacing);
    state.insert("dimensions".into(), Value::Object(dimensions));
    state.insert("position".into(), middle.chain(whole).collect());
    // A panel is some 375 pixels high.
    state.insert("crossSectionScale".into(), json!(longest / unit / 360.0));
    state.insert("projectionScale".into(), json!(1.6 * longest / unit));
}

pub(super) fn dimension(axis: &Axis) -> Value {
    match (axis.metres, axis.seconds) {
        (Some(metres), _) => json!([axis.spacing * metres, "m"]),
        (_, Some(seconds)) => json!([axis.spacing * seconds, "s"]),
        _ => json!([axis.spacing, ""]),
    }
}
