//! A solved distance as it is read: repaired, told from which side, measured, and put into images.

pub(crate) mod early;
pub(crate) mod field;
pub(crate) mod found;
pub(crate) mod images;
pub(crate) mod kept;
pub(crate) mod reading;
pub(crate) mod repair;
pub(crate) mod tile;
pub(crate) mod visit;
pub(crate) mod within;
