//! The start of the time loop on one brick (docs/algorithms.md, "Narrow band").
//!
//! u = 1 inside, 0 outside. Solved are the voxels within `inner` of the cloud on the inside and within `outer` on the
//! outside, and those near the border between both sides wherever it is, across holes too; all others keep their start
//! value. Comparisons alone, voxel by voxel, so the result does not depend on how the volume is divided.
//!
//! Bricks are dense `[z][y][x]` with row length and plane height `edge`; `valid` voxels along each axis are inside the
//! domain. `d` is the distance to the cloud, physical lengths; `inside` is 1 or 0, with [`HELD`]; `near` is above 0
//! near the border.

use crate::grid::FACES;
use crate::tile::HaloTile;

/// Added to the side of voxels that stay on it.
pub const HELD: u8 = 2;

/// How far u of a held voxel is from the surface's 1/2: little, so that a shell of such voxels is thin.
const HELD_OFF: f32 = 0.02;

/// The start value on a side.
#[must_use]
pub fn value(side: u8) -> f32 {
    let inside = side & 1 == 1;
    match (side & HELD == HELD, inside) {
        (true, true) => 0.5 + HELD_OFF,
        (true, false) => 0.5 - HELD_OFF,
        (false, _) => f32::from(u8::from(inside)),
    }
}

/// How far the band reaches on both sides of the cloud. Physical lengths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reaches {
    /// The band's reach on the inside.
    pub inner: f32,
    /// The band's reach on the outside.
    pub outer: f32,
}

impl Reaches {
    /// True for voxels that are solved wherever the border is.
    #[inline]
    #[must_use]
    pub fn solves(self, d: f32, inside: u8) -> bool {
        d <= if inside & 1 == 0 { self.outer } else { self.inner }
    }
}

/// What tells the band of a brick.
#[derive(Clone, Copy, Debug)]
pub struct CellSides<'a> {
    /// Distance to the cloud.
    pub d: &'a [f32],
    /// 1 inside, 0 outside; with [`HELD`] where it stays so.
    pub inside: &'a [u8],
    /// Above 0 near the border, where that is far from the cloud anywhere.
    pub near: Option<&'a [u8]>,
}

impl CellSides<'_> {
    fn solves(&self, place: usize, reaches: Reaches) -> bool {
        let (d, inside) = (self.d[place], self.inside[place]);
        inside & HELD == 0 && (reaches.solves(d, inside) || self.near.is_some_and(|near| near[place] > 0))
    }
}

/// Sets 1 at voxels of the domain that are solved, 0 elsewhere; returns how many there are.
pub fn mark(sides: CellSides<'_>, edge: usize, valid: [usize; 3], reaches: Reaches, solved: &mut [u8]) -> u64 {
    solved.fill(0);
    let mut count = 0;
    for place in rows(edge, valid).flatten() {
        solved[place] = u8::from(sides.solves(place, reaches));
        count += u64::from(solved[place]);
    }
    count
}

/// True when any voxel of the domain is solved.
#[must_use]
pub fn holds(sides: CellSides<'_>, edge: usize, valid: [usize; 3], reaches: Reaches) -> bool {
    rows(edge, valid).flatten().any(|place| sides.solves(place, reaches))
}

/// The start of u around a surface, whose signed distance is `shape`: 1 inside, 0 outside; or falling from 1 to 0 over
/// `width` across it, where that is above 0.
pub fn from_shape(shape: &[f32], width: f32, u: &mut [f32]) {
    if width > 0.0 {
        u.iter_mut().zip(shape).for_each(|(u, s)| *u = (0.5 - s / width).clamp(0.0, 1.0));
    } else {
        u.iter_mut().zip(shape).for_each(|(u, &s)| *u = value(u8::from(s < 0.0)));
    }
}

/// A potential that pulls towards sources as their distance does, but fades beyond `range`: `d range / (d + range)`.
pub fn fading(distance: &[f32], range: f32, out: &mut [f32]) {
    out.iter_mut().zip(distance).for_each(|(out, d)| *out = d / (1.0 + d / range));
}

/// Sets 1 at voxels of the domain within `reach` of a surface, 0 elsewhere; `shape` is the signed distance to it.
/// Returns how many there are.
pub fn near_surface(shape: &[f32], edge: usize, valid: [usize; 3], reach: f32, solved: &mut [u8]) -> u64 {
    solved.fill(0);
    let mut count = 0;
    for place in rows(edge, valid).flatten() {
        solved[place] = u8::from(shape[place].abs() <= reach);
        count += u64::from(solved[place]);
    }
    count
}

/// Sets 1 at voxels beside the border that no reach solves, 0 elsewhere; returns whether there are any. `inside` has
/// its ghosts across faces.
pub fn border(d: &[f32], inside: &HaloTile<u8>, reaches: Reaches, near: &mut [u8]) -> bool {
    near.fill(0);
    let mut found = false;
    for_each_with_beside(inside, |place, here, beside| {
        if beside.iter().any(|side| side & 1 != here & 1) && !reaches.solves(d[place], here) {
            near[place] = 1;
            found = true;
        }
    });
    found
}

/// Grows what is near by a voxel: beside those that have at most `step`, those that have none become `step + 1`.
/// `tile` has its ghosts across faces; `near` is the brick.
pub fn grow(tile: &HaloTile<u8>, step: u8, near: &mut [u8]) {
    for_each_with_beside(tile, |place, here, beside| {
        if here == 0 && beside.iter().any(|near| (1..=step).contains(near)) {
            near[place] = step + 1;
        }
    });
}

fn for_each_with_beside(tile: &HaloTile<u8>, mut visit: impl FnMut(usize, u8, [u8; 6])) {
    let (pitch, edge) = (tile.pitch(), tile.edge());
    let strides = [1, pitch, pitch * pitch];
    for row in rows(edge, tile.valid()) {
        let start = tile.at(0, (row.start / edge % edge) as isize, (row.start / (edge * edge)) as isize);
        for (x, place) in row.enumerate() {
            let at = start + x;
            let beside = FACES.map(|face| {
                let stride = strides[face.axis];
                tile.data()[if face.upper { at + stride } else { at - stride }]
            });
            visit(place, tile.data()[at], beside);
        }
    }
}

/// The places of each row inside the domain.
fn rows(edge: usize, valid: [usize; 3]) -> impl Iterator<Item = std::ops::Range<usize>> {
    let starts = (0..valid[2]).flat_map(move |z| (0..valid[1]).map(move |y| (z * edge + y) * edge));
    starts.map(move |start| start..start + valid[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    const EDGE: usize = 4;
    const REACHES: Reaches = Reaches { inner: 2.0, outer: 3.0 };

    /// A distance and the sides in one brick: inside at first, outside from z = 2 on.
    fn fields() -> ([f32; 64], [u8; 64]) {
        let d = std::array::from_fn(|n| 0.5 * (n % EDGE + n / EDGE % EDGE) as f32 + 0.5);
        (d, std::array::from_fn(|n| u8::from(n < 32)))
    }

    #[test]
    fn each_side_has_its_reach_and_the_domain_its_end() {
        let (d, inside) = fields();
        let mut solved = [7; 64];
        // x + y <= 3 inside, x + y <= 5 outside; of 3 x 4 x 3 voxels.
        let count = mark(CellSides { d: &d, inside: &inside, near: None }, EDGE, [3, 4, 3], REACHES, &mut solved);
        let wanted = |n: usize| {
            let [x, y, z] = [n % EDGE, n / EDGE % EDGE, n / 16];
            x < 3 && z < 3 && x + y <= if z < 2 { 3 } else { 5 }
        };
        assert!((0..64).all(|n| solved[n] == u8::from(wanted(n))), "{solved:?}");
        assert_eq!(count, 2 * (3 + 3 + 2 + 1) + 12);
    }

    #[test]
    fn what_is_held_is_not_solved_and_what_is_near_the_border_is() {
        let (d, mut inside) = fields();
        let nothing = Reaches { inner: 0.0, outer: 0.0 };
        let sides = CellSides { d: &d, inside: &inside, near: None };
        assert!(holds(sides, EDGE, [4; 3], REACHES) && !holds(sides, EDGE, [4; 3], nothing));
        let mut near = [0; 64];
        near[63] = 3;
        let sides = CellSides { near: Some(&near), ..sides };
        assert!(holds(sides, EDGE, [4; 3], nothing) && !holds(sides, EDGE, [4, 4, 3], nothing));
        inside.fill(HELD | 1);
        assert!(!holds(CellSides { d: &d, inside: &inside, near: Some(&near) }, EDGE, [4; 3], REACHES));
    }

    #[test]
    fn the_border_far_from_the_cloud_is_solved_with_what_is_near_it() {
        let (d, inside) = fields();
        let mut tile = HaloTile::new(EDGE);
        for n in 0..64 {
            let at = tile.at((n % EDGE) as isize, (n / EDGE % EDGE) as isize, (n / 16) as isize);
            tile.data_mut()[at] = inside[n];
        }
        for (axis, upper) in [(0, false), (0, true), (1, false), (1, true), (2, false), (2, true)] {
            tile.mirror(axis, upper);
        }
        let mut near = [9; 64];
        assert!(border(&d, &tile, REACHES, &mut near));
        let wanted = |n: usize| match (n / 16, n % EDGE + n / EDGE % EDGE) {
            (1, 4..) | (2, 6..) => 1,
            _ => 0,
        };
        assert!((0..64).all(|n| near[n] == wanted(n)), "{near:?}");
        for n in 0..64 {
            let at = tile.at((n % EDGE) as isize, (n / EDGE % EDGE) as isize, (n / 16) as isize);
            tile.data_mut()[at] = near[n];
        }
        grow(&tile, 1, &mut near);
        assert_eq!((near[15], near[63], near[62], near[31]), (2, 2, 0, 1));
        assert!(!border(&[0.0; 64], &tile, REACHES, &mut near), "all is solved anyhow");
    }
}
