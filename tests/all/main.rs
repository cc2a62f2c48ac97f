//! The integration suite: one binary, so that it links once.
#![allow(missing_docs)]

#[path = "../common/mod.rs"]
mod common;
mod zarr_readers;
