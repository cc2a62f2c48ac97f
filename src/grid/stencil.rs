//! Neighbour offsets: the six faces of a voxel or brick, and all 26 directions.

/// One of the six faces of a box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Face {
    /// 0, 1, 2 for x, y, z.
    pub axis: usize,
    /// False for the lower side, true for the upper.
    pub upper: bool,
}

impl Face {
    /// 0..6, in the order of [`FACES`].
    #[must_use]
    pub const fn index(self) -> usize {
        2 * self.axis + self.upper as usize
    }

    /// The step across the face, `[x, y, z]`.
    #[must_use]
    pub fn offset(self) -> [i64; 3] {
        let mut step = [0; 3];
        step[self.axis] = if self.upper { 1 } else { -1 };
        step
    }

    /// The same face seen from the other side.
    #[must_use]
    pub const fn opposite(self) -> Self {
        Self { axis: self.axis, upper: !self.upper }
    }
}

/// The six faces: -x, +x, -y, +y, -z, +z.
pub const FACES: [Face; 6] = [
    Face { axis: 0, upper: false },
    Face { axis: 0, upper: true },
    Face { axis: 1, upper: false },
    Face { axis: 1, upper: true },
    Face { axis: 2, upper: false },
    Face { axis: 2, upper: true },
];

/// The 26 directions to the neighbours of a voxel or brick, z slowest.
pub const NEIGHBOURS_26: [[i64; 3]; 26] = {
    let mut all = [[0; 3]; 26];
    let (mut code, mut n) = (0, 0);
    while code < 27 {
        if code != 13 {
            all[n] = [code % 3 - 1, code / 3 % 3 - 1, code / 9 - 1];
            n += 1;
        }
        code += 1;
    }
    all
};
