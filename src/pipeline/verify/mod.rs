//! Whether a store is what a run wrote: its files, its voxels, and what of it follows from what else is in it.
//!
//! Nothing is changed, and all is read box by box; of a mesh alone all of the file is in memory at a time.

mod distances;
mod found;
mod objects;
mod rerun;
mod series;
mod structure;
mod sums;
mod surface;
mod vertices;
mod voxels;

use std::path::Path;

use serde_json::Value;

use crate::error::{Error, Result};
use crate::exec::{Engine, Footprint};
use crate::io::ome_zarr::{TIMES, listed_sums};
use structure::Image;
use vertices::DrawnFrom;

pub use found::{Check, Fault};
pub use rerun::same_results;

/// Makes all checks of a store and tells each as it ends.
///
/// # Errors
/// When there is no store, the memory is too little, or the run is interrupted. What is wrong with the store is no error.
pub fn verify(engine: &Engine, store: &Path, tell: &mut dyn FnMut(Check)) -> Result<()> {
    let _held = engine.reserve(Footprint::of_thread(voxels::HELD))?;
    tell(sums::check(engine, store)?);
    let (structure, images) = structure::check(store)?;
    tell(structure);
    let is_of_time = |image: &&Image| image.group.starts_with(&format!("{TIMES}/"));
    for image in images.iter().filter(|image| !is_of_time(image)) {
        tell(voxels::check(engine, image)?);
    }
    if let Some(check) = voxels::check_all(engine, TIMES, images.iter().filter(is_of_time))? {
        tell(check);
    }
    let mut told = Check::new("report.json");
    let report = read_report(store, &images, &mut told);
    tell(told);
    let Some(report) = report else { return Ok(()) };
    let result = &report["result"];
    let of = |group: &str| images.iter().find(|image| image.group == group);
    if result["times"].is_array() {
        return series::check(engine, store, &images, &report, tell);
    }
    match report["command"].as_str().unwrap_or_default() {
        "segment" | "demo" => {
            tell(objects::check(engine, &images, &report)?);
            for object in result["objects"].as_array().into_iter().flatten() {
                tell(surface::check_object(engine, store, (&images, "meshes"), object)?);
            }
        }
        "reconstruct" => {
            // The rim of an open surface lies where the points end.
            let image = of("").filter(|_| report["settings"]["open"] != true);
            let from = image.map(|image| match result["moved_vertices"].as_f64() {
                Some(most) if most > 0.0 => DrawnFrom::Moved(image, most),
                _ => DrawnFrom::LevelSet(image),
            });
            tell(surface::check(engine, store, "meshes/surface.ply", from, result)?);
        }
        "middle" if report["settings"]["surface"] == "walls" => {
            let bounded = report["settings"]["background"] == true;
            let from = |image| if bounded { DrawnFrom::Bounded(image) } else { DrawnFrom::Labels(image) };
            tell(surface::check(engine, store, "meshes/surface.ply", of("labels/nearest").map(from), result)?);
        }
        "distance" => tell(distances::check(engine, &images, &report)?),
        _ => {
            tell(distances::check(engine, &images, &report)?);
            // Its vertices lie where two distances are equal, of which the lesser one alone is stored.
            let labels = of("labels/nearest").map(DrawnFrom::Labels);
            tell(surface::check(engine, store, "meshes/surface.ply", labels, result)?);
        }
    }
    Ok(())
}

/// The commands that write reports.
const COMMANDS: [&str; 5] = ["segment", "demo", "reconstruct", "distance", "middle"];

/// The report of a run, where it is one and tells of the grid that the store has.
fn read_report(store: &Path, images: &[Image], found: &mut Check) -> Option<Value> {
    let name = "report.json";
    let path = store.join(name);
    if !path.exists() {
        let is_listed = || listed_sums(store).ok().flatten().is_some_and(|listed| listed.contains_key(name));
        if store.join("report.html").exists() || is_listed() {
            found.wrong_in(name, "is missing");
        }
        found.told = "there is none, as in stores of convert and of the library: labels, meshes and distances are compared with \
                      nothing"
            .into();
        return None;
    }
    let report = match report_of(store) {
        Ok(report) => report,
        Err(error) => {
            found.wrong_in(name, error.to_string());
            return None;
        }
    };
    let command = report["command"].as_str().unwrap_or_default();
    if !COMMANDS.contains(&command) || !report["result"].is_object() || !report["settings"].is_object() {
        found.wrong_in(name, "is no report of segment, demo, reconstruct, distance or middle");
        return None;
    }
    if let Some(image) = images.iter().find(|image| image.group.is_empty()) {
        let geometry = &image.reader.levels()[0].geometry;
        let shape = [2, 1, 0].map(|a| geometry.shape[a]);
        let [spacing, origin] = [geometry.spacing, geometry.origin].map(|[x, y, z]| [z, y, x]);
        for (what, is) in [
            ("shape_zyx", serde_json::json!(shape)),
            ("spacing_zyx", serde_json::json!(spacing)),
            ("origin_zyx", serde_json::json!(origin)),
        ] {
            if report["grid"][what] != is {
                found.wrong_in(name, format!("says {what} {}; the image has {is}", report["grid"][what]));
            }
        }
    }
    found.told = format!("of strandline {} {command}, its grid", report["version"].as_str().unwrap_or("?"));
    Some(report)
}

/// The report of a store.
///
/// # Errors
/// When there is none, or it is no JSON.
pub fn report_of(store: &Path) -> Result<Value> {
    let path = store.join("report.json");
    let text = std::fs::read(&path)
        .map_err(|error| Error::input(format!("cannot be read: {error}")).caused_by(error).at(&path))?;
    serde_json::from_slice(&text)
        .map_err(|error| Error::input(format!("is no JSON: {error}")).caused_by(error).at(&path))
}
