//! Volumes as they are written: [`formats::FORMATS`] is the one table of what is.

mod body;
pub mod formats;
mod nrrd;
mod ome_xml;
mod tiff;
mod vti;
