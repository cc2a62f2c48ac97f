//! The layers of the page: images with their grey range, labels in their colours, surfaces, marks.

use serde_json::{Map, Value, json};

use super::placing::dimension;
use super::window::window;
use crate::view::choice::{Chosen, path_in_address};
use crate::view::described::{Axis, Image, Kind, Unsolved};
use crate::view::shown::{Marks, MeshFile, root_of};

/// Colours of meshes without one, evenly around the circle of hues.
const HUE_STEP: f64 = 0.618_033_988_75;

/// Channels that have layers of their own, at most; their colours where nobody says them, and as many as are seen at first.
const MOST_CHANNELS: u64 = 16;
const CHANNELS: [[u8; 3]; 4] = [[0, 255, 0], [255, 0, 255], [0, 255, 255], [255, 255, 0]];

/// Voxels along the longest axis of an image that is not large.
const LARGE: u64 = 256;

/// The name of a layer: with its store's, where there are several.
fn layer_name(chosen: &Chosen<'_>, path: &str, name: &str) -> String {
    let root = root_of(path);
    if chosen.shown.roots.len() < 2 { name.into() } else { format!("{} {name}", root.trim_end_matches(".zarr")) }
}

/// The address of an image on the server, as neuroglancer takes it.
pub(in crate::view) fn address(image: &Image) -> String {
    let version = if image.is_version_2 { "zarr2" } else { "zarr3" };
    format!("/data/{}/|{version}:", path_in_address(&image.path))
}

/// An image's layers: one, or of a picture with a few channels one for each.
pub(super) fn layers(image: &Image, chosen: &Chosen<'_>) -> Vec<Value> {
    let channels = image.axes.iter().find(|axis| axis.is_channel).map_or(1, |axis| axis.voxels);
    let mut layers = match image.kind {
        Kind::Labels => vec![labels(image, chosen)],
        _ if (2..=MOST_CHANNELS).contains(&channels) => {
            (0..channels).map(|n| channel(image, chosen, n as usize)).collect()
        }
        _ => vec![grey(image, chosen)],
    };
    for layer in layers.iter_mut().filter(|_| chosen.is_aside(image)) {
        layer["archived"] = true.into();
    }
    layers
}

fn labels(image: &Image, chosen: &Chosen<'_>) -> Value {
    let colors: Map<String, Value> =
        image.colors.iter().map(|(label, rgb)| (label.to_string(), hex(*rgb).into())).collect();
    let segments: Vec<String> = image.colors.iter().map(|(label, _)| label.to_string()).collect();
    json!({
        "type": "segmentation", "name": layer_name(chosen, &image.path, &image.name), "source": source(image),
        "visible": chosen.is_seen(image), "segmentColors": colors, "segments": segments,
        "selectedAlpha": 0.35, "notSelectedAlpha": if segments.is_empty() { 0.35 } else { 0.0 },
        "crossSectionRenderScale": render_scale(image),
    })
}

fn grey(image: &Image, chosen: &Chosen<'_>) -> Value {
    json!({
        "type": "image", "name": layer_name(chosen, &image.path, &image.name), "source": source(image),
        "visible": chosen.is_seen(image), "shaderControls": controls(image, 0),
        "crossSectionRenderScale": render_scale(image),
        "shader": shader(image.unsolved),
    })
}

/// A channel in its colour, which is added to the others.
fn channel(image: &Image, chosen: &Chosen<'_>, n: usize) -> Value {
    let said = image.channels.get(n);
    let name = said.and_then(|said| said.name.clone()).unwrap_or_else(|| format!("channel {n}"));
    let color = said.and_then(|said| said.color).unwrap_or(CHANNELS[n % CHANNELS.len()]);
    let is_off = said.map_or(n >= CHANNELS.len(), |said| said.is_off);
    let axis = image.axes.iter().find(|axis| axis.is_channel).map_or("c", |axis| &axis.name);
    json!({
        "type": "image", "name": layer_name(chosen, &image.path, &format!("{} {name}", image.name)), "source": source(image),
        "localDimensions": { format!("{axis}'"): [1.0, ""] }, "localPosition": [n as f64 + 0.5],
        "visible": chosen.is_seen(image) && !is_off, "shaderControls": controls(image, n),
        "crossSectionRenderScale": render_scale(image), "opacity": 1.0, "blend": "additive",
        "shader": format!(
            "#uicontrol invlerp normalized\n#uicontrol vec3 color color(default=\"{}\")\nvoid main() {{\n  \
             emitRGB(color * normalized());\n}}\n",
            hex(color)
        ),
    })
}

/// The grey range of a channel, as it is said or as it is.
fn controls(image: &Image, n: usize) -> Value {
    let said = image.channels.get(n).and_then(|channel| channel.window);
    let window = said.or_else(|| window(image, n as u32));
    window.map_or(json!({}), |window| json!({ "normalized": { "range": window } }))
}

/// Where an image lies, with its axes where the page would not understand what is said of them.
fn source(image: &Image) -> Value {
    let mut source = json!({ "url": address(image) });
    if image.axes.iter().any(|axis| axis.is_odd) {
        let name = |axis: &Axis| if axis.is_channel { format!("{}'", axis.name) } else { axis.name.clone() };
        let of = |axis: &Axis| if axis.is_channel { json!([1.0, ""]) } else { dimension(axis) };
        let dimensions: Map<String, Value> = image.axes.iter().map(|axis| (name(axis), of(axis))).collect();
        // Lengths of the one are those of the other.
        source["transform"] = json!({ "inputDimensions": dimensions.clone(), "outputDimensions": dimensions });
    }
    source
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
pub(super) fn marks(chosen: &Chosen<'_>, image: &Image, marks: &Marks) -> Value {
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
        "type": "annotation", "name": layer_name(chosen, path, "marks"), "annotationColor": "#ffe14d", "visible": chosen.has(path),
        "source": { "url": "local://annotations", "transform": { "outputDimensions": dimensions } },
        "annotations": marks.places.iter().enumerate().map(point).collect::<Vec<_>>(),
        // Borders of the colour itself: where marks are crowded, black ones would hide them.
        "shader": "void main() {\n  setColor(defaultColor());\n  setPointMarkerSize(4.0);\n  \
                   setPointMarkerBorderColor(0.4 * defaultColor());\n}\n",
    })
}

/// The meshes of a store as one layer: those of labels in the labels' colours, those of pairs of labels in hues apart.
pub(super) fn meshes(chosen: &Chosen<'_>, of: &[MeshFile]) -> Value {
    let path = of.first().map_or("", |mesh| &mesh.path);
    let images = || chosen.shown.images.iter().filter(|image| root_of(&image.path) == root_of(path));
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
    let is_beside = chosen.is_in_no_store(path) && !chosen.shown.roots.is_empty();
    let name = if is_beside { path.to_owned() } else { layer_name(chosen, path, "surfaces") };
    let mut layer = json!({
        "type": "segmentation", "name": name, "source": mesh_source(chosen, path, "mesh"), "segments": segments,
        "segmentColors": colors, "objectAlpha": 0.8, "visible": chosen.has(path),
    });
    if is_beside && chosen.leaves_others_out() {
        layer["archived"] = true.into();
    }
    layer
}

/// The meshes of a store, at an address of the server, in the world of its image.
fn mesh_source(chosen: &Chosen<'_>, path: &str, address: &str) -> Value {
    let mut source = json!({ "url": format!("precomputed:///{address}") });
    let axes = chosen.shown.axes_at(path);
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
pub(super) fn growing(chosen: &Chosen<'_>) -> Value {
    let moved = chosen.shown.growing.1;
    let segments: Vec<String> = chosen.growing().map(|mesh| mesh.segment.to_string()).collect();
    json!({
        "type": "segmentation", "name": "growing", "source": mesh_source(chosen, chosen.root, &format!("growing/{moved}")),
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
            let axis = Axis {
                name: "x".into(),
                is_channel: false,
                is_odd: false,
                metres: None,
                seconds: None,
                voxels,
                spacing: 1.0,
                origin: 0.0,
            };
            let (path, name, folder) = (String::new(), String::new(), std::path::PathBuf::new());
            let (channels, unsolved, colors, axes) = (Vec::new(), Unsolved::default(), Vec::new(), vec![axis]);
            let (is_version_2, levels) = (false, 1);
            render_scale(&Image {
                path,
                folder,
                name,
                kind,
                is_version_2,
                is_wide,
                axes,
                levels,
                channels,
                unsolved,
                colors,
            })
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
