//! `Normalised`: an image as the level set sees it, read box by box and taken to [0, 1] on the way.

use crate::error::Result;
use crate::grid::Box3;
use crate::kernel::image::grey::grey_range::GreyRange;
use crate::store::{BoxSource, Element};

/// An image seen through its grey range, on a box that may reach past the image: there its border is repeated.
pub struct Normalised<'a, T: Element> {
    image: &'a dyn BoxSource<T>,
    range: GreyRange,
    window: Box3,
}

impl<'a, T: Element> Normalised<'a, T> {
    /// The part `window` of `image` (in its voxels), counted from `window.lo`.
    pub fn new(image: &'a dyn BoxSource<T>, range: GreyRange, window: Box3) -> Self {
        Self { image, range, window }
    }
}

impl<T: Element> BoxSource<f32> for Normalised<'_, T> {
    fn shape(&self) -> [i64; 3] {
        self.window.shape()
    }

    fn read_box(&self, part: &Box3, out: &mut [f32]) -> Result<()> {
        let shape = self.image.shape();
        let wanted = part.translate(self.window.lo);
        let clamp = |v: [i64; 3]| -> [i64; 3] { std::array::from_fn(|a| v[a].clamp(0, shape[a] - 1)) };
        let inside = Box3::new(clamp(wanted.lo), clamp(wanted.hi.map(|v| v - 1)).map(|v| v + 1));
        let mut grey = vec![T::default(); inside.len()];
        self.image.read_box(&inside, &mut grey)?;
        self.range.normalise(&grey, &inside, &wanted, out);
        Ok(())
    }
}
