//! Objects that were solved one by one become one tissue: voxels that neighbours both claim are told apart, gaps
//! between neighbours shared out along the wall's crest, and their common faces drawn and measured.
//!
//! ```text
//! u of all objects -> survey -> nesting, contested voxels -> by depth, one label each     (survey, nesting, overlaps)
//! labels -> width of gaps -> gaps -> wall of the image -> watershed -> labels              (widths, gaps, walls, sharing)
//! labels -> one mesh with tagged faces -> areas of contact                                 (faces, table)
//! ```
//!
//! All of it goes through boxes of [`EDGE`] voxels, whatever the bricks are.

mod faces;
mod fields;
mod gaps;
mod join;
pub(crate) mod joined;
mod needs;
mod nesting;
mod overlaps;
mod sharing;
mod survey;
mod table;
mod walls;
mod widths;

pub use faces::draw as draw_faces;
pub use join::join;
pub use joined::{FillGaps, Found, Joined, Joining};
pub(super) use needs::needs;
pub(super) use table::csv;

/// Edge of the boxes that everything here is computed in.
const EDGE: i64 = 32;
