//! strandline finds surfaces in 3-D volumes larger than memory.
#![cfg_attr(test, allow(clippy::disallowed_methods))]

// The rooms that everything is made of. They are there for this project's own tests and measurements: what is not on the
// front page may change in any version.
#[cfg(feature = "cli")]
#[doc(hidden)]
pub mod cli;
#[doc(hidden)]
pub mod error;
#[doc(hidden)]
pub mod exec;
#[doc(hidden)]
pub mod grid;
#[doc(hidden)]
pub mod io;
#[doc(hidden)]
pub mod kernel;
#[doc(hidden)]
pub mod pipeline;
#[doc(hidden)]
pub mod store;
#[doc(hidden)]
pub mod tile;
