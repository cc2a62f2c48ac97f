//! The integration suite: one binary, so that it links once.
#![allow(missing_docs, clippy::disallowed_methods)]

#[path = "../common/mod.rs"]
mod common;
mod covolume;
mod distance;
mod distance_cli;
mod distance_front;
mod distance_hostile;
mod distance_limited;
mod distance_meshes;
mod distance_outside;
mod distance_outside_dense;
mod distance_papers;
mod far_coordinates;
mod flood;
mod fsm_sources;
mod fuzz;
mod gaussian;
mod heat;
mod level_set;
mod live;
mod live_series;
mod maximum_principle;
mod memory;
mod mesh_dialects;
mod mesh_faults;
mod mesh_files;
mod mesh_ply;
mod mesh_sources;
mod middle;
mod middle_labels;
mod neighbours;
mod pace;
mod point_forms;
mod points;
mod ranks;
mod ranks_jobs;
mod reconstruct;
mod reconstruct_cli;
mod reconstruct_open;
mod reconstruct_vertices;
mod surfaces;
mod travel_times;
mod triangle_distance;
mod verify;
mod watershed;
mod wavefront;

#[cfg(target_os = "linux")]
mod batch;
mod batch_told;
mod builders;
mod builders_refused;
mod citations;
mod cli;
mod clouds_cli;
mod convert;
mod label_walls;
mod layering;
mod outlines;
#[cfg(target_os = "linux")]
mod outputs;
mod report_page;
#[cfg(target_os = "linux")]
mod resume;
mod room_circles;
#[cfg(target_os = "linux")]
mod segment_notes;
#[cfg(target_os = "linux")]
mod series;
mod shell;
mod signals;
mod slice_folders;
mod terminal;
mod tiff_axes;
mod tiff_derived;
mod tiff_dialects;
mod tiff_handmade;
mod tiff_hostile;
mod tiff_levels;
mod told;
mod travel_times_cli;
mod view;
mod view_folder;
mod view_page;
mod viewer_meshes;
mod zarr_input;
mod zarr_odd;
mod zarr_readers;
