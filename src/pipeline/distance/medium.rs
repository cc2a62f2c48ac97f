//! What a front goes through: the speed of each voxel, read from an image into bricks as those of the times (docs/algorithms.md,
//! "Travel times"). A rank keeps the speeds of its own bricks, and nobody reads others: the update of a voxel asks for its own
//! speed alone.

use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::exec::{Engine, Stage, Workers, gather_records};
use crate::grid::digits::number;
use crate::grid::{Box3, BrickSet, Geometry, Slot};
use crate::kernel::distance::state::precision::Precision;
use crate::store::{BoxSource, BrickArray, Sample, SampleWork, VolumeSource};
use crate::tile::HaloTile;

/// The speed of each voxel, 0 where nothing passes.
pub struct Medium {
    speeds: BrickArray<f32>,
    found: Found,
}

impl fmt::Debug for Medium {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Medium").field("found", &self.found).finish_non_exhaustive()
    }
}

/// What is found of all speeds, on all ranks alike.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Found {
    slowest: f32,
    fastest: f32,
    /// Voxels by the exponent of their speed, where that is more than 0.
    exponents: Vec<u64>,
}

/// Exponents that a number of 32 bits has.
const EXPONENTS: usize = 256;

impl Default for Found {
    fn default() -> Self {
        Self { slowest: f32::INFINITY, fastest: 0.0, exponents: vec![0; EXPONENTS] }
    }
}

impl Found {
    fn add(&mut self, speeds: &[f32]) {
        for &speed in speeds.iter().filter(|speed| **speed > 0.0) {
            (self.slowest, self.fastest) = (self.slowest.min(speed), self.fastest.max(speed));
            self.exponents[(speed.to_bits() >> 23) as usize] += 1;
        }
    }

    /// With what others have found; in any order the same.
    fn and(mut self, other: &Self) -> Self {
        (self.slowest, self.fastest) = (self.slowest.min(other.slowest), self.fastest.max(other.fastest));
        self.exponents.iter_mut().zip(&other.exponents).for_each(|(all, n)| *all += n);
        self
    }

    /// A power of two near the median.
    fn typical(&self) -> f64 {
        let half = self.exponents.iter().sum::<u64>().div_ceil(2);
        let mut below = 0;
        let middle = self.exponents.iter().position(|n| {
            below += n;
            below >= half
        });
        middle.map_or(1.0, |exponent| f64::powi(2.0, exponent as i32 - 127))
    }
}

/// The square of the time that it takes to come as far as the root of `squared` at a speed; infinite at 0.
pub(crate) fn time_squared(squared: f64, speed: f32) -> f64 {
    let slowness = 1.0 / f64::from(speed);
    if speed > 0.0 { squared * (slowness * slowness) } else { f64::INFINITY }
}

impl Medium {
    /// Reads the speeds of this rank's bricks by the boxes in which they are stored.
    ///
    /// # Errors
    /// When the image cannot be read, holds what is no speed or lets nothing pass, scratch runs out or another rank is gone.
    pub fn read(engine: &Engine, set: &Arc<BrickSet>, image: &dyn VolumeSource) -> Result<Self> {
        let speeds = BrickArray::new(engine.scratch(), set)?;
        let domain = Box3::from_shape(set.grid().shape());
        let mut boxes = image.natural_boxes(&domain);
        boxes.retain(|part| own_bricks(set, part).next().is_some());
        let stage = engine.stage("read speeds", boxes.len() as u64);
        stage.voxels(domain.volume());
        let found = image.element().with_samples(Reading { stage: &stage, image, boxes: &boxes, speeds: &speeds })?;
        let found = if engine.comm().ranks() == 1 {
            found
        } else {
            gather_records(engine.comm(), &found)?.iter().fold(Found::default(), Found::and)
        };
        stage.finish();
        if found.fastest == 0.0 {
            let error = Error::input("holds no speed above 0, so that no front passes any voxel; give another image");
            return Err(match image.path() {
                Some(path) => error.at(path),
                None => error,
            });
        }
        Ok(Self { speeds, found })
    }

    /// How long a front takes for a unit of length, about: what it is scheduled by, and nothing else.
    pub(crate) fn slowness(&self) -> f64 {
        1.0 / self.found.typical()
    }

    /// Copies the speeds of a brick into a tile, without ghosts.
    pub(crate) fn put(&self, slot: Slot, tile: &mut HaloTile<f32>) {
        let set = self.speeds.set();
        let [nx, ny, nz] = set.grid().brick_box(set.id(slot)).shape().map(|n| n as usize);
        let (edge, pitch) = (tile.edge(), tile.pitch());
        tile.set_valid([nx, ny, nz]);
        self.speeds.read(slot, |speeds| {
            for (y, z) in (0..nz).flat_map(|z| (0..ny).map(move |y| (y, z))) {
                let to = ((z + 1) * pitch + y + 1) * pitch + 1;
                tile.data_mut()[to..][..nx].copy_from_slice(&speeds[(z * edge + y) * edge..][..nx]);
            }
        });
    }

    /// The same of the brick that holds a box.
    pub(crate) fn put_of(&self, part: &Box3, tile: &mut HaloTile<f32>) {
        let set = self.speeds.set();
        if let Some(slot) = set.grid().brick_of(part.lo).and_then(|id| set.slot(id)) {
            self.put(slot, tile);
        }
    }

    /// The speeds of a brick, `[z][y][x]`.
    pub(crate) fn of<R>(&self, slot: Slot, read: impl FnOnce(&[f32]) -> R) -> R {
        self.speeds.read(slot, read)
    }

    /// All of them, dense `[z][y][x]`, where one rank has all.
    pub(crate) fn whole(&self) -> Result<Vec<f32>> {
        let domain = Box3::from_shape(self.speeds.shape());
        let mut speeds = vec![0.0; domain.len()];
        self.speeds.read_box(&domain, &mut speeds)?;
        Ok(speeds)
    }

    /// Refuses times that the type of the field cannot hold.
    ///
    /// # Errors
    /// With the speeds.
    pub(crate) fn check_range<P: Precision>(&self, geometry: &Geometry) -> Result<()> {
        let diagonal = geometry.length(geometry.shape);
        let (least, most) = (f64::from(self.found.slowest), f64::from(self.found.fastest));
        if diagonal / least < P::MAX && geometry.min_spacing() / most > P::LEAST {
            return Ok(());
        }
        Err(Error::usage(format!(
            "times at speeds from {} to {} do not fit --precision {}; choose a wider one, or another unit of the speeds",
            number(least),
            number(most),
            P::TYPE.name()
        )))
    }
}

/// An image of speeds, read into bricks: those that are this rank's, by the boxes that hold them.
struct Reading<'a> {
    stage: &'a Stage<'a>,
    image: &'a dyn VolumeSource,
    boxes: &'a [Box3],
    speeds: &'a BrickArray<f32>,
}

impl SampleWork for Reading<'_> {
    type Output = Result<Found>;

    fn on<T: Sample>(self) -> Result<Found> {
        let Self { stage, image, boxes, speeds } = self;
        let found = Mutex::new(Found::default());
        let workers = Workers::new(|| (Vec::<T>::new(), Vec::<f32>::new()));
        stage.run(boxes, &workers, |(samples, read), part| {
            samples.resize(part.len(), T::default());
            image.read_box(part, T::buffer(samples))?;
            read.clear();
            for (place, sample) in samples.iter().enumerate() {
                let value = sample.to_f64();
                read.push(speed(value).ok_or_else(|| no_speed(image, part.voxel_at(place), value))?);
            }
            let mut own = Found::default();
            own_bricks(speeds.set(), part).for_each(|slot| write(speeds, slot, (part, read), &mut own));
            let mut found = found.lock().unwrap_or_else(PoisonError::into_inner);
            *found = std::mem::take(&mut *found).and(&own);
            Ok(())
        })?;
        Ok(found.into_inner().unwrap_or_else(PoisonError::into_inner))
    }
}

/// The bricks of this rank that a box reaches.
fn own_bricks<'a>(set: &'a BrickSet, part: &Box3) -> impl Iterator<Item = Slot> + use<'a> {
    set.grid().bricks_in(part).filter_map(|id| set.own_slot(id))
}

/// Writes what a box holds of a brick.
fn write(speeds: &BrickArray<f32>, slot: Slot, (part, read): (&Box3, &[f32]), found: &mut Found) {
    let (set, edge) = (speeds.set(), speeds.set().grid().edge());
    let brick = set.grid().brick_box(set.id(slot));
    let shared = brick.intersect(part);
    let width = shared.shape()[0] as usize;
    speeds.write(slot, |out| {
        for (y, z) in shared.rows() {
            let from = &read[part.offset_of([shared.lo[0], y, z])..][..width];
            let [x, y, z] = [shared.lo[0] - brick.lo[0], y - brick.lo[1], z - brick.lo[2]];
            out[((z * edge + y) * edge + x) as usize..][..width].copy_from_slice(from);
            found.add(from);
        }
    });
}

/// A value as a speed, where it is one that a number of 32 bits holds.
fn speed(value: f64) -> Option<f32> {
    let speed = value as f32;
    let is_one =
        speed.is_finite() && value >= 0.0 && (speed == 0.0 || speed.is_normal()) && (speed > 0.0 || value == 0.0);
    // Of -0 the magnitude.
    is_one.then_some(speed.abs())
}

fn no_speed(image: &dyn VolumeSource, [x, y, z]: [i64; 3], value: f64) -> Error {
    let stored = image.whereabouts([x, y, z]);
    let of_file = stored.as_ref().map(|stored| &stored.part).filter(|part| !part.is_empty());
    let of_file = of_file.map_or(String::new(), |part| format!(" ({part})"));
    let error = Error::input(format!(
        "holds the speed {value} at voxel {x}, {y}, {z} (x, y, z, counted from 0){of_file}; give a finite speed above 0, or 0 \
         where nothing passes"
    ));
    match stored {
        Some(stored) => error.at(&stored.file),
        None => error,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speeds_are_told_from_what_is_none() {
        for (value, expected) in [(0.0, Some(0.0)), (-0.0, Some(0.0)), (1.5, Some(1.5)), (1e38, Some(1e38))] {
            assert_eq!(speed(value).map(f32::to_bits), expected.map(f32::to_bits), "{value}");
        }
        for value in [-1e-9, f64::NAN, f64::INFINITY, 1e39, 1e-39, 1e-300, f64::NEG_INFINITY] {
            assert_eq!(speed(value), None, "{value}");
        }
    }

    #[test]
    fn the_typical_speed_is_near_the_median_in_any_order() {
        let mut all = Found::default();
        all.add(&[0.0, 1e-3, 3.0, 3.5, 2.5, 900.0, 0.0]);
        assert_eq!(all.typical(), 2.0);
        let (mut one, mut other) = (Found::default(), Found::default());
        one.add(&[3.0, 900.0, 2.5]);
        other.add(&[1e-3, 3.5]);
        let (first, second) = (one.clone().and(&other), other.and(&one));
        assert_eq!((first.typical(), first.slowest, first.fastest), (2.0, 1e-3, 900.0));
        assert_eq!((second.typical(), second.slowest, second.fastest), (2.0, 1e-3, 900.0));
    }
}
