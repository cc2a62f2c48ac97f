//! The six outermost layers of a cell, and how far they moved while it was relaxed: what its neighbours do not know
//! yet.

use crate::grid::{FACES, Face};
use crate::kernel::level_set::cell::{CELL, GROWN};

const AREA: usize = CELL * CELL;

/// Copies of the layers of a cell beside its faces, in the order of [`FACES`].
#[derive(Clone, Debug)]
pub struct Border(Vec<f32>);

impl Border {
    /// Room for the six layers.
    #[must_use]
    pub fn new() -> Self {
        Self(vec![0.0; 6 * AREA])
    }

    /// Keeps the layers of a cell with its halo, dense `[z][y][x]`.
    pub fn keep(&mut self, u: &[f32]) {
        for (kept, face) in self.0.chunks_exact_mut(AREA).zip(FACES) {
            for (j, kept) in kept.chunks_exact_mut(CELL).enumerate() {
                kept.copy_from_slice(&row(u, face, j));
            }
        }
    }

    /// For each face the root of the sum of squared changes of its layer since it was kept.
    #[must_use]
    pub fn moved(&self, u: &[f32]) -> [f64; 6] {
        let mut moved = [0.0; 6];
        for (sum, (kept, face)) in moved.iter_mut().zip(self.0.chunks_exact(AREA).zip(FACES)) {
            // Rows are added up lane by lane, so that the sum is a vector's.
            let mut lanes = [0.0_f32; CELL];
            for (j, kept) in kept.chunks_exact(CELL).enumerate() {
                let now = row(u, face, j);
                for i in 0..CELL {
                    lanes[i] += (now[i] - kept[i]) * (now[i] - kept[i]);
                }
            }
            *sum = lanes.iter().map(|&lane| f64::from(lane)).sum::<f64>().sqrt();
        }
        moved
    }
}

impl Default for Border {
    fn default() -> Self {
        Self::new()
    }
}

/// Row `j` of the layer beside a face: along y beside the faces across x, else along x.
#[inline]
fn row(u: &[f32], face: Face, j: usize) -> [f32; CELL] {
    let layer = if face.upper { CELL } else { 1 };
    let [y, z] = [[1, j + 1], [layer, j + 1], [j + 1, layer]][face.axis];
    let line = &u[(z * GROWN + y) * GROWN..];
    if face.axis == 0 {
        let column = &line[layer..][..(CELL - 1) * GROWN + 1];
        std::array::from_fn(|i| column[i * GROWN])
    } else {
        std::array::from_fn(|i| line[1..1 + CELL][i])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::level_set::cell::GROWN_LEN;

    #[test]
    fn a_voxel_counts_for_the_faces_that_it_lies_beside() {
        let mut u = vec![0.5; GROWN_LEN];
        let mut border = Border::new();
        border.keep(&u);
        // Local (0, 7, 15): beside -x and +z.
        u[(16 * GROWN + 8) * GROWN + 1] += 0.25;
        // A ghost and a voxel inside count for none.
        u[0] = 9.0;
        u[(8 * GROWN + 8) * GROWN + 8] = 9.0;
        assert_eq!(border.moved(&u), [0.25, 0.0, 0.0, 0.0, 0.0, 0.25]);
    }
}
