//! Grey values: their range, how often they occur.

pub mod extremes;
pub mod grey_range;
pub mod histogram;
