//! Shapes, files and slow plain references that several tests share.

pub(crate) mod python;
