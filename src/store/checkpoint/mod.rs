//! Checkpoints: what a run has solved so far, kept in a folder of files so that a run after it goes on from there with the same
//! bits.
//!
//! ```text
//! DIR/strandline.lock         held by the run that works in the folder
//! DIR/000007.checkpoint       a manifest: who made it, and its entries (record)
//! DIR/000006-0.bricks         the bricks of a field (payload); manifests that follow each other share those that did not change
//! DIR/000005-17.shard         a second name (hard link) of a file of the output that is whole
//! ```
//!
//! An entry is one stage: what it knows, packed, the fields that it works on, and what it has written of the output. Everything is
//! written beside, flushed and renamed, never in place; the last two manifests are kept with what they name. A torn one is known
//! by its checksums, and the one before is taken; what files of the output hold is looked at by the stage, which knows their
//! checksums.
//!
//! Each rank of several has manifests and files of its own in the same folder. What all ranks work on they put by together, at places
//! that all of them reach; what one has solved by itself it puts by when it likes. A later run, on any number of ranks, goes on from
//! the last that all had put by together, with what each has added since.

mod folder;
mod identity;
mod last_whole;
mod links;
mod lock;
mod manifest;
mod names;
mod payload;
mod put;
mod record;

pub use folder::{Checkpoints, Found, Kept, KeptPart, Shared, Taken};
pub use identity::{Identity, difference};
pub use links::Linked;
pub use payload::{SavedField, SomeBricks, restore};
pub use record::{pack, unpack};
