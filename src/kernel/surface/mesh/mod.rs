//! Triangles as they pass: joined, counted, measured, looked up.

pub(crate) mod clustering;
pub(crate) mod components;
pub(crate) mod edge_tally;
pub(crate) mod growing;
pub(crate) mod key_hash;
pub(crate) mod measure;
pub(crate) mod nearest;
pub(crate) mod patch;
mod quadric;
pub(crate) mod spread;
pub(crate) mod vertex_key;
pub(crate) mod weld;
