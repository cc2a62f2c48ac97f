//! Outlines in their planes: smooth closed curves through noisy marks, and what they enclose.

pub mod chords;
pub mod crossing;
pub mod curve;
pub mod marked;
pub mod noise;
pub mod plane;
pub mod section;
