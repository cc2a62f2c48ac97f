//! Volumes whose voxels lie one after the other in a file, x fastest, behind a header of text: NRRD and VTI.

pub(crate) mod nrrd;
mod nrrd_fields;
mod planes;
pub(crate) mod vti;
