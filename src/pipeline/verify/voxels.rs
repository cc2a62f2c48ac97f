//! Every chunk decoded, and each coarser level against the one below it, by the rule that `crate::pipeline::output::pyramid` has.

use super::found::{Check, at};
use super::structure::{Image, factors};
use crate::error::{Error, Result};
use crate::exec::{Engine, Workers};
use crate::grid::Box3;
use crate::kernel::image::difference::{first_difference, same_number};
use crate::kernel::image::filter::downsample::{self, coarse_box, coarse_shape};
use crate::store::{Element, ElementType};

/// Voxels along the edge of what is read at a time: one chunk of the stores that we write.
pub(super) const EDGE: i64 = 64;

/// Bytes that a thread holds: a box as numbers of each of two kinds and reduced, and a chunk of Zarr 2 of wide numbers, packed
/// and unpacked.
pub(super) const HELD: u64 = 40 << 20;

/// The types of images that are written.
const TYPES: [ElementType; 9] = [
    ElementType::U8,
    ElementType::U16,
    ElementType::U32,
    ElementType::I8,
    ElementType::I16,
    ElementType::I32,
    ElementType::F16,
    ElementType::F32,
    ElementType::F64,
];

/// Decodes all of an image, at all of its times, and makes its coarser levels once more.
///
/// # Errors
/// When the run is interrupted.
pub(super) fn check(engine: &Engine, image: &Image) -> Result<Check> {
    let Some(times) = image.reader.times() else { return check_one(engine, image) };
    let mut found = Check::new(format!("voxels of {}", image.name()));
    for of_time in image.all_times() {
        let part = check_one(engine, &of_time)?;
        found.told = format!("{times} times; {}", part.told);
        found.take(part);
    }
    Ok(found)
}

/// The same of many images that are told as one.
pub(super) fn check_all<'a>(
    engine: &Engine,
    name: &str,
    images: impl Iterator<Item = &'a Image>,
) -> Result<Option<Check>> {
    let (mut found, mut count) = (Check::new(format!("voxels of {name}")), 0);
    for image in images {
        count += 1;
        found.take(check_one(engine, image)?);
    }
    found.told = format!("{count} images, every chunk decoded, coarser levels made once more");
    Ok((count > 0).then_some(found))
}

fn check_one(engine: &Engine, image: &Image) -> Result<Check> {
    let mut found = Check::new(format!("voxels of {}", image.name()));
    let element = image.reader.levels()[0].element.as_str();
    let Some(element) = TYPES.into_iter().find(|known| known.name() == element) else {
        found.wrong_in(&image.group, format!("holds voxels of type {element}, which are not read"));
        return Ok(found);
    };
    for level in 0..image.reader.levels().len() {
        found.take(match element {
            ElementType::U8 => level_of::<u8>(engine, image, level),
            ElementType::U16 => level_of::<u16>(engine, image, level),
            ElementType::U32 => level_of::<u32>(engine, image, level),
            ElementType::I8 => level_of::<i8>(engine, image, level),
            ElementType::I16 => level_of::<i16>(engine, image, level),
            ElementType::I32 => level_of::<i32>(engine, image, level),
            ElementType::F16 => level_of::<half::f16>(engine, image, level),
            ElementType::F32 => level_of::<f32>(engine, image, level),
            ElementType::F64 => level_of::<f64>(engine, image, level),
        }?);
    }
    let levels = image.reader.levels().len();
    found.told = match (levels, image.reader.kind()) {
        (1, _) => "every chunk decoded".into(),
        (_, Some(kind @ ("mean" | "mode"))) => {
            format!("every chunk decoded, {} coarser levels made once more by their {kind}", levels - 1)
        }
        _ => format!("every chunk decoded; how its {} coarser levels are made is not told", levels - 1),
    };
    Ok(found)
}

/// Reads all of a level, and compares what it is reduced to with the next one.
fn level_of<T: Element>(engine: &Engine, image: &Image, level: usize) -> Result<Check> {
    let levels = image.reader.levels();
    let next = levels.get(level + 1).and_then(|next| factors(&levels[level], next));
    let parts: Vec<Box3> = levels[level].geometry.domain().tiles([EDGE; 3]).collect();
    let stage = engine.stage(&format!("voxels of {}, level {level}", image.name()), parts.len() as u64);
    let faults = stage.run(&parts, &Workers::none(), |(), part| {
        let mut found = Check::default();
        if let Some(values) = read::<T>(image, level, part, &mut found)
            && let Some(factors) = next
        {
            compare(image, level + 1, (&values, part), factors, &mut found);
        }
        Ok(found)
    })?;
    stage.finish();
    let mut found = Check::default();
    found.take_all(faults);
    Ok(found)
}

fn compare<T: Element>(image: &Image, level: usize, (fine, part): (&[T], &Box3), factors: [i64; 3], found: &mut Check) {
    let coarse = coarse_box(part, factors);
    let mut expected = vec![T::default(); coarse.len()];
    match image.reader.kind() {
        Some("mean") => downsample::mean(fine, part.shape(), factors, &mut expected),
        Some("mode") => downsample::mode(fine, part.shape(), factors, &mut expected),
        _ => return,
    }
    debug_assert_eq!(coarse.shape(), coarse_shape(part.shape(), factors));
    let Some(stored) = read::<T>(image, level, &coarse, found) else { return };
    let same = |a: &T, b: &T| same_number(a.to_f64(), b.to_f64());
    let Some((place, others)) = first_difference(&stored, &expected, same) else { return };
    let (voxel, is, should) = (coarse.voxel_at(place), stored[place].to_f64(), expected[place].to_f64());
    let text = format!("is {is} where the finer level gives {should}, and {others} more voxels around differ");
    found.add(at(image.file(level, voxel), voxel, text));
}

/// The voxels of a part of a level; none, and a fault that names the file, where they cannot be decoded.
pub(super) fn read<T: Element>(image: &Image, level: usize, part: &Box3, found: &mut Check) -> Option<Vec<T>> {
    match image.reader.read_box(level, part) {
        Ok(values) => Some(values.into_iter().map(T::from_f64).collect()),
        Err(error) => {
            found.wrong_in(image.file(level, part.lo), unreadable(&error));
            None
        }
    }
}

fn unreadable(error: &Error) -> String {
    use std::error::Error as _;
    let why = error.source().map_or_else(|| error.to_string(), ToString::to_string);
    format!("cannot be decoded: {why}")
}
