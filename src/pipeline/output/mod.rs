//! Fields on their way into the store.

pub mod pyramid;
