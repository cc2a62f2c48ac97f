//! Objects shared out to ranks: each is solved whole by one of them, and all ranks then have all objects.

pub(super) mod parts;
pub(super) mod solved;
