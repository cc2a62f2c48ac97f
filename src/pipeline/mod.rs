//! What is solved, and in which order.

pub mod band;
mod cell_needs;
pub mod distance;
pub mod enclosure;
pub mod evolve;
mod evolve_ranks;
mod far_regions;
mod heat_step;
pub mod image_terms;
pub mod ingest;
pub mod intensity;
pub mod label_borders;
pub mod marks;
pub mod middle;
pub mod motion;
mod pockets;
pub mod pyramid;
pub mod reconstruct;
pub mod segment;
mod sheets;
pub mod smoothing;
pub mod surface;
pub mod tagging;
pub mod value_range;
pub mod vicinity;
pub mod watershed;
