//! `report.html`: a run as one page that needs nothing but itself, beside `report.json`, whose numbers it shows.
//!
//! All text goes through [`html::Html`], which escapes it; the page is well-formed XML and allows no request.

pub(crate) mod document;
pub(crate) mod evidence;
pub(crate) mod html;
mod objects;
mod picture;
mod plots;
pub(crate) mod series;
mod settings;
mod slices;
mod stages;
mod views;
mod warnings;
pub(crate) mod written;
