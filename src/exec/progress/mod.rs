//! How far a run is, and who hears of it.

pub(super) mod heard;
pub(super) mod outlook;
pub(super) mod report;
