//! Files in and out: one format a file.

pub mod tiff_stack;
