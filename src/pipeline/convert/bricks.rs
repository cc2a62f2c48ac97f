//! A volume in bricks of the type in which its format hands it out, and seen in the type in which it was stored.

use std::sync::{Arc, Mutex, PoisonError};

use half::f16;

use crate::error::Result;
use crate::exec::{Engine, Workers};
use crate::grid::{Box3, BrickGrid, BrickSet};
use crate::kernel::image::grey::histogram::Histogram;
use crate::store::{BoxSource, BrickArray, Element, ElementType, Sample, VolumeSource};

/// Voxels along the edge of a brick.
const EDGE: i64 = 64;
/// Percentages of the values that viewers show as black and white at first.
const PERCENTILES: [f64; 2] = [0.1, 99.9];

/// A volume in bricks.
pub(super) enum Bricks {
    U8(BrickArray<u8>),
    U16(BrickArray<u16>),
    U32(BrickArray<u32>),
    F32(BrickArray<f32>),
    F64(BrickArray<f64>),
}

/// A volume in bricks, and how often its values occur; those that are no number are left out there.
pub(super) struct Gathered {
    pub(super) bricks: Bricks,
    histogram: Histogram,
}

/// Work on the voxels of a volume in the type in which they were stored.
pub(super) trait Work {
    fn on<T: Element>(self, voxels: &dyn BoxSource<T>) -> Result<()>;
}

impl Gathered {
    /// The values that count as black and white, and the smallest and the largest; none where no voxel has a number.
    pub(super) fn window(&self) -> Option<[[f64; 2]; 2]> {
        let (range, extremes) = (self.histogram.range(PERCENTILES), self.histogram.extremes());
        (extremes[0] <= extremes[1]).then_some([[range.low, range.high], extremes])
    }
}

impl Bricks {
    /// Does work on voxels of a type; they are handed out in one that holds all of its values.
    pub(super) fn with(&self, stored: ElementType, work: impl Work) -> Result<()> {
        match (self, stored) {
            (Self::U8(bricks), _) => work.on(bricks),
            (Self::U16(bricks), _) => work.on(bricks),
            (Self::U32(bricks), _) => work.on(bricks),
            (Self::F32(bricks), ElementType::I8) => work.on::<i8>(&Stored(bricks)),
            (Self::F32(bricks), ElementType::I16) => work.on::<i16>(&Stored(bricks)),
            (Self::F32(bricks), ElementType::F16) => work.on::<f16>(&Stored(bricks)),
            (Self::F32(bricks), _) => work.on(bricks),
            (Self::F64(bricks), ElementType::I32) => work.on::<i32>(&Stored(bricks)),
            (Self::F64(bricks), _) => work.on(bricks),
        }
    }
}

/// Bricks seen in the type that they were read from.
struct Stored<'a, S: Element>(&'a BrickArray<S>);

impl<S: Element, T: Element> BoxSource<T> for Stored<'_, S> {
    fn shape(&self) -> [i64; 3] {
        self.0.shape()
    }

    fn read_box(&self, part: &Box3, out: &mut [T]) -> Result<()> {
        let mut values = vec![S::default(); part.len()];
        self.0.read_box(part, &mut values)?;
        out.iter_mut().zip(values).for_each(|(out, value)| *out = T::from_f64(value.to_f64()));
        Ok(())
    }
}

/// Reads a volume by the boxes in which it is stored.
pub(super) fn gather(engine: &Engine, volume: &dyn VolumeSource) -> Result<Gathered> {
    match volume.element() {
        ElementType::U8 => of(engine, volume, Bricks::U8),
        ElementType::U16 => of(engine, volume, Bricks::U16),
        ElementType::U32 => of(engine, volume, Bricks::U32),
        ElementType::I8 | ElementType::I16 | ElementType::F16 | ElementType::F32 => of(engine, volume, Bricks::F32),
        ElementType::I32 | ElementType::F64 => of(engine, volume, Bricks::F64),
    }
}

fn of<T: Sample>(engine: &Engine, volume: &dyn VolumeSource, wrap: fn(BrickArray<T>) -> Bricks) -> Result<Gathered> {
    let domain = Box3::from_shape(volume.shape());
    let boxes = volume.natural_boxes(&domain);
    let stage = engine.stage("read", boxes.len() as u64);
    stage.voxels(domain.volume());
    let set = Arc::new(BrickSet::dense(BrickGrid::new(domain.shape(), EDGE)));
    let bricks = BrickArray::<T>::new(engine.scratch(), &set)?;
    // Counts add up the same in any order, and a histogram for each thread bounds the memory.
    let histograms = Mutex::new(Vec::<Histogram>::new());
    stage.run(&boxes, &Workers::new(Vec::new), |voxels, part| {
        voxels.resize(part.len(), T::default());
        volume.read_box(part, T::buffer(voxels))?;
        bricks.write_box(part, voxels);
        let idle = histograms.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let mut histogram = idle.unwrap_or_default();
        let mut rest = voxels.as_slice();
        while let Err(place) = histogram.add(rest) {
            rest = &rest[place + 1..];
        }
        histograms.lock().unwrap_or_else(PoisonError::into_inner).push(histogram);
        Ok(())
    })?;
    stage.finish();
    let mut histogram = Histogram::default();
    histograms.into_inner().unwrap_or_else(PoisonError::into_inner).iter().for_each(|counts| histogram.merge(counts));
    Ok(Gathered { bricks: wrap(bricks), histogram })
}
