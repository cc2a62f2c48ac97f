//! What a run may use: memory, threads, a folder for temporary fields.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread::available_parallelism;

use crate::error::{Error, Result};
use crate::exec::{Budget, Cancel, Engine, Progress, machine_memory};
use crate::grid::digits::bytes;
use crate::store::Scratch;

/// How many ranks share something.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sharing {
    /// The machine, each as a process.
    pub(crate) machine: usize,
    /// This process, each as a thread.
    pub(crate) process: usize,
}

const MOST_THREADS: usize = 1024;

/// What a run may use.
#[derive(Clone, Debug)]
pub(crate) struct Resources {
    /// Bytes that the process may have resident.
    pub(crate) memory: u64,
    /// Threads that compute.
    pub(crate) threads: usize,
    /// The folder of temporary fields.
    pub(crate) scratch: PathBuf,
}

/// Refuses a number of threads that no run can have.
///
/// # Errors
/// `Usage`.
pub(crate) fn check_threads(threads: usize) -> Result<()> {
    if (1..=MOST_THREADS).contains(&threads) {
        return Ok(());
    }
    Err(Error::usage(format!("--threads is {threads}; give 1 to {MOST_THREADS}")))
}

impl Resources {
    /// What was asked for; half of the machine's memory and all of its cores where nothing was. `output` is what lies nearest
    /// to large free disks when no folder is named, neither here nor as TMPDIR.
    pub(crate) fn new(
        memory: Option<u64>,
        threads: Option<usize>,
        scratch: Option<&Path>,
        output: Option<&Path>,
    ) -> Result<Self> {
        let threads = threads.unwrap_or_else(|| available_parallelism().map_or(1, usize::from));
        check_threads(threads)?;
        let there = machine_memory();
        let memory = memory.unwrap_or(there / 2);
        if memory > there {
            return Err(Error::usage(format!(
                "--memory is {}, but the machine or its control group has {}; give less, or leave it out",
                bytes(memory),
                bytes(there)
            )));
        }
        let from_environment = || std::env::var_os("TMPDIR").filter(|dir| !dir.is_empty()).map(PathBuf::from);
        let beside_output = || output.map(|path| folder_of(path).to_path_buf());
        let scratch = scratch.map(Path::to_path_buf).or_else(from_environment).or_else(beside_output);
        let scratch = scratch.unwrap_or_else(std::env::temp_dir);
        if !scratch.is_dir() {
            let what = "the folder for temporary fields does not exist; create it, or name another with --scratch";
            return Err(Error::usage(what).at(&scratch));
        }
        Ok(Self { memory, threads, scratch })
    }

    /// What one of several ranks may use: of what was given for a process its share of that; of what was not, and so is the
    /// machine's, its share of the machine.
    pub(crate) fn share(self, sharing: Sharing, gave: [bool; 2]) -> Self {
        let [gave_memory, gave_threads] = gave;
        let of = |gave: bool| if gave { 1 } else { sharing.machine };
        let memory = self.memory / of(gave_memory) as u64;
        let memory = Budget { total: memory }.share(sharing.process).total;
        let threads = (self.threads / (sharing.process * of(gave_threads))).max(1);
        Self { memory, threads, ..self }
    }

    /// An engine that keeps to them. Jobs take what they hold off its window.
    pub(crate) fn engine(&self, cancel: &Cancel, progress: Arc<dyn Progress>) -> Result<Engine> {
        let scratch = Scratch::new(&self.scratch, self.memory).watching();
        Engine::new(self.threads, scratch, Budget { total: self.memory }, cancel.clone(), progress)
    }
}

/// The folder that a path lies in.
pub(crate) fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."))
}
