//! The table of distance methods. A method is one file in `kernel::distance::methods` and one row here; the command line, its
//! help and the shared tests pick it up from the table.

use super::Schedule;
use super::costs;
use super::readout::field::Solved;
use super::solving::{Solving, dijkstra_pythagoras, fast_marching, fast_sweeping, vector_distance};
use crate::error::Result;
use crate::grid::BrickGrid;
use crate::kernel::distance::state::precision::Precision;
use crate::kernel::distance::whole_volume::{dijkstra_heap, marching_heap};
use crate::tile::TileCost;

/// Solves on the bricks of a set, by a schedule.
pub(super) type Solve<P> = for<'a> fn(&Solving<'_, 'a, P>, Schedule) -> Result<Solved<'a, P>>;

/// The order of `--schedule sweep`: that of the textbook.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Textbook {
    /// Ordered sweeps, brick by brick.
    Sweeps,
    /// One heap over the whole volume in memory.
    Heap {
        /// Bytes of memory for each voxel.
        bytes: u64,
    },
}

/// One row of the table, for fields stored as `P`.
#[derive(Clone, Copy, Debug)]
pub struct Solver<P> {
    /// What `--method` calls it.
    pub name: &'static str,
    /// One line for the help.
    pub about: &'static str,
    /// The order in which a textbook does it.
    pub textbook: Textbook,
    /// Whether it can look at all 26 neighbours.
    pub takes_all_neighbours: bool,
    /// Edge of bricks that it is fastest with on large grids.
    pub brick: i64,
    /// Seconds for a voxel on one thread, with `front`.
    pub seconds: f64,
    /// Bytes of a voxel's state.
    pub state_bytes: u64,
    /// Bytes of a voxel's source, where sources are asked for and not part of the state.
    pub source_bytes: u64,
    /// What a thread takes for a brick of an edge, whether sources are points or triangles.
    pub cost: fn(usize, Schedule) -> TileCost,
    /// Does it.
    pub solve: Solve<P>,
}

/// Edge of the bricks of grids that are too small or too thin for larger ones.
const SMALL_BRICK: i64 = 32;
/// Fewer bricks than this are a small grid: what a brick at its border stores beyond it, and that a thread waits for
/// the last brick of a wave, then cost more than larger bricks save.
const FEWEST_BRICKS: u64 = 512;

impl<P> Solver<P> {
    /// Whether a voxel's state is its nearest source, from which the distance follows.
    #[must_use]
    pub fn tracks_sources(&self) -> bool {
        self.source_bytes == 0
    }

    /// Edge of the bricks that a grid is cut into where nobody asks for another. It follows from the shape alone, so
    /// that a run can be repeated on another machine.
    #[must_use]
    pub fn brick_for(&self, shape: [i64; 3]) -> i64 {
        let bricks = |edge| BrickGrid::new(shape, edge).len();
        let stored = |edge: i64| bricks(edge) as f64 * edge.pow(3) as f64;
        // Thin grids: larger bricks would stick out of them by a quarter more.
        let sticks_out = stored(self.brick) > 1.25 * stored(SMALL_BRICK);
        if bricks(self.brick) < FEWEST_BRICKS || sticks_out { self.brick.min(SMALL_BRICK) } else { self.brick }
    }
}

/// The distance methods, in the order in which the help lists them.
#[must_use]
pub const fn solvers<P: Precision>() -> [Solver<P>; 4] {
    [
        Solver {
            name: "fsm",
            about: "fast sweeping, the Eikonal equation",
            textbook: Textbook::Sweeps,
            takes_all_neighbours: false,
            brick: 64,
            seconds: 25e-9,
            state_bytes: size_of::<P>() as u64,
            source_bytes: 4,
            cost: costs::fast_sweeping::<P>,
            solve: fast_sweeping::<P>,
        },
        Solver {
            name: "vdt",
            about: "vector distance transform, Euclidean to a tracked source",
            textbook: Textbook::Sweeps,
            takes_all_neighbours: true,
            brick: 32,
            seconds: 30e-9,
            state_bytes: 4,
            source_bytes: 0,
            cost: costs::vector_distance::<P>,
            solve: vector_distance::<P>,
        },
        Solver {
            name: "fmm",
            about: "fast marching, the Eikonal equation",
            textbook: Textbook::Heap { bytes: size_of::<P>() as u64 + 4 + marching_heap::SCRATCH_BYTES },
            takes_all_neighbours: false,
            brick: 32,
            seconds: 55e-9,
            state_bytes: size_of::<P>() as u64,
            source_bytes: 4,
            cost: costs::fast_marching::<P>,
            solve: fast_marching::<P>,
        },
        Solver {
            name: "dp",
            about: "Dijkstra-Pythagoras, Euclidean to a tracked source",
            textbook: Textbook::Heap { bytes: 4 + dijkstra_heap::SCRATCH_BYTES },
            takes_all_neighbours: true,
            brick: 32,
            seconds: 45e-9,
            state_bytes: 4,
            source_bytes: 0,
            cost: costs::dijkstra_pythagoras::<P>,
            solve: dijkstra_pythagoras::<P>,
        },
    ]
}

/// The methods for fields in f32.
pub const SOLVERS: &[Solver<f32>] = &solvers();

/// A method of the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Method(usize);

impl Method {
    /// Fast sweeping.
    pub const FSM: Self = Self(0);
    /// The vector distance transform.
    pub const VDT: Self = Self(1);
    /// Fast marching.
    pub const FMM: Self = Self(2);
    /// Dijkstra-Pythagoras.
    pub const DP: Self = Self(3);

    /// What `--method` calls it.
    #[must_use]
    pub fn name(self) -> &'static str {
        SOLVERS[self.0].name
    }

    /// The method of that name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        SOLVERS.iter().position(|row| row.name == name).map(Self)
    }

    /// All methods.
    pub fn all() -> impl Iterator<Item = Self> {
        (0..SOLVERS.len()).map(Self)
    }

    /// Its row in the table of fields stored as `P`.
    #[must_use]
    pub fn solver<P: Precision>(self) -> Solver<P> {
        solvers()[self.0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_and_thin_grids_get_small_bricks() {
        let of = |name: &str, shape| Method::named(name).unwrap().solver::<f32>().brick_for(shape);
        for shape in [[1; 3], [145; 3], [289; 3], [397; 3], [3000, 3000, 1], [20_000, 30, 20_000], [70, 1300, 1300]] {
            assert_eq!(SOLVERS.iter().map(|row| row.brick_for(shape)).max(), Some(32), "{shape:?}");
        }
        for shape in [[577; 3], [512; 3], [2048, 2048, 1024], [1024, 20_000, 250]] {
            assert_eq!([of("fsm", shape), of("vdt", shape)], [64, 32], "{shape:?}");
        }
    }

    /// Bricks never store much more beyond the grid's border than small ones would.
    #[test]
    fn bricks_stick_out_of_no_grid_far() {
        let stored = |shape, edge| BrickGrid::new(shape, edge).len() * edge.pow(3) as u64;
        for n in 1..400 {
            let shape = [n, 3 * n + 1, 2000 / n + 5];
            for row in SOLVERS {
                let edge = row.brick_for(shape);
                assert!(4 * stored(shape, edge) <= 5 * stored(shape, 32), "{} {shape:?}: {edge}", row.name);
            }
        }
    }
}
