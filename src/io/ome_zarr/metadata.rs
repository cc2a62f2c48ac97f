//! The `zarr.json` documents: groups, arrays, and the OME attributes of images and labels.
//!
//! Written by hand rather than through a typed library, since those keep scales as f32 and lose the place of far crops.

use serde_json::{Map, Value, json};

use super::compression::Content;
use super::pyramid::LevelPlan;
use super::shard::{ChunkCodec, ShardLayout};
use crate::grid::Geometry;
use crate::store::ElementType;

const VERSION: &str = "0.5";

/// An image to be written: intensities, distances, a level set.
#[derive(Clone, Debug)]
pub struct ImageSpec<'a> {
    /// The image's name, as viewers show it.
    pub name: &'a str,
    /// Shape, spacing, origin and unit of the finest level.
    pub geometry: &'a Geometry,
    /// The type of a voxel.
    pub element: ElementType,
    /// What voxels are, which decides how they are packed.
    pub content: Content,
    /// The values that viewers show as black and white at first.
    pub window: Option<[f64; 2]>,
    /// The smallest and the largest value, how far viewers' sliders go, where they are known.
    pub extremes: Option<[f64; 2]>,
}

/// A label image to be written.
#[derive(Clone, Debug)]
pub struct LabelSpec<'a> {
    /// The label image's name, also its folder's; one path component.
    pub name: &'a str,
    /// Shape, spacing, origin and unit of the finest level.
    pub geometry: &'a Geometry,
    /// The type of a voxel: unsigned; 32 bits or fewer are what viewers read.
    pub element: ElementType,
    /// Colours by label.
    pub colors: &'a [LabelColor],
}

/// The colour in which viewers show a label.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LabelColor {
    /// The voxels' value.
    pub label: u32,
    /// Red, green, blue and opacity.
    pub rgba: [u8; 4],
}

/// `[x, y, z]` as files order it.
fn zyx<T: Copy>(triple: [T; 3]) -> [T; 3] {
    [triple[2], triple[1], triple[0]]
}

/// A group; with `ome` as its OME attributes, where it has some.
pub(super) fn group(ome: Option<Map<String, Value>>) -> Value {
    group_with(ome, None)
}

/// A group with its OME attributes and another one, where it has them.
pub(super) fn group_with(ome: Option<Map<String, Value>>, other: Option<(String, Value)>) -> Value {
    let mut attributes: Map<String, Value> = other.into_iter().collect();
    if let Some(mut ome) = ome {
        ome.insert("version".into(), VERSION.into());
        attributes.insert("ome".into(), ome.into());
    }
    json!({ "zarr_format": 3, "node_type": "group", "attributes": attributes })
}

/// The array of one level.
pub(super) fn array(shape: [i64; 3], element: ElementType, layout: ShardLayout, codec: &ChunkCodec) -> Value {
    let fill_value = match element {
        ElementType::F16 | ElementType::F32 | ElementType::F64 => json!(0.0),
        _ => json!(0),
    };
    json!({
        "zarr_format": 3,
        "node_type": "array",
        "shape": zyx(shape),
        "data_type": element.name(),
        "chunk_grid": { "name": "regular", "configuration": { "chunk_shape": zyx(layout.shard) } },
        "chunk_key_encoding": { "name": "default", "configuration": { "separator": "/" } },
        "fill_value": fill_value,
        "codecs": codec.metadata(layout),
        "attributes": {},
        "dimension_names": ["z", "y", "x"]
    })
}

/// The OME attributes of an image.
pub(super) fn image(spec: &ImageSpec<'_>, levels: &[LevelPlan]) -> Map<String, Value> {
    let mut ome = Map::new();
    ome.insert("multiscales".into(), multiscales(spec.name, levels, "mean", "mean of each block of voxels"));
    // JSON has no infinities; an image of nothing but one value needs no window.
    if let Some(window) = spec.window.filter(|[low, high]| (high - low).is_finite() && low < high) {
        ome.insert("omero".into(), omero(spec, window));
    }
    ome
}

/// The OME attributes of a label image, two folders below the image it belongs to, or without one.
pub(super) fn labels(spec: &LabelSpec<'_>, levels: &[LevelPlan], has_image: bool) -> Map<String, Value> {
    let how = "most frequent label of each block of voxels; ties: the smallest label that is not background";
    let colors: Vec<Value> =
        spec.colors.iter().map(|color| json!({ "label-value": color.label, "rgba": color.rgba })).collect();
    let mut ome = Map::new();
    ome.insert("multiscales".into(), multiscales(spec.name, levels, "mode", how));
    let mut label = json!({ "version": VERSION });
    if has_image {
        label["source"] = json!({ "image": "../../" });
    }
    if !colors.is_empty() {
        label["colors"] = colors.into();
    }
    ome.insert("image-label".into(), label);
    ome
}

/// The OME attributes of the group `labels`.
pub(super) fn label_list(names: &[String]) -> Map<String, Value> {
    Map::from_iter([("labels".into(), json!(names))])
}

fn multiscales(name: &str, levels: &[LevelPlan], method: &str, how: &str) -> Value {
    let unit = levels.first().and_then(|level| level.geometry.unit.as_deref());
    let axes = ["z", "y", "x"].map(|axis| match unit {
        Some(unit) => json!({ "name": axis, "type": "space", "unit": unit }),
        None => json!({ "name": axis, "type": "space" }),
    });
    let datasets: Vec<Value> = levels.iter().enumerate().map(|(level, plan)| dataset(level, &plan.geometry)).collect();
    json!([{
        "name": name,
        "axes": axes,
        "datasets": datasets,
        "type": method,
        "metadata": { "description": how, "method": "strandline", "version": env!("CARGO_PKG_VERSION") }
    }])
}

fn dataset(level: usize, geometry: &Geometry) -> Value {
    json!({
        "path": level.to_string(),
        "coordinateTransformations": [
            { "type": "scale", "scale": zyx(geometry.spacing) },
            { "type": "translation", "translation": zyx(geometry.origin) }
        ]
    })
}

fn omero(spec: &ImageSpec<'_>, [start, end]: [f64; 2]) -> Value {
    let [low, high] = spec.extremes.filter(|values| values.iter().all(|v| v.is_finite())).unwrap_or([start, end]);
    let window = json!({ "start": start, "end": end, "min": low.min(start), "max": high.max(end) });
    let channel = json!({
        "label": spec.name, "color": "FFFFFF", "active": true, "window": window,
        "coefficient": 1.0, "family": "linear", "inverted": false
    });
    // Opened in its middle slice, as a grey picture.
    let planes = json!({ "model": "greyscale", "defaultT": 0, "defaultZ": spec.geometry.shape[2] / 2 });
    json!({ "name": spec.name, "channels": [channel], "rdefs": planes })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::ome_zarr::plan_levels;

    #[test]
    fn far_origins_keep_all_digits() {
        let geometry = Geometry {
            shape: [3, 4, 5],
            spacing: [0.1, 0.2, 0.3],
            origin: [123_456_789.012_345, -1e-9, 0.0],
            unit: None,
        };
        let spec = ImageSpec {
            name: "far",
            geometry: &geometry,
            element: ElementType::F32,
            content: Content::Field,
            window: None,
            extremes: None,
        };
        let ome = image(&spec, &plan_levels(&geometry));
        let multiscale = &ome["multiscales"][0];
        let placed = &multiscale["datasets"][0]["coordinateTransformations"];
        assert_eq!(placed[0]["scale"], json!([0.3, 0.2, 0.1]));
        assert_eq!(placed[1]["translation"], json!([0.0, -1e-9, 123_456_789.012_345]));
        assert_eq!(multiscale["axes"][0], json!({ "name": "z", "type": "space" }));
        assert!(!ome.contains_key("omero"));
    }

    #[test]
    fn windows_are_numbers() {
        let geometry = Geometry { shape: [3; 3], spacing: [1.0; 3], origin: [0.0; 3], unit: None };
        let omero = |window| {
            let spec = ImageSpec {
                name: "d",
                geometry: &geometry,
                element: ElementType::F32,
                content: Content::Field,
                window: Some(window),
                extremes: Some([-2.0, 2.0]),
            };
            image(&spec, &plan_levels(&geometry)).remove("omero")
        };
        let found = omero([-1.0, 2.5]).unwrap();
        assert_eq!(found["channels"][0]["window"], json!({ "start": -1.0, "end": 2.5, "min": -2.0, "max": 2.5 }));
        for window in [[0.0, f64::INFINITY], [f64::NAN, 1.0], [2.0, 2.0]] {
            assert_eq!(omero(window), None);
        }
    }
}
