//! Steepest ascent of the distance inside one brick: which maximum each voxel belongs to (the watershed of -d; after
//! Meyer, Topographic distance and watershed lines, 1994).
//!
//! A voxel points to the face neighbour towards which d rises fastest, and belongs to the region of the maximum that
//! the pointers lead to. Near a cloud that is the space on the voxel's own side of it. Regions are numbers over the
//! whole grid, given by the caller; a brick knows its own maxima, and those of others where pointers leave it once its
//! neighbours know. Only comparisons of d and its differences, so no result depends on bricks.

use serde::{Deserialize, Serialize};

use crate::grid::FACES;
use crate::tile::HaloTile;

/// The region of voxels that is not known yet.
pub const UNKNOWN: u32 = u32::MAX;
/// The region outside of the domain.
pub const OUTSIDE: u32 = 0;

/// A maximum, where all pointers nearby lead to; or a pocket, where they end.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Peak {
    /// Its distance to the cloud, of a pocket the largest.
    pub depth: f32,
    /// How deep a pocket is, the most; 0 for a maximum.
    pub pocket: f32,
}

/// Work buffers for one brick.
#[derive(Clone, Debug, Default)]
pub struct Ascent {
    /// For each voxel of the grown brick the way in the tile to the neighbour towards which d rises fastest; 0 where it
    /// rises to none, and in ghosts.
    ways: Vec<i32>,
    stack: Vec<usize>,
}

impl Ascent {
    /// Finds the brick's maxima; `d` has its ghosts across faces, infinite beyond the domain. Connected voxels of one
    /// value are one maximum. Connected voxels where `pockets`, dense over the brick, is above 0 are regions of their
    /// own, and pointers end there. `regions`, dense too, gets the numbers, `first` for the first of them, and
    /// [`UNKNOWN`] elsewhere.
    pub fn peaks(
        &mut self,
        d: &HaloTile<f32>,
        spacing: [f64; 3],
        first: u32,
        pockets: Option<&[f32]>,
        regions: &mut [u32],
    ) -> Vec<Peak> {
        self.point(d, spacing);
        regions.fill(UNKNOWN);
        let depth = |place: usize| d.data()[place_in(d, place)];
        let pocket = |place: usize| pockets.map_or(0.0, |pockets| pockets[place]);
        let mut peaks = Vec::new();
        for row in rows(d).map(|(row, _)| row) {
            for seed in row..row + d.valid()[0] {
                if regions[seed] != UNKNOWN {
                    continue;
                }
                let name = first + peaks.len() as u32;
                if pocket(seed) > 0.0 {
                    let mut peak = Peak { depth: 0.0, pocket: 0.0 };
                    fill(d, seed, name, regions, &mut self.stack, |at| {
                        let joins = pocket(at) > 0.0;
                        if joins {
                            peak = Peak { depth: peak.depth.max(depth(at)), pocket: peak.pocket.max(pocket(at)) };
                        }
                        joins
                    });
                    peaks.push(peak);
                } else if self.ways[place_in(d, seed)] == 0 {
                    let height = depth(seed);
                    let ways = &self.ways;
                    fill(d, seed, name, regions, &mut self.stack, |at| {
                        ways[place_in(d, at)] == 0 && depth(at) == height && pocket(at) == 0.0
                    });
                    peaks.push(Peak { depth: height, pocket: 0.0 });
                }
            }
        }
        peaks
    }

    /// Carries regions down to the voxels whose pointers lead to known ones: `regions` has its ghosts across faces.
    /// Returns whether any voxel became known.
    pub fn descend(&mut self, d: &HaloTile<f32>, spacing: [f64; 3], regions: &mut HaloTile<u32>) -> bool {
        self.point(d, spacing);
        let data = regions.data_mut();
        let mut changed = false;
        for (_, start) in rows(d) {
            for seed in start..start + d.valid()[0] {
                if data[seed] != UNKNOWN {
                    continue;
                }
                self.stack.clear();
                let mut at = seed;
                // Ghosts lead nowhere: the walk ends there, known or not.
                while data[at] == UNKNOWN && self.ways[at] != 0 {
                    self.stack.push(at);
                    at = at.wrapping_add_signed(self.ways[at] as isize);
                }
                let region = data[at];
                changed |= region != UNKNOWN;
                for &passed in &self.stack {
                    data[passed] = region;
                }
            }
        }
        self.stack.clear();
        changed
    }

    fn point(&mut self, d: &HaloTile<f32>, spacing: [f64; 3]) {
        self.ways.clear();
        self.ways.resize(d.data().len(), 0);
        let (ways, inverse) = (&mut self.ways[..], spacing.map(|h| (1.0 / h) as f32));
        vectorised!({ d: &HaloTile<f32>, inverse: [f32; 3], ways: &mut [i32] } => point_all);
    }
}

/// Adds `first` to the numbers of all known regions.
pub fn renumber(regions: &mut [u32], first: u32) {
    for region in regions.iter_mut().filter(|region| **region != UNKNOWN) {
        *region += first;
    }
}

/// Names the voxels that are connected to `seed` by such as `joins` says yes to.
fn fill(
    d: &HaloTile<f32>,
    seed: usize,
    name: u32,
    regions: &mut [u32],
    stack: &mut Vec<usize>,
    mut joins: impl FnMut(usize) -> bool,
) {
    if joins(seed) {
        regions[seed] = name;
        stack.push(seed);
    }
    while let Some(at) = stack.pop() {
        for next in neighbours(at, d.edge(), d.valid()).into_iter().flatten() {
            if regions[next] == UNKNOWN && joins(next) {
                regions[next] = name;
                stack.push(next);
            }
        }
    }
}

#[inline(always)]
fn point_all(d: &HaloTile<f32>, inverse: [f32; 3], ways: &mut [i32]) {
    let pitch = d.pitch();
    let strides = [1, pitch, pitch * pitch];
    for (_, start) in rows(d) {
        let len = d.valid()[0];
        let beside = FACES.map(|face| {
            let stride = strides[face.axis];
            let (first, way) =
                if face.upper { (start + stride, stride as i32) } else { (start - stride, -(stride as i32)) };
            (&d.data()[first..][..len], inverse[face.axis], way)
        });
        let (here, ways) = (&d.data()[start..][..len], &mut ways[start..][..len]);
        for x in 0..len {
            let (mut steepest, mut towards) = (0.0f32, 0);
            for (next, inverse, way) in beside {
                let slope = (next[x] - here[x]) * inverse;
                towards = if slope > steepest { way } else { towards };
                steepest = if slope > steepest { slope } else { steepest };
            }
            ways[x] = towards;
        }
    }
}

/// Starts of the rows inside the domain: in the dense brick and in the tile.
#[inline(always)]
pub(crate) fn rows(d: &HaloTile<f32>) -> impl Iterator<Item = (usize, usize)> {
    let (edge, pitch, valid) = (d.edge(), d.pitch(), d.valid());
    let row = move |y: usize, z: usize| ((z * edge + y) * edge, ((z + 1) * pitch + y + 1) * pitch + 1);
    (0..valid[2]).flat_map(move |z| (0..valid[1]).map(move |y| row(y, z)))
}

fn place_in<T: Copy + Default>(tile: &HaloTile<T>, place: usize) -> usize {
    let edge = tile.edge();
    tile.at((place % edge) as isize, (place / edge % edge) as isize, (place / (edge * edge)) as isize)
}

fn neighbours(at: usize, edge: usize, valid: [usize; 3]) -> [Option<usize>; 6] {
    let place = [at % edge, at / edge % edge, at / (edge * edge)];
    let strides = [1, edge, edge * edge];
    FACES.map(|face| {
        let inside = if face.upper { place[face.axis] + 1 < valid[face.axis] } else { place[face.axis] > 0 };
        let stride = strides[face.axis];
        inside.then(|| if face.upper { at + stride } else { at - stride })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::level_set::initial::contacts::{Contact, contacts};

    /// A row of four voxels in a brick of edge 4, walls of the domain all around but across x.
    fn row(d: [f32; 4], beyond: [f32; 2]) -> HaloTile<f32> {
        let mut tile = HaloTile::new(4);
        tile.set_valid([4, 1, 1]);
        tile.data_mut().fill(-1.0);
        for (x, value) in [beyond[0], d[0], d[1], d[2], d[3], beyond[1]].into_iter().enumerate() {
            let at = tile.at(x as isize - 1, 0, 0);
            tile.data_mut()[at] = value;
        }
        tile
    }

    #[test]
    fn voxels_follow_the_steepest_way_up() {
        // A maximum of two voxels; the last voxel leads across the brick's end.
        let d = row([1.0, 3.0, 3.0, 0.5], [0.0, 4.0]);
        let (mut ascent, mut dense) = (Ascent::default(), [0; 64]);
        assert_eq!(ascent.peaks(&d, [1.0; 3], 7, None, &mut dense), [Peak { depth: 3.0, pocket: 0.0 }]);
        assert_eq!(dense[..4], [UNKNOWN, 7, 7, UNKNOWN]);
        let mut regions = HaloTile::new(4);
        regions.set_valid([4, 1, 1]);
        regions.data_mut().fill(UNKNOWN);
        let at = |x: isize| regions.at(x, 0, 0);
        let (x, beyond) = ([at(0), at(1), at(2), at(3)], at(4));
        (0..4).for_each(|n| regions.data_mut()[x[n]] = dense[n]);
        assert!(ascent.descend(&d, [1.0; 3], &mut regions), "the first voxel");
        assert_eq!(x.map(|at| regions.data()[at]), [7, 7, 7, UNKNOWN]);
        assert!(!ascent.descend(&d, [1.0; 3], &mut regions), "what lies beyond is not known yet");
        regions.data_mut()[beyond] = 2;
        assert!(ascent.descend(&d, [1.0; 3], &mut regions));
        assert_eq!(x.map(|at| regions.data()[at]), [7, 7, 7, 2]);
        let met = contacts(&d, &regions, [false; 3]);
        let between = met.iter().find(|contact| contact.regions == [2, 7]).unwrap();
        assert_eq!(*between, Contact { regions: [2, 7], pass: 0.5, place: 2, faces: 1 });
    }

    #[test]
    fn pointers_end_in_pockets() {
        let d = row([1.0, 2.0, 3.0, 4.0], [0.0, 5.0]);
        let (mut ascent, mut dense, mut pockets) = (Ascent::default(), [0; 64], [0.0; 64]);
        (pockets[1], pockets[2]) = (0.5, 0.25);
        let found = ascent.peaks(&d, [1.0; 3], 3, Some(&pockets), &mut dense);
        assert_eq!((found, &dense[..4]), (vec![Peak { depth: 3.0, pocket: 0.5 }], &[UNKNOWN, 3, 3, UNKNOWN][..]));
    }

    #[test]
    fn slopes_are_of_physical_lengths() {
        let mut d = row([1.0, 2.0, 1.5, 0.0], [0.0, 0.0]);
        let above = d.at(1, 1, 0);
        d.data_mut()[above] = 3.0;
        let (mut ascent, mut dense) = (Ascent::default(), [0; 64]);
        assert_eq!(ascent.peaks(&d, [1.0; 3], 1, None, &mut dense), [], "up across y");
        // From the third voxel 0.5 along x in a step of 1 against none along y in a step of 9.
        d.data_mut()[above] = 2.0;
        assert_eq!(ascent.peaks(&d, [1.0, 9.0, 9.0], 1, None, &mut dense), [Peak { depth: 2.0, pocket: 0.0 }]);
    }
}
