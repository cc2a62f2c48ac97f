//! What is solved, and in which order.

pub mod convert;
pub mod distance;
pub mod enclosure;
pub mod image;
pub mod laying;
pub mod level_set;
pub mod limits;
pub mod marks;
pub mod middle;
pub mod output;
pub mod reconstruct;
pub mod segment;
pub mod surface;
pub mod topology;
pub mod verify;
