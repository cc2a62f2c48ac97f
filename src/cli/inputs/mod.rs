//! What was typed becomes what is read: images, marks, sources, grids, settings.

pub(crate) mod agreed;
pub(crate) mod content;
pub(crate) mod grid;
pub(crate) mod identity;
pub(crate) mod image;
pub(crate) mod marks;
pub(crate) mod noted;
pub(crate) mod over_time;
pub(crate) mod settings;
pub(crate) mod sources;
pub(crate) mod speed;
pub(crate) mod typed;
