//! What a search for an enclosure ends with: the fields of what is enclosed, and what is told of holes.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::tagging::Basin;
use crate::error::Result;
use crate::exec::{Engine, Hold, whole_field};
use crate::grid::{Box3, BrickSet, Geometry, digits};
use crate::pipeline::level_set::band::{Band, Reaches, SidesNear, make_band};
use crate::store::BrickArray;

/// The hole through which a cloud would leak first.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hole {
    /// Its width: twice the saddle's distance to the cloud.
    pub width: f64,
    /// Where it is, world coordinates.
    pub place: [f64; 3],
}

/// The deepest space that a cloud has, whether it is closed enough or not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deepest {
    /// Its largest hole.
    pub hole: Hole,
    /// The largest distance to the cloud in it.
    pub depth: f64,
}

impl Deepest {
    pub(super) fn of(basins: &[Basin], geometry: &Geometry) -> Option<Self> {
        let basin = basins.iter().max_by(|a, b| a.depth.total_cmp(&b.depth))?;
        let hole = Hole { width: 2.0 * f64::from(basin.saddle), place: geometry.position(basin.place) };
        Some(Self { hole, depth: f64::from(basin.depth) })
    }

    /// A beta at which the start surface closes the hole and leaves room inside.
    #[must_use]
    pub fn beta(&self) -> Option<f64> {
        // A hair from either end: on the grid both are known to that.
        digits::shortest_between(0.5 * self.hole.width * 1.005, self.depth * 0.995)
    }
}

/// A cloud that encloses something, on a grid that reaches far enough around it.
pub struct Enclosure {
    /// The grid of its box.
    pub geometry: Geometry,
    /// The box in voxels of the grid that was given.
    pub window: Box3,
    /// How far from the cloud the start surface lies; 0 where it runs between the points.
    pub beta: f64,
    /// How far the band reaches.
    pub reaches: Reaches,
    /// The cells near the cloud, of all ranks.
    pub(super) cells: BrickSet,
    /// On this rank's part of them.
    pub(super) distance: BrickArray<f32>,
    pub(super) inside: BrickArray<u8>,
    pub(super) basins: Vec<Basin>,
    pub(super) deepest: Option<Deepest>,
    pub(super) sheet: Vec<u32>,
    /// The level set, where it is known.
    pub(super) known: Option<BrickArray<f32>>,
    /// What the box takes of the memory.
    pub(super) held: Hold,
}

/// What a search ends with.
pub enum Found {
    /// Something enclosed.
    Enclosed(Box<Enclosure>),
    /// Too little within the first reach, where the search was not to go on.
    Open,
    /// Nothing at the beta that was asked for; a larger one would do.
    Leaks(Deepest),
    /// Nothing; at most a space that is not deep enough for its holes.
    Nothing(Option<Deepest>),
}

impl Enclosure {
    /// The cloud's largest hole.
    #[must_use]
    pub fn hole(&self) -> Option<Hole> {
        let basin = self.basins.iter().max_by(|a, b| a.saddle.total_cmp(&b.saddle))?;
        Some(Hole { width: 2.0 * f64::from(basin.saddle), place: self.geometry.position(basin.place) })
    }

    /// A beta that the start surface may have, where another one failed: larger than this, and no larger than the
    /// deepest space has room for.
    #[must_use]
    pub fn larger_beta(&self) -> Option<f64> {
        self.deepest.and_then(|deepest| deepest.beta()).filter(|&beta| beta > self.beta)
    }

    /// Number of enclosed spaces.
    #[must_use]
    pub fn spaces(&self) -> usize {
        self.basins.len()
    }

    /// The points that are held as thin shells or slits, in order.
    #[must_use]
    pub fn sheet(&self) -> &[u32] {
        &self.sheet
    }

    /// Distance and sides of all voxels of the box.
    #[cfg(test)]
    pub(super) fn fields(&self) -> Result<(Vec<f32>, Vec<u8>)> {
        use crate::store::BoxSource;
        let part = self.geometry.domain();
        let (mut distance, mut inside) = (vec![0.0; part.len()], vec![0; part.len()]);
        self.distance.read_box(&part, &mut distance)?;
        self.inside.read_box(&part, &mut inside)?;
        Ok((distance, inside))
    }

    /// Makes the band, which all ranks then have; the fields of the search go. What the box takes of the memory is held until the guard goes.
    ///
    /// # Errors
    /// When scratch runs out, the run is interrupted or another rank is gone.
    pub fn into_band(self, engine: &Engine, suffix: &str) -> Result<(Band, Hold)> {
        let stage = engine.stage(&format!("band{suffix}"), self.inside.set().len() as u64);
        if let Some(u) = self.known {
            let set = &Arc::new(self.cells);
            let solved = BrickArray::blank(engine.scratch(), set, 0)?;
            let (u, distance) = (whole_field(&stage, u, set)?, whole_field(&stage, self.distance, set)?);
            stage.finish();
            return Ok((Band { u, distance, solved, voxels: 0 }, self.held));
        }
        let sides = SidesNear { distance: &self.distance, inside: &self.inside, cells: &self.cells };
        let band = make_band(&stage, engine, sides, self.reaches)?;
        stage.finish();
        Ok((band, self.held))
    }
}
