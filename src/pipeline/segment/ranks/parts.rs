//! Which objects a rank solves, alone or together with the others, and which parts of the image it keeps for that.

use crate::error::Result;
use crate::exec::{Comm, Engine};
use crate::grid::{Box3, Geometry};
use crate::io::ome_zarr::StoreWriter;
use crate::pipeline::marks::ObjectMarks;
use crate::pipeline::output::pyramid::written_by_this_rank;
use crate::pipeline::segment::reach::{likely_box, likely_work};
use crate::pipeline::segment::settings::{Guides, SegmentSettings};
use crate::store::ElementType;

/// An object that takes more than so many times a rank's fair share of all would keep the others waiting.
const TOO_LARGE: f64 = 1.5;

/// The objects that a rank solves, by their numbers, in order.
pub(in crate::pipeline::segment) struct Share {
    /// Those that all ranks solve together, one after the other.
    pub together: Vec<usize>,
    /// Those that this one solves without the others.
    pub own: Vec<usize>,
}

impl Share {
    /// That of a rank: what is too large for one all solve together; of the others the largest come first, each to the rank that has least to
    /// do (Graham 1969). All ranks find the same without a word.
    pub(in crate::pipeline::segment) fn of(comm: &dyn Comm, objects: &[ObjectMarks], grid: &Geometry) -> Self {
        if comm.ranks() == 1 {
            return Self { together: Vec::new(), own: (0..objects.len()).collect() };
        }
        let takes: Vec<f64> = objects.iter().map(|marks| likely_work(marks, grid)).collect();
        let owners = shared_out(&takes, comm.ranks());
        let numbers = |of: Option<usize>| (0..objects.len()).filter(|&n| owners[n] == of).collect();
        Self { together: numbers(None), own: numbers(Some(comm.rank())) }
    }

    /// All of them, in order.
    pub(in crate::pipeline::segment) fn all(&self) -> Vec<usize> {
        let mut all = [&self.together[..], &self.own].concat();
        all.sort_unstable();
        all
    }
}

/// The rank of each of several jobs, of which is known what they take; none where it is one for all ranks.
fn shared_out(takes: &[f64], ranks: usize) -> Vec<Option<usize>> {
    let most = TOO_LARGE * takes.iter().sum::<f64>() / ranks as f64;
    let mut order: Vec<usize> = (0..takes.len()).filter(|&n| takes[n] <= most).collect();
    order.sort_by(|&a, &b| takes[b].total_cmp(&takes[a]).then(a.cmp(&b)));
    let (mut owners, mut busy) = (vec![None; takes.len()], vec![0.0_f64; ranks]);
    for n in order {
        let rank = (0..ranks).min_by(|&a, &b| busy[a].total_cmp(&busy[b])).unwrap_or(0);
        owners[n] = Some(rank);
        busy[rank] += takes[n];
    }
    owners
}

/// The parts of the image that this rank looks at often: around the objects that it solves, and what it writes. What else it
/// looks at it reads once more from where the image is stored. None where it keeps all.
///
/// # Errors
/// When another rank is gone.
pub(in crate::pipeline::segment) fn kept_parts(
    engine: &Engine,
    guides: &Guides<'_>,
    settings: &SegmentSettings,
    (element, store): (ElementType, Option<&StoreWriter>),
) -> Result<Option<Vec<Box3>>> {
    let (comm, geometry) = (engine.comm(), guides.geometry);
    // Walls between objects are looked for anywhere.
    if comm.ranks() == 1 || settings.fill_gaps.is_some() {
        return Ok(None);
    }
    let mut parts = match store {
        Some(store) => written_by_this_rank(engine, geometry, store.finest_edges(geometry.shape, element))?,
        None => Vec::new(),
    };
    let solved = Share::of(comm, guides.objects, geometry).all();
    parts.extend(solved.into_iter().map(|n| likely_box(&guides.objects[n], geometry).intersect(&geometry.domain())));
    Ok(Some(parts))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_rank_has_much_more_to_do_than_another() {
        let takes: Vec<f64> = (0..40).map(|n| f64::from(n * n % 37 + 1)).collect();
        for ranks in [1, 2, 3, 8, 60] {
            let owners = shared_out(&takes, ranks);
            let of = |rank| (0..takes.len()).filter(|&n| owners[n] == rank).map(|n| takes[n]).sum::<f64>();
            let sums: Vec<f64> = (0..ranks).map(|rank| of(Some(rank))).collect();
            let (most, mean) = (sums.iter().copied().fold(0.0, f64::max), takes.iter().sum::<f64>() / ranks as f64);
            // Of any number of jobs this way leaves the busiest with four thirds of the least that is possible, at most.
            assert!(most <= 4.0 / 3.0 * mean.max(37.0), "{ranks} ranks: {sums:?}");
            assert!((of(None) + sums.iter().sum::<f64>() - takes.iter().sum::<f64>()).abs() < 1e-9);
        }
    }

    #[test]
    fn what_would_keep_others_waiting_is_for_all() {
        assert_eq!(shared_out(&[5.0], 1), [Some(0)]);
        assert_eq!(shared_out(&[5.0], 2), [None]);
        assert_eq!(shared_out(&[5.0, 4.0], 2), [Some(0), Some(1)]);
        assert_eq!(shared_out(&[1.0, 20.0, 1.0, 1.0], 3), [Some(0), None, Some(1), Some(2)]);
    }
}
