//! Slices through what a run wrote, each across one axis: the image with the outlines of objects, or a distance with lines of equal
//! values; over them the points that lie in the slice.

use std::path::Path;

use super::evidence::{Evidence, Root};
use super::picture::Picture;
use crate::cli::terminal::text::number;
use crate::error::Result;
use crate::exec::{Stage, Workers};
use crate::grid::{Box3, Geometry};
use crate::io::ome_zarr::{ImageReader, StoredLevel};
use crate::kernel::image::picture::dots::dot;
use crate::kernel::image::picture::field::field_panel;
use crate::kernel::image::picture::panel::{Slice, panel, percentile_window};

/// Slices are taken from the finest level that has no longer side.
const LONGEST_SIDE: i64 = 600;
/// Pixels of a picture along its longer side.
const PIXELS: f64 = 480.0;
/// Bytes that drawing one takes: labels and lines at three samples along each side of a pixel.
const DRAWING: u64 = (PIXELS * PIXELS) as u64 * 9 * 6;
/// Points that are drawn on a slice, at most: of more, some in even steps.
const MOST_DOTS: usize = 3000;
/// The yellow of marks, as `strandline view` has it.
const MARK: [u8; 3] = [255, 225, 77];
/// Lines of equal distance, about.
const LINES: f64 = 8.0;

/// The slices: the axis across, then the axes along the picture's rows and columns.
const VIEWS: [[usize; 3]; 3] = [[2, 0, 1], [1, 0, 2], [0, 1, 2]];

/// One slice as it was read.
struct Read {
    /// Which of [`VIEWS`].
    view: [usize; 3],
    part: Box3,
    values: Vec<f32>,
    labels: Vec<u32>,
}

/// Pictures of slices through the store in `folder`.
///
/// # Errors
/// When the store cannot be read.
pub(super) fn slices(stage: &Stage<'_>, folder: &Path, evidence: &Evidence<'_>) -> Result<Vec<Picture>> {
    let image = ImageReader::open(folder)?;
    let labels = label_image(folder, evidence.root)?;
    let coarsest = image.levels().len().min(labels.as_ref().map_or(usize::MAX, |labels| labels.levels().len())) - 1;
    let small = |level: &StoredLevel| level.geometry.shape.iter().all(|&n| n <= LONGEST_SIDE);
    let finest = image.levels().iter().position(small).unwrap_or(coarsest).min(coarsest);
    let level = (finest..coarsest).find(|&level| stage.hold(taken(&image.levels()[level])).is_ok()).unwrap_or(coarsest);
    let geometry = &image.levels()[level].geometry;
    let _taken = stage.hold(taken(&image.levels()[level]))?;
    let read = VIEWS
        .into_iter()
        .map(|view| {
            let mut part = geometry.domain();
            let at = place_across(view[0], geometry, evidence);
            (part.lo[view[0]], part.hi[view[0]]) = (at, at + 1);
            let values: Vec<f32> = image.read_box(level, &part)?.into_iter().map(|v| v as f32).collect();
            let labels = match (&labels, evidence.root) {
                (Some(labels), _) => labels.read_box(level, &part)?.into_iter().map(|v| v as u32).collect(),
                (None, Root::LevelSet) => values.iter().map(|&u| u32::from(u >= 0.5)).collect(),
                (None, _) => vec![0; values.len()],
            };
            Ok(Read { view, part, values, labels })
        })
        .collect::<Result<Vec<_>>>()?;
    let shown = Shown::of(&read, evidence.root);
    // Side by side where the memory allows it.
    let draw = |slice: &Read| shown.picture(slice, geometry, evidence);
    match stage.hold(2 * DRAWING) {
        Ok(_taken) => stage.run(&read, &Workers::none(), |(), slice| draw(slice)),
        Err(_) => read.iter().map(draw).collect(),
    }
}

/// Bytes that slices of a level take: as they are read and kept, and one of them while it is drawn.
fn taken(level: &StoredLevel) -> u64 {
    let [x, y, z] = level.geometry.shape.map(|n| n as u64);
    let voxels = [x * y, x * z, y * z];
    8 * voxels.iter().sum::<u64>() + 16 * voxels.into_iter().fold(0, u64::max) + DRAWING
}

fn label_image(folder: &Path, root: Root) -> Result<Option<ImageReader>> {
    let name = match root {
        Root::Image => "labels/segmentation",
        Root::LevelSet => return Ok(None),
        Root::Distance | Root::Times | Root::Labels => "labels/nearest",
    };
    let group = folder.join(name);
    if group.is_dir() { ImageReader::open(&group).map(Some) } else { Ok(None) }
}

/// The slice that holds the point nearest to the middle, so that it has marks on it.
fn place_across(axis: usize, geometry: &Geometry, evidence: &Evidence<'_>) -> i64 {
    let middle = evidence
        .sources
        .bounds()
        .map_or(evidence.centre, |(low, high)| std::array::from_fn(|a| f64::midpoint(low[a], high[a])));
    let points = evidence.sources.positions.iter().map(|p| p[axis]);
    let away = |v: &f64| (v - middle[axis]).abs();
    let at = points.min_by(|a, b| away(a).total_cmp(&away(b))).unwrap_or(middle[axis]);
    let voxel = (at - geometry.origin[axis]) / geometry.spacing[axis];
    (voxel.round() as i64).clamp(0, geometry.shape[axis] - 1)
}

/// How values are shown, the same on all slices.
struct Shown {
    root: Root,
    window: [f64; 2],
    step: f64,
}

impl Shown {
    fn of(read: &[Read], root: Root) -> Self {
        let all: Vec<f32> = read.iter().flat_map(|slice| slice.values.iter().copied()).collect();
        let window = match root {
            Root::Image | Root::Labels => percentile_window(&all, 0.002, 0.998),
            // Grey enough for what is drawn over it to be seen.
            Root::LevelSet => [-0.2, 1.8],
            Root::Distance | Root::Times => percentile_window(&all, 0.0, 1.0),
        };
        let window = window.map(f64::from);
        Self { root, window, step: nice_step((window[1] - window[0]) / LINES) }
    }

    fn picture(&self, slice: &Read, geometry: &Geometry, evidence: &Evidence<'_>) -> Result<Picture> {
        let [across, row, column] = slice.view;
        let spacing = geometry.spacing;
        let [width, height] = [row, column].map(|a| slice.part.shape()[a] as usize);
        let extent = (width as f64 * spacing[row]).max(height as f64 * spacing[column]);
        let scale = PIXELS / extent * spacing[row];
        let flat = Slice {
            grey: &slice.values,
            labels: &slice.labels,
            width,
            height,
            pixel_aspect: spacing[column] / spacing[row],
        };
        let mut picture = match self.root {
            Root::Distance | Root::Times => field_panel(&flat, self.window, self.step, scale),
            _ => panel(&flat, self.window.map(|v| v as f32), scale),
        };
        let at = slice.part.lo[across];
        let plane = geometry.origin[across] + at as f64 * spacing[across];
        let near: Vec<[f64; 3]> = evidence
            .sources
            .positions
            .iter()
            .filter(|p| (p[across] - plane).abs() <= 0.5 * spacing[across])
            .copied()
            .collect();
        let size = [picture.width as f64, picture.height as f64];
        for point in near.iter().step_by(near.len().div_ceil(MOST_DOTS).max(1)) {
            let place = |a: usize, n: usize, pixels: f64| {
                ((point[a] - geometry.origin[a]) / spacing[a] + 0.5) / n as f64 * pixels
            };
            let radius = if near.len() > 400 { 1.3 } else { 2.2 };
            dot(&mut picture, [place(row, width, size[0]), place(column, height, size[1])], radius, MARK);
        }
        let unit = geometry.unit.as_deref().map_or(String::new(), |unit| format!(" {unit}"));
        let [across, right, down] = slice.view.map(|a| ["x", "y", "z"][a]);
        let of = match near.len() {
            0 => String::new(),
            n => format!(", {n} {}", evidence.points),
        };
        let plane = number(plane);
        Picture::new(&picture, format!("{across} = {plane}{unit} ({right} to the right, {down} down){of}"))
    }
}

/// The number 1, 2 or 5 times a power of ten that is nearest below a length, or 1.
fn nice_step(length: f64) -> f64 {
    if !(length.is_finite() && length > 0.0) {
        return 1.0;
    }
    let power = libm::pow(10.0, libm::floor(libm::log10(length)));
    let factor = [5.0, 2.0, 1.0].into_iter().find(|factor| factor * power <= length).unwrap_or(1.0);
    factor * power
}

/// What the slices are, in a sentence.
pub(super) fn explained(evidence: &Evidence<'_>) -> String {
    let points = format!("Yellow dots are {} within half a voxel of the slice.", evidence.points);
    match evidence.root {
        Root::Labels => "Outlines of the labels over the volume.".into(),
        Root::Image => format!("Outlines of the objects over the image. {points}"),
        Root::LevelSet => format!("The solved function, light inside; its surface is outlined. {points}"),
        Root::Distance => format!(
            "Distances from small (violet) to large (yellow), with lines of equal distance; white lines lie where the \
             nearest data set is another or the sign changes. {points}"
        ),
        Root::Times => format!(
            "Travel times from small (violet) to large (yellow), with lines of equal time; white lines lie where the front \
             of another data set comes first. {points}"
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_round() {
        for (length, step) in [(0.013, 0.01), (0.3, 0.2), (7.0, 5.0), (1000.0, 1000.0), (0.0, 1.0), (f64::NAN, 1.0)] {
            assert!((nice_step(length) - step).abs() < 1e-12 * step, "{length}: {}", nice_step(length));
        }
    }
}
