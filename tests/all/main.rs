//! The integration suite: one binary, so that it links once.
#![allow(missing_docs)]

#[path = "../common/mod.rs"]
mod common;
mod covolume;
mod distance;
mod flood;
mod heat;
mod level_set;
mod maximum_principle;
mod mesh_ply;
mod mesh_sources;
mod points;
mod ranks;
mod surfaces;
mod triangle_distance;

mod cli;
mod layering;
mod tiff_derived;
mod tiff_handmade;
mod tiff_hostile;
mod zarr_readers;
