//! The surface as a mesh, with its measures: brick by brick, welded in grid order.

use super::distances::Beside;
use super::isosurface::{Isosurface, Pencil};
use crate::error::Result;
use crate::exec::{Stage, Workers, run_in_order};
use crate::grid::BrickId;
use crate::kernel::surface::{Hausdorff, Measures, Patch, Spread, SurfaceMeasure, Welder};
use crate::store::MeshSink;

/// Bricks whose patches are made in parallel before they are welded in order.
const BATCH: usize = 256;

/// Cuts what it will off a patch, and returns the area of that. What becomes of a vertex depends on its place alone, so that patches
/// beside each other stay so.
pub type Trim<'a> = dyn Fn(&mut Patch) -> f64 + Sync + 'a;

/// A surface that was drawn.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Drawn {
    /// What it measures.
    pub measures: Measures,
    /// How far its vertices lie, at most, from where u has them.
    pub moved: f64,
    /// The area that was cut off.
    pub trimmed: f64,
    /// Distances of the points from it; none without points or surface.
    pub hausdorff: Option<Hausdorff>,
    /// How many of the points are how far from it.
    pub spread: Option<Spread>,
    /// Points that are farther from it than they may be.
    pub lost_points: u64,
}

/// Sends a closed surface to `mesh`; measures it, and how far `points` lie from it, of which those beyond `lost_beyond` are
/// counted.
///
/// # Errors
/// When the sink fails or the run is interrupted.
pub fn draw(
    stage: &Stage<'_>,
    surface: &Isosurface<'_>,
    cloud: (&[[f64; 3]], f64),
    mesh: &mut dyn MeshSink,
) -> Result<Drawn> {
    draw_trimmed(stage, surface, cloud, mesh, &|_| 0.0)
}

/// The same of what `trim` leaves of the surface; how far points lie is told of all of it.
///
/// # Errors
/// As [`draw`].
pub fn draw_trimmed(
    stage: &Stage<'_>,
    surface: &Isosurface<'_>,
    (points, lost_beyond): (&[[f64; 3]], f64),
    mesh: &mut dyn MeshSink,
    trim: &Trim<'_>,
) -> Result<Drawn> {
    let beside = Beside::new(surface, points);
    let mut squared = beside.none_yet();
    let near = Some((&beside, squared.as_mut_slice()));
    let Extracted { measures, moved, trimmed } = extract_beside(stage, surface, mesh, near, trim)?;
    let distances = beside.distances(stage, &squared)?;
    let lost_points = distances.iter().flatten().filter(|&&d| d > lost_beyond).count() as u64;
    let known = || distances.iter().copied().flatten();
    Ok(Drawn { measures, moved, trimmed, hausdorff: Hausdorff::of(known()), spread: Spread::of(known()), lost_points })
}

/// Sends a closed surface to `sink` and measures it; tells how far its vertices lie, at most, from where u has them.
///
/// # Errors
/// When the sink fails or the run is interrupted.
pub fn extract(stage: &Stage<'_>, surface: &Isosurface<'_>, sink: &mut dyn MeshSink) -> Result<(Measures, f64)> {
    let Extracted { measures, moved, .. } = extract_beside(stage, surface, sink, None, &|_| 0.0)?;
    Ok((measures, moved))
}

/// What was sent.
struct Extracted {
    measures: Measures,
    /// How far its vertices lie, at most, from where u has them.
    moved: f64,
    /// The area that was cut off.
    trimmed: f64,
}

/// The same, and tells how near it comes to points.
fn extract_beside(
    stage: &Stage<'_>,
    surface: &Isosurface<'_>,
    sink: &mut dyn MeshSink,
    near: Option<(&Beside<'_>, &mut [f64])>,
    trim: &Trim<'_>,
) -> Result<Extracted> {
    let (grid, geometry) = (*surface.u.set().grid(), surface.geometry);
    let (lo, hi) = (geometry.origin, geometry.position(geometry.shape));
    let centre = std::array::from_fn(|a| 0.5 * (lo[a] + hi[a]));
    let (mut farthest, mut trimmed) = (0.0_f64, 0.0);
    let mut welder = Welder::new(geometry);
    let mut measure = SurfaceMeasure::new(centre);
    let workers = Workers::new(Pencil::new);
    // A surface may pass between a brick that is not stored and the one above it, so the bricks below stored ones
    // count.
    let bricks: Vec<BrickId> = (0..grid.len()).filter(|&id| surface.is_in(id)).collect();
    let (beside, mut squared) = near.unzip();
    let make = |pencil: &mut Pencil, &id: &BrickId| {
        let mut patch = Patch::default();
        let moved = surface.patch_of(id, pencil, &mut patch)?;
        let near = beside.map_or_else(Vec::new, |beside| beside.nearest_in(id, &patch));
        let cut = trim(&mut patch);
        Ok((patch, moved, near, cut))
    };
    run_in_order(stage, (&bricks, BATCH), &workers, make, |&id, (patch, moved, near, cut)| {
        trimmed += cut;
        if let (Some(beside), Some(squared)) = (beside, &mut squared) {
            beside.take(id, &near, squared);
        }
        farthest = farthest.max(moved);
        if let Some(kept) = welder.enter_layer(&patch) {
            measure.forget_but(&kept);
        }
        welder.add(&patch, sink)?;
        welder.triangles_of(&patch).for_each(|(corners, positions)| measure.add(corners, positions));
        Ok(())
    })?;
    Ok(Extracted { measures: measure.measures(), moved: farthest, trimmed })
}
