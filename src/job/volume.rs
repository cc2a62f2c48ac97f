//! Volumes that a program already has: arrays in memory, or whatever boxes can be read from.

use std::borrow::Cow;

use crate::error::{Error, Result};
use crate::grid::{Box3, Geometry};
use crate::pipeline::distance::seeding::label_borders::Labels;
use crate::store::{BoxSource, Element, ElementType, Sample, SamplesMut, VolumeSource};

/// A volume in memory, dense `[z][y][x]`, x fastest.
#[derive(Clone, Debug)]
pub struct Volume<'a, T: Element> {
    shape: [i64; 3],
    values: Cow<'a, [T]>,
}

impl<'a, T: Element> Volume<'a, T> {
    /// The volume of so many voxels along x, y and z.
    ///
    /// # Errors
    /// When there are more or fewer values than voxels, or no voxel.
    pub fn new(shape: [i64; 3], values: impl Into<Cow<'a, [T]>>) -> Result<Self> {
        let values = values.into();
        let [x, y, z] = shape;
        let voxels: f64 = shape.iter().map(|&n| n as f64).product();
        if shape.iter().any(|&n| n < 1) || voxels != values.len() as f64 {
            return Err(Error::usage(format!(
                "a volume of {x} x {y} x {z} voxels (x, y, z) cannot hold {} values; give as many values as voxels",
                values.len()
            )));
        }
        Ok(Self { shape, values })
    }
}

impl<T: Element> BoxSource<T> for Volume<'_, T> {
    fn shape(&self) -> [i64; 3] {
        self.shape
    }

    fn read_box(&self, part: &Box3, out: &mut [T]) -> Result<()> {
        let whole = Box3::from_shape(self.shape);
        let width = part.shape()[0] as usize;
        for ((y, z), row) in part.rows().zip(out.chunks_exact_mut(width.max(1))) {
            row.copy_from_slice(&self.values[whole.offset_of([part.lo[0], y, z])..][..width]);
        }
        Ok(())
    }
}

/// Edge of the boxes that a volume is read by.
const EDGE: i64 = 64;

/// What boxes can be read from, as an image.
pub(super) struct Image<S, T> {
    source: S,
    /// What its voxels are.
    element: std::marker::PhantomData<fn() -> T>,
}

impl<S, T> Image<S, T> {
    pub(super) fn new(source: S) -> Self {
        Self { source, element: std::marker::PhantomData }
    }
}

impl<S: BoxSource<T>, T: Sample> VolumeSource for Image<S, T> {
    fn shape(&self) -> [i64; 3] {
        self.source.shape()
    }

    fn element(&self) -> ElementType {
        T::TYPE
    }

    fn natural_shape(&self) -> [i64; 3] {
        self.source.shape().map(|n| n.min(EDGE))
    }

    fn decoding_bytes(&self) -> u64 {
        (EDGE * EDGE * EDGE) as u64 * size_of::<T>() as u64
    }

    fn read_box(&self, part: &Box3, out: SamplesMut<'_>) -> Result<()> {
        let mut values = vec![T::default(); part.len()];
        self.source.read_box(part, &mut values)?;
        match out {
            SamplesMut::U8(out) => hand_out(&values, out),
            SamplesMut::U16(out) => hand_out(&values, out),
            SamplesMut::U32(out) => hand_out(&values, out),
            SamplesMut::F32(out) => hand_out(&values, out),
            SamplesMut::F64(out) => hand_out(&values, out),
        }
        Ok(())
    }
}

/// The same values: both are of the type that the volume names.
fn hand_out<T: Element, U: Element>(values: &[T], out: &mut [U]) {
    out.iter_mut().zip(values).for_each(|(out, value)| *out = U::from_f64(value.to_f64()));
}

/// What boxes of labels can be read from, with its place in the world.
pub(super) struct PlacedLabels<'a> {
    pub(super) source: &'a dyn BoxSource<u32>,
    pub(super) geometry: &'a Geometry,
}

impl Labels for PlacedLabels<'_> {
    fn geometry(&self) -> &Geometry {
        self.geometry
    }

    fn natural_boxes(&self) -> Box<dyn Iterator<Item = Box3> + '_> {
        Box::new(self.geometry.domain().tiles([EDGE; 3]))
    }

    fn read_box(&self, part: &Box3, out: &mut Vec<u32>) -> Result<()> {
        out.resize(part.len(), 0);
        self.source.read_box(part, out)
    }
}

/// Refuses a place in the world for a volume of another shape.
pub(super) fn check_shape(shape: [i64; 3], geometry: &Geometry) -> Result<()> {
    if shape == geometry.shape {
        return Ok(());
    }
    let told = |[x, y, z]: [i64; 3]| format!("{x} x {y} x {z}");
    Err(Error::usage(format!(
        "the volume has {} voxels (x, y, z), and the grid that it is said to lie on {}; give the same shape",
        told(shape),
        told(geometry.shape)
    )))
}
