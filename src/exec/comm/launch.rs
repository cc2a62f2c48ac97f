//! Whether this process is one of several that an MPI launcher has started, as the launcher says in the environment.

/// How many processes were started together, by what the launcher calls it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Launched {
    /// Processes, this one too.
    pub processes: usize,
    /// Those of them on this machine.
    pub on_this_machine: usize,
    /// The variable that says so.
    pub variable: &'static str,
}

/// What says how many there are, and how many on this machine: Open MPI's own; those of MPICH, Intel MPI and their kin.
const VARIABLES: [[&str; 2]; 2] =
    [["OMPI_COMM_WORLD_SIZE", "OMPI_COMM_WORLD_LOCAL_SIZE"], ["PMI_SIZE", "MPI_LOCALNRANKS"]];

/// The same of SLURM's `srun`, which counts where it starts ranks of an MPI by `PMIx`, as this other variable says.
const OF_SLURM: [&str; 3] = ["SLURM_STEP_NUM_TASKS", "SLURM_STEP_TASKS_PER_NODE", "PMIX_RANK"];

/// What a launcher says, where it has started several. `srun` without MPI says nothing: it is used to start programs that have nothing
/// to do with each other.
#[must_use]
pub fn launched() -> Option<Launched> {
    launched_by(|name| std::env::var(name).ok())
}

fn launched_by(environment: impl Fn(&str) -> Option<String>) -> Option<Launched> {
    // "4(x2)": four on each of two machines.
    let first = |text: String| text.trim().split(['(', ',']).next().map(str::to_owned);
    let number = |name: &str| environment(name).and_then(first)?.parse::<usize>().ok();
    let [tasks, of_node, pmix] = OF_SLURM;
    let of_slurm = environment(pmix).map(|_| [tasks, of_node]);
    VARIABLES.into_iter().chain(of_slurm).find_map(|[variable, local]| {
        let processes = number(variable).filter(|&processes| processes > 1)?;
        let on_this_machine = number(local).unwrap_or(1).clamp(1, processes);
        Some(Launched { processes, on_this_machine, variable })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn launchers_are_known_by_what_they_set() {
        let found = |set: &'static [(&str, &str)]| {
            launched_by(|name| set.iter().find(|(key, _)| *key == name).map(|(_, value)| (*value).to_owned()))
        };
        assert_eq!(found(&[]), None);
        let open = found(&[("OMPI_COMM_WORLD_SIZE", "8"), ("OMPI_COMM_WORLD_LOCAL_SIZE", "4")]);
        assert_eq!(open, Some(Launched { processes: 8, on_this_machine: 4, variable: "OMPI_COMM_WORLD_SIZE" }));
        assert_eq!(found(&[("PMI_SIZE", "2")]).map(|launched| launched.processes), Some(2));
        let slurm = found(&[("SLURM_STEP_NUM_TASKS", "6"), ("SLURM_STEP_TASKS_PER_NODE", "3(x2)"), ("PMIX_RANK", "0")]);
        assert_eq!(slurm, Some(Launched { processes: 6, on_this_machine: 3, variable: "SLURM_STEP_NUM_TASKS" }));
        // Started by srun, but not as ranks.
        assert_eq!(found(&[("SLURM_STEP_NUM_TASKS", "6")]), None);
        // One process is none of several, and what is no number says nothing.
        assert_eq!(found(&[("OMPI_COMM_WORLD_SIZE", "1")]), None);
        assert_eq!(found(&[("PMI_SIZE", "many")]), None);
    }
}
