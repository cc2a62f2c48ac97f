//! Which tiles are computed, when and where: the halo, the schedules, the one loop over bricks, the memory budget.
//! The only threads of the crate.

mod by_itself;
mod cancel;
mod comm;
mod copies;
mod engine;
mod exchange;
mod fixed_point;
mod halo;
mod in_order;
mod memory;
mod ownership;
mod progress;
mod ranks;
mod relax;
pub(crate) mod save_points;
mod schedule;
mod shared;
mod side_by_side;
mod workers;

pub use cancel::Cancel;
pub use comm::launch::{Launched, launched};
pub use comm::messages::{Comm, Message, RankTraffic, SelfComm};
#[cfg(feature = "mpi")]
pub use comm::mpi::MpiComm;
pub use comm::records::{gather_records, join_records, pack_message, unpack_message};
pub use comm::threads::ThreadComm;
pub use comm::traffic::Counted;
pub use copies::borrow::{ROUND_BYTES, borrow_bricks, read_by_bricks, read_with_borrowed};
pub use copies::spread::spread_fields;
pub use copies::whole::{part_of, take_parts, whole_field};
pub use engine::{Engine, Stage};
pub use exchange::{Exchange, Note, tell_faces};
pub use fixed_point::{FixedPoint, relax_to_fixed_point};
pub use halo::{Boundary, HaloPlan, Reach};
pub use in_order::run_in_order;
pub use memory::budget::{Budget, machine_memory, peak_resident};
pub use memory::footprint::{Footprint, Hold, Lent};
pub use ownership::{Ownership, equal_part};
pub use progress::heard::{Progress, Silent};
pub use progress::outlook::{Outlook, Plan};
pub use progress::report::StageReport;
pub use ranks::as_threads;
pub use relax::{Place, Relax, Until, Waves};
pub use save_points::{SavePoint, SavePoints, Saved, share_checkpoints};
pub use schedule::{checkerboard, corner_colours, one_wave, sweep_waves};
pub use shared::run_shared;
pub use workers::Workers;
