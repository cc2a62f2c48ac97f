//! The marks of all files as one cloud in the world of the image, and what is odd about them.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use crate::cli::args::common::PointsIn;
use crate::cli::terminal::console::Console;
use crate::cli::terminal::text::{number, triple};
use crate::error::{Error, ErrorKind, Result};
use crate::exec::Progress;
use crate::grid::{Geometry, PointCloud};
use crate::io::geometry::read::point_file::{PointFile, Scale};
use crate::io::geometry::read::points::{LengthUnit, read_points};
use crate::pipeline::marks::{ObjectMarks, Seed, split_and_seed};
use crate::pipeline::segment;
use crate::pipeline::segment::{CheckedMarks, Extent, Grids, Refused, shared};

/// Objects, and pairs of them, that notes name, at most.
const MOST_NAMED: usize = 10;

/// What decides how the numbers of a file are read.
pub(crate) struct Reading<'a> {
    /// The grid of the whole image.
    pub(crate) image: &'a Geometry,
    /// What was asked for, in place of what the file's form says.
    pub(crate) points_in: Option<PointsIn>,
    /// The time of the image, counted from 0; none where points of all times are wanted.
    pub(crate) time: Option<u32>,
}

/// The marks of all files, and which file each object is from.
#[derive(Default)]
pub(crate) struct Marks {
    pub(crate) cloud: PointCloud,
    pub(crate) files: BTreeMap<u32, PathBuf>,
    /// The time of each point, where points of all times were wanted; none of those whose file names no times.
    pub(crate) times: Vec<Option<i64>>,
    /// The objects whose numbers were read as lengths though nothing says that they are.
    unsure: Vec<u32>,
}

/// Reads all files of marks. A file that names no objects is one object; those of later files are numbered on.
pub(crate) fn read_marks(paths: &[PathBuf], reading: &Reading<'_>, console: &Console) -> Result<Marks> {
    let mut marks = Marks::default();
    for (n, path) in paths.iter().enumerate() {
        if path.as_os_str() == "-" && paths[..n].contains(path) {
            return Err(Error::usage("--points - is given twice; standard input holds one file"));
        }
        if let Some(before) = paths[..n].iter().find(|before| is_same(before, path)) {
            let (path, before) = (path.display(), before.display());
            console.note(&format!("{path} is given twice (--points {before}): each of its objects is solved twice"));
        }
        let file = read_points(path)?;
        let note = |note: &str| console.note(&format!("{}: {note}", path.display()));
        file.notes.iter().for_each(|told| note(told));
        let is_given = |axis: usize| file.scales[axis] != Scale::Physical || file.units[axis].is_some();
        let is_sure = reading.points_in.is_some() || (0..3).all(is_given);
        let times = file.times.clone();
        let cloud = placed(file, reading, note).map_err(|error| error.at(path))?;
        if reading.time.is_none() {
            let known = times.into_iter().map(Some);
            marks.times.extend(known.chain(std::iter::repeat(None)).take(cloud.len()));
        }
        if !marks.cloud.is_empty() && marks.cloud.contours.is_empty() != cloud.contours.is_empty() {
            let (this, other) =
                if cloud.contours.is_empty() { ("no contours", "does") } else { ("contours", "does not") };
            return Err(Error::input(format!(
                "names {this} while {} {other}; give a contour column in all files of points or in none",
                paths[0].display()
            ))
            .at(path));
        }
        note_numbers(&marks.add(cloud, path, is_sure), path, console);
    }
    Ok(marks)
}

/// Says which numbers the objects of a file have, where others had theirs: all of many in one note.
fn note_numbers(numbers: &[(u32, u32)], path: &Path, console: &Console) {
    let path = path.display();
    match numbers {
        [(first, first_to), .., (last, last_to)] if numbers.len() > MOST_NAMED => console.note(&format!(
            "the {} objects of {path} are numbered on: {first} is {first_to}, {last} is {last_to}",
            numbers.len()
        )),
        few => few.iter().for_each(|(from, to)| console.note(&format!("object {from} of {path} is numbered {to}"))),
    }
}

/// Whether two paths name one file, by whatever spelling.
fn is_same(a: &Path, b: &Path) -> bool {
    a == b || a.canonicalize().ok().zip(b.canonicalize().ok()).is_some_and(|(a, b)| a == b)
}

/// The points of a file in the world of the image.
pub(crate) fn placed(file: PointFile, reading: &Reading<'_>, note: impl Fn(&str)) -> Result<PointCloud> {
    let image = reading.image;
    let (form, scales, units) = (file.form.clone(), file.scales, file.units);
    let mut cloud = match reading.time {
        Some(time) => of_time(file, time, &note)?,
        None => file.cloud,
    };
    let in_voxels: [bool; 3] = std::array::from_fn(|axis| match (scales[axis], reading.points_in) {
        (Scale::Slices, _) | (_, Some(PointsIn::Voxels)) => true,
        (_, Some(PointsIn::Physical)) => false,
        (scale, None) => scale == Scale::Voxels,
    });
    let factor: [f64; 3] = std::array::from_fn(|axis| unit_factor(units[axis], image));
    for point in &mut cloud.positions {
        for axis in 0..3 {
            let value = &mut point[axis];
            *value =
                if in_voxels[axis] { image.origin[axis] + *value * image.spacing[axis] } else { *value * factor[axis] };
        }
    }
    if reading.points_in.is_none() && in_voxels != [false; 3] {
        let axes: Vec<&str> = (0..3).filter(|&a| in_voxels[a]).map(|a| ["x", "y", "z"][a]).collect();
        let (axes, spacing) = (axes.join(", "), triple(image.spacing));
        note(&format!(
            "{form}: {axes} are read as voxel indices, times the spacing {spacing}; else give --points-in physical"
        ));
    }
    if let Some(axis) = (0..3).find(|&axis| !in_voxels[axis] && factor[axis] != 1.0) {
        let (from, to) = (units[axis].map_or("", |unit| unit.name), image.unit.as_deref().unwrap_or_default());
        note(&format!(
            "its lengths are in {from}, the image's in {to}: they are multiplied by {}",
            number(factor[axis])
        ));
    }
    Ok(cloud)
}

/// How many units of the image a unit of the file has, where both are known.
fn unit_factor(unit: Option<LengthUnit>, image: &Geometry) -> f64 {
    let known = image.unit.as_deref().and_then(LengthUnit::named);
    match (unit, known) {
        (Some(from), Some(to)) => from.in_units_of(to),
        _ => 1.0,
    }
}

/// The points of the image's time, where the file tells times.
fn of_time(file: PointFile, time: u32, note: impl Fn(&str)) -> Result<PointCloud> {
    let PointFile { mut cloud, times, .. } = file;
    let Some(&first) = times.first() else { return Ok(cloud) };
    let wanted = i64::from(time);
    if times.iter().all(|&time| time == first) {
        if first != wanted {
            note(&format!("all of its points are of time {first}, the image is of time {wanted} (--time)"));
        }
        return Ok(cloud);
    }
    let keep: Vec<bool> = times.iter().map(|&time| time == wanted).collect();
    let kept = keep.iter().filter(|&&keep| keep).count();
    if kept == 0 {
        let (low, high) = times.iter().fold((first, first), |(low, high), &t| (low.min(t), high.max(t)));
        return Err(Error::input(format!(
            "has points of the times {low} to {high} and none of time {wanted}, that of the image; give --time"
        )));
    }
    let left_out = keep.len() - kept;
    note(&format!("{left_out} points are of other times than {wanted} (--time) and are left out"));
    retain(&mut cloud.positions, &keep);
    retain(&mut cloud.objects, &keep);
    retain(&mut cloud.contours, &keep);
    Ok(cloud)
}

fn retain<T>(values: &mut Vec<T>, keep: &[bool]) {
    let mut keep = keep.iter();
    values.retain(|_| keep.next() == Some(&true));
}

impl Marks {
    /// The error with the file of the marks: an input that cannot be used and is not the image, which its errors name.
    pub(crate) fn named_in(&self, error: Error) -> Error {
        let first = self.files.values().next();
        match first.filter(|first| self.files.values().all(|file| file == *first)) {
            Some(only) if error.kind() == ErrorKind::Input => error.at(only),
            _ => error,
        }
    }

    /// The marks of other points of the same objects and files.
    pub(crate) fn with_cloud(&self, cloud: PointCloud) -> Self {
        Self { cloud, files: self.files.clone(), times: Vec::new(), unsure: self.unsure.clone() }
    }

    /// Adds a file's marks; returns its objects that have another number now, with that.
    fn add(&mut self, cloud: PointCloud, path: &Path, is_sure: bool) -> Vec<(u32, u32)> {
        let before = self.files.keys().last().copied().unwrap_or(0);
        let names_objects = !cloud.objects.is_empty();
        let objects = if names_objects { cloud.objects } else { vec![1; cloud.len()] };
        let mut numbers: BTreeMap<u32, u32> = objects.iter().map(|&object| (object, object)).collect();
        if before > 0 {
            (before + 1..).zip(numbers.values_mut()).for_each(|(number, renumbered)| *renumbered = number);
        }
        self.files.extend(numbers.values().map(|&object| (object, path.to_path_buf())));
        if !is_sure {
            self.unsure.extend(numbers.values());
        }
        self.cloud.objects.extend(objects.iter().map(|object| numbers[object]));
        self.cloud.positions.extend(cloud.positions);
        self.cloud.contours.extend(cloud.contours);
        numbers.into_iter().filter(|&(from, to)| names_objects && from != to).collect()
    }
}

/// The objects that marks and seeds stand for.
pub(crate) struct Objects {
    /// Those whose marks can be those of the image, and those of seeds.
    pub(crate) fit: Vec<ObjectMarks>,
    /// Those whose marks cannot.
    pub(crate) refused: Vec<Refused>,
}

impl Objects {
    /// The numbers of all.
    pub(crate) fn numbers(&self) -> Vec<u32> {
        self.fit.iter().map(|marks| marks.object).chain(self.refused.iter().map(|refused| refused.label)).collect()
    }
}

/// Checks the marks of each object, and says what is odd about them; refuses all where no object's fit the image.
pub(crate) fn check_all_marks(marks: &Marks, grids: &Grids<'_>, seeds: &[Seed], console: &Console) -> Result<Objects> {
    let (seeded, marked): (Vec<_>, Vec<_>) =
        split_and_seed(&marks.cloud, seeds).into_iter().partition(|object| object.seed.is_some());
    let checked = segment::check_all_marks(&marked, grids, &marks.unsure, &|text| console.note(text));
    let CheckedMarks { mut fit, refused, first_error } = checked;
    note_twice_marked(&marked, marks, grids.whole, console);
    fit.extend(seeded);
    // One of several that does not fit is refused by itself.
    match first_error {
        Some((label, error)) if fit.is_empty() => Err(error.at(&marks.files[&label])),
        _ => Ok(Objects { fit, refused }),
    }
}

/// Pairs of objects that are compared, at most: it is looked at for people's files, not for thousands of cells.
const MOST_PAIRS: usize = 1 << 20;

/// Says which objects of two files lie where one object would.
fn note_twice_marked(objects: &[ObjectMarks], marks: &Marks, image: &Geometry, console: &Console) {
    if marks.files.values().collect::<BTreeSet<_>>().len() < 2 || objects.len().pow(2) > MOST_PAIRS {
        return;
    }
    let extents: Vec<(u32, Extent)> =
        objects.iter().filter_map(|object| Some((object.object, Extent::of(object)?))).collect();
    let file = |object: &u32| &marks.files[object];
    let pairs = extents.iter().enumerate().flat_map(|(n, a)| extents[n + 1..].iter().map(move |b| (a, b)));
    let of_two_files = pairs.filter(|((a, _), (b, _))| file(a) != file(b));
    let mut twice = of_two_files.filter_map(|((a, first), (b, second))| Some((a, b, shared(first, second, image)?)));
    for (a, b, share) in twice.by_ref().take(MOST_NAMED) {
        console.note(&format!(
            "objects {a} ({}) and {b} ({}) overlap by {:.0} %: if they are one, put their marks into one file, with one \
             object number",
            file(a).display(),
            file(b).display(),
            100.0 * share
        ));
    }
    match twice.count() {
        0 => {}
        more => console.note(&format!("{more} more pairs of objects of two files overlap by half or more")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cloud(objects: &[u32]) -> PointCloud {
        PointCloud { positions: vec![[0.0; 3]; objects.len().max(2)], objects: objects.into(), contours: Vec::new() }
    }

    #[test]
    fn objects_of_later_files_are_numbered_on() {
        let mut marks = Marks::default();
        assert!(marks.add(cloud(&[2, 5, 2]), Path::new("a"), true).is_empty());
        assert!(marks.add(cloud(&[]), Path::new("b"), true).is_empty());
        assert_eq!(marks.add(cloud(&[9, 1, 9]), Path::new("c"), false), [(1, 7), (9, 8)]);
        assert_eq!(marks.cloud.objects, [2, 5, 2, 6, 6, 8, 7, 8]);
        let files: Vec<(u32, &str)> = marks.files.iter().map(|(&n, p)| (n, p.to_str().unwrap())).collect();
        assert_eq!(files, [(2, "a"), (5, "a"), (6, "b"), (7, "c"), (8, "c")]);
    }

    #[test]
    fn units_are_converted_where_both_are_known() {
        let image = |unit: Option<&str>| Geometry {
            shape: [9; 3],
            spacing: [1.0; 3],
            origin: [0.0; 3],
            unit: unit.map(ToOwned::to_owned),
        };
        let factor = |from, to| unit_factor(LengthUnit::named(from), &image(to));
        assert_eq!(factor("nm", Some("micrometer")), 1e-3);
        assert_eq!(factor("mm", Some("micrometer")), 1e3);
        assert_eq!(
            (factor("um", Some("micrometer")), factor("um", None), factor("furlong", Some("meter"))),
            (1.0, 1.0, 1.0)
        );
    }
}
