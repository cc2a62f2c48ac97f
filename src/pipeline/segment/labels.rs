//! The label volume: all objects on the image's grid, one of them at each voxel.

use crate::error::Result;
use crate::grid::Box3;
use crate::kernel::image::labels;
use crate::store::{BoxSource, BrickArray, Element};

/// Which object a voxel belongs to where several overlap.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Overlap {
    /// The one with the smaller volume: nested tissues.
    Smaller,
    /// The one with the larger volume.
    Larger,
    /// The one with the lower number.
    First,
    /// The one with the higher number.
    Last,
}

/// An object on the image's grid.
pub struct Placed<'a> {
    /// Its label.
    pub label: u32,
    /// Its box in voxels of the image.
    pub window: Box3,
    /// Its segmentation function.
    pub u: &'a BrickArray<f32>,
    /// Its volume.
    pub volume: f64,
}

/// The label volume as a source of boxes; nothing of it is stored.
pub(super) struct LabelVolume<'a> {
    shape: [i64; 3],
    /// Objects in the order in which they are painted: later ones win.
    objects: Vec<Placed<'a>>,
}

impl<'a> LabelVolume<'a> {
    /// Puts the objects in their order.
    #[must_use]
    pub(super) fn new(shape: [i64; 3], mut objects: Vec<Placed<'a>>, overlap: Overlap) -> Self {
        objects.sort_by(|a, b| match overlap {
            Overlap::Smaller => b.volume.total_cmp(&a.volume).then(b.label.cmp(&a.label)),
            Overlap::Larger => a.volume.total_cmp(&b.volume).then(b.label.cmp(&a.label)),
            Overlap::First => b.label.cmp(&a.label),
            Overlap::Last => a.label.cmp(&b.label),
        });
        Self { shape, objects }
    }

    /// The part of an object's box that `part` shares, in the object's own voxels.
    fn own_part(object: &Placed<'_>, part: &Box3) -> Box3 {
        part.intersect(&object.window).translate(object.window.lo.map(|v| -v))
    }
}

impl<T: Element> BoxSource<T> for LabelVolume<'_> {
    fn shape(&self) -> [i64; 3] {
        self.shape
    }

    fn read_box(&self, part: &Box3, out: &mut [T]) -> Result<()> {
        out.fill(T::default());
        let mut values = Vec::new();
        for object in &self.objects {
            let own = Self::own_part(object, part);
            if own.is_empty() || object.u.constant_in(&own).is_some_and(|u| u < 0.5) {
                continue;
            }
            values.resize(own.len(), 0.0f32);
            object.u.read_box(&own, &mut values)?;
            let covered = own.translate(object.window.lo);
            labels::paint(&values, &covered, T::from_f64(f64::from(object.label)), part, out);
        }
        Ok(())
    }

    fn constant_in(&self, part: &Box3) -> Option<T> {
        let empty = |object: &Placed<'_>| {
            let own = Self::own_part(object, part);
            own.is_empty() || object.u.constant_in(&own).is_some_and(|u| u < 0.5)
        };
        self.objects.iter().all(empty).then(T::default)
    }
}
