//! The image that objects are found in, and where an object lies in it.

use crate::grid::{Geometry, digits};
use crate::io::ome_zarr::StoreWriter;
use crate::kernel::image::grey::grey_range::GreyRange;
use crate::pipeline::enclosure::search::Hole;
use crate::pipeline::marks::ObjectMarks;
use crate::store::{BoxSource, Element};

/// The image as the objects see it.
#[derive(Clone, Copy)]
pub(crate) struct Picture<'a, T: Element> {
    /// Its voxels.
    pub voxels: &'a dyn BoxSource<T>,
    /// The grey values taken as black and white.
    pub range: GreyRange,
    /// Where it lies.
    pub geometry: &'a Geometry,
    /// Where it lies in truth, for messages.
    pub world: World<'a>,
    /// The store that shows surfaces while they move, where it is live.
    pub shown_in: Option<&'a StoreWriter>,
}

/// Where a picture lies that is solved as if its first voxel were the origin.
#[derive(Clone, Copy)]
pub(crate) struct World<'a> {
    /// The grid of the whole image.
    pub whole: &'a Geometry,
    /// The world position of the picture's origin.
    pub origin: [f64; 3],
}

impl World<'_> {
    /// Where a place of the picture lies in the world.
    pub(super) fn of(&self, place: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|a| place[a] + self.origin[a])
    }

    /// A hole in an object's marks: how wide it is, and where; with the slice, where it is none beyond the image.
    pub(super) fn describe(&self, hole: &Hole) -> String {
        let whole = self.whole;
        let place = self.of(hole.place);
        let slice = whole.to_voxels(place)[2].round();
        let last = (whole.shape[2] - 1) as f64;
        let on = if (0.0..=last).contains(&slice) {
            format!("on slice {slice} (counted from 0)")
        } else {
            let (end, which) = if slice < 0.0 { (0.0, "first") } else { (last, "last") };
            format!("beyond the {which} slice ({end}, counted from 0)")
        };
        let unit = whole.unit.as_deref().unwrap_or("(no unit)");
        let width = digits::number(hole.width);
        format!("a hole {width} {unit} wide at {}, {on}", digits::place(place, whole.min_spacing()))
    }
}

pub(super) fn name(what: &str, marks: &ObjectMarks) -> String {
    format!("{what} {}", marks.object)
}
