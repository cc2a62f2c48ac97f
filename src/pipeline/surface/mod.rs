//! The surface u = 1/2 of a solved band as a mesh: `isosurface` (its piece in the cells of a brick), `drawing` (all pieces, welded in grid
//! order, and what they measure), `distances` (how far points lie
//! from it: from what passes beside them, `patch_distance`, or farther away, `shells`).

mod distances;
mod drawing;
mod isosurface;
mod patch_distance;
mod shells;

pub use distances::distances_to;
pub use drawing::{Drawn, Trim, draw, draw_trimmed, extract};
pub use isosurface::{Isosurface, Placement, read_padded};
