//! How ranks talk to each other: what they say (`messages`), as threads of one process (`threads`), as processes of an MPI
//! program (`mpi`), the records among it (`records`), what is counted of it (`traffic`), and how a process knows that it is one of several (`launch`).

pub(super) mod launch;
pub(super) mod messages;
#[cfg(feature = "mpi")]
pub(super) mod mpi;
pub(super) mod records;
pub(super) mod threads;
pub(super) mod traffic;
