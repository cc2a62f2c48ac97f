//! A cloud with normals, and what they are good for: sides where no inside is told, and surfaces that end where the points do.

pub(super) mod oriented;
pub(super) mod sided;
mod trimming;
