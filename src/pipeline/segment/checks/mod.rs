//! Do the marks fit the image, and may they be meant otherwise?

pub(crate) mod all_marks;
pub(crate) mod doubts;
pub(crate) mod lengths;
pub(crate) mod same_object;
