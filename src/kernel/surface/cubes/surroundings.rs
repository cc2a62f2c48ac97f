//! What u tells of the surroundings of a surface u = level, where it falls from inside to outside. Which way is out: against the gradient of
//! u, of central differences between voxels, linear in between. And how near another sheet may be: where a voxel near a vertex has the
//! surface on both sides of it along an axis, these two are so far apart along it.

use glam::DVec3;

use super::marching_cubes::fraction;
use crate::grid::Box3;
use crate::kernel::geometry::vector::unit;

/// What surrounds a vertex of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surroundings {
    /// The unit vector that leads out; 0 where u does not tell.
    pub outward: DVec3,
    /// How thick the parts of the inside and the outside are around the vertex, along the axis along which they are thinnest; infinite where
    /// none is thinner than two voxels.
    pub room: f64,
}

/// The surroundings of a vertex between two voxels, in voxels, in the world of voxels of this spacing.
///
/// `values` is dense `[z][y][x]` over `part`, which must hold two layers of voxels around those two.
#[must_use]
pub fn surroundings((values, part): (&[f32], &Box3), vertex: [f64; 3], spacing: [f64; 3], level: f32) -> Surroundings {
    let strides = [1, part.shape()[0] as usize, (part.shape()[0] * part.shape()[1]) as usize];
    let axis = (0..3).find(|&a| vertex[a].fract() != 0.0).unwrap_or(0);
    let lower = vertex.map(|v| v.floor() as i64);
    let mut upper = lower.map(|v| v + 1);
    upper[axis] += 1;
    let mut room = f64::INFINITY;
    let around = Box3::new(lower, upper).grow(1);
    for at in around.rows().flat_map(|(y, z)| (0..around.shape()[0] as usize).map(move |x| (x, y, z))) {
        let at = part.offset_of([around.lo[0], at.1, at.2]) + at.0;
        let own = values[at];
        for a in 0..3 {
            let (below, above) = (values[at - strides[a]], values[at + strides[a]]);
            let is_inside = own >= level;
            if (below >= level) != is_inside && (above >= level) != is_inside {
                let thick = 1.0 - fraction(below, own, level) + fraction(own, above, level);
                room = room.min(thick * spacing[a]);
            }
        }
    }
    Surroundings { outward: outward(values, part, vertex, spacing), room }
}

/// The unit vector that leads out at a place, in the world of voxels of this spacing; 0 where u is constant around it.
///
/// `values` is dense `[z][y][x]` over `part`, in voxel indices; `place` is in voxels, and `part` must hold the voxels around it and those
/// beside them: a place outside of these is taken as the nearest inside.
#[must_use]
pub fn outward(values: &[f32], part: &Box3, place: [f64; 3], spacing: [f64; 3]) -> DVec3 {
    let mut lower = [0; 3];
    let mut on = [0.0; 3];
    for a in 0..3 {
        // The last voxel whose upper neighbour, and the one beside that, are there.
        let last = (part.hi[a] - 3).max(part.lo[a] + 1);
        lower[a] = (place[a].floor() as i64).clamp(part.lo[a] + 1, last);
        on[a] = (place[a] - lower[a] as f64).clamp(0.0, 1.0);
    }
    let strides = [1, part.shape()[0] as usize, (part.shape()[0] * part.shape()[1]) as usize];
    let first = part.offset_of(lower);
    let mut falls = [0.0; 3];
    for corner in 0..8_usize {
        let bit = |a: usize| corner >> a & 1;
        let share: f64 = (0..3).map(|a| if bit(a) == 1 { on[a] } else { 1.0 - on[a] }).product();
        // A place between two voxels has all others with a share of 0.
        if share > 0.0 {
            let at = first + (0..3).map(|a| bit(a) * strides[a]).sum::<usize>();
            for a in 0..3 {
                let [below, above] = [values[at - strides[a]], values[at + strides[a]]].map(f64::from);
                falls[a] += share * (below - above);
            }
        }
    }
    unit(DVec3::from_array(std::array::from_fn(|a| falls[a] / spacing[a])))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A plane that falls one way, between voxels and on them, on a grid of three spacings.
    #[test]
    fn a_plane_has_its_normal() {
        let part = Box3::new([-2, 3, 10], [5, 9, 15]);
        let (spacing, normal) = ([0.5, 1.0, 2.0], DVec3::new(1.0, -2.0, 0.5).normalize());
        let world = |p: [f64; 3]| DVec3::from_array(std::array::from_fn(|a| p[a] * spacing[a]));
        let u = |p: [f64; 3]| (3.0 - 0.1 * world(p).dot(normal)) as f32;
        let values: Vec<f32> = part
            .rows()
            .flat_map(|(y, z)| (part.lo[0]..part.hi[0]).map(move |x| u([x, y, z].map(|v| v as f64))))
            .collect();
        for place in [[0.3, 5.2, 12.5], [1.0, 4.0, 11.0], [2.0, 6.7, 12.0], [3.0, 7.0, 13.0], [-9.0, 90.0, 0.0]] {
            let found = outward(&values, &part, place, spacing);
            assert!(found.distance(normal) < 1e-5, "{place:?}: {found}");
        }
        assert_eq!(outward(&vec![0.25; part.len()], &part, [1.0, 5.0, 12.0], spacing), DVec3::ZERO);
    }

    /// A plate across y, 0.8 voxels thick: above it, below it, and a vertex far from it.
    #[test]
    fn the_room_is_that_of_a_thin_part() {
        let part = Box3::new([0; 3], [5, 12, 5]);
        let u = |y: i64| [0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.625, 0.0, 0.0, 0.0_f32][y as usize];
        let values: Vec<f32> = part.rows().flat_map(|(y, _)| [u(y); 5]).collect();
        let room = |y: f64| surroundings((&values, &part), [2.0, y, 2.0], [3.0, 2.0, 1.0], 0.5).room;
        let thin = 2.0 * (1.0 - 0.8) * 2.0;
        assert!((room(7.8) - thin).abs() < 1e-6 && (room(8.2) - thin).abs() < 1e-6, "{} {thin}", room(7.8));
        assert!((room(6.5) - thin).abs() < 1e-6, "beside it: {}", room(6.5));
        assert!((room(5.5) - (0.5 + 0.8) * 2.0).abs() < 1e-6, "the gap below it: {}", room(5.5));
        assert_eq!(room(2.5), f64::INFINITY);
    }
}
