//! The label volume on its way into a store: while objects are still solved, or at the end.

pub(super) mod early;
mod image;
pub(super) mod write;
