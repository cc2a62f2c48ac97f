//! Samples of any type read as f64, which holds all of them exactly.

use strandline::error::Result;
use strandline::grid::Box3;
use strandline::store::{Sample, SampleWork, VolumeSource};

/// The samples of a box, dense.
pub(crate) fn numbers(volume: &dyn VolumeSource, part: &Box3) -> Result<Vec<f64>> {
    volume.element().with_samples(Reading { volume, part })
}

struct Reading<'a> {
    volume: &'a dyn VolumeSource,
    part: &'a Box3,
}

impl SampleWork for Reading<'_> {
    type Output = Result<Vec<f64>>;

    fn on<T: Sample>(self) -> Self::Output {
        // Not zero, so that a voxel that was left out shows.
        let mut out = vec![T::from_f64(77.0); self.part.len()];
        self.volume.read_box(self.part, T::buffer(&mut out))?;
        Ok(out.into_iter().map(T::to_f64).collect())
    }
}
