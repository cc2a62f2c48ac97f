//! Fields and meshes on their way into the store.

pub(crate) mod drawn;
pub mod pyramid;
pub(crate) mod saved;
pub(crate) mod share;
pub mod viewer_mesh;
