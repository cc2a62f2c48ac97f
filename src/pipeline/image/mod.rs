//! The image on its way to a level set: read into bricks, its grey values told, smoothed, its edges detected.

pub mod as_read;
pub mod follow;
pub(crate) mod heat_step;
pub mod ingest;
pub mod intensity;
pub mod smoothing;
pub mod terms;
pub mod value_range;
