//! The image of `--speed`: opened, and the grid that it gives or has to agree with.

use std::path::Path;

use super::image::{chosen_notes, open_volume};
use crate::cli::args::grid::GridArgs;
use crate::cli::terminal::text::triple;
use crate::error::{Error, Result};
use crate::grid::Geometry;
use crate::io::stack::volume::Stack;

/// Spacings that differ by no more are the same: files hold them rounded.
const ROUNDING: f64 = 1e-5;

/// Opens an image of speeds; with it comes the grid of the times, that of the image where none is `given`. Adds what the user
/// should know to `notes`.
pub(crate) fn open_speed(
    path: &Path,
    args: &GridArgs,
    given: Option<Geometry>,
    notes: &mut Vec<String>,
) -> Result<(Box<dyn Stack>, Geometry)> {
    if args.filled.padding.is_some() {
        return Err(Error::usage(
            "--padding lays a grid around the sources, and --speed gives one; leave one of them out",
        ));
    }
    let select = args.volume.select();
    let open = open_volume(path, select, args.image_spacing)?;
    let image = open.geometry;
    let asked = given.as_ref().map(|grid| grid.spacing).or(args.spacing);
    if let Some(spacing) = asked {
        let differs = |a: usize| !open.guessed[a] && (spacing[a] - image.spacing[a]).abs() > ROUNDING * spacing[a];
        if (0..3).any(differs) {
            return Err(Error::usage(format!(
                "has the spacing {}, and the grid that was asked for {}; leave the grid out, or give --image-spacing where the file \
                 is wrong",
                triple(image.spacing),
                triple(spacing)
            ))
            .at(path));
        }
    }
    if let Some(grid) = given.as_ref().filter(|grid| grid.shape != image.shape) {
        let told = |[x, y, z]: [i64; 3]| format!("{x} x {y} x {z}");
        return Err(Error::usage(format!(
            "has {} voxels (x, y, z), and the grid that was asked for {}; times need a speed for each voxel, so leave the grid out",
            told(image.shape),
            told(grid.shape)
        ))
        .at(path));
    }
    // Of a spacing that the user told none was guessed.
    notes.extend(open.notes.into_iter().filter(|note| asked.is_none() || !note.contains("--image-spacing")));
    notes.extend(chosen_notes(path, open.stack.info(), select));
    let grid = match given {
        Some(grid) => Geometry { unit: grid.unit.or(image.unit), ..grid },
        None => Geometry { spacing: args.spacing.unwrap_or(image.spacing), ..image },
    };
    Ok((open.stack, grid))
}
