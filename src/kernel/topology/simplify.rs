//! Small handles, tunnels and pieces of a surface taken away: the seams of its two sides that are narrow.
//!
//! A seam of the outside closes a tunnel: its voxels become inside. A seam of the inside cuts a handle: its voxels become outside, if the
//! handle's loop is short too; a thin handle around a wide hole stays (Wood, Hoppe, Desbrun and Schröder 2004, "Removing excess topology from
//! isosurfaces", there on a mesh). Each such voxel set is a disc, and takes one handle of the surface. The narrowest go first, so that of the
//! two ways to take a handle away that one is taken that changes less. Small pieces become what is around them.

use std::collections::BTreeSet;

use super::blocks::{Blocks, Where};
use super::growth::{Grown, Order};
use super::seams::{Seam, ends_of, seams};

/// What is small.
#[derive(Clone, Debug, PartialEq)]
pub struct Small {
    /// Widths of seams, and the order in which sides are grown for them, one after the other.
    pub rounds: Vec<(f64, Order)>,
    /// Voxels of a cut through a strand or strip too thin for points of its own.
    pub thin: usize,
    /// Steps around a handle that is cut.
    pub around: u32,
    /// Steps from a cut to where a short handle has become wider.
    pub along: u32,
    /// Voxels of a piece.
    pub voxels: u64,
    /// The places of the points that the surface is that of, in order.
    pub points: Vec<usize>,
    /// A piece that has so many of them, its own voxels' and those of voxels beside it, is a body.
    pub body_points: usize,
}

/// What was taken away.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Taken {
    /// Handles that were cut.
    pub handles: u64,
    /// Tunnels that were filled.
    pub tunnels: u64,
    /// The widest cut or filling.
    pub widest: f64,
    /// Pieces and hollows that were dropped.
    pub pieces: u64,
}

/// Takes away what is small; voxels change sides in `blocks`. `check` is asked now and then whether to go on.
///
/// # Errors
/// Those of `check`.
pub fn simplify<E>(
    blocks: &mut Blocks,
    spacing: [f64; 3],
    small: &Small,
    mut check: impl FnMut() -> Result<(), E>,
) -> Result<Taken, E> {
    let mut taken = Taken::default();
    let widest = small.rounds.iter().map(|(width, _)| *width).fold(0.0, f64::max);
    for &(width, order) in &small.rounds {
        let mut left = false;
        for inside in [false, true] {
            let mut grown = Grown::new(blocks, inside, order, &mut check)?;
            let found = seams(blocks, &grown, spacing, widest);
            left |= !found.is_empty();
            let pieces = grown.small_pieces(small.voxels);
            for seam in found.into_iter().filter(|seam| seam.width <= width) {
                if blocks.holds_fixed(&seam.places) || inside && !is_short(blocks, &grown, &seam, small) {
                    continue;
                }
                let count = if inside { &mut taken.handles } else { &mut taken.tunnels };
                *count += 1;
                taken.widest = taken.widest.max(seam.width);
                blocks.put(&seam.places, !inside);
            }
            for piece in pieces {
                if blocks.holds_fixed(&piece) || inside && is_body(blocks, &piece, small) {
                    continue;
                }
                taken.pieces += 1;
                blocks.put(&piece, !inside);
            }
        }
        if !left {
            break;
        }
    }
    Ok(taken)
}

/// A handle becomes so many times as wide as it is where it is cut.
const WIDENS: usize = 2;

/// True for a handle that is cut by a seam and is thin, or leads around a narrow hole, or that is short: on both sides there is more than it would have
/// if it went on as wide as it is there.
fn is_short(blocks: &Blocks, grown: &Grown, seam: &Seam, small: &Small) -> bool {
    if seam.places.len() <= small.thin {
        return true;
    }
    let Some(ends) = ends_of(blocks, grown, seam, small.along, small.around) else { return true };
    ends.meet || ends.voxels > WIDENS * seam.places.len() * small.along as usize
}

/// True for a piece that holds points.
fn is_body(blocks: &Blocks, piece: &[usize], small: &Small) -> bool {
    let beside = |place: usize| {
        (0..27).filter_map(move |bit| match blocks.neighbour(place, bit) {
            Where::Voxel(other) => Some(other),
            Where::Room(_) => None,
        })
    };
    let around: BTreeSet<usize> = piece.iter().flat_map(|&place| beside(place)).collect();
    let until = |place: usize| small.points.partition_point(|&point| point < place);
    let points: usize = around.into_iter().map(|place| until(place + 1) - until(place)).sum();
    points >= small.body_points
}
