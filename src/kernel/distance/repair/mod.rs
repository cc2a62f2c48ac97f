//! Sources of a finished field that a method missed, found where its distance bends.

pub mod bends;
pub(crate) mod descent;
pub(crate) mod distinct;
pub(crate) mod label_borders;
pub(crate) mod repair_box;
