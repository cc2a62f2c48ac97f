//! strandline finds surfaces in 3-D volumes larger than memory.
#![cfg_attr(test, allow(clippy::disallowed_methods))]
pub mod cli;
pub mod error;
pub mod exec;
pub mod grid;
pub mod io;
pub mod kernel;
pub mod pipeline;
pub mod store;
pub mod tile;
