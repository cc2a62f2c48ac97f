//! Opening inputs: the stack with its place in the world, and the marks of all files as one cloud.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::console::Console;
use super::text::number;
use super::values::Crop;
use crate::error::{Error, Result};
use crate::exec::Progress;
use crate::grid::{Box3, Geometry, PointCloud};
use crate::io::points::read_cloud;
use crate::io::stacks::{self, Select, Stack, StackInfo};
use crate::pipeline::marks::split;
use crate::pipeline::segment::{Grids, check_marks, crossed};

/// A stack and where it lies.
pub(super) struct OpenStack {
    pub(super) stack: Box<dyn Stack>,
    /// The grid of the whole stack.
    pub(super) geometry: Geometry,
    /// The axes along which the spacing was guessed.
    pub(super) guessed: [bool; 3],
    /// What the user should know about how the file was understood.
    pub(super) notes: Vec<String>,
}

const AXES: [&str; 3] = ["x", "y", "z"];

/// Opens one channel and time of a stack; `spacing` stands in place of the file's.
pub(super) fn open_stack(path: &Path, select: Select, spacing: Option<[f64; 3]>) -> Result<OpenStack> {
    let stack = stacks::open_stack(path, select)?;
    let info = stack.info();
    if let Some(axis) = (0..3).find(|&a| info.shape[a] < 2) {
        return Err(Error::input(flat(stack.as_ref(), select, axis)).at(path));
    }
    let mut notes: Vec<String> = info.notes.iter().map(|note| format!("{}: {note}", path.display())).collect();
    let guessed = info.spacing.map(|told| told.is_none() && spacing.is_none());
    let spacing = spacing.unwrap_or_else(|| file_spacing(path, info, &mut notes));
    let geometry = Geometry { shape: info.shape, spacing, origin: [0.0; 3], unit: info.unit.clone() };
    Ok(OpenStack { stack, geometry, guessed, notes })
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
pub(super) fn crop_box(crop: Option<Crop>, shape: [i64; 3]) -> Result<Box3> {
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

/// The marks of all files, and which file each object is from.
pub(super) struct Marks {
    pub(super) cloud: PointCloud,
    pub(super) files: BTreeMap<u32, PathBuf>,
}

/// Reads all files of marks. A file that names no objects is one object; those of later files are numbered on.
pub(super) fn read_marks(paths: &[PathBuf]) -> Result<Marks> {
    let mut marks = Marks { cloud: PointCloud::default(), files: BTreeMap::new() };
    for path in paths {
        let cloud = read_cloud(path)?;
        if !marks.cloud.is_empty() && marks.cloud.contours.is_empty() != cloud.contours.is_empty() {
            let (this, other) =
                if cloud.contours.is_empty() { ("no contours", "does") } else { ("contours", "does not") };
            return Err(Error::input(format!(
                "names {this} while {} {other}; give a contour column in all files of points or in none",
                paths[0].display()
            ))
            .at(path));
        }
        marks.add(cloud, path);
    }
    Ok(marks)
}

impl Marks {
    fn add(&mut self, cloud: PointCloud, path: &Path) {
        let before = self.files.keys().last().copied().unwrap_or(0);
        let objects = if cloud.objects.is_empty() { vec![1; cloud.len()] } else { cloud.objects };
        let mut numbers: BTreeMap<u32, u32> = objects.iter().map(|&object| (object, object)).collect();
        if before > 0 {
            (before + 1..).zip(numbers.values_mut()).for_each(|(number, renumbered)| *renumbered = number);
        }
        self.files.extend(numbers.values().map(|&object| (object, path.to_path_buf())));
        self.cloud.objects.extend(objects.iter().map(|object| numbers[object]));
        self.cloud.positions.extend(cloud.positions);
        self.cloud.contours.extend(cloud.contours);
    }
}

/// Says what is odd about the marks; refuses them where no object's fit the image. Whether there are several objects.
pub(super) fn look_at_marks(marks: &Marks, grids: &Grids<'_>, seeds: usize, console: &Console) -> Result<bool> {
    let objects = split(&marks.cloud);
    let (mut bad, several) = (Vec::new(), objects.len() + seeds > 1);
    for object in &objects {
        let label = object.object;
        match check_marks(object, grids) {
            Ok(notes) => notes.iter().for_each(|note| console.note(note)),
            Err(error) => bad.push(error.at(&marks.files[&label])),
        }
        for number in crossed(object, grids.part) {
            console.note(&format!("outline {number} of object {label} crosses itself: are its marks in order?"));
        }
    }
    // One of several that does not fit is refused by itself.
    if seeds == 0 && bad.len() == objects.len() && !bad.is_empty() {
        return Err(bad.swap_remove(0));
    }
    Ok(several)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cloud(objects: &[u32]) -> PointCloud {
        PointCloud { positions: vec![[0.0; 3]; objects.len().max(2)], objects: objects.into(), contours: Vec::new() }
    }

    #[test]
    fn objects_of_later_files_are_numbered_on() {
        let mut marks = Marks { cloud: PointCloud::default(), files: BTreeMap::new() };
        marks.add(cloud(&[2, 5, 2]), Path::new("a"));
        marks.add(cloud(&[]), Path::new("b"));
        marks.add(cloud(&[9, 1, 9]), Path::new("c"));
        assert_eq!(marks.cloud.objects, [2, 5, 2, 6, 6, 8, 7, 8]);
        let files: Vec<(u32, &str)> = marks.files.iter().map(|(&n, p)| (n, p.to_str().unwrap())).collect();
        assert_eq!(files, [(2, "a"), (5, "a"), (6, "b"), (7, "c"), (8, "c")]);
    }

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
