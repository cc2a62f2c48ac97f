//! What is connected to what.

pub mod union_find;
