//! Whether this process is one of several that an MPI launcher has started, as the launcher says in the environment.

/// How many processes were started together, by what the launcher calls it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Launched {
    /// Processes, this one too.
    pub processes: usize,
    /// The variable that says so.
    pub variable: &'static str,
}

/// Open MPI's own; that of MPICH, Intel MPI and their kin.
const VARIABLES: [&str; 2] = ["OMPI_COMM_WORLD_SIZE", "PMI_SIZE"];

/// What a launcher says, where it has started several. `srun` alone says nothing: without MPI it is used to start programs that
/// have nothing to do with each other.
#[must_use]
pub fn launched() -> Option<Launched> {
    launched_by(|name| std::env::var(name).ok())
}

fn launched_by(environment: impl Fn(&str) -> Option<String>) -> Option<Launched> {
    VARIABLES.into_iter().find_map(|variable| {
        let processes: usize = environment(variable)?.trim().parse().ok()?;
        (processes > 1).then_some(Launched { processes, variable })
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
        let open = found(&[("OMPI_COMM_WORLD_SIZE", "8"), ("OMPI_COMM_WORLD_RANK", "3")]);
        assert_eq!(open, Some(Launched { processes: 8, variable: "OMPI_COMM_WORLD_SIZE" }));
        assert_eq!(found(&[("PMI_SIZE", "2")]).map(|launched| launched.processes), Some(2));
        // One process is none of several, and what is no number says nothing.
        assert_eq!(found(&[("OMPI_COMM_WORLD_SIZE", "1")]), None);
        assert_eq!(found(&[("PMI_SIZE", "many")]), None);
    }
}
