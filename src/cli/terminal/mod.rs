//! The terminal: what is told while a run goes on, and the signals that end it.

pub(crate) mod console;
mod fault;
pub(crate) mod log;
pub(crate) mod parent;
pub(crate) mod signals;
pub(crate) mod text;
pub(crate) mod world;
