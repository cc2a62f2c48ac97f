//! Fields on their way into the store.

pub(crate) mod drawn;
pub mod pyramid;
