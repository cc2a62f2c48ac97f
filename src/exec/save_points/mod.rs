//! What a run puts by of what it has solved: when (`points`), what a run after it finds of that (`saved`), and
//! whose it is on several ranks (`shared`). `ending` is for tests.

#[cfg(test)]
pub(crate) mod ending;
mod points;
mod saved;
mod shared;

pub(super) use points::By;
pub use points::{SavePoint, SavePoints};
pub use saved::Saved;
pub use shared::share_checkpoints;
