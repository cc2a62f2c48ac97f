//! The shape of an object's outlines on a grid of its own: signed distance, brick by brick, near its surface.

use std::sync::Arc;

use crate::error::Result;
use crate::exec::{Engine, Stage, Workers, equal_part, one_wave, run_shared, whole_field};
use crate::grid::{Box3, BrickGrid, BrickId, BrickSet, Geometry};
use crate::kernel::level_set::cell::CELL;
use crate::kernel::outline::planar::section::Section;
use crate::kernel::outline::spatial::fitted::Fitted;
use crate::kernel::outline::spatial::lattice::Lattice;
use crate::kernel::outline::spatial::shape::Shape;
use crate::pipeline::enclosure::region::voxel_bounds;
use crate::store::BrickArray;

/// Nodes of the lattice that the function is laid out on, about.
const NODES: f64 = 60_000.0;
/// How many smallest spacings they are apart at least.
const APART: f64 = 2.0;

/// What a cell takes to be told near the surface or not, in the mean, and what it takes to be filled.
const TELLING: u64 = 1;
const FILLING: u64 = 5;

/// A fitted shape on the grid of its box.
pub(crate) struct ShapeField<'a> {
    /// The grid of the box.
    pub geometry: Geometry,
    /// The box in voxels of the image; may reach past it.
    pub window: Box3,
    shape: Shape<'a>,
}

impl<'a> ShapeField<'a> {
    /// Lays a shape out on a box around its sections that reaches `margin` beyond what it may cover.
    pub(crate) fn new(
        stage: &Stage<'_>,
        image: &Geometry,
        sections: &[&'a Section],
        fitted: &Fitted,
        margin: f64,
    ) -> Result<Self> {
        let (geometry, window) = box_around(image, sections, fitted, margin);
        let mut lattice = Lattice::for_box(geometry.shape, geometry.spacing, NODES, APART);
        let planes: Vec<usize> = (0..lattice.planes()).collect();
        // These take little beside the cells of all but small objects.
        stage.weigh(0);
        let of = |point: [f64; 3]| fitted.distance(point).0 as f32;
        let filled = stage.run(&planes, &Workers::none(), |(), &n| Ok(lattice.plane(n, &geometry, of)))?;
        lattice.fill(&filled);
        Ok(Self { shape: Shape::new(fitted, geometry.clone(), lattice, sections), geometry, window })
    }

    /// Fills a box of voxels, dense, with the signed distance.
    pub(crate) fn read(&self, part: &Box3, out: &mut [f32]) {
        self.shape.read(part, out);
    }

    /// The signed distance at a voxel.
    fn at(&self, voxel: [i64; 3]) -> f32 {
        let mut value = [0.0];
        self.read(&Box3::new(voxel, voxel.map(|v| v + 1)), &mut value);
        value[0]
    }

    /// Fills a box of voxels, dense, with how far they lie beyond the first or last outline.
    pub(crate) fn beyond_sections(&self, part: &Box3, out: &mut [f32]) {
        self.shape.beyond_sections(part, out);
    }

    /// Fills a box of voxels, dense, with how far the nearest outline's plane is.
    pub(crate) fn to_sections(&self, part: &Box3, out: &mut [f32]) {
        self.shape.to_sections(part, out);
    }

    /// The cells with voxels within `reach` of the surface.
    pub(crate) fn cells_within(&self, stage: &Stage<'_>, reach: f64) -> Result<Arc<BrickSet>> {
        let grid = BrickGrid::new(self.geometry.shape, CELL as i64);
        let ids: Vec<BrickId> = (0..grid.len()).collect();
        let may_be_near =
            run_shared(stage, &ids, &Workers::none(), |(), &id| Ok(!self.shape.is_beyond(&grid.brick_box(id), reach)))?;
        let asked: Vec<BrickId> = ids.into_iter().filter(|&id| may_be_near[id as usize]).collect();
        let telling = TELLING * asked.len() as u64;
        stage.expect(telling + FILLING * asked.len() as u64);
        stage.weigh(TELLING);
        let is_near = run_shared(stage, &asked, &Workers::new(Vec::new), |values, &id| {
            let part = grid.brick_box(id);
            // Most cells near the surface show it at a few voxels.
            if a_few(&part).any(|voxel| f64::from(self.at(voxel).abs()) <= reach) {
                return Ok(true);
            }
            values.resize(part.len(), 0.0);
            self.read(&part, values);
            Ok(values.iter().any(|v| f64::from(v.abs()) <= reach))
        })?;
        let mut near = may_be_near;
        asked.iter().zip(is_near).for_each(|(&id, is_near)| near[id as usize] = is_near);
        let set = Arc::new(BrickSet::from_fn(grid, |id| near[id as usize]));
        stage.expect(telling + FILLING * set.len() as u64);
        stage.weigh(FILLING);
        Ok(set)
    }

    /// The signed distance on cells, and how deep the shape is in them; as deep as can be where it fills others.
    pub(crate) fn on_cells(
        &self,
        stage: &Stage<'_>,
        engine: &Engine,
        set: &Arc<BrickSet>,
    ) -> Result<(BrickArray<f32>, f64)> {
        let own = &Arc::new(equal_part(stage.comm(), set));
        let mut field = BrickArray::with_faces(engine.scratch(), own)?;
        let grid = *set.grid();
        let mut fills = false;
        for id in (0..grid.len()).filter(|&id| set.slot(id).is_none()) {
            let value = self.at(grid.brick_box(id).lo);
            field.set_absent(id, value);
            fills |= value < 0.0;
        }
        let lowest = stage.run(&one_wave(own), &Workers::new(Vec::new), |values, &slot| {
            let part = grid.brick_box(own.id(slot));
            values.resize(part.len(), 0.0);
            self.read(&part, values);
            field.write_box(&part, values);
            field.refresh_faces(slot);
            Ok(values.iter().copied().fold(f32::INFINITY, f32::min))
        })?;
        let lowest = stage.comm().least(f64::from(lowest.into_iter().fold(0.0, f32::min)))?;
        let deepest = if fills { f64::INFINITY } else { -lowest };
        Ok((whole_field(stage, field, set)?, deepest))
    }
}

/// The voxels of a box at a quarter and three quarters along each axis.
fn a_few(part: &Box3) -> impl Iterator<Item = [i64; 3]> {
    let part = *part;
    (0..8).map(move |corner| std::array::from_fn(|a| part.lo[a] + part.shape()[a] * (1 + 2 * (corner >> a & 1)) / 4))
}

/// The grid around sections: their bounds, how far the shape may reach beyond them, and a margin, from a whole cell on.
fn box_around(image: &Geometry, sections: &[&Section], fitted: &Fitted, margin: f64) -> (Geometry, Box3) {
    let lifted = |section: &&Section| -> Vec<[f64; 3]> {
        let beyond = fitted.ends().map_or(0.0, |ends| ends.height());
        let points = section.curves.iter().flat_map(|curve| &curve.points);
        points.flat_map(|&p| [-beyond, beyond].map(|by| section.plane.lift(p, by))).collect()
    };
    let bounds = voxel_bounds(&sections.iter().flat_map(lifted).collect::<Vec<_>>(), image);
    let cell = CELL as i64;
    let margin: [i64; 3] = image.spacing.map(|h| (margin / h).ceil() as i64 + 2);
    let window = Box3 {
        lo: std::array::from_fn(|a| (bounds.lo[a] - margin[a]).div_euclid(cell) * cell),
        hi: std::array::from_fn(|a| bounds.hi[a] + margin[a]),
    };
    (image.crop(&window), window)
}
