//! ROIs of ImageJ and Fiji, single (`.roi`) and in a set (`.zip`), as outlines in voxels.
//!
//! Each ROI is a contour on its slice, a composite as many as it has parts. The form is that of ImageJ's `RoiDecoder`
//! (public domain): `decode` reads it, `paths` the parts of composites, `objects` tells which ROIs belong together.

mod bytes;
mod decode;
mod objects;
mod paths;

use std::collections::BTreeMap;
use std::io::{Cursor, Read};

use zip::ZipArchive;

use super::input::Input;
use super::point_file::{PointFile, Scale};
use crate::error::{Error, Result};
use crate::grid::PointCloud;
use crate::io::text::quoted;
use decode::{Marks, Roi};

/// The longest file or set that is read. A thousand outlines take about a megabyte; a point of four bytes takes 88 while it
/// is understood, and a set unpacks to a thousand times of itself, so that no more fits a gigabyte.
const LONGEST: u64 = 32 << 20;

/// True for what starts like a ROI.
pub(crate) fn is_roi(head: &[u8]) -> bool {
    head.starts_with(b"Iout")
}

/// True for what starts like a ZIP archive.
pub(crate) fn is_zip(head: &[u8]) -> bool {
    head.starts_with(b"PK\x03\x04")
}

/// Reads a single ROI.
pub(crate) fn read_roi(input: &mut Input) -> Result<PointFile> {
    let roi = Roi::decode(&input.read_whole(LONGEST)?, "")?;
    points("ROI of ImageJ", vec![roi], Vec::new())
}

/// Reads the ROIs of an archive.
pub(crate) fn read_zip(input: &mut Input) -> Result<PointFile> {
    let bytes = input.read_whole(LONGEST)?;
    let damaged = |e: zip::result::ZipError| Error::input(format!("is a damaged ZIP archive: {e}")).caused_by(e);
    let mut archive = ZipArchive::new(Cursor::new(bytes)).map_err(damaged)?;
    let (mut rois, mut others, mut left) = (Vec::new(), 0, LONGEST);
    for n in 0..archive.len() {
        let entry = archive.by_index(n).map_err(damaged)?;
        let name = entry.name().map_err(damaged)?.into_owned();
        if entry.is_dir() || name.starts_with("__MACOSX") {
            continue;
        }
        if !name.to_lowercase().ends_with(".roi") {
            others += 1;
            continue;
        }
        let mut content = Vec::new();
        entry
            .take(left + 1)
            .read_to_end(&mut content)
            .map_err(|e| Error::input(format!("{} in it cannot be read: {e}", quoted(&name))).caused_by(e))?;
        left = left
            .checked_sub(content.len() as u64)
            .ok_or_else(|| Error::input(format!("holds more than {} MiB of ROIs; divide it", LONGEST >> 20)))?;
        let stem = name.rsplit('/').next().unwrap_or_default();
        let stem = &stem[..stem.len() - ".roi".len()];
        rois.push(
            Roi::decode(&content, stem)
                .map_err(|e| Error::input(format!("{} in it {e}", quoted(&name))).caused_by(e))?,
        );
    }
    if rois.is_empty() {
        return Err(Error::input(
            "is a ZIP archive without ROIs of ImageJ; give a set of .roi files, or a table as CSV",
        ));
    }
    let mut notes = Vec::new();
    if others > 0 {
        notes.push(format!("{others} files in it are no ROIs and are left out"));
    }
    points("ROI set of ImageJ", rois, notes)
}

/// The points of all ROIs.
fn points(form: &str, rois: Vec<Roi>, mut notes: Vec<String>) -> Result<PointFile> {
    let all = rois.len();
    let rois: Vec<Roi> = rois.into_iter().filter(|roi| roi.marks != Marks::None).collect();
    if rois.len() < all {
        notes.push(format!("{} of {all} ROIs are texts, images or angles, and are left out", all - rois.len()));
    }
    let open = rois.iter().filter(|roi| roi.is_open).count();
    if open > 0 {
        let what = if open == 1 { "one open line is".into() } else { format!("{open} open lines are") };
        notes.push(format!("{what} taken as closed: an outline runs all around its object"));
    }
    let (objects, told) = objects::objects_of(&rois);
    notes.extend(told);
    let with_times = rois.iter().all(|roi| roi.time.is_some());
    let (mut cloud, mut times) = (PointCloud::default(), Vec::new());
    let mut contour = 0;
    for outline in outlines(&rois, &objects)? {
        contour += 1;
        cloud.objects.extend(vec![outline.object; outline.points.len()]);
        cloud.contours.extend(vec![contour; outline.points.len()]);
        if let Some(time) = outline.time.filter(|_| with_times) {
            times.extend(vec![time; outline.points.len()]);
        }
        cloud.positions.extend(outline.points.into_iter().map(|[x, y]| [x, y, outline.slice as f64]));
    }
    if loose(&rois) {
        cloud.contours.clear();
    }
    Ok(PointFile { cloud, form: form.into(), scales: [Scale::Voxels; 3], units: [None; 3], times, notes })
}

/// A contour.
struct Outline {
    object: u32,
    slice: i64,
    time: Option<i64>,
    points: Vec<[f64; 2]>,
}

/// The contours of all ROIs. Points are one contour for each slice and object: programs store them in one ROI or in many.
fn outlines(rois: &[Roi], objects: &[u32]) -> Result<Vec<Outline>> {
    let mut found: Vec<Outline> = Vec::new();
    let mut dotted: BTreeMap<_, usize> = BTreeMap::new();
    for (roi, &object) in rois.iter().zip(objects) {
        let missing = || {
            Error::input(format!(
                "the ROI {} tells no slice; in ImageJ tick 'Associate with slices' in the ROI Manager's options and add it \
                 again",
                quoted(&roi.name)
            ))
        };
        match &roi.marks {
            Marks::None => {}
            Marks::Outlines(parts) => {
                let slice = roi.slice.ok_or_else(missing)?;
                let outline =
                    |points: &Vec<[f64; 2]>| Outline { object, slice, time: roi.time, points: points.clone() };
                found.extend(parts.iter().map(outline));
            }
            Marks::Points(points) => {
                for &(point, slice) in points {
                    let slice = slice.or(roi.slice).ok_or_else(missing)?;
                    let n = *dotted.entry((object, slice, roi.time)).or_insert(found.len());
                    if n == found.len() {
                        found.push(Outline { object, slice, time: roi.time, points: Vec::new() });
                    }
                    found[n].points.push(point);
                }
            }
        }
    }
    Ok(found)
}

/// Points alone, of which a slice has one or two, are a loose cloud and no outlines.
fn loose(rois: &[Roi]) -> bool {
    let mut slices = BTreeMap::new();
    for roi in rois {
        let Marks::Points(points) = &roi.marks else { return false };
        for (_, slice) in points {
            *slices.entry(slice.or(roi.slice)).or_insert(0) += 1;
        }
    }
    slices.values().any(|&count| count < 3)
}
