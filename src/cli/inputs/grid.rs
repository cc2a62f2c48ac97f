//! The grid of a distance: as typed, like an image, or around the sources.

use super::image::open_stack;
use crate::cli::args::grid::GridArgs;
use crate::error::{Error, Result};
use crate::grid::Geometry;

/// Voxels along the longest side where no spacing is given.
const DEFAULT_VOXELS: f64 = 256.0;

/// The room around sources where none is given, in parts of their largest extent (Kósa & Mikula 2023).
const DEFAULT_PADDING: f64 = 1.0 / 6.0;

/// The grid that was asked for where no source is needed to tell it: that of an image, or one typed in full. Adds what the
/// user should know to `notes`.
pub(crate) fn given(args: &GridArgs, notes: &mut Vec<String>) -> Result<Option<Geometry>> {
    if let Some(image) = &args.like {
        let stack = open_stack(image, args.volume.select(), args.image_spacing)?;
        notes.extend(stack.notes);
        return Ok(Some(stack.geometry));
    }
    check_spacing("--spacing", args.spacing)?;
    match (args.filled.shape, args.filled.origin, args.spacing) {
        (Some(shape), Some(origin), Some(spacing)) => exact(shape, origin, spacing).map(Some),
        _ => Ok(None),
    }
}

/// The grid that was asked for; `bounds` is the box of all sources. Adds what the user should know to `notes`.
pub(crate) fn asked_grid(args: &GridArgs, bounds: ([f64; 3], [f64; 3]), notes: &mut Vec<String>) -> Result<Geometry> {
    given(args, notes)?.map_or_else(|| around(args, bounds), Ok)
}

/// The grid around sources, of which `bounds` is the box.
pub(crate) fn around(args: &GridArgs, (low, high): ([f64; 3], [f64; 3])) -> Result<Geometry> {
    let padding = args.filled.padding;
    if let Some(padding) = padding.filter(|p| !(p.is_finite() && *p >= 0.0)) {
        return Err(Error::usage(format!("--padding is {padding}; give a length, 0 or more")));
    }
    let extent: [f64; 3] = std::array::from_fn(|a| high[a] - low[a]);
    let largest = extent.iter().copied().fold(0.0, f64::max);
    if !largest.is_finite() {
        return Err(Error::input("the coordinates reach farther than numbers do; scale them down"));
    }
    if largest == 0.0 && (args.spacing.is_none() || padding.is_none()) {
        return Err(Error::input(
            "all sources lie in one point, which tells no scale; give --spacing and --padding, or --origin and --shape",
        ));
    }
    let padding = padding.unwrap_or(DEFAULT_PADDING * largest);
    let spacing = args.spacing.unwrap_or([(largest + 2.0 * padding) / DEFAULT_VOXELS; 3]);
    // One voxel more than the room needs, as the papers' grids have it.
    let count = |a: usize| ((extent[a] + 2.0 * padding) / spacing[a]).floor() + 2.0;
    let counts = [count(0), count(1), count(2)];
    check_counts(counts)?;
    let origin = low.map(|v| v - padding);
    Ok(Geometry { shape: counts.map(|n| n as i64), spacing, origin, unit: None })
}

fn exact(shape: [i64; 3], origin: [f64; 3], spacing: [f64; 3]) -> Result<Geometry> {
    if shape.iter().any(|&n| n < 1) {
        let [x, y, z] = shape;
        return Err(Error::usage(format!("--shape is {x},{y},{z}; give three numbers of voxels, each 1 or more")));
    }
    if origin.iter().any(|v| !v.is_finite()) {
        let [x, y, z] = origin;
        return Err(Error::usage(format!("--origin is {x},{y},{z}; give three finite coordinates")));
    }
    check_counts(shape.map(|n| n as f64))?;
    Ok(Geometry { shape, spacing, origin, unit: None })
}

impl GridArgs {
    /// Whether anything was said of where the grid lies.
    pub(crate) fn is_asked_for(&self) -> bool {
        self.spacing.is_some() || self.filled.is_given() || self.like.is_some()
    }
}

/// Refuses a spacing that is none.
pub(crate) fn check_spacing(flag: &str, spacing: Option<[f64; 3]>) -> Result<()> {
    match spacing.filter(|h| h.iter().any(|h| !(h.is_finite() && *h > 0.0))) {
        Some([x, y, z]) => {
            Err(Error::usage(format!("{flag} is {x},{y},{z}; give one length or three, each more than 0")))
        }
        None => Ok(()),
    }
}

/// Refuses what no index could count.
pub(crate) fn check_counts(counts: [f64; 3]) -> Result<()> {
    let voxels: f64 = counts.iter().product();
    if counts.iter().any(|&n| n >= 1e9) || voxels >= 1e18 {
        let [x, y, z] = counts;
        return Err(Error::usage(format!(
            "the grid would have {x:.3e} x {y:.3e} x {z:.3e} voxels; give a larger --spacing or a smaller --shape"
        )));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::args::grid::GridBoxArgs;

    fn laid(args: &GridArgs, low: [f64; 3], high: [f64; 3]) -> Result<Geometry> {
        asked_grid(args, (low, high), &mut Vec::new())
    }

    #[test]
    fn the_papers_grid_around_sources() {
        let args = GridArgs { spacing: Some([0.1; 3]), ..GridArgs::default() };
        let found = laid(&args, [0.0; 3], [3.0, 1.0, 0.0]).unwrap();
        assert_eq!(found.shape, [42, 22, 12]);
        assert_eq!(found.origin, [-0.5; 3]);
        assert_eq!(laid(&GridArgs::default(), [0.0; 3], [1.0; 3]).unwrap().shape, [258; 3]);
    }

    #[test]
    fn senseless_grids_are_refused() {
        let with = |spacing| GridArgs { spacing: Some(spacing), ..GridArgs::default() };
        for spacing in [[0.0; 3], [-1.0; 3], [f64::NAN, 1.0, 1.0], [f64::INFINITY; 3], [1e-12; 3]] {
            assert_eq!(laid(&with(spacing), [0.0; 3], [1.0; 3]).unwrap_err().exit_code(), 2, "{spacing:?}");
        }
        assert!(laid(&GridArgs::default(), [1.0; 3], [1.0; 3]).unwrap_err().to_string().contains("one point"));
        assert!(laid(&GridArgs::default(), [-1e308; 3], [1e308; 3]).is_err());
        let shape = GridArgs {
            filled: GridBoxArgs { shape: Some([5, 0, 5]), origin: Some([0.0; 3]), padding: None },
            ..with([1.0; 3])
        };
        assert!(laid(&shape, [0.0; 3], [1.0; 3]).unwrap_err().to_string().contains("--shape"));
        let padding =
            GridArgs { filled: GridBoxArgs { padding: Some(-1.0), ..GridBoxArgs::default() }, ..GridArgs::default() };
        assert!(laid(&padding, [0.0; 3], [1.0; 3]).unwrap_err().to_string().contains("--padding"));
    }
}
