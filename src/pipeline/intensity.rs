//! Intensities taken to [0, 1], so that K means the same for 8, 16 and 32 bit images (algorithms: section 6).

use crate::error::Result;
use crate::grid::Box3;
use crate::store::{BoxSource, Element};

/// The grey values that become 0 and 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GreyRange {
    /// Becomes 0.
    pub low: f64,
    /// Becomes 1.
    pub high: f64,
}

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
        let scale = 1.0 / (self.range.high - self.range.low).max(f64::MIN_POSITIVE);
        for (y, z) in wanted.rows() {
            let row = &mut out[wanted.offset_of([wanted.lo[0], y, z])..][..wanted.shape()[0] as usize];
            for (x, value) in (wanted.lo[0]..).zip(row) {
                let grey = grey[inside.offset_of(clamp([x, y, z]))].to_f64();
                *value = ((grey - self.range.low) * scale).clamp(0.0, 1.0) as f32;
            }
        }
        Ok(())
    }
}
