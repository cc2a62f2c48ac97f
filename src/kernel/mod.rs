//! How one tile is computed: pure functions of their input. No threads, no files, no printing.

pub mod surface;
