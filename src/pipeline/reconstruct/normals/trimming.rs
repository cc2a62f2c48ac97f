//! An open surface: what is left of a surface where points support it (docs/algorithms.md, "Open surfaces").
//!
//! Vertices beyond the rim of the cloud go, and with them their triangles; those of triangles that reach across the rim are moved
//! onto it.

use glam::DVec3;
use rstar::RTree;

use super::oriented::Numbered;
use crate::grid::Geometry;
use crate::kernel::points::rim::{Rim, Support};
use crate::kernel::points::surfel::Surfel;
use crate::kernel::surface::Patch;

/// The radius of the disc that rolls along the rim, and how far beyond the outermost points it lies, in spacings of the points.
pub(in crate::pipeline::reconstruct) const RADIUS: f64 = 3.0;
const BEYOND: f64 = 0.3;

/// The points that support a surface.
pub(in crate::pipeline::reconstruct) struct Trimming<'a> {
    /// Where they are.
    pub(in crate::pipeline::reconstruct) tree: &'a RTree<Numbered>,
    /// By number.
    pub(in crate::pipeline::reconstruct) surfels: &'a [Surfel],
    /// Their spacing.
    pub(in crate::pipeline::reconstruct) spacing: f64,
    /// The grid of the patches.
    pub(in crate::pipeline::reconstruct) geometry: &'a Geometry,
}

impl Trimming<'_> {
    /// Cuts off what is beyond the rim; returns its area.
    pub(in crate::pipeline::reconstruct) fn trim(&self, patch: &mut Patch) -> f64 {
        let before = self.area(patch);
        let rim = Rim { radius: RADIUS * self.spacing, beyond: BEYOND * self.spacing };
        let places: Vec<DVec3> = patch.positions.iter().map(|&position| self.world(position)).collect();
        let supports: Vec<Support> = places.iter().map(|&at| self.support(rim, at)).collect();
        let of = |triangle: &[u32; 3]| triangle.map(|v| supports[v as usize]);
        patch.triangles.retain(|triangle| {
            let supports = of(triangle);
            supports.contains(&Support::Within) && !supports.contains(&Support::Away)
        });
        for (position, support) in patch.positions.iter_mut().zip(&supports) {
            if let Support::Beyond(back) = support {
                let back = back.to_array();
                *position = std::array::from_fn(|a| position[a] + back[a] / self.geometry.spacing[a]);
            }
        }
        drop_unused(patch);
        before - self.area(patch)
    }

    fn world(&self, position: [f64; 3]) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|a| self.geometry.origin[a] + position[a] * self.geometry.spacing[a]))
    }

    fn support(&self, rim: Rim, at: DVec3) -> Support {
        let Some(nearest) = self.tree.nearest_neighbor(at.to_array()) else { return Support::Away };
        let nearest = self.surfels[nearest.data as usize];
        if nearest.place.distance(at) <= rim.beyond {
            return Support::Within;
        }
        // Beyond a radius the first disc that is tried is empty.
        if !rim.leads(&nearest, at) || nearest.place.distance(at) >= rim.radius {
            return Support::Away;
        }
        if rim.is_surrounded(at, &self.within(at, rim.near()), nearest.normal) {
            return Support::Within;
        }
        rim.support(at, &self.within(at, 2.0 * rim.radius))
    }

    /// The points so near a place, in their order.
    fn within(&self, at: DVec3, distance: f64) -> Vec<Surfel> {
        let mut near: Vec<u32> =
            self.tree.locate_within_distance(at.to_array(), distance * distance).map(|point| point.data).collect();
        near.sort_unstable();
        near.into_iter().map(|n| self.surfels[n as usize]).collect()
    }

    fn area(&self, patch: &Patch) -> f64 {
        let area = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|v| self.world(patch.positions[v as usize]));
            0.5 * (b - a).cross(c - a).length()
        };
        patch.triangles.iter().map(area).sum()
    }
}

/// Leaves out vertices that no triangle has.
fn drop_unused(patch: &mut Patch) {
    const NONE: u32 = u32::MAX;
    let mut numbers = vec![NONE; patch.positions.len()];
    for &v in patch.triangles.iter().flatten() {
        numbers[v as usize] = 0;
    }
    for (next, number) in (0..).zip(numbers.iter_mut().filter(|number| **number != NONE)) {
        *number = next;
    }
    let mut used = numbers.iter().map(|&number| number != NONE);
    patch.keys.retain(|_| used.next() == Some(true));
    let mut used = numbers.iter().map(|&number| number != NONE);
    patch.positions.retain(|_| used.next() == Some(true));
    for v in patch.triangles.iter_mut().flatten() {
        *v = numbers[*v as usize];
    }
}
