//! Where results go: names that are checked, room on the disk, files that appear when they are whole.

pub(crate) mod checks;
pub(crate) mod drawing;
pub(crate) mod files;
pub(crate) mod store;
pub(crate) mod survival;
