//! What was typed: the commands and their flags.

pub(crate) mod batch;
pub(crate) mod command_line;
pub(crate) mod common;
pub(crate) mod convert;
pub(crate) mod distance;
pub(crate) mod grid;
pub(crate) mod measure;
pub(crate) mod middle;
pub(crate) mod pages;
pub(crate) mod reconstruct;
pub(crate) mod survive;
pub(crate) mod times;
pub(crate) mod values;
pub(crate) mod verify;
#[cfg(feature = "viewer")]
pub(crate) mod view;
