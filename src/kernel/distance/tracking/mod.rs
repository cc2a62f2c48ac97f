//! Sources for methods that keep distances only, out of the finished distances.

pub mod parents;
pub mod trace;
