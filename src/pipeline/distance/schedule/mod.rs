//! In which order the bricks of a distance are relaxed, and how sources follow.

#[cfg(test)]
mod ended;
pub(crate) mod front;
pub mod passing;
pub(crate) mod sweep;
pub(crate) mod sweep_sources;
pub(crate) mod textbook;
pub(crate) mod trace;
