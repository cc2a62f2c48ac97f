//! Where a grid lies: as it was given, or around sources (Kósa & Mikula 2023).

use crate::error::{Error, Result};
use crate::grid::Geometry;

/// Voxels along the longest side where no spacing is given.
const DEFAULT_VOXELS: f64 = 256.0;

/// The room around sources where none is given, in parts of their largest extent (Kósa & Mikula 2023).
const DEFAULT_PADDING: f64 = 1.0 / 6.0;

/// The grid around sources, of which `low` and `high` are the corners of the box; lengths physical.
///
/// # Errors
/// When spacing or padding make no sense, or follow from nothing, or there would be more voxels than can be counted.
pub fn around([low, high]: [[f64; 3]; 2], spacing: Option<[f64; 3]>, padding: Option<f64>) -> Result<Geometry> {
    if let Some(padding) = padding.filter(|p| !(p.is_finite() && *p >= 0.0)) {
        return Err(Error::usage(format!("--padding is {padding}; give a length, 0 or more")));
    }
    let extent: [f64; 3] = std::array::from_fn(|a| high[a] - low[a]);
    let largest = extent.iter().copied().fold(0.0, f64::max);
    if !largest.is_finite() {
        return Err(Error::input("the coordinates reach farther than numbers do; scale them down"));
    }
    if largest == 0.0 && (spacing.is_none() || padding.is_none()) {
        return Err(Error::input(
            "all sources lie in one point, which tells no scale; give --spacing and --padding, or --origin and --shape",
        ));
    }
    let padding = padding.unwrap_or(DEFAULT_PADDING * largest);
    let spacing = spacing.unwrap_or([(largest + 2.0 * padding) / DEFAULT_VOXELS; 3]);
    // One voxel more than the room needs, as the papers' grids have it.
    let count = |a: usize| ((extent[a] + 2.0 * padding) / spacing[a]).floor() + 2.0;
    let counts = [count(0), count(1), count(2)];
    check_counts(counts)?;
    let origin = low.map(|v| v - padding);
    Ok(Geometry { shape: counts.map(|n| n as i64), spacing, origin, unit: None })
}

/// Refuses a grid that is none, or has more voxels than can be counted; its spacing is looked at by [`check_spacing`].
///
/// # Errors
/// With the number that cannot be.
pub fn check_grid(geometry: &Geometry) -> Result<()> {
    if geometry.shape.iter().any(|&n| n < 1) {
        let [x, y, z] = geometry.shape;
        return Err(Error::usage(format!("--shape is {x},{y},{z}; give three numbers of voxels, each 1 or more")));
    }
    if geometry.origin.iter().any(|v| !v.is_finite()) {
        let [x, y, z] = geometry.origin;
        return Err(Error::usage(format!("--origin is {x},{y},{z}; give three finite coordinates")));
    }
    check_counts(geometry.shape.map(|n| n as f64))
}

/// Refuses a spacing that is none.
///
/// # Errors
/// With the spacing.
pub fn check_spacing(flag: &str, spacing: Option<[f64; 3]>) -> Result<()> {
    match spacing.filter(|h| h.iter().any(|h| !(h.is_finite() && *h > 0.0))) {
        Some([x, y, z]) => {
            Err(Error::usage(format!("{flag} is {x},{y},{z}; give one length or three, each more than 0")))
        }
        None => Ok(()),
    }
}

/// Refuses what no index could count.
///
/// # Errors
/// With the number of voxels that there would be.
pub fn check_counts(counts: [f64; 3]) -> Result<()> {
    let voxels: f64 = counts.iter().product();
    if counts.iter().any(|&n| n >= 1e9) || voxels >= 1e18 {
        let [x, y, z] = counts;
        return Err(Error::usage(format!(
            "the grid would have {x:.3e} x {y:.3e} x {z:.3e} voxels; give a larger --spacing or a smaller --shape"
        )));
    }
    Ok(())
}
