//! The processes that an MPI launcher has started together with this one: who they are to a run, and how it ends for all of them.

use std::path::PathBuf;
use std::sync::Arc;

use crate::cli::args::command_line::Command;
use crate::error::{Error, Result};
use crate::exec::{Comm, SelfComm, as_threads, launched};
#[cfg(feature = "mpi")]
use crate::exec::{Counted, MpiComm};
use crate::io::geometry::read::sources::is_standard_input;
use crate::job::resources::Sharing;

/// Refuses what would be done by each of several processes alike: all would write over each other's output.
///
/// # Errors
/// When a launcher has started several of this process and the command, or this build, cannot share the work out.
pub(crate) fn check(command: &Command) -> Result<()> {
    let Some(launched) = launched() else { return Ok(()) };
    let (processes, variable) = (launched.processes, launched.variable);
    let name = match command {
        Command::Batch(_) => "batch",
        Command::Demo(_) => "demo",
        Command::Convert(_) => "convert",
        Command::Distance(_) | Command::Middle(_) | Command::Reconstruct(_) | Command::Segment(_) => {
            if cfg!(feature = "mpi") {
                return Ok(());
            }
            return Err(Error::usage(format!(
                "{processes} processes were started together ({variable}), but this build knows no MPI: each would do all of the work and \
                 write over the others; build it with --features mpi, or start it once"
            )));
        }
        _ => return Ok(()),
    };
    Err(Error::usage(format!(
        "{processes} processes were started together ({variable}), but {name} runs in one: each would do all of the work and write over \
         the others; start it once, without mpirun, or unset {variable}"
    )))
}

/// How many of the processes share this machine.
pub(crate) fn on_this_machine() -> usize {
    launched().map_or(1, |launched| launched.on_this_machine)
}

/// How many ranks run a job that is given so many in this process; MPI need not be begun to know that.
pub(crate) fn number(in_process: usize) -> usize {
    launched().map_or(1, |launched| launched.processes).max(in_process)
}

/// How ranks share this machine, of which so many are threads of this process.
pub(crate) fn sharing(in_process: usize) -> Sharing {
    let machine = on_this_machine();
    Sharing { machine, process: if machine > 1 { 1 } else { in_process } }
}

#[cfg(feature = "mpi")]
static WORLD: std::sync::OnceLock<Arc<MpiComm>> = std::sync::OnceLock::new();

/// The ranks of this run: the processes of an MPI program, or this process alone.
///
/// # Errors
/// When MPI cannot be begun.
#[cfg_attr(not(feature = "mpi"), expect(clippy::unnecessary_wraps, reason = "MPI may fail"))]
pub(crate) fn ranks() -> Result<Arc<dyn Comm>> {
    #[cfg(feature = "mpi")]
    if let Some(launched) = launched() {
        let world = Arc::new(MpiComm::begin()?);
        if world.ranks() != launched.processes {
            return Err(Error::failed(format!(
                "{} processes were started together ({}), but MPI knows of {}: the program was built for another MPI than the one \
                 that has started it",
                launched.processes,
                launched.variable,
                world.ranks()
            )));
        }
        return Ok(Arc::new(Counted::new(WORLD.get_or_init(|| world).clone())));
    }
    Ok(Arc::new(SelfComm))
}

/// Runs a job on all ranks: as the one of them that this process is, or as so many threads of it. Of its inputs none may be one that only one
/// rank can read.
///
/// # Errors
/// Of the job, and when MPI cannot be begun.
pub(crate) fn on_ranks(
    in_process: usize,
    inputs: &[PathBuf],
    job: impl Fn(Arc<dyn Comm>) -> Result<()> + Sync,
) -> Result<()> {
    if number(in_process) > 1 && inputs.iter().any(|path| is_standard_input(path)) {
        return Err(Error::usage("several ranks cannot read standard input; give files that all of them can read"));
    }
    let comm = ranks()?;
    if in_process == 1 || comm.ranks() > 1 { job(comm) } else { as_threads(in_process, job).map(drop) }
}

/// What ends one rank often ends all, and the first says it for them: the others wait a moment, in which it ends them too.
pub(crate) fn give_way() {
    #[cfg(feature = "mpi")]
    if WORLD.get().is_some_and(|world| world.rank() > 0) {
        std::thread::sleep(std::time::Duration::from_secs(4));
    }
}

/// Leaves the other processes at the end of a run: in order where it succeeded, else all of them end with this one's exit code.
#[cfg(feature = "mpi")]
pub(crate) fn leave(code: u8) {
    match WORLD.get() {
        Some(world) if code == 0 => world.end(),
        Some(world) => {
            world.abort(i32::from(code));
            // The launcher ends this process too.
            std::thread::sleep(std::time::Duration::from_secs(10));
        }
        None => {}
    }
}

/// There are no others.
#[cfg(not(feature = "mpi"))]
pub(crate) fn leave(_code: u8) {}
