//! The sources that fix the voxels of one brick, or that these are told of, and the states that follow from them (Kósa
//! & Mikula 2023, Alg. 1; docs/algorithms.md, "Points").
//!
//! Arrays are dense `[z][y][x]` over a brick. Of what fixes a voxel and what it is told of it starts from the nearer;
//! of equal distances from the lower label, then from the lower index.

use crate::grid::NO_SOURCE;
use crate::kernel::distance::state::method::DistanceState;
use crate::kernel::distance::state::source::counts_before;

/// The nearest source of each voxel of a brick, of those that were looked at.
#[derive(Clone, Debug)]
pub struct Seeds {
    /// Squared distances, physical; infinite where there is none.
    pub squared: Vec<f64>,
    /// Their indices, [`NO_SOURCE`] where there is none.
    pub source: Vec<u32>,
}

/// A voxel that no source is near to.
const NONE: (f64, u32) = (f64::INFINITY, NO_SOURCE);

impl Seeds {
    /// None, for `len` voxels.
    #[must_use]
    pub fn new(len: usize) -> Self {
        Self { squared: vec![NONE.0; len], source: vec![NONE.1; len] }
    }

    /// Forgets all.
    pub fn clear(&mut self) {
        self.squared.fill(NONE.0);
        self.source.fill(NONE.1);
    }

    /// Voxels that have a source.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.source.iter().filter(|&&source| source != NO_SOURCE).count() as u64
    }
}

/// The states of voxels that are `fixed`, and of others that are `told` of a source (which may have no voxels: none
/// is). Each source has a `label`.
pub fn write_states<M: DistanceState>(fixed: &Seeds, told: &Seeds, label: impl Fn(u32) -> u32, out: &mut [M::State]) {
    for (at, out) in out.iter_mut().enumerate() {
        let nearest = |seeds: &Seeds| (seeds.squared[at], seeds.source[at]);
        let (fixing, beside) = (nearest(fixed), if told.source.is_empty() { NONE } else { nearest(told) });
        *out = match (fixing.1 == NO_SOURCE, beside.1 == NO_SOURCE) {
            (false, told) => {
                let farther = told || !counts_before(beside, fixing, &label);
                let (squared, source) = if farther { fixing } else { beside };
                M::fixed(squared, source)
            }
            (true, false) => M::trial(beside.1).unwrap_or(M::UNKNOWN),
            (true, true) => M::UNKNOWN,
        };
    }
}
