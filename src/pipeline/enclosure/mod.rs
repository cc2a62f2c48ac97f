//! What a cloud encloses, and the region in which its surface is sought.

mod facing;
pub(crate) mod far_regions;
mod found;
pub mod near;
pub(crate) mod needs;
pub(crate) mod pockets;
pub mod region;
mod resumed;
pub mod search;
pub(crate) mod sheets;
pub mod tagging;
pub mod watershed;
