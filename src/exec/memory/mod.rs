//! The memory that a run may take, and what a job says that it does.

pub(super) mod budget;
pub(super) mod footprint;
