//! What is told after a run: report, tables, pictures.

pub(crate) mod csv;
pub(crate) mod distance;
pub(crate) mod lines;
pub(crate) mod neighbours;
pub(crate) mod page;
pub(crate) mod picture;
pub(crate) mod ranks;
pub(crate) mod reconstruction;
pub(crate) mod run_report;
pub(crate) mod series;
pub(crate) mod settings;
pub(crate) mod table;
pub(crate) mod walls;
