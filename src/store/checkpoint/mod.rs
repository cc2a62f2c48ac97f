//! Checkpoints: what a run has solved so far, kept in a folder of files so that a run after it goes on from there with the same
//! bits.
//!
//! ```text
//! DIR/strandline.lock         held by the run that works in the folder
//! DIR/000007.checkpoint       a manifest: who made it, and its entries (record)
//! DIR/000006-0.bricks         the bricks of a field (payload); manifests that follow each other share those that did not change
//! ```
//!
//! An entry is one stage: what it knows, packed, and the fields that it works on. Everything is written beside, flushed and
//! renamed, never in place; the last two manifests are kept with what they name. A torn one is known by its checksums, and the
//! one before is taken.

mod folder;
mod identity;
mod lock;
mod payload;
mod record;

pub use folder::{Checkpoints, Found};
pub use identity::{Identity, difference};
pub use payload::{SavedField, restore};
pub use record::{pack, unpack};
