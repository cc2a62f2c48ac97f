//! Distances that cannot be computed, refused before anything is: settings that contradict each other, grids with too
//! many bricks, lengths that the type of the field cannot hold.

use super::{DistanceSettings, Init, Schedule, Solver, Textbook};
use crate::error::{Error, Result};
use crate::grid::digits::{grouped, number};
use crate::grid::{BrickGrid, DataSets, Geometry, Slot};
use crate::kernel::distance::seeding::outside::count_outside;
use crate::kernel::distance::state::neighbours::Neighbours;
use crate::kernel::distance::state::precision::Precision;
use crate::pipeline::limits::check_brick;

impl DistanceSettings {
    /// Refuses settings that make no sense, alone or together.
    ///
    /// # Errors
    /// With the setting, and what to give instead.
    pub fn check(&self) -> Result<()> {
        self.check_order()?;
        if let Schedule::Sweep { iterations } = self.schedule {
            check_iterations(iterations)?;
        }
        if let Some(far) = self.farthest.filter(|d| !(d.is_finite() && *d > 0.0)) {
            return Err(Error::usage(format!("--max-distance is {far}; give a length, more than 0")));
        }
        check_brick(self.brick)
    }

    /// Refuses what a method cannot do in the order that was asked for.
    pub(super) fn check_order(&self) -> Result<()> {
        let row = self.method.solver::<f32>();
        let sweeps = self.schedule != Schedule::Front;
        if self.neighbours == Neighbours::All && !row.takes_all_neighbours {
            return Err(Error::usage(format!("--method {} looks at 6 neighbours; leave --neighbours out", row.name)));
        }
        if sweeps && self.neighbours == Neighbours::All && row.textbook == Textbook::Sweeps {
            return Err(Error::usage("sweeps by bricks cannot keep the order of 26 neighbours; leave --schedule out"));
        }
        if self.exact && (sweeps || self.neighbours == Neighbours::All || self.init != Init::Cell) {
            return Err(Error::usage("exact distances need no method; leave --schedule, --neighbours and --init out"));
        }
        if self.timed {
            self.check_timed(row)?;
        }
        if sweeps && self.farthest.is_some() {
            return Err(Error::usage("--max-distance needs --schedule front; leave one of the two out"));
        }
        Ok(())
    }

    /// Refuses what cannot be had of times through an image of speeds.
    fn check_timed(&self, row: Solver<f32>) -> Result<()> {
        let words = if self.exact {
            "--exact measures straight ways, which a front at many speeds does not take; leave --exact or --speed out"
                .into()
        } else if row.tracks_sources() {
            format!(
                "--method {} measures straight ways, which a front at many speeds does not take; with --speed give fsm or fmm",
                row.name
            )
        } else if self.signed {
            "times through an image have no sign; leave --signed or --speed out".into()
        } else if self.init == Init::Contiguous {
            "--init contiguous fixes voxels far from the points as if the speed were the same on the way; with --speed leave it out"
                .into()
        } else {
            return Ok(());
        };
        Err(Error::usage(words))
    }

    /// Refuses a grid on which these settings cannot be computed for fields stored as `P`: too many bricks, or distances
    /// that the type cannot hold.
    ///
    /// # Errors
    /// With what does not fit, and what to give instead.
    pub fn check_on<P: Precision>(&self, geometry: &Geometry, sets: &DataSets) -> Result<()> {
        check_range::<P>(geometry, sets)?;
        let bricks = BrickGrid::new(geometry.shape, self.brick).len();
        if bricks < u64::from(Slot::MAX) {
            return Ok(());
        }
        Err(Error::usage(format!(
            "a grid of {} voxels falls into {} bricks, more than can be numbered; give a larger --brick or a coarser \
             grid",
            grouped(geometry.domain().volume()),
            grouped(bricks)
        )))
    }
}

/// Refuses no iterations at all.
///
/// # Errors
/// For 0.
pub fn check_iterations(iterations: u32) -> Result<()> {
    if iterations == 0 {
        return Err(Error::usage("--iterations is 0; give 1 or more"));
    }
    Ok(())
}

/// What is said of sources that have no inside where signs are asked for: points, or label volumes.
#[must_use]
pub fn without_inside(what: &str) -> Error {
    Error::input(format!("holds {what}, which have no inside here; --signed needs triangle meshes"))
}

/// Refuses an image of speeds that lies on another grid than the times.
pub(super) fn check_shape(image: [i64; 3], geometry: &Geometry) -> Result<()> {
    if image == geometry.shape {
        return Ok(());
    }
    let told = |[x, y, z]: [i64; 3]| format!("{x} x {y} x {z}");
    Err(Error::usage(format!(
        "the image of speeds has {} voxels (x, y, z), and the grid of the times {}; both must have the same, so leave the grid out \
         or give that of the image",
        told(image),
        told(geometry.shape)
    )))
}

/// Refuses sources to which a way through an image of speeds has no closest point.
///
/// # Errors
/// Where the closest points of triangles are wanted.
pub fn check_timed_sources(settings: &DistanceSettings, sets: &DataSets) -> Result<()> {
    if settings.timed && settings.closest_point && !sets.mesh.is_empty() {
        return Err(Error::usage(
            "--closest-point tells where a triangle is nearest as the crow flies, not where a front came from; with --speed and \
             meshes leave it out",
        ));
    }
    Ok(())
}

/// Says how many sources lie outside of the grid: it may not be where it was meant to be. `timed` as in the settings.
#[must_use]
pub fn outside_note(geometry: &Geometry, sets: &DataSets, timed: bool) -> Option<String> {
    let (outside, all) = (count_outside(geometry, sets), sets.len() as u64);
    let which = match outside {
        0 => return None,
        1 if all == 1 => "the only source lies outside of the grid or reaches".into(),
        _ if outside == all => format!("all {} sources lie outside of the grid or reach", grouped(all)),
        1 => format!("1 of {} sources lies outside of the grid or reaches", grouped(all)),
        _ => format!("{} of {} sources lie outside of the grid or reach", grouped(outside), grouped(all)),
    };
    if timed {
        return Some(format!(
            "{which} out of it, where no speed is known; what of them is outside counts for nothing (--origin and --image-spacing \
             say where the image lies)"
        ));
    }
    Some(format!(
        "{which} out of it; such sources count like all others (--origin, --shape and --spacing say where it lies)"
    ))
}

/// How far a voxel may be from the nearest source where all of them lie outside: half of the grid's diagonal more than its
/// middle is.
fn farthest_outside(geometry: &Geometry, sets: &DataSets, diagonal: f64) -> f64 {
    let [lo, hi] = [geometry.position([0; 3]), geometry.position(geometry.shape.map(|n| n - 1))];
    let middle: [f64; 3] = std::array::from_fn(|a| f64::midpoint(lo[a], hi[a]));
    let away = |p: &[f64; 3]| (0..3).map(|a| (p[a] - middle[a]).powi(2)).sum::<f64>();
    let corners = (0..sets.mesh.len()).map(|n| sets.mesh.corners(n)[0]);
    let nearest = sets.positions.iter().copied().chain(corners).map(|p| away(&p)).fold(f64::INFINITY, f64::min);
    nearest.sqrt() + 0.5 * diagonal
}

/// Refuses distances that the type cannot hold.
fn check_range<P: Precision>(geometry: &Geometry, sets: &DataSets) -> Result<()> {
    let diagonal = (0..3).map(|a| (geometry.shape[a] as f64 * geometry.spacing[a]).powi(2)).sum::<f64>().sqrt();
    let is_outside = count_outside(geometry, sets) > 0;
    let diagonal = if is_outside { diagonal.max(farthest_outside(geometry, sets, diagonal)) } else { diagonal };
    let smallest = geometry.min_spacing();
    // Below 2^-14 half precision loses digits.
    if diagonal < P::MAX && smallest > P::LEAST {
        return Ok(());
    }
    Err(Error::usage(format!(
        "distances from {} to {} do not fit --precision {}; choose a wider one, or another unit of length",
        number(smallest),
        number(diagonal),
        P::TYPE.name()
    )))
}
