//! What of a solved surface's topology is no more than a few spacings wide, taken away (docs/algorithms.md, "Handles and crumbs").

mod gather;
mod needs;
mod pieces;
mod removal;

pub(crate) use needs::topology_bytes;
pub use removal::{Removed, remove_small};
