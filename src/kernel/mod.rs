//! How one tile is computed: pure functions without threads, files or printing.

pub mod image;
