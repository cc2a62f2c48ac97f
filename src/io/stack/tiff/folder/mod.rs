//! Folders of slices, one file a plane.

pub(crate) mod names;
pub(crate) mod sequence;
pub(crate) mod slices;
