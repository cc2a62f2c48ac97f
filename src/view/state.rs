//! The state that the page opens with, as neuroglancer takes it: a layer for each image, label image, field, and the meshes and marks
//! of each store, in the world of the first image; what is large, of another store than the first or only of use beside the rest
//! waits unseen.

use percent_encoding::{AsciiSet, NON_ALPHANUMERIC, utf8_percent_encode};
use serde_json::{Map, Value, json};

use super::described::{Axis, Image, Kind, Unsolved};
use super::mesh;
use super::shown::{Marks, MeshFile, Shown};

/// Colours of meshes without one, evenly around the circle of hues.
const HUE_STEP: f64 = 0.618_033_988_75;

/// Voxels along the longest axis of an image that is not large.
const LARGE: u64 = 256;

/// The state; sources begin with a slash, for the server that the page came from.
pub(super) fn state(shown: &Shown) -> Value {
    let mut layers: Vec<Value> = shown.images.iter().map(|image| layer(image, shown)).collect();
    layers.extend(shown.meshes.chunk_by(|a, b| root_of(&a.path) == root_of(&b.path)).map(|of| meshes(shown, of)));
    if !shown.growing.0.is_empty() {
        layers.push(growing(shown));
    }
    layers.extend(shown.marks.iter().filter_map(|of| {
        let image = shown.images.iter().find(|image| root_of(&image.path) == of.root)?;
        Some(marks(shown, image, of))
    }));
    let has_unit = shown.images.iter().flat_map(|image| &image.axes).any(|axis| axis.metres.is_some());
    let mut state = json!({
        "title": shown.name,
        "layers": layers,
        // Sections of surfaces alone are empty.
        "layout": if shown.images.is_empty() && surfaces(shown).next().is_some() { "3d" } else { "4panel-alt" },
        // Without a unit its letters would be read as one: m, a thousandth, as metres.
        "showScaleBar": has_unit,
        "showAxisLines": false,
        // Sections would hide the surfaces behind them.
        "showSlices": false,
        "projectionBackgroundColor": "#1a1a1a",
    });
    if let Value::Object(state) = &mut state {
        match shown.images.first() {
            Some(image) => place(image, state),
            None => place_meshes(shown, state),
        }
    }
    state
}

/// The store that a path on the server leads into.
pub(super) fn root_of(path: &str) -> &str {
    path.split('/').next().unwrap_or_default()
}

/// The name of a layer: with its store's, where there are several.
fn layer_name(shown: &Shown, path: &str, name: &str) -> String {
    let root = root_of(path);
    if shown.roots.len() < 2 { name.into() } else { format!("{} {name}", root.trim_end_matches(".zarr")) }
}

/// Whether a path leads into the store that is seen at first.
fn is_first(shown: &Shown, path: &str) -> bool {
    shown.images.first().is_none_or(|image| root_of(&image.path) == root_of(path))
}

/// What stays as it is in an address.
const PLAIN: &AsciiSet = &NON_ALPHANUMERIC.remove(b'/').remove(b'-').remove(b'_').remove(b'.');

/// The address of an image on the server, as neuroglancer takes it.
pub(super) fn address(image: &Image) -> String {
    let version = if image.is_version_2 { "zarr2" } else { "zarr3" };
    format!("/data/{}/|{version}:", utf8_percent_encode(&image.path, PLAIN))
}

/// All surfaces, those that still move among them.
fn surfaces(shown: &Shown) -> impl Iterator<Item = &MeshFile> {
    shown.meshes.iter().chain(&shown.growing.0)
}

/// Looks at meshes alone, whose numbers have no unit, so that they fill the page.
fn place_meshes(shown: &Shown, state: &mut Map<String, Value>) {
    // A page that only waits for a store.
    let Some((low, high)) = surfaces(shown).filter_map(mesh::bounds).reduce(joined) else { return };
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
fn place(image: &Image, state: &mut Map<String, Value>) {
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
    // A panel is some 500 pixels wide.
    state.insert("crossSectionScale".into(), json!(longest / unit / 450.0));
    state.insert("projectionScale".into(), json!(1.6 * longest / unit));
}

fn dimension(axis: &Axis) -> Value {
    match (axis.metres, axis.seconds) {
        (Some(metres), _) => json!([axis.spacing * metres, "m"]),
        (_, Some(seconds)) => json!([axis.spacing * seconds, "s"]),
        _ => json!([axis.spacing, ""]),
    }
}

fn layer(image: &Image, shown: &Shown) -> Value {
    let has_picture = shown.images.iter().any(|other| other.kind == Kind::Picture);
    let (source, name) = (json!({ "url": address(image) }), layer_name(shown, &image.path, &image.name));
    match image.kind {
        Kind::Labels => {
            let colors: Map<String, Value> =
                image.colors.iter().map(|(label, rgb)| (label.to_string(), hex(*rgb).into())).collect();
            let segments: Vec<String> = image.colors.iter().map(|(label, _)| label.to_string()).collect();
            json!({
                "type": "segmentation", "name": name, "source": source,
                "visible": !image.path.ends_with("/border") && is_first(shown, &image.path),
                "segmentColors": colors, "segments": segments,
                "selectedAlpha": 0.35, "notSelectedAlpha": if segments.is_empty() { 0.35 } else { 0.0 },
                "crossSectionRenderScale": render_scale(image),
            })
        }
        kind => {
            let visible = (kind == Kind::Picture || !has_picture) && is_first(shown, &image.path);
            let controls = image.window.map(|window| json!({ "normalized": { "range": window } })).unwrap_or(json!({}));
            json!({
                "type": "image", "name": name, "source": source, "visible": visible, "shaderControls": controls,
                "crossSectionRenderScale": render_scale(image),
                "shader": shader(image.unsolved),
            })
        }
    }
}

/// Grey values, and nothing where there are none.
fn shader(unsolved: Unsolved) -> String {
    let fill = unsolved.fill.filter(|fill| fill.is_finite()).map(|fill| format!("value == {fill:e}"));
    // Inside of a closed surface distances are negative.
    let beyond = unsolved.beyond.filter(|far| far.is_finite()).map(|far| format!("abs(value) >= {:e}", far as f32));
    let nothing: Vec<String> = fill.into_iter().chain(beyond).collect();
    let passed_over = if nothing.is_empty() {
        String::new()
    } else {
        format!(
            "  float value = toRaw(getDataValue());\n  if ({}) {{\n    emitTransparent();\n    return;\n  }}\n",
            nothing.join(" || ")
        )
    };
    format!("#uicontrol invlerp normalized\nvoid main() {{\n{passed_over}  emitGrayscale(normalized());\n}}\n")
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

/// Marks as points in units of the image; where it has times, each at its own.
fn marks(shown: &Shown, image: &Image, marks: &Marks) -> Value {
    let unit = |name: &str| {
        let metres = image.axes.iter().find(|axis| axis.name == name).and_then(|axis| axis.metres);
        metres.map_or(json!([1.0, ""]), |metres| json!([metres, "m"]))
    };
    let mut dimensions: Map<String, Value> =
        ["x", "y", "z"].map(|name| (name.to_owned(), unit(name))).into_iter().collect();
    let time = image.axes.iter().find(|axis| axis.name == "t").filter(|_| !marks.times.is_empty());
    if let Some(axis) = time {
        dimensions.insert("t".into(), dimension(axis));
    }
    let point = |(n, place): (usize, &[f64; 3])| {
        let at = marks.times.get(n).filter(|_| time.is_some()).map(|&t| t as f64);
        let point: Vec<f64> = place.iter().copied().chain(at).collect();
        json!({ "type": "point", "id": n.to_string(), "point": point })
    };
    let path = &image.path;
    json!({
        "type": "annotation", "name": layer_name(shown, path, "marks"), "annotationColor": "#ffe14d", "visible": is_first(shown, path),
        "source": { "url": "local://annotations", "transform": { "outputDimensions": dimensions } },
        "annotations": marks.places.iter().enumerate().map(point).collect::<Vec<_>>(),
        // Borders of the colour itself: where marks are crowded, black ones would hide them.
        "shader": "void main() {\n  setColor(defaultColor());\n  setPointMarkerSize(4.0);\n  \
                   setPointMarkerBorderColor(0.4 * defaultColor());\n}\n",
    })
}

/// The meshes of a store as one layer: those of labels in the labels' colours, those of pairs of labels in hues apart.
fn meshes(shown: &Shown, of: &[MeshFile]) -> Value {
    let path = of.first().map_or("", |mesh| &mesh.path);
    let images = || shown.images.iter().filter(|image| root_of(&image.path) == root_of(path));
    let labelled = |segment: u64| images().flat_map(|image| &image.colors).find(|(label, _)| *label == segment);
    let color = |mesh: &MeshFile| {
        // The number of a pair of labels is that of neither.
        let label = mesh.object.and_then(labelled).filter(|_| mesh.name.is_none());
        label.map_or_else(|| hue(mesh.segment as f64 * HUE_STEP), |(_, color)| *color)
    };
    let colors: Map<String, Value> =
        of.iter().map(|mesh| (mesh.segment.to_string(), hex(color(mesh)).into())).collect();
    let segments: Vec<String> = of.iter().map(|mesh| mesh.segment.to_string()).collect();
    // A file beside stores is of none of them, and called as itself.
    let is_alone = !shown.roots.iter().any(|(root, _)| root == root_of(path));
    let name = if is_alone && !shown.roots.is_empty() { path.to_owned() } else { layer_name(shown, path, "surfaces") };
    json!({
        "type": "segmentation", "name": name, "source": mesh_source(shown, "mesh"), "segments": segments,
        "segmentColors": colors, "objectAlpha": 0.8, "visible": is_first(shown, path),
    })
}

/// Meshes at a path of the server, in the world of the first image.
fn mesh_source(shown: &Shown, path: &str) -> Value {
    let mut source = json!({ "url": format!("precomputed:///{path}") });
    let axes = shown.images.first().map_or(&[][..], |image| &image.axes);
    if axes.iter().all(|axis| axis.metres.is_none()) {
        // Lengths without a unit: the numbers of the mesh are those of the image.
        let is_space = |name: &&str| axes.is_empty() || axes.iter().any(|axis| axis.name == **name);
        let names = || ["x", "y", "z"].into_iter().filter(is_space).map(str::to_owned);
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
            let axis = Axis { name: "x".into(), metres: None, seconds: None, voxels, spacing: 1.0, origin: 0.0 };
            let (path, name) = (String::new(), String::new());
            let (window, unsolved, colors, axes) = (None, Unsolved::default(), Vec::new(), vec![axis]);
            render_scale(&Image { path, name, kind, is_version_2: false, is_wide, axes, window, unsolved, colors })
        };
        assert_eq!([256, 257, 1024].map(|n| scale(n, false, Kind::Picture)), [1.0, 2.0, 2.0]);
        assert_eq!([256, 257, 1024].map(|n| scale(n, true, Kind::Picture)), [1.0, 4.0, 4.0]);
        assert_eq!(scale(1024, true, Kind::Labels), 2.0, "labels pack well");
    }
    #[test]
    fn what_was_not_solved_is_not_drawn() {
        let plain = shader(Unsolved::default());
        assert!(!plain.contains("Transparent") && plain.contains("emitGrayscale"), "{plain}");
        let capped = shader(Unsolved { fill: Some(0.0), beyond: Some(f64::from(2.6_f32)) });
        assert!(capped.contains("(value == 0e0 || abs(value) >= 2.6e0)"), "{capped}");
    }
}
