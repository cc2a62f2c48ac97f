//! Regions far from the cloud: bricks that are not stored, because all their voxels lie at the same (largest) distance.
//! A connected region of them is one place to a flood.

use crate::grid::{BrickId, BrickSet, FACES};

/// Connected regions of bricks that are not stored; each counts as one.
pub(crate) struct FarRegions {
    /// The region of each brick; meaningless for stored ones.
    pub(crate) region: Vec<u32>,
    /// Of each region the largest threshold at which the flood reaches it: all of `farthest` at the domain's border.
    pub(crate) level: Vec<f32>,
    pub(crate) farthest: f32,
    pub(crate) bricks: Vec<Vec<BrickId>>,
}

impl FarRegions {
    /// Those between the stored bricks of all ranks.
    pub(crate) fn new(cells: &BrickSet, farthest: f32) -> Self {
        let grid = cells.grid();
        let mut regions =
            Self { region: vec![u32::MAX; grid.len() as usize], level: Vec::new(), farthest, bricks: Vec::new() };
        for seed in 0..grid.len() {
            if cells.slot(seed).is_some() || regions.region[seed as usize] != u32::MAX {
                continue;
            }
            let name = regions.bricks.len() as u32;
            let (mut bricks, mut next, mut outside) = (vec![seed], 0, false);
            regions.region[seed as usize] = name;
            while let Some(&id) = bricks.get(next) {
                next += 1;
                for face in FACES {
                    match grid.neighbour(id, face.offset()) {
                        None => outside = true,
                        Some(n) if cells.slot(n).is_none() && regions.region[n as usize] == u32::MAX => {
                            regions.region[n as usize] = name;
                            bricks.push(n);
                        }
                        Some(_) => {}
                    }
                }
            }
            regions.bricks.push(bricks);
            regions.level.push(if outside { farthest } else { 0.0 });
        }
        regions
    }

    /// Raises the level of the region that a brick belongs to. Returns the region's bricks and level if it rose.
    pub(crate) fn raise(&mut self, id: BrickId, level: f32) -> Option<(&[BrickId], f32)> {
        self.raise_region(self.region[id as usize] as usize, level)
    }

    /// The same of the region of that number.
    pub(crate) fn raise_region(&mut self, region: usize, level: f32) -> Option<(&[BrickId], f32)> {
        let level = level.min(self.farthest);
        if level <= self.level[region] {
            return None;
        }
        self.level[region] = level;
        Some((&self.bricks[region], level))
    }
}
