//! A fitted shape on a grid: its function read from a lattice, and, where that does not pass through all marks, what is
//! left to the sections' own signed distances (`residual.rs`).

use super::ends::Ends;
use super::fitted::Fitted;
use super::lattice::Lattice;
use super::residual::{Family, MOST_LEFT, families, share_out};
use crate::grid::{Box3, Geometry};
use crate::kernel::outline::planar::section::Section;

/// A shape on a grid.
#[derive(Clone, Debug)]
pub struct Shape<'a> {
    geometry: Geometry,
    lattice: Lattice,
    ends: Option<Ends>,
    /// Sections by direction.
    families: Vec<Family<'a>>,
    /// Whether the function passes through all marks.
    is_close: bool,
}

/// A function that passes outlines within this part of the smallest spacing needs no correction.
const CLOSE: f64 = 0.2;

impl<'a> Shape<'a> {
    /// The fitted function, laid out on a lattice of a grid.
    #[must_use]
    pub fn new(fitted: &Fitted, geometry: Geometry, lattice: Lattice, sections: &[&'a Section]) -> Self {
        let families = families(sections);
        let mut shape = Self { geometry, lattice, ends: fitted.ends(), families, is_close: true };
        let spacing = shape.geometry.min_spacing();
        let off = |section: &Section| {
            let on = section.curves.iter().flat_map(|curve| curve.points.iter().step_by(3));
            on.map(|&p| shape.on_lattice(section.plane.lift(p, 0.0)).abs()).fold(0.0, f64::max)
        };
        shape.is_close = sections.iter().all(|section| off(section) <= CLOSE * spacing);
        shape
    }

    fn on_lattice(&self, point: [f64; 3]) -> f64 {
        f64::from(self.lattice.at(self.geometry.to_voxels(point)))
    }

    /// True where no voxel of a box lies within `reach` of the surface, as far as its middle tells.
    #[must_use]
    pub fn is_beyond(&self, part: &Box3, reach: f64) -> bool {
        const STEEPEST: f64 = 1.5;
        let middle = std::array::from_fn(|a| 0.5 * (part.lo[a] + part.hi[a] - 1) as f64);
        let half = 0.5 * self.geometry.length(part.shape());
        let left = if self.is_close { 0.0 } else { MOST_LEFT * self.geometry.min_spacing() };
        f64::from(self.lattice.at(middle)).abs() > reach + left + STEEPEST * half
    }

    /// Fills a box of voxels, dense, with the signed distance.
    pub fn read(&self, part: &Box3, out: &mut [f32]) {
        self.lattice.read(part, out);
        if !self.is_close {
            share_out(&self.families, &self.geometry, part, |point| self.on_lattice(point), out);
        }
        if let Some(ends) = self.ends {
            self.for_each(part, out, |point, value| *value = value.max(ends.beyond(point) as f32));
        }
    }

    /// Fills a box of voxels, dense, with how far they lie beyond the first or last section of a direction; with 0 where
    /// there are several.
    pub fn beyond_sections(&self, part: &Box3, out: &mut [f32]) {
        match self.ends {
            Some(ends) => self.for_each(part, out, |point, value| *value = ends.beyond_sections(point) as f32),
            None => out.fill(0.0),
        }
    }

    /// Fills a box of voxels, dense, with how far the nearest section's plane is: there is no doubt of what lies in it.
    pub fn to_sections(&self, part: &Box3, out: &mut [f32]) {
        let nearest = |point| self.families.iter().map(|family| family.away(point)).fold(f64::INFINITY, f64::min);
        self.for_each(part, out, |point, value| *value = nearest(point) as f32);
    }

    fn for_each(&self, part: &Box3, out: &mut [f32], mut with: impl FnMut([f64; 3], &mut f32)) {
        let width = part.shape()[0] as usize;
        for ((y, z), row) in part.rows().zip(out.chunks_exact_mut(width)) {
            for (x, value) in (part.lo[0]..).zip(row) {
                with(self.geometry.position([x, y, z]), value);
            }
        }
    }
}
