//! The level set equation `u_t + v . grad u - delta |grad u| div(grad u / |grad u|) = 0` on one cell.
//!
//! A *cell* is a box of [`CELL`]^3 voxels of the grid: the unit on which the band is stored, solved and judged, the
//! same whatever the brick size. Source: Kósa 2015, chapter 3; Kósa PhD, chapter 3 (docs/algorithms.md, "The level
//! set").

pub mod ascent;
pub mod ball;
pub mod basins;
pub mod border;
pub(crate) mod coefficients;
pub mod contacts;
pub mod covolume;
pub mod flood;
pub mod gradients;
pub mod mask;
pub mod persistence;
pub mod pocket;
pub mod scheme;
pub mod sor;
pub mod spaces;
pub mod start;
pub mod velocity;

/// Voxels along the edge of a cell.
pub const CELL: usize = 16;
/// Voxels of a cell.
pub const CELL_LEN: usize = CELL * CELL * CELL;
/// Voxels along the edge of a cell grown by its halo.
pub(crate) const GROWN: usize = CELL + 2;
/// Voxels of one plane of the grown cell.
pub(crate) const PLANE: usize = GROWN * GROWN;
/// Voxels of a plane of the cell, its rows at the grown cell's pitch, and one vector.
pub(crate) const FLAT: usize = CELL * GROWN + CELL;
/// Voxels of the grown cell.
pub(crate) const GROWN_LEN: usize = GROWN * PLANE;
