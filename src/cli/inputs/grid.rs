//! The grid of a distance: as typed, like an image, or around the sources.

use super::image::open_stack;
use crate::cli::args::grid::GridArgs;
use crate::error::Result;
use crate::grid::Geometry;
use crate::pipeline::laying;
use crate::pipeline::laying::{check_grid, check_spacing};

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
        (Some(shape), Some(origin), Some(spacing)) => {
            let geometry = Geometry { shape, spacing, origin, unit: None };
            check_grid(&geometry)?;
            Ok(Some(geometry))
        }
        _ => Ok(None),
    }
}

/// The grid that was asked for; `bounds` is the box of all sources. Adds what the user should know to `notes`.
pub(crate) fn asked_grid(args: &GridArgs, bounds: ([f64; 3], [f64; 3]), notes: &mut Vec<String>) -> Result<Geometry> {
    given(args, notes)?.map_or_else(|| around(args, bounds), Ok)
}

/// The grid around sources, of which `bounds` is the box.
pub(crate) fn around(args: &GridArgs, (low, high): ([f64; 3], [f64; 3])) -> Result<Geometry> {
    laying::around([low, high], args.spacing, args.filled.padding)
}

impl GridArgs {
    /// Whether anything was said of where the grid lies.
    pub(crate) fn is_asked_for(&self) -> bool {
        self.spacing.is_some() || self.filled.is_given() || self.like.is_some()
    }
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
