//! The level set over the cells of a band: its start, its time loop, what moves it.

pub mod band;
pub mod evolve;
pub mod growing;
pub mod motion;
pub(crate) mod ranks;
pub mod time_loop;
