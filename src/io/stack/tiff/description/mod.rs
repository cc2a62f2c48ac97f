//! What a file says of its pages: the descriptions that programs write into the first one.

pub(crate) mod imagej;
pub(crate) mod layout;
pub(crate) mod ome_xml;
pub(crate) mod shaped;
