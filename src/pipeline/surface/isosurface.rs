//! `Isosurface`: the surface u = 1/2 of a field, brick by brick, with its vertices where u has them or where more is known of them.

use crate::error::Result;
use crate::grid::{Box3, BrickId, Geometry};
use crate::kernel::surface::{MarchingCubes, Patch, Surroundings, cells_of_brick, surroundings};
use crate::store::{BoxSource, BrickArray};

/// The value of u on its surface.
const LEVEL: f32 = 0.5;

/// Where vertices go that u has between two voxels, where more is known of the surface than u tells. It is a function of a vertex's
/// place and of what surrounds it alone, so that vertices that patches share stay one.
pub trait Placement: Sync {
    /// How far a vertex may be moved, a length.
    fn farthest(&self) -> f64;

    /// Moves the vertices of a patch, of which the surroundings are given, and says how far at most.
    fn place(&self, patch: &mut Patch, around: &[Surroundings]) -> f64;
}

/// A surface as it is drawn.
#[derive(Clone, Copy)]
pub struct Isosurface<'a> {
    /// The field whose level 1/2 it is.
    pub u: &'a BrickArray<f32>,
    /// The grid of u.
    pub geometry: &'a Geometry,
    /// Where its vertices go; where u has them, if none.
    pub placement: Option<&'a dyn Placement>,
}

/// What a thread draws patches in.
pub(super) struct Pencil {
    cubes: MarchingCubes,
    values: Vec<f32>,
    around: Vec<Surroundings>,
}

impl Pencil {
    pub(super) fn new() -> Self {
        Self { cubes: MarchingCubes::new(LEVEL), values: Vec::new(), around: Vec::new() }
    }
}

impl<'a> Isosurface<'a> {
    /// With vertices where u has them.
    #[must_use]
    pub fn of(u: &'a BrickArray<f32>, geometry: &'a Geometry) -> Self {
        Self { u, geometry, placement: None }
    }

    /// True unless the brick and all it touches above are constant and equal.
    pub(super) fn is_in(&self, id: BrickId) -> bool {
        let grid = self.u.set().grid();
        let cells = cells_of_brick(&grid.brick_box(id), grid.shape(), true);
        let part = Box3::new(cells.lo, cells.hi.map(|v| v + 1));
        let reaches_out = part.intersect(&Box3::from_shape(grid.shape())) != part;
        self.u.constant_in(&part).is_none_or(|value| value >= 0.5 && reaches_out)
    }

    /// The surface in the cells of one brick, and how far its vertices were moved at most.
    pub(super) fn patch_of(&self, id: BrickId, pencil: &mut Pencil, patch: &mut Patch) -> Result<f64> {
        let grid = *self.u.set().grid();
        let Pencil { cubes, values, around } = pencil;
        let cells = cells_of_brick(&grid.brick_box(id), grid.shape(), true);
        let corners = Box3::new(cells.lo, cells.hi.map(|v| v + 1));
        let Some(placement) = self.placement else {
            read_padded(self.u, &corners, values)?;
            cubes.extract(values, &corners, &cells, patch);
            return Ok(0.0);
        };
        // The voxels around those of an edge tell of its surroundings.
        let part = corners.grow(2);
        read_padded(self.u, &part, values)?;
        cubes.extract(values, &part, &cells, patch);
        let spacing = self.geometry.spacing;
        around.clear();
        around.extend(patch.positions.iter().map(|&vertex| surroundings((values, &part), vertex, spacing, LEVEL)));
        Ok(placement.place(patch, around))
    }

    /// The box that the surface in a brick's cells lies in, world coordinates; a little larger, for positions are f32.
    pub(super) fn extent_of(&self, id: BrickId) -> ([f64; 3], [f64; 3]) {
        let (grid, geometry) = (self.u.set().grid(), self.geometry);
        let cells = cells_of_brick(&grid.brick_box(id), grid.shape(), true);
        let slack = 1e-3 * geometry.max_spacing() + self.farthest();
        (geometry.position(cells.lo).map(|v| v - slack), geometry.position(cells.hi).map(|v| v + slack))
    }

    /// How far vertices may lie from where u has them.
    pub(super) fn farthest(&self) -> f64 {
        self.placement.map_or(0.0, Placement::farthest)
    }
}

/// Reads a box that may reach out of the domain, where it is 0.
///
/// # Errors
/// When the field cannot be read.
pub fn read_padded(u: &BrickArray<f32>, part: &Box3, values: &mut Vec<f32>) -> Result<()> {
    values.clear();
    values.resize(part.len(), 0.0);
    let inside = part.intersect(&Box3::from_shape(u.set().grid().shape()));
    if inside == *part {
        return u.read_box(part, values);
    }
    let mut stored = vec![0.0; inside.len()];
    u.read_box(&inside, &mut stored)?;
    let width = inside.shape()[0] as usize;
    for (row, (y, z)) in stored.chunks_exact(width).zip(inside.rows()) {
        values[part.offset_of([inside.lo[0], y, z])..][..width].copy_from_slice(row);
    }
    Ok(())
}
