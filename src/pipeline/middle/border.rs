//! The discrete borders of labels: voxels with a face neighbour of another label keep theirs, all others are 0.

use crate::error::Result;
use crate::grid::Box3;
use crate::kernel::image::labels::border;
use crate::pipeline::distance::NearestLabels;
use crate::store::{BoxSource, Element};

/// The borders of the labels of nearest sources.
pub(super) struct Border<'a> {
    pub(super) labels: NearestLabels<'a>,
}

impl<T: Element + PartialEq> BoxSource<T> for Border<'_> {
    fn shape(&self) -> [i64; 3] {
        self.labels.sources.shape()
    }

    fn read_box(&self, part: &Box3, out: &mut [T]) -> Result<()> {
        let domain = Box3::from_shape(self.labels.sources.shape());
        let around = part.grow(1).intersect(&domain);
        let mut labels = vec![T::default(); around.len()];
        self.labels.read_box(&around, &mut labels)?;
        border(&labels, &around, part, out);
        Ok(())
    }
}
