//! Opening an image: the stack with its place in the world, and the part of it that counts.

use std::path::Path;

use crate::cli::args::values::Crop;
use crate::cli::terminal::text::number;
use crate::error::{Error, Result};
use crate::grid::{Box3, Geometry};
use crate::io::ome_zarr::is_store;
use crate::io::stack::formats;
use crate::io::stack::volume::{Select, Stack, StackInfo};

/// A stack and where it lies.
pub(crate) struct OpenStack {
    pub(crate) stack: Box<dyn Stack>,
    /// The grid of the whole stack.
    pub(crate) geometry: Geometry,
    /// The axes along which the spacing was guessed.
    pub(crate) guessed: [bool; 3],
    /// What the user should know about how the file was understood.
    pub(crate) notes: Vec<String>,
}

/// Says which channel and time of several is read, where neither was chosen and nothing says it yet.
pub(crate) fn chosen_notes(path: &Path, info: &StackInfo, select: Select) -> Vec<String> {
    let of = |what: &str, flag: &str, count: u32, chosen: u32| {
        let is_given = info.notes.iter().any(|note| note.contains(flag));
        let name = path.display();
        (count > 1 && chosen == 0 && !is_given)
            .then(|| format!("{name}: has {count} {what}s; {what} 0 is read, {flag} N picks another"))
    };
    let channel = of("channel", "--channel", info.channels, select.channel);
    let time = of("time", "--time", info.times, select.time);
    channel.into_iter().chain(time).collect()
}

const AXES: [&str; 3] = ["x", "y", "z"];

/// Opens one channel and time of a stack; `spacing` stands in place of the file's.
pub(crate) fn open_stack(path: &Path, select: Select, spacing: Option<[f64; 3]>) -> Result<OpenStack> {
    open_any(path, select, spacing, true)
}

/// Opens one channel and time of an image that may be flat.
pub(crate) fn open_volume(path: &Path, select: Select, spacing: Option<[f64; 3]>) -> Result<OpenStack> {
    open_any(path, select, spacing, false)
}

fn open_any(path: &Path, select: Select, spacing: Option<[f64; 3]>, is_solid: bool) -> Result<OpenStack> {
    let stack = formats::open_stack(path, select)?;
    let info = stack.info();
    if let Some(axis) = (0..3).find(|&a| is_solid && info.shape[a] < 2) {
        return Err(Error::input(flat(stack.as_ref(), select, axis)).at(path));
    }
    if spacing.is_none() {
        check_told(path, info)?;
    }
    let mut notes: Vec<String> = info.notes.iter().map(|note| format!("{}: {note}", path.display())).collect();
    let guessed = info.spacing.map(|told| told.is_none() && spacing.is_none());
    let spacing = spacing.unwrap_or_else(|| file_spacing(path, info, &mut notes));
    let geometry = Geometry { shape: info.shape, spacing, origin: info.origin, unit: info.unit.clone() };
    Ok(OpenStack { stack, geometry, guessed, notes })
}

/// Refuses a spacing that is none, and an array that says nothing of where its voxels lie.
fn check_told(path: &Path, info: &StackInfo) -> Result<()> {
    let give = "give --image-spacing HX,HY,HZ";
    for (axis, spacing) in AXES.iter().zip(info.spacing) {
        if let Some(spacing) = spacing.filter(|h| !(h.is_finite() && *h > 0.0)) {
            return Err(
                Error::input(format!("has scale {spacing} along {axis}, where voxels have a size; {give}")).at(path)
            );
        }
    }
    if is_store(path) && info.spacing == [None; 3] {
        return Err(Error::input(format!("does not tell the spacing of its voxels; {give}")).at(path));
    }
    Ok(())
}

/// Why a stack that has one voxel along an axis is none, and which flag finds the others.
fn flat(stack: &dyn Stack, select: Select, axis: usize) -> String {
    let (info, images, axis) = (stack.info(), stack.images(), AXES[axis]);
    let read = select.image.unwrap_or(0);
    let other = images.iter().enumerate().find(|(_, image)| image.shape.iter().all(|&n| n > 1));
    // One of another time or channel is no slice of a stack that there is.
    let told = info.notes.iter().find(|note| axis == "z" && note.contains("--axes"));
    match (other, told) {
        (Some((n, image)), _) if n as u32 != read => format!(
            "image {read} of {} has one voxel along {axis}: a surface needs a 3-D stack; image {n} is one ({image}), give \
             --image-index {n}",
            images.len()
        ),
        (_, Some(note)) => format!("has one voxel along z: {note}"),
        _ => format!(
            "has one voxel along {axis}: a surface needs a 3-D stack; name the file with all planes, or the folder that \
             holds them"
        ),
    }
}

/// The file's spacing; what it does not tell is guessed, with a note.
fn file_spacing(path: &Path, info: &StackInfo, notes: &mut Vec<String>) -> [f64; 3] {
    let missing: Vec<&str> = (0..3).filter(|&a| info.spacing[a].is_none()).map(|a| AXES[a]).collect();
    let known = (0..3).find_map(|a| Some((AXES[a], info.spacing[a]?)));
    let assumed = known.map_or(1.0, |(_, spacing)| spacing);
    if !missing.is_empty() {
        let unit = info.unit.as_deref().map_or(String::new(), |unit| format!(" {unit}"));
        let like = match known {
            Some((axis, _)) => format!("{}{unit} as along {axis} is a guess", number(assumed)),
            None => "1 is assumed for x, y and z".into(),
        };
        notes.push(format!(
            "no {} spacing in {}: {like}; give --image-spacing HX,HY,HZ if that is wrong",
            missing.join(", "),
            path.display()
        ));
    }
    info.spacing.map(|spacing| spacing.unwrap_or(assumed))
}

/// The box that a crop means on a stack.
pub(crate) fn crop_box(crop: Option<Crop>, shape: [i64; 3]) -> Result<Box3> {
    let Some(Crop(limits)) = crop else { return Ok(Box3::from_shape(shape)) };
    let part = Box3 {
        lo: limits.map(|[low, _]| low.unwrap_or(0)),
        hi: std::array::from_fn(|a| limits[a][1].unwrap_or(shape[a])),
    };
    for a in 0..3 {
        let (axis, low, high) = (AXES[a], part.lo[a], part.hi[a]);
        if low < 0 || high > shape[a] {
            return Err(Error::usage(format!(
                "--crop reaches from {low} to {high} along {axis}, but the image has the voxels 0 to {}",
                shape[a]
            )));
        }
        if high - low < 2 {
            return Err(Error::usage(format!(
                "--crop leaves {} voxels along {axis}; leave at least 2",
                (high - low).max(0)
            )));
        }
    }
    Ok(part)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crops_stay_in_the_image() {
        let crop = |limits| crop_box(Some(Crop(limits)), [10, 20, 30]);
        let all = [None, None];
        assert_eq!(crop([[Some(2), None], [None, Some(5)], all]).unwrap(), Box3::new([2, 0, 0], [10, 5, 30]));
        for limits in [[Some(-1), None], [None, Some(11)], [Some(4), Some(4)], [Some(9), None], [Some(7), Some(2)]] {
            assert_eq!(crop([limits, all, all]).unwrap_err().exit_code(), 2, "{limits:?}");
        }
        assert_eq!(crop_box(None, [1, 2, 3]).unwrap(), Box3::from_shape([1, 2, 3]));
    }
}
