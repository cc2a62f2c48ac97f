//! What a run puts by of what it has solved: when (`points`), and what a run after it finds of that (`saved`). `ending` is for tests.

#[cfg(test)]
pub(crate) mod ending;
mod points;
mod saved;

pub(super) use points::By;
pub use points::{SavePoint, SavePoints};
pub use saved::Saved;
