//! The neighbours that a voxel looks at, and the orders in which sweeps go through all voxels.

use crate::grid::{FACES, NEIGHBOURS_26};

/// The eight sweep orders: for each axis, whether it runs from low to high; x changes fastest.
pub const SWEEPS: [[bool; 3]; 8] = {
    let mut orders = [[true; 3]; 8];
    let mut n = 0;
    while n < 8 {
        orders[n] = [n & 1 == 0, n & 2 == 0, n & 4 == 0];
        n += 1;
    }
    orders
};

/// The neighbours whose sources a voxel is offered.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Neighbours {
    /// The six that share a face with it.
    #[default]
    Faces,
    /// All 26.
    All,
}

impl Neighbours {
    /// The steps to them: -x, +x, -y, +y, -z, +z, or all 26, z slowest.
    #[must_use]
    pub fn offsets(self) -> Vec<[i64; 3]> {
        match self {
            Self::Faces => FACES.iter().map(|face| face.offset()).collect(),
            Self::All => NEIGHBOURS_26.to_vec(),
        }
    }
}
