//! The semi-implicit co-volume scheme on one cell: gradients, coefficients, the linear system and its solver.

pub mod border;
pub(crate) mod coefficients;
pub mod covolume;
pub mod gradients;
pub mod mask;
pub mod sor;
pub mod system;
pub mod velocity;
