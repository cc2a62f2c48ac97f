//! What a voxel holds and which neighbours it looks at: the contract between methods and schedules, and its numbers.

pub mod method;
pub mod neighbours;
pub mod precision;
pub mod source;
