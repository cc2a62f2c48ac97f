//! The points of a cloud with their normals, found again by their place: what an open surface is made of and trimmed by.

use glam::DVec3;
use rstar::RTree;

use super::oriented::{Numbered, OrientedCloud, numbered};
use super::trimming::Trimming;
use crate::error::Result;
use crate::exec::{Engine, Hold};
use crate::grid::Geometry;
use crate::kernel::points::surfel::Surfel;
use crate::pipeline::reconstruct::estimate::spacing_memory;
use crate::pipeline::reconstruct::spacing::typical_spacing;

/// Bytes a point takes: its place and number in two trees, its normal, and its links until all normals are turned.
const BYTES: u64 = 1000;

/// A cloud with its normals.
pub(in crate::pipeline::reconstruct) struct Sided {
    pub(in crate::pipeline::reconstruct) tree: RTree<Numbered>,
    pub(in crate::pipeline::reconstruct) cloud: OrientedCloud,
    /// By number.
    pub(in crate::pipeline::reconstruct) surfels: Vec<Surfel>,
    spacing: f64,
    _held: Hold,
}

impl Sided {
    /// Finds the normals of a cloud.
    ///
    /// # Errors
    /// When the memory is too little, or the run is interrupted.
    pub(in crate::pipeline::reconstruct) fn new(engine: &Engine, points: &[[f64; 3]]) -> Result<Self> {
        let held = engine.hold(points.len() as u64 * BYTES.max(spacing_memory(1)))?;
        let stage = engine.stage("normals", points.len() as u64);
        let tree = numbered(points);
        let cloud = OrientedCloud::new(&stage, points, &tree)?;
        stage.finish();
        Ok(Self {
            surfels: cloud.surfels(points),
            tree,
            cloud,
            spacing: typical_spacing(points).unwrap_or(0.0),
            _held: held,
        })
    }

    /// How far a place is from the nearest point.
    pub(in crate::pipeline::reconstruct) fn away(&self, at: DVec3) -> f64 {
        let nearest = self.tree.nearest_neighbor(at.to_array());
        nearest.map_or(f64::INFINITY, |point| DVec3::from(*point.geom()).distance(at))
    }

    /// What trims a surface on a grid.
    pub(in crate::pipeline::reconstruct) fn trimming<'a>(&'a self, geometry: &'a Geometry) -> Trimming<'a> {
        Trimming { tree: &self.tree, surfels: &self.surfels, spacing: self.spacing, geometry }
    }
}
