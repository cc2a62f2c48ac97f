//! The commands, one file each.

pub(crate) mod batch;
pub(crate) mod convert;
pub(crate) mod demo;
pub(crate) mod distance;
pub(crate) mod info;
pub(crate) mod info_store;
pub(crate) mod measure;
pub(crate) mod middle;
pub(crate) mod reconstruct;
pub(crate) mod segment;
pub(crate) mod shell;
pub(crate) mod store_contents;
pub(crate) mod verify;
#[cfg(feature = "viewer")]
pub(crate) mod view;
pub(crate) mod walls;
