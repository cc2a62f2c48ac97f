//! The `multiscales` of OME-Zarr 0.1 to 0.5: axes, levels, and the transformations from voxels to the world.
//!
//! Rests on the OME-Zarr specifications 0.4 and 0.5. Those of a level come first, then those of the multiscale, which
//! hold for all levels.

use std::path::{Component, Path};

use serde_json::Value;

use super::axes::{self, Axis};

/// A multiscale image.
#[derive(Clone, Debug)]
pub(crate) struct Multiscale {
    pub(crate) name: Option<String>,
    pub(crate) version: Option<String>,
    /// None before version 0.3.
    pub(crate) axes: Option<Vec<Axis>>,
    pub(crate) levels: Vec<Level>,
}

/// One resolution.
#[derive(Clone, Debug)]
pub(crate) struct Level {
    /// Its folder, below the group's.
    pub(crate) path: String,
    /// Where it lies, where that is told.
    pub(crate) placed: Option<Placed>,
}

/// The world position of an entry is `entry * scale + translation`, axes as the array has them.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Placed {
    pub(crate) scale: Vec<f64>,
    pub(crate) translation: Vec<f64>,
}

/// Reads a multiscale, or says why that cannot be.
pub(crate) fn parse(document: &Value, ome: &Value) -> Result<Multiscale, String> {
    let version = document["version"].as_str().or_else(|| ome["version"].as_str()).map(ToOwned::to_owned);
    let told = version.as_deref().unwrap_or("without a version");
    let axes = match &document["axes"] {
        Value::Null if document.get("coordinateSystems").is_some() => {
            return Err(format!("is OME-Zarr {told}, which is not read; save it as version 0.5"));
        }
        Value::Null => None,
        list => Some(axes::parse(list).ok_or("holds a list of axes that names none")?),
    };
    let datasets = document["datasets"].as_array().filter(|list| !list.is_empty());
    let datasets =
        datasets.ok_or_else(|| format!("holds a multiscale image (OME-Zarr {told}) that names no arrays"))?;
    let common = &document["coordinateTransformations"];
    let level = |dataset: &Value| level(dataset, common, axes.as_ref().map(Vec::len));
    let levels = datasets.iter().map(level).collect::<Result<Vec<_>, _>>()?;
    Ok(Multiscale { name: document["name"].as_str().map(ToOwned::to_owned), version, axes, levels })
}

fn level(dataset: &Value, common: &Value, axes: Option<usize>) -> Result<Level, String> {
    let path = dataset["path"].as_str().ok_or("holds a multiscale image with a dataset that has no path")?.to_owned();
    let is_below = |part: Component<'_>| matches!(part, Component::Normal(_) | Component::CurDir);
    if !Path::new(&path).components().all(is_below) || path.is_empty() {
        return Err(format!("names the array '{path}', which is no folder below it"));
    }
    let own = &dataset["coordinateTransformations"];
    let mut placed: Option<Placed> = None;
    for transformation in [own, common].into_iter().filter_map(Value::as_array).flatten() {
        // Where no axes are named their number is that of the transformations, which the array's is held against.
        let kind = transformation["type"].as_str().unwrap_or("");
        let numbers = transformation[kind].as_array().map_or(0, Vec::len);
        let count = axes.or_else(|| placed.as_ref().map(|placed| placed.scale.len())).unwrap_or(numbers);
        apply(transformation, count, &mut placed).map_err(|reason| format!("{reason} (of array {path})"))?;
    }
    Ok(Level { path, placed })
}

/// Does one transformation after those before it.
fn apply(transformation: &Value, count: usize, placed: &mut Option<Placed>) -> Result<(), String> {
    let kind = transformation["type"].as_str().unwrap_or("");
    if kind == "identity" {
        return Ok(());
    }
    if !["scale", "translation"].contains(&kind) {
        return Err(format!("has a transformation of type '{kind}'; only scale and translation are read"));
    }
    let Some(list) = transformation[kind].as_array() else {
        return Err(format!("has a {kind} without numbers, which is not read"));
    };
    let numbers: Vec<f64> = list.iter().filter_map(Value::as_f64).filter(|number| number.is_finite()).collect();
    if numbers.len() != count || list.len() != count {
        return Err(format!("has a {kind} of {} numbers for {count} axes", numbers.len()));
    }
    let placed = placed.get_or_insert_with(|| Placed { scale: vec![1.0; count], translation: vec![0.0; count] });
    for (a, number) in numbers.into_iter().enumerate() {
        if kind == "scale" {
            placed.scale[a] *= number;
            placed.translation[a] *= number;
        } else {
            placed.translation[a] += number;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn with(own: &Value, common: &Value) -> Result<Multiscale, String> {
        let document = json!({
            "axes": [{"name": "z"}, {"name": "y"}, {"name": "x"}],
            "datasets": [{"path": "a/0", "coordinateTransformations": own}], "coordinateTransformations": common
        });
        parse(&document, &json!({"version": "0.5"}))
    }

    #[test]
    fn transformations_of_the_image_follow_those_of_its_levels() {
        let scale = |s: [f64; 3]| json!({"type": "scale", "scale": s});
        let shift = |t: [f64; 3]| json!({"type": "translation", "translation": t});
        let own = json!([scale([1.0, 2.0, 4.0]), shift([1.0, 1.0, 1.0])]);
        let found = with(&own, &json!([scale([2.0, 0.5, 0.5]), shift([0.0, 0.0, 3.0])])).unwrap();
        let placed = found.levels[0].placed.clone().unwrap();
        assert_eq!(placed, Placed { scale: vec![2.0, 1.0, 2.0], translation: vec![2.0, 0.5, 3.5] });
        assert_eq!(with(&Value::Null, &Value::Null).unwrap().levels[0].placed, None);
    }

    #[test]
    fn what_is_not_understood_is_named() {
        for (own, reason) in [
            (json!([{"type": "affine"}]), "'affine'"),
            (json!([{"type": "scale", "scale": [1.0, 2.0]}]), "2 numbers for 3 axes"),
            (json!([{"type": "scale", "path": "s"}]), "without numbers"),
            (json!([{"type": "scale", "scale": ["1", 2, 3]}]), "2 numbers"),
        ] {
            assert!(with(&own, &Value::Null).unwrap_err().contains(reason), "{reason}");
        }
        for path in ["../x", "/etc", "", "a/../../b"] {
            assert!(level(&json!({"path": path}), &Value::Null, None).is_err(), "{path}");
        }
    }
}
