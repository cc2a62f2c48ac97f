//! Objects with outlines: the shape that these stand for, what the image says of it, and the start from both.

pub(crate) mod cross_validate;
pub(crate) mod outlines;
pub(crate) mod shape_field;
pub(crate) mod shape_start;
pub(crate) mod speed;
pub(crate) mod survey;
