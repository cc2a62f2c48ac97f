//! The size of a cell, the unit on which the band is stored, solved and judged.

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
