//! The level set equation `u_t + v . grad u - delta |grad u| div(grad u / |grad u|) = 0` on one cell.
//!
//! A *cell* is a box of [`CELL`](cell::CELL)^3 voxels of the grid: the unit on which the band is stored, solved and judged, the
//! same whatever the brick size. Source: Kósa 2015, chapter 3; Kósa PhD, chapter 3 (docs/algorithms.md, "The level
//! set").

pub mod cell;
pub mod initial;
pub mod scheme;
