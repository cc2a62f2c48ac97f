//! Which voxels of a cell are solved and where the domain ends: what the level set and the presmoothing share.

use crate::kernel::level_set::cell::{CELL, CELL_LEN};

/// Which voxels of a cell are solved, and where the domain ends.
#[derive(Clone, Debug)]
pub struct CellMask {
    /// 1 for voxels of the band, 0 for voxels that keep their value; dense over the cell.
    pub solved: Vec<u8>,
    /// Weights of the lower and upper neighbour along each axis: 0 at the domain's border, else 1.
    pub open: [[[f32; CELL]; 2]; 3],
    /// 1 for columns (x) inside the domain, 0 for those beyond its end.
    pub columns: [f32; CELL],
    /// Planes (z) that hold solved voxels, half open.
    pub planes: [usize; 2],
    /// Rows (y) of each plane that hold solved voxels, half open.
    pub rows: [[usize; 2]; CELL],
    /// Number of solved voxels.
    pub count: u32,
}

impl CellMask {
    /// A mask in which nothing is solved.
    #[must_use]
    pub fn new() -> Self {
        Self {
            solved: vec![0; CELL_LEN],
            open: [[[1.0; CELL]; 2]; 3],
            columns: [1.0; CELL],
            planes: [0; 2],
            rows: [[0; 2]; CELL],
            count: 0,
        }
    }

    /// Takes over a cell's flags; `valid` voxels along each axis are inside the domain, and `border[axis]` says
    /// whether the domain ends at the cell's lower and upper side.
    pub fn set(&mut self, solved: &[u8], valid: [usize; 3], border: [[bool; 2]; 3]) {
        self.solved.copy_from_slice(solved);
        self.count = 0;
        (self.rows, self.planes) = ([[CELL, 0]; CELL], [CELL, 0]);
        for (row, flags) in solved.chunks_exact(CELL).enumerate() {
            let count: u32 = flags.iter().map(|&f| u32::from(f)).sum();
            if count > 0 {
                let (y, z) = (row % CELL, row / CELL);
                self.rows[z] = [self.rows[z][0].min(y), self.rows[z][1].max(y + 1)];
                self.planes = [self.planes[0].min(z), self.planes[1].max(z + 1)];
                self.count += count;
            }
        }
        self.columns = std::array::from_fn(|x| if x < valid[0] { 1.0 } else { 0.0 });
        self.open = [[[1.0; CELL]; 2]; 3];
        for axis in 0..3 {
            if border[axis][0] {
                self.open[axis][0][0] = 0.0;
            }
            if border[axis][1] {
                self.open[axis][1][valid[axis] - 1] = 0.0;
            }
        }
    }
}

impl CellMask {
    /// The rows on which the vertices or z-faces below plane `z` are needed: those of the planes on both its sides.
    pub(crate) fn rows_around(&self, z: usize) -> [usize; 2] {
        let below = z.checked_sub(1).map_or([CELL, 0], |z| self.rows[z]);
        let above = self.rows.get(z).copied().unwrap_or([CELL, 0]);
        [below[0].min(above[0]), below[1].max(above[1])]
    }
}

impl Default for CellMask {
    fn default() -> Self {
        Self::new()
    }
}
