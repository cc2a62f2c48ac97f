//! The times of a series, each as a store of that time alone is looked at: labels against level sets, meshes against both.

use std::path::Path;

use serde_json::{Value, json};

use super::found::Check;
use super::structure::{Image, of_time};
use super::{objects, surface};
use crate::error::Result;
use crate::exec::Engine;
use crate::io::ome_zarr::time_name;

/// Makes the checks of all times, those of a kind told as one.
///
/// # Errors
/// When the memory does not hold a mesh or the run is interrupted.
pub(super) fn check(
    engine: &Engine,
    store: &Path,
    images: &[Image],
    report: &Value,
    tell: &mut dyn FnMut(Check),
) -> Result<()> {
    let (mut labels, mut surfaces) = (Check::new("labels against level sets"), Check::new("meshes"));
    let (mut solved, mut meshes) = (0, 0);
    let times = report["result"]["times"].as_array().map_or(&[][..], Vec::as_slice);
    for (place, told) in (0..).zip(times) {
        let time = told["time"].as_u64().and_then(|time| u32::try_from(time).ok());
        let Some(time) = time else {
            labels.wrong_in("report.json", "lists a time without its number");
            continue;
        };
        // Nothing is there of a time of which nothing could be solved.
        if !told["objects"].is_array() {
            continue;
        }
        solved += 1;
        let of_time = of_time(images, place, time);
        let alone = json!({ "settings": report["settings"], "result": told });
        labels.take(objects::check(engine, &of_time, &alone)?);
        for object in told["objects"].as_array().into_iter().flatten() {
            let folder = format!("meshes/{}", time_name(time));
            surfaces.take(surface::check_object(engine, store, (&of_time, &folder), object)?);
            meshes += 1;
        }
    }
    labels.told = format!("{solved} of {} times, every voxel", times.len());
    surfaces.told = format!("{meshes} meshes, their measures, every vertex on the surface u = 1/2 of its time");
    tell(labels);
    tell(surfaces);
    Ok(())
}
