//! The state that the page opens with, as neuroglancer takes it: a layer for each image, label image, field and all meshes, in the
//! world of the first image; what is large or only of use beside the rest waits unseen.

use serde_json::{Map, Value, json};

use super::shown::{Axis, Image, Kind, MeshFile, Shown};

/// Colours of meshes without one, evenly around the circle of hues.
const HUE_STEP: f64 = 0.618_033_988_75;

/// Voxels along the longest axis of an image that is not large.
const LARGE: u64 = 256;

/// The state; sources begin with a slash, for the server that the page came from.
pub(super) fn state(shown: &Shown) -> Value {
    let mut layers: Vec<Value> = shown.images.iter().map(|image| layer(image, shown)).collect();
    if !shown.meshes.is_empty() {
        layers.push(meshes(shown));
    }
    if !shown.growing.0.is_empty() {
        layers.push(growing(shown));
    }
    layers.extend(shown.images.first().filter(|_| !shown.marks.is_empty()).map(|image| marks(image, &shown.marks)));
    let mut state = json!({
        "layers": layers,
        "layout": "4panel-alt",
        "showScaleBar": true,
        "showAxisLines": false,
        // Sections would hide the surfaces behind them.
        "showSlices": false,
        "projectionBackgroundColor": "#1a1a1a",
    });
    if let (Value::Object(state), Some(image)) = (&mut state, shown.images.first()) {
        place(image, state);
    }
    state
}

/// Looks at the middle of an image, so that it fills the page.
fn place(image: &Image, state: &mut Map<String, Value>) {
    let space: Vec<&Axis> =
        image.axes.iter().rev().filter(|axis| ["x", "y", "z"].contains(&axis.name.as_str())).collect();
    let dimensions: Map<String, Value> = space.iter().map(|axis| (axis.name.clone(), dimension(axis))).collect();
    let middle = |axis: &&Axis| axis.origin / axis.spacing + 0.5 * axis.voxels as f64;
    let longest = space.iter().map(|axis| axis.voxels as f64 * axis.spacing).fold(0.0, f64::max);
    let unit = space.first().map_or(1.0, |axis| axis.spacing);
    state.insert("dimensions".into(), Value::Object(dimensions));
    state.insert("position".into(), space.iter().map(middle).collect());
    // A panel is some 500 pixels wide.
    state.insert("crossSectionScale".into(), json!(longest / unit / 450.0));
    state.insert("projectionScale".into(), json!(1.6 * longest / unit));
}

fn dimension(axis: &Axis) -> Value {
    match axis.metres {
        Some(metres) => json!([axis.spacing * metres, "m"]),
        None => json!([axis.spacing, ""]),
    }
}

fn layer(image: &Image, shown: &Shown) -> Value {
    let has_picture = shown.images.iter().any(|other| other.kind == Kind::Picture);
    let version = if image.is_version_2 { "zarr2" } else { "zarr3" };
    let source = json!({ "url": format!("/data/{}/|{version}:", image.path) });
    match image.kind {
        Kind::Labels => {
            let colors: Map<String, Value> =
                image.colors.iter().map(|(label, rgb)| (label.to_string(), hex(*rgb).into())).collect();
            let segments: Vec<String> = image.colors.iter().map(|(label, _)| label.to_string()).collect();
            json!({
                "type": "segmentation", "name": image.name, "source": source, "visible": !image.path.ends_with("/border"),
                "segmentColors": colors, "segments": segments,
                "selectedAlpha": 0.35, "notSelectedAlpha": if segments.is_empty() { 0.35 } else { 0.0 },
                "crossSectionRenderScale": render_scale(image),
            })
        }
        kind => {
            let visible = kind == Kind::Picture || !has_picture;
            let controls = image.window.map(|window| json!({ "normalized": { "range": window } })).unwrap_or(json!({}));
            json!({
                "type": "image", "name": image.name, "source": source, "visible": visible, "shaderControls": controls,
                "crossSectionRenderScale": render_scale(image),
                "shader": "#uicontrol invlerp normalized\nvoid main() {\n  emitGrayscale(normalized());\n}\n",
            })
        }
    }
}

/// Pixels that a voxel of a section may cover before a finer level is loaded: of large images the finer one would be most of what
/// a page loads before anything is to be seen, most of all where voxels are numbers that hardly pack. Whoever looks closer gets all
/// of it.
fn render_scale(image: &Image) -> f64 {
    let longest = image.axes.iter().map(|axis| axis.voxels).max().unwrap_or(0);
    match (longest > LARGE, image.is_wide && image.kind != Kind::Labels) {
        (false, _) => 1.0,
        (true, false) => 2.0,
        (true, true) => 4.0,
    }
}

/// Marks as points in units of the image.
fn marks(image: &Image, marks: &[[f64; 3]]) -> Value {
    let unit = |name: &str| {
        let metres = image.axes.iter().find(|axis| axis.name == name).and_then(|axis| axis.metres);
        metres.map_or(json!([1.0, ""]), |metres| json!([metres, "m"]))
    };
    let point = |(n, place): (usize, &[f64; 3])| json!({ "type": "point", "id": n.to_string(), "point": place });
    json!({
        "type": "annotation", "name": "marks", "annotationColor": "#ffe14d",
        "source": {
            "url": "local://annotations",
            "transform": { "outputDimensions": { "x": unit("x"), "y": unit("y"), "z": unit("z") } },
        },
        "annotations": marks.iter().enumerate().map(point).collect::<Vec<_>>(),
        // Borders of the colour itself: where marks are crowded, black ones would hide them.
        "shader": "void main() {\n  setColor(defaultColor());\n  setPointMarkerSize(4.0);\n  \
                   setPointMarkerBorderColor(0.4 * defaultColor());\n}\n",
    })
}

/// All meshes as one layer: those of labels in the labels' colours, those of pairs of labels in hues apart.
fn meshes(shown: &Shown) -> Value {
    let labelled =
        |segment: u64| shown.images.iter().flat_map(|image| &image.colors).find(|(label, _)| *label == segment);
    let color = |mesh: &MeshFile| {
        // The number of a pair of labels is that of neither.
        let label = labelled(mesh.segment).filter(|_| mesh.name.is_none());
        label.map_or_else(|| hue(mesh.segment as f64 * HUE_STEP), |(_, color)| *color)
    };
    let all = || shown.meshes.iter();
    let colors: Map<String, Value> = all().map(|mesh| (mesh.segment.to_string(), hex(color(mesh)).into())).collect();
    let segments: Vec<String> = all().map(|mesh| mesh.segment.to_string()).collect();
    json!({
        "type": "segmentation", "name": "surfaces", "source": mesh_source(shown, "mesh"), "segments": segments,
        "segmentColors": colors, "objectAlpha": 0.8,
    })
}

/// Meshes at a path of the server, in the world of the first image.
fn mesh_source(shown: &Shown, path: &str) -> Value {
    let mut source = json!({ "url": format!("precomputed:///{path}") });
    if let Some(axes) =
        shown.images.first().map(|image| &image.axes).filter(|axes| axes.iter().all(|axis| axis.metres.is_none()))
    {
        // Lengths without a unit: the numbers of the mesh are those of the image.
        let names =
            || axes.iter().rev().map(|axis| axis.name.clone()).filter(|name| ["x", "y", "z"].contains(&name.as_str()));
        let of = |unit: &str| names().map(|name| (name, json!([1e-9, unit]))).collect::<Map<String, Value>>();
        let of_image = names().map(|name| (name, json!([1.0, ""]))).collect::<Map<String, Value>>();
        source["transform"] = json!({ "inputDimensions": of("m"), "outputDimensions": of_image });
    }
    source
}

/// Surfaces that still move, under an address that is another when they have moved: pages keep what they have read.
fn growing(shown: &Shown) -> Value {
    let (meshes, moved) = &shown.growing;
    let segments: Vec<String> = meshes.iter().map(|mesh| mesh.segment.to_string()).collect();
    json!({
        "type": "segmentation", "name": "growing", "source": mesh_source(shown, &format!("growing/{moved}")),
        "segments": segments, "segmentDefaultColor": "#7fd4ff", "objectAlpha": 0.6,
    })
}

fn hex([red, green, blue]: [u8; 3]) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

/// A light colour of a hue, which counts turns.
fn hue(turns: f64) -> [u8; 3] {
    [0.0, 1.0 / 3.0, 2.0 / 3.0].map(|shift| {
        let wave = 0.5 + 0.5 * libm::cos(std::f64::consts::TAU * (turns - shift));
        (90.0 + 165.0 * wave) as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_images_open_coarser_and_those_of_wide_numbers_more_so() {
        let scale = |voxels: u64, is_wide: bool, kind: Kind| {
            let axis = Axis { name: "x".into(), metres: None, voxels, spacing: 1.0, origin: 0.0 };
            let (path, name) = (String::new(), String::new());
            let (window, colors) = (None, Vec::new());
            render_scale(&Image { path, name, kind, is_version_2: false, is_wide, axes: vec![axis], window, colors })
        };
        assert_eq!([256, 257, 1024].map(|n| scale(n, false, Kind::Picture)), [1.0, 2.0, 2.0]);
        assert_eq!([256, 257, 1024].map(|n| scale(n, true, Kind::Picture)), [1.0, 4.0, 4.0]);
        assert_eq!(scale(1024, true, Kind::Labels), 2.0, "labels pack well");
    }
}
