//! Whether all ranks of a run were asked for the same, and have read the same: machines may see other files under one name.

use crate::error::{Error, Result};
use crate::exec::Comm;
use crate::grid::DataSets;

/// Refuses ranks of which one has read other sources, or was asked for something else. All ranks ask.
///
/// # Errors
/// When one differs, or is gone.
pub(crate) fn check_agreed(comm: &dyn Comm, asked: &str, sets: &DataSets) -> Result<()> {
    if comm.ranks() == 1 { Ok(()) } else { check(comm, [asked.as_bytes(), &sum(sets).to_le_bytes()].concat()) }
}

/// Refuses ranks of which one was asked for something else. All ranks ask.
///
/// # Errors
/// When one differs, or is gone.
pub(crate) fn check_asked(comm: &dyn Comm, asked: &str) -> Result<()> {
    if comm.ranks() == 1 { Ok(()) } else { check(comm, asked.as_bytes().to_vec()) }
}

fn check(comm: &dyn Comm, own: Vec<u8>) -> Result<()> {
    let all = comm.gather(own)?;
    let Some(other) = all.iter().position(|own| *own != all[0]) else { return Ok(()) };
    Err(Error::usage(format!(
        "rank {other} has other inputs, or was given other flags, than rank 0: all ranks need the same command line, and files that are \
         the same on all machines"
    )))
}

/// A checksum of all sources and their labels.
fn sum(sets: &DataSets) -> u32 {
    let places = sets.positions.iter().chain(&sets.mesh.vertices).flatten().map(|value| value.to_bits().to_le_bytes());
    let sum = places.fold(0, |sum, word| crc32c::crc32c_append(sum, &word));
    let corners = sets.mesh.triangles.iter().flatten().chain(sets.labels()).map(|value| value.to_le_bytes());
    corners.fold(sum, |sum, word| crc32c::crc32c_append(sum, &word))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exec::ThreadComm;

    #[test]
    fn ranks_that_differ_are_refused_and_named() {
        let cloud = |x: f64| {
            let mut sets = DataSets::default();
            sets.add_cloud(&[[0.0; 3], [x, 1.0, 2.0]]);
            sets
        };
        for (asked, x, is_good) in [("same", 1.0, true), ("same", 1.0 + 1e-15, false), ("other", 1.0, false)] {
            std::thread::scope(|scope| {
                for comm in ThreadComm::connected(3) {
                    scope.spawn(move || {
                        let is_last = comm.rank() == 2;
                        let (asked, x) = if is_last { (asked, x) } else { ("same", 1.0) };
                        let checked = check_agreed(&comm, asked, &cloud(x)).map_err(|error| error.to_string());
                        assert_eq!(checked.is_ok(), is_good);
                        assert!(checked.err().is_none_or(|said| said.starts_with("rank 2 has other inputs")));
                    });
                }
            });
        }
    }
}
