//! A server for looking at results in a browser: a page with neuroglancer, the files of a store or of another program's
//! OME-Zarr, and its meshes in a form that the page can draw. Reads only, on this machine only.
//!
//! `folder` and `ranges` hold what a request may get of a file, `shown` what lies in a folder that can be shown, `documents` and
//! `described` what is said of its images, `ready` what of it is there in a form that the page can draw, `choice` which of several stores
//! a page shows, `state` and `links` how the page and other programs are told of it, `mesh` the meshes, `page` the bundled page, `server`
//! the connections, `present` whether all of it is still there, `site` what there is at a moment, `told` what the page's line says.

mod answers;
mod choice;
mod described;
mod documents;
mod folder;
mod links;
mod listing;
mod mesh;
mod page;
mod present;
mod ranges;
mod ready;
mod server;
mod shown;
mod site;
mod state;
mod told;

pub use links::links;
pub use server::{Server, Settings};
pub use shown::Shown;
