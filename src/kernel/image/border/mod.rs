//! Which border an image shows near an outline, and how sure that is.

pub mod border_model;
pub mod carried;
pub mod profiles;
pub mod speed;
pub mod wall;
