//! The list of jobs: as it is written, and the items that it means.

mod flags;
pub(crate) mod init;
pub(crate) mod items;
pub(crate) mod manifest;
pub(crate) mod problems;

pub(crate) use flags::Kind;
