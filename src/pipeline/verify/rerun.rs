//! Two stores of the same command: whether their arrays and surfaces are the same to the bit.

use std::path::Path;

use super::found::{Check, at};
use super::structure::{self, Image};
use super::voxels::{EDGE, read};
use crate::error::{Error, Result};
use crate::exec::{Engine, Footprint, Workers};
use crate::grid::Box3;
use crate::io::ome_zarr::{FileSum, store_files};
use crate::kernel::image::difference::{first_difference, same_bits};

/// Compares the finest levels of all images of a store, and its meshes and tables, with those of another; coarser levels follow
/// from them, reports hold times.
///
/// # Errors
/// When a store cannot be read, the memory is too little, or the run is interrupted.
pub fn same_results(engine: &Engine, store: &Path, again: &Path) -> Result<Check> {
    let _held = engine.reserve(Footprint::of_thread(super::voxels::HELD))?;
    let mut found = Check::new("rerun");
    let (_, ours) = structure::check(store)?;
    let (_, theirs) = structure::check(again)?;
    for image in &ours {
        match theirs.iter().find(|other| other.group == image.group) {
            Some(other) => found.take(compare(engine, image, other)?),
            None => found.wrong_in(image.name(), "is not made by the second run"),
        }
    }
    for other in theirs.iter().filter(|other| !ours.iter().any(|image| image.group == other.group)) {
        found.wrong_in(other.name(), "is made by the second run, and is not in the store");
    }
    let meshes = compare_meshes(store, again, &mut found)?;
    found.told = format!("{} images and {meshes} files of meshes and tables are the same to the bit", ours.len());
    Ok(found)
}

fn compare(engine: &Engine, image: &Image, other: &Image) -> Result<Check> {
    let mut found = Check::default();
    let [a, b] = [image, other].map(|image| &image.reader.levels()[0]);
    if (&a.geometry, &a.element) != (&b.geometry, &b.element) {
        found.wrong_in(image.name(), "has another grid or type in the second run");
        return Ok(found);
    }
    if image.reader.times() != other.reader.times() {
        found.wrong_in(image.name(), "has other times in the second run");
        return Ok(found);
    }
    for (image, other) in image.all_times().iter().zip(&other.all_times()) {
        compare_at_one_time(engine, (image, other), &mut found)?;
    }
    Ok(found)
}

fn compare_at_one_time(engine: &Engine, (image, other): (&Image, &Image), found: &mut Check) -> Result<()> {
    let parts: Vec<Box3> = image.reader.levels()[0].geometry.domain().tiles([EDGE; 3]).collect();
    let stage = engine.stage(&format!("compare {}", image.name()), parts.len() as u64);
    let faults = stage.run(&parts, &Workers::none(), |(), part| {
        let mut found = Check::default();
        let Some(first) = read::<f64>(image, 0, part, &mut found) else { return Ok(found) };
        let Some(second) = read::<f64>(other, 0, part, &mut found) else { return Ok(found) };
        if let Some((place, others)) = first_difference(&first, &second, |a, b| same_bits(*a, *b)) {
            let voxel = part.voxel_at(place);
            let (is, then) = (first[place], second[place]);
            let text = format!("is {is}, in the second run {then}, and {others} more voxels around differ");
            found.add(at(image.file(0, voxel), voxel, text));
        }
        Ok(found)
    })?;
    stage.finish();
    found.take_all(faults);
    Ok(())
}

/// Compares files that are no arrays; how many there are.
fn compare_meshes(store: &Path, again: &Path, found: &mut Check) -> Result<usize> {
    let list = |folder: &Path| -> Result<Vec<String>> {
        let files = store_files(folder).map_err(|e| Error::from_io("the store cannot be read", &e).at(folder))?;
        let is_result = |file: &String| file.starts_with("meshes/") || ["marks.csv", "volumes.csv"].contains(&&**file);
        Ok(files.into_iter().filter(is_result).collect())
    };
    let (ours, theirs) = (list(store)?, list(again)?);
    for file in &ours {
        let [first, second] = [store, again].map(|folder| FileSum::of(&folder.join(file)).ok());
        if second.is_none() {
            found.wrong_in(file, "is not made by the second run");
        } else if first != second {
            found.wrong_in(file, "has other bytes in the second run");
        }
    }
    for file in theirs.iter().filter(|file| !ours.contains(file)) {
        found.wrong_in(file, "is made by the second run, and is not in the store");
    }
    Ok(ours.len())
}
