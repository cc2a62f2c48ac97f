//! Pages: where they lie in a file, and how their values are read.

pub(crate) mod codec;
pub(crate) mod compression;
pub(crate) mod decode;
pub(crate) mod ifd;
pub(crate) mod page;
pub(crate) mod samples;
