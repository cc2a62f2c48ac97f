//! Pictures of slices and of surfaces.

pub mod camera;
pub mod dots;
pub mod field;
pub mod palette;
pub mod panel;
pub mod ramp;
pub mod shading;
pub mod z_buffer;
