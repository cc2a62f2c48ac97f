//! The state that the page opens with, as neuroglancer takes it: a layer for each image, label image, field, and the meshes and marks
//! of each store, in the world of the store that is shown; what is large, of another store or only of use beside the rest waits unseen.

mod layers;
mod placing;
mod window;

use std::collections::BTreeSet;

use serde_json::{Value, json};

pub(super) use self::layers::address;
use super::choice::Chosen;
use super::shown::root_of;

/// The state; sources begin with a slash, for the server that the page came from.
pub(super) fn state(chosen: &Chosen<'_>) -> Value {
    let shown = chosen.shown;
    let mut layers: Vec<Value> = chosen.layered().flat_map(|image| layers::layers(image, chosen)).collect();
    let of_stores = shown.meshes.chunk_by(|a, b| root_of(&a.path) == root_of(&b.path));
    layers.extend(of_stores.filter(|of| chosen.is_layered(&of[0].path)).map(|of| layers::meshes(chosen, of)));
    if chosen.growing().next().is_some() {
        layers.push(layers::growing(chosen));
    }
    layers.extend(shown.marks.iter().filter(|of| chosen.is_layered(&of.root)).filter_map(|of| {
        let image = shown.images.iter().find(|image| root_of(&image.path) == of.root)?;
        Some(layers::marks(chosen, image, of))
    }));
    tell_apart(&mut layers);
    let own = || shown.meshes.iter().filter(|mesh| chosen.has(&mesh.path)).chain(chosen.growing());
    let image = chosen.images().next();
    let is_flat = image.is_some_and(|image| !image.axes.iter().any(|axis| axis.name == "z"));
    let layout = match image {
        None if own().next().is_some() => "3d",
        _ if is_flat && own().next().is_none() => "xy",
        _ => "4panel-alt",
    };
    let has_unit = chosen.images().flat_map(|image| &image.axes).any(|axis| axis.metres.is_some());
    let mut state = json!({
        "title": shown.name,
        "layers": layers,
        // Sections of surfaces alone are empty.
        "layout": layout,
        // Without a unit its letters would be read as one: m, a thousandth, as metres.
        "showScaleBar": has_unit,
        "showAxisLines": false,
        // Sections would hide the surfaces behind them.
        "showSlices": false,
        "projectionBackgroundColor": "#1a1a1a",
    });
    // Channels are added to what is behind them.
    if image.is_some_and(|image| image.axes.iter().any(|axis| axis.is_channel && axis.voxels > 1)) {
        state["crossSectionBackgroundColor"] = "#000000".into();
    }
    if let Value::Object(state) = &mut state {
        match image {
            Some(image) => placing::place(image, state),
            None => placing::place_meshes(own(), state),
        }
    }
    state
}

/// Gives layers of one name others, by which the page knows them.
fn tell_apart(layers: &mut [Value]) {
    let mut taken = BTreeSet::new();
    for layer in layers {
        let name = layer["name"].as_str().unwrap_or_default().to_owned();
        let others = (2..).map(|n| format!("{name} ({n})"));
        let free = std::iter::once(name.clone()).chain(others).find(|name| taken.insert(name.clone()));
        layer["name"] = free.unwrap_or(name).into();
    }
}
