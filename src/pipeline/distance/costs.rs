//! What the kernels of each method take for a tile, by schedule: those of points and of triangles, whichever takes more.

use super::Schedule;
use crate::kernel::distance::methods::dijkstra_pythagoras::DijkstraPythagoras;
use crate::kernel::distance::methods::fast_marching::FastMarching;
use crate::kernel::distance::methods::fast_sweeping::FastSweeping;
use crate::kernel::distance::methods::shape_distance::ShapeDistance;
use crate::kernel::distance::methods::vector_distance::VectorDistance;
use crate::kernel::distance::state::method::DistanceMethod;
use crate::kernel::distance::state::precision::Precision;
use crate::tile::TileCost;

pub(super) fn fast_sweeping<P: Precision>(edge: usize, schedule: Schedule) -> TileCost {
    match schedule {
        Schedule::Front => FastSweeping::<P, P::Fast>::cost(edge),
        Schedule::Sweep { .. } => FastSweeping::<P, f64>::cost(edge),
    }
}

pub(super) fn vector_distance<P: Precision>(edge: usize, schedule: Schedule) -> TileCost {
    let of_points = match schedule {
        Schedule::Front => VectorDistance::<P::Fast>::cost(edge),
        Schedule::Sweep { .. } => VectorDistance::<f64>::cost(edge),
    };
    of_points.or(ShapeDistance::cost(edge))
}

/// One heap over the whole volume works in no tiles.
const NO_TILES: TileCost = TileCost { halo: 0, scratch: 0 };

pub(super) fn fast_marching<P: Precision>(edge: usize, schedule: Schedule) -> TileCost {
    match schedule {
        Schedule::Front => FastMarching::<P, P::Fast>::cost(edge),
        Schedule::Sweep { .. } => NO_TILES,
    }
}

pub(super) fn dijkstra_pythagoras<P: Precision>(edge: usize, schedule: Schedule) -> TileCost {
    match schedule {
        Schedule::Front => {
            let of_points = DijkstraPythagoras::<VectorDistance<'_, P::Fast>>::cost(edge);
            of_points.or(DijkstraPythagoras::<ShapeDistance<'_>>::cost(edge))
        }
        Schedule::Sweep { .. } => NO_TILES,
    }
}

/// Of methods that go through an image of speeds, in whichever order.
pub(super) fn timed(edge: usize) -> u64 {
    FastSweeping::<f64, f64, true>::cost(edge).or(FastMarching::<f64, f64, true>::cost(edge)).bytes::<f64>(edge)
}
