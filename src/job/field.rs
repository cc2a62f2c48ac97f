//! A field that was solved, as it is handed out: any box of it can be read.

use crate::error::{Error, Result};
use crate::grid::{Box3, Geometry};
use crate::store::{BoxSource, Element};

/// A field of a result. It may be larger than memory: it is read by boxes.
pub struct Field<'a, T: Element> {
    geometry: &'a Geometry,
    source: Box<dyn BoxSource<T> + Send + 'a>,
}

impl<'a, T: Element> Field<'a, T> {
    pub(super) fn new(geometry: &'a Geometry, source: impl BoxSource<T> + Send + 'a) -> Self {
        Self { geometry, source: Box::new(source) }
    }

    /// Where its voxels lie.
    #[must_use]
    pub fn geometry(&self) -> &'a Geometry {
        self.geometry
    }

    /// The values of a box, dense `[z][y][x]`, x fastest.
    ///
    /// # Errors
    /// When the box reaches out of the grid, or what is stored cannot be read.
    pub fn read_box(&self, part: &Box3) -> Result<Vec<T>> {
        check_part(part, self.geometry)?;
        let mut values = vec![T::default(); part.len()];
        self.source.read_box(part, &mut values)?;
        Ok(values)
    }

    /// The value of a voxel.
    ///
    /// # Errors
    /// As [`Field::read_box`].
    pub fn at(&self, voxel: [i64; 3]) -> Result<T> {
        Ok(self.read_box(&Box3::new(voxel, voxel.map(|v| v.saturating_add(1))))?[0])
    }

    /// All values, dense `[z][y][x]`, x fastest: for fields that fit memory.
    ///
    /// # Errors
    /// When what is stored cannot be read.
    pub fn read(&self) -> Result<Vec<T>> {
        self.read_box(&self.geometry.domain())
    }
}

impl<T: Element> BoxSource<T> for Field<'_, T> {
    fn shape(&self) -> [i64; 3] {
        self.geometry.shape
    }

    fn read_box(&self, part: &Box3, out: &mut [T]) -> Result<()> {
        self.source.read_box(part, out)
    }

    fn constant_in(&self, part: &Box3) -> Option<T> {
        self.source.constant_in(part)
    }
}

/// Refuses a box that is not one of the grid's.
pub(super) fn check_part(part: &Box3, geometry: &Geometry) -> Result<()> {
    if !part.is_empty() && part.intersect(&geometry.domain()) == *part {
        return Ok(());
    }
    let [x, y, z] = geometry.shape;
    Err(Error::usage(format!(
        "the box from {:?} to {:?} is no part of the grid, which has {x} x {y} x {z} voxels (x, y, z); give one that holds a \
         voxel and ends with the grid",
        part.lo, part.hi
    )))
}
