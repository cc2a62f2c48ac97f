//! What is solved, and in which order.

pub mod band;
pub mod distance;
pub mod evolve;
pub mod image_terms;
pub mod ingest;
pub mod intensity;
pub mod marks;
pub mod pyramid;
pub mod segment;
pub mod surface;
pub mod tagging;
