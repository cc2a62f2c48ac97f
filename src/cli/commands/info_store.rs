//! What `info` tells of a Zarr store: its images with axes, levels, chunks, codecs and range, its meshes and tables, and
//! what a run of ours reported.

use std::path::Path;

use serde_json::{Map, Value, json};

use super::store_contents::{contents, groups, range};
use crate::cli::report::lines::{Lines, line};
use crate::cli::terminal::text::{number, place};
use crate::error::{Error, Result};
use crate::io::ome_zarr::live;
use crate::io::stack::zarr::{LevelDescription, ZarrDescription, describe, holds_image};

/// What a store holds, as JSON and as lines; `image` chooses the image of a store with several.
pub(crate) fn store(path: &Path, image: Option<u32>) -> Result<(Value, Lines)> {
    let mut lines = vec![line("kind", "OME-Zarr store")];
    let live = live(path);
    lines.extend(
        live.map(|live| line("state", format!("{}, {:.0} % of the run done", live.state.name(), 100.0 * live.done))),
    );
    let (mut images, mut stored) = (Map::new(), Map::new());
    for group in groups(path) {
        let name = if group.is_empty() { "image" } else { &group };
        let chosen = image.filter(|_| group.is_empty());
        match describe(&path.join(&group), chosen) {
            // Whoever asks for an image that is not there is told so.
            Err(error) if chosen.is_some() => return Err(error),
            Ok(image) => {
                lines.extend(image_lines(name, &image));
                let mut levels: Vec<Value> = image.levels.iter().map(level_json).collect();
                match range(&path.join(&group), chosen, &image.levels) {
                    Ok(Some((level, [low, high]))) => {
                        let mut of =
                            if level == 0 { String::new() } else { format!(" on level {}", image.levels[level].path) };
                        of +=
                            if image.axes.first().is_some_and(|axis| axis == "t") { " at the first time" } else { "" };
                        lines
                            .push(line(&format!("{name}, values"), format!("{} to {}{of}", number(low), number(high))));
                        levels[level]["range"] = json!([low, high]);
                    }
                    Ok(None) => {}
                    Err(error) => lines.push(line(&format!("{name}, values"), format!("cannot be read: {error}"))),
                }
                images.insert(name.into(), levels.into());
                let (version, axes, notes) = (&image.version, &image.axes, &image.notes);
                stored.insert(
                    name.into(),
                    json!({ "ome_zarr": version, "name": image.name, "axes": axes, "notes": notes }),
                );
            }
            // The root of a store may hold no image of its own.
            Err(error) if holds_image(&path.join(&group)) => lines.push(line(name, format!("cannot be read: {error}"))),
            Err(_) => {}
        }
    }
    if images.is_empty() && live.is_none() {
        // Says why the store itself cannot be read.
        describe(path, image)?;
        return Err(Error::input("holds no image that can be read").at(path));
    }
    let files = contents(path);
    let named = files.iter().map(|(name, what)| (name.clone(), json!(what))).collect::<Map<_, _>>();
    lines.extend(files);
    let report = std::fs::read(path.join("report.json")).ok().and_then(|text| serde_json::from_slice(&text).ok());
    if let Some(report) = &report {
        lines.extend(summary(report));
    }
    let result = report.as_ref().map_or(Value::Null, |report| report["result"].clone());
    let state = live.map(|live| live.state.name());
    Ok((
        json!({ "kind": "store", "state": state, "images": images, "stored": stored, "files": named, "result": result }),
        lines,
    ))
}

fn image_lines(name: &str, image: &ZarrDescription) -> Lines {
    let mut lines = Lines::new();
    for level in &image.levels {
        let [x, y, z] = level.shape;
        let spacing = level.spacing.map(|h| h.map_or("?".into(), number)).join(", ");
        let unit = level.unit.as_deref().unwrap_or("");
        let text = format!("{x} x {y} x {z} {}, spacing {spacing} {unit}", level.element);
        let finest = level.spacing.iter().flatten().copied().fold(1.0, f64::min);
        let origin =
            if level.origin == [0.0; 3] { String::new() } else { format!(", origin {}", place(level.origin, finest)) };
        let number = if level.path.is_empty() { name.to_owned() } else { format!("{name}, level {}", level.path) };
        lines.push(line(&number, format!("{}{origin}", text.trim_end())));
    }
    // Levels are stored alike as a rule, and told apart where they are not.
    let mut told = String::new();
    for level in &image.levels {
        let text = storage(image, level);
        if text != told {
            let of = if told.is_empty() { "stored".to_owned() } else { format!("level {} stored", level.path) };
            lines.push(line(&format!("{name}, {of}"), &*text));
            told = text;
        }
    }
    lines.extend(image.notes.iter().map(|note| line("note", &**note)));
    lines
}

/// How a level is stored: versions, axes, chunks, codecs.
fn storage(image: &ZarrDescription, level: &LevelDescription) -> String {
    let by = |list: &[u64]| list.iter().map(u64::to_string).collect::<Vec<_>>().join(" x ");
    let version = image.version.as_ref().map_or(String::new(), |version| format!("OME-Zarr {version}, "));
    let shards = level.shards.as_ref().map_or(String::new(), |shards| format!(" in shards of {}", by(shards)));
    let (zarr, axes, chunks) = (level.format, image.axes.join(", "), by(&level.chunks));
    format!("{version}Zarr {zarr}, axes {axes}, chunks {chunks}{shards}, codecs {}", level.codecs)
}

fn level_json(level: &LevelDescription) -> Value {
    json!({
        "path": level.path, "shape_xyz": level.shape, "spacing_xyz": level.spacing, "origin_xyz": level.origin,
        "unit": level.unit, "type": level.element, "zarr_format": level.format, "stored_shape": level.stored_shape,
        "chunks": level.chunks, "shards": level.shards, "codecs": level.codecs,
    })
}

/// The inputs that a report names: an image, or sources.
fn made_from(settings: &Value) -> String {
    let sources = settings["sources"].as_array().into_iter().flatten();
    let single = ["image", "cloud"].iter().filter_map(|key| settings[key].as_str());
    let names: Vec<&str> = single.chain(sources.filter_map(Value::as_str)).collect();
    names.join(", ")
}

/// A few lines out of a report.
fn summary(report: &Value) -> Lines {
    let text = |value: &Value| value.as_str().map_or_else(|| value.to_string(), ToOwned::to_owned);
    let unit = report["grid"]["unit"].as_str().filter(|unit| !unit.is_empty()).unwrap_or("units of length").to_owned();
    let mut lines = vec![
        line("made by", format!("strandline {} {}", text(&report["version"]), text(&report["command"]))),
        line("from", made_from(&report["settings"])),
        line("seconds", report["seconds"].as_f64().map_or("?".into(), number)),
    ];
    let mut over_time: Vec<(u64, Vec<f64>)> = Vec::new();
    for object in report["result"]["times"]
        .as_array()
        .into_iter()
        .flatten()
        .flat_map(|time| time["objects"].as_array().into_iter().flatten())
    {
        let (Some(label), Some(volume)) = (object["label"].as_u64(), object["volume"].as_f64()) else { continue };
        match over_time.iter_mut().find(|(known, _)| *known == label) {
            Some((_, volumes)) => volumes.push(volume),
            None => over_time.push((label, vec![volume])),
        }
    }
    for (label, volumes) in over_time {
        let [low, high] = [f64::min, f64::max].map(|of| volumes.iter().copied().reduce(of).map_or("?".into(), number));
        let text = format!("volume {low} to {high} ({unit} cubed) at {} times (volumes.csv)", volumes.len());
        lines.push(line(&format!("object {label}"), text));
    }
    for object in report["result"]["objects"].as_array().into_iter().flatten() {
        let value = |name: &str| object[name].as_f64().map_or("?".into(), number);
        lines.push(line(
            &format!("object {}", object["label"]),
            format!(
                "volume {}, area {} ({unit} cubed, squared), closed: {}",
                value("volume"),
                value("area"),
                object["closed"]
            ),
        ));
    }
    lines
}
