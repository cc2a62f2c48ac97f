//! `strandline batch`: the items of a list, each a run of the program by itself, several at a time within one limit of memory and
//! threads; and what is known of them afterwards.

pub(crate) mod asked;
pub(crate) mod child;
mod content;
pub(crate) mod list;
pub(crate) mod page;
pub(crate) mod plan;
pub(crate) mod rows;
pub(crate) mod schedule;
pub(crate) mod share;
pub(crate) mod state;
pub(crate) mod summary;
pub(crate) mod tell;
mod thumbnail;
