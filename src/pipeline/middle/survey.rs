//! What there is in a label volume, looked at once before its walls are drawn: so that what these take is told before a run starts.

use super::crowded::{Crowded, Filled};
use super::draw::EDGE;
use crate::error::Result;
use crate::grid::{BrickGrid, BrickId};
use crate::pipeline::distance::seeding::label_borders::Labels;

/// So many labels of boxes are listed before those that are there twice are left out.
const LISTED: usize = 1 << 21;

/// Those that are looked through whether one is there.
const RECENT: usize = 8;

/// A volume's boxes, how many labels they have and how many of their voxels touch another label.
#[derive(Clone, Debug)]
pub struct Survey {
    pub(super) crowded: Crowded,
}

impl Survey {
    /// Looks at a volume.
    ///
    /// # Errors
    /// When a box cannot be read, a voxel holds no label, or the run is interrupted.
    pub fn new(volume: &dyn Labels, check: impl Fn() -> Result<()>) -> Result<Self> {
        let grid = BrickGrid::new(volume.geometry().shape, EDGE);
        let mut faces = vec![0.0_f64; grid.len() as usize];
        let mut listed: Vec<(BrickId, u32)> = Vec::new();
        let mut kept = 0;
        let mut labels = Vec::new();
        for part in volume.natural_boxes() {
            check()?;
            volume.read_box(&part, &mut labels)?;
            let [width, height, depth] = part.shape().map(|n| n as usize);
            // Of planes one by one what touches along z is not seen, nor what does across boxes: as much as along the others.
            let axes = [width, height, depth].iter().filter(|n| **n > 1).count();
            let weight = 3.0 / axes.max(1) as f64;
            for (n, (y, z)) in part.rows().enumerate() {
                let row = &labels[n * width..][..width];
                let beside = (y > part.lo[1]).then(|| &labels[(n - 1) * width..][..width]);
                let below = (z > part.lo[2]).then(|| &labels[(n - height) * width..][..width]);
                let mut from = 0;
                while from < width {
                    let x = part.lo[0] + from as i64;
                    let to = width.min(from + (EDGE - x % EDGE) as usize);
                    let id = grid.brick_of([x, y, z]).unwrap_or(0);
                    let differ =
                        |other: &[u32]| row[from..to].iter().zip(&other[from..to]).filter(|(a, b)| a != b).count();
                    let along = row[from..to].windows(2).filter(|pair| pair[0] != pair[1]).count();
                    let across = beside.map_or(0, differ) + below.map_or(0, differ);
                    faces[id as usize] += weight * (along + across) as f64;
                    // Most often the row has the labels of the one before it.
                    for run in row[from..to].chunk_by(|a, b| a == b).map(|run| (id, run[0])) {
                        if !listed[listed.len().saturating_sub(RECENT)..].contains(&run) {
                            listed.push(run);
                        }
                    }
                    from = to;
                }
            }
            if listed.len() > kept + LISTED {
                listed.sort_unstable();
                listed.dedup();
                kept = listed.len();
            }
        }
        listed.sort_unstable();
        listed.dedup();
        let filled = listed.chunk_by(|a, b| a.0 == b.0).map(|labels| {
            let (id, part) = (labels[0].0, grid.brick_box(labels[0].0));
            Filled { layer: part.lo[2], labels: labels.len(), touching: faces[id as usize], voxels: part.volume() }
        });
        Ok(Self { crowded: Crowded::of(filled) })
    }
}
