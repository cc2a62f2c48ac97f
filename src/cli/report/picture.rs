//! A picture of a result: three slices through the objects, their outlines over the image.

use std::path::Path;

use crate::error::{Error, Result};
use crate::grid::Box3;
use crate::io::ome_zarr::{ImageReader, StoredLevel};
use crate::io::png::write_rgb;
use crate::kernel::image::picture::panel::{Rgb, Slice, panel, percentile_window, side_by_side};

/// Pixels along the width of the picture; it may be a little less where it would grow too high.
const WIDTH: f64 = 1200.0;
const HEIGHT: f64 = 1000.0;
/// Slices are taken from the finest level that has no longer side.
const LONGEST_SIDE: i64 = 1200;

/// The slices: the axis across, then the axes along the picture's rows and columns.
const VIEWS: [[usize; 3]; 3] = [[2, 0, 1], [1, 0, 2], [0, 1, 2]];

/// Refuses a name that says the picture is something else than a PNG.
pub(crate) fn check_name(file: &Path) -> Result<()> {
    match file.extension() {
        Some(extension) if extension.eq_ignore_ascii_case("png") => Ok(()),
        _ => Err(Error::usage("pictures are PNG files; give a name that ends in .png").at(file)),
    }
}

/// Draws the store in `folder`, cut at the world position `centre`, into a PNG file, in place of one that is there if it may
/// `replace` that.
pub(crate) fn draw(folder: &Path, centre: [f64; 3], file: &Path, replace: bool) -> Result<()> {
    let image = ImageReader::open(folder)?;
    let labels = ImageReader::open(&folder.join("labels/segmentation"))?;
    let coarsest = image.levels().len().min(labels.levels().len()) - 1;
    let small = |level: &StoredLevel| level.geometry.shape.iter().all(|&n| n <= LONGEST_SIDE);
    let level = image.levels().iter().position(small).unwrap_or(coarsest).min(coarsest);
    let geometry = &image.levels()[level].geometry;
    let at = geometry.to_voxels(centre);
    let at: [i64; 3] = std::array::from_fn(|a| (at[a].round() as i64).clamp(0, geometry.shape[a] - 1));
    let mut slices = Vec::new();
    for [across, _, _] in VIEWS {
        let mut part = geometry.domain();
        (part.lo[across], part.hi[across]) = (at[across], at[across] + 1);
        let grey: Vec<f32> = image.read_box(level, &part)?.into_iter().map(|v| v as f32).collect();
        let labels: Vec<u32> = labels.read_box(level, &part)?.into_iter().map(|v| v as u32).collect();
        slices.push((part, grey, labels));
    }
    let all: Vec<f32> = slices.iter().flat_map(|(_, grey, _)| grey.iter().copied()).collect();
    let window = percentile_window(&all, 0.002, 0.998);
    let extent: [f64; 3] = std::array::from_fn(|a| geometry.shape[a] as f64 * geometry.spacing[a]);
    let pixels_per_length = scale(extent);
    let panels: Vec<Rgb> = VIEWS
        .iter()
        .zip(&slices)
        .map(|(&[_, row, column], (part, grey, labels))| {
            let [width, height] = sides(part, [row, column]);
            let pixel_aspect = geometry.spacing[column] / geometry.spacing[row];
            panel(
                &Slice { grey, labels, width, height, pixel_aspect },
                window,
                pixels_per_length * geometry.spacing[row],
            )
        })
        .collect();
    let picture = side_by_side(&panels);
    let size = [picture.width, picture.height].map(|n| u32::try_from(n).unwrap_or(u32::MAX));
    if size.contains(&u32::MAX) {
        return Err(Error::failed("the picture would be too large").at(file));
    }
    write_rgb(file, size, &picture.pixels, replace)
}

/// Pixels for a unit of length, so that the three slices fill the picture.
fn scale(extent: [f64; 3]) -> f64 {
    let width: f64 = VIEWS.iter().map(|&[_, row, _]| extent[row]).sum();
    let height = VIEWS.iter().map(|&[_, _, column]| extent[column]).fold(0.0, f64::max);
    (WIDTH / width).min(HEIGHT / height)
}

fn sides(part: &Box3, axes: [usize; 2]) -> [usize; 2] {
    axes.map(|a| part.shape()[a] as usize)
}
