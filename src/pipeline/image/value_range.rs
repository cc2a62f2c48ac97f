//! The range of a volume's values, read by the boxes in which it is stored.

use crate::error::Result;
use crate::grid::Box3;
use crate::kernel::image::grey::extremes::Extremes;
use crate::store::{Sample, SampleWork, VolumeSource};

/// The smallest and the largest value of a volume; voxels without a number take no part, such as those of a closest-point
/// field that no source was found for. None where no voxel has one.
///
/// # Errors
/// When the volume cannot be read.
pub fn value_range(volume: &dyn VolumeSource) -> Result<Option<[f64; 2]>> {
    volume.element().with_samples(Reading(volume))
}

struct Reading<'a>(&'a dyn VolumeSource);

impl SampleWork for Reading<'_> {
    type Output = Result<Option<[f64; 2]>>;

    fn on<T: Sample>(self) -> Self::Output {
        let (mut found, mut values) = (Extremes::default(), Vec::new());
        for part in self.0.natural_boxes(&Box3::from_shape(self.0.shape())) {
            values.resize(part.len(), T::default());
            self.0.read_box(&part, T::buffer(&mut values))?;
            found.add(&values);
        }
        Ok(found.range())
    }
}
