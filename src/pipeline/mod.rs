//! What is solved, and in which order.

pub mod band;
pub mod distance;
pub mod evolve;
pub mod tagging;
