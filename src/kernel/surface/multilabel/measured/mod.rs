//! What surfaces between labels measure, as their triangles pass.

pub(crate) mod bending;
pub(crate) mod contact;
pub(crate) mod label_measures;
pub(crate) mod pairs;
