//! Which tiles are computed, when and where: the halo, the schedules, the one loop over bricks, the memory budget.
//! The only threads of the crate.

mod budget;
mod cancel;
mod comm;
mod engine;
mod halo;
mod progress;
mod schedule;

pub use budget::{Budget, machine_memory, peak_resident};
pub use cancel::Cancel;
pub use comm::{Comm, SelfComm};
pub use engine::{Engine, Stage, StageReport, Workers};
pub use halo::{Boundary, HaloPlan, Reach};
pub use progress::{Progress, Silent};
pub use schedule::{checkerboard, one_wave, sweep_waves};
