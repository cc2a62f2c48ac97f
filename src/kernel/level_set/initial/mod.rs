//! Where the level set starts: what a cloud encloses, told from its distance.

pub mod ascent;
pub mod ball;
pub mod basins;
pub mod contacts;
pub mod flood;
pub mod persistence;
pub mod pocket;
pub mod spaces;
pub mod start;
