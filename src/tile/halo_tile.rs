//! `HaloTile`: a brick's copy in memory, grown by one halo layer on every side.
//!
//! The buffer is dense `[z][y][x]` over (edge + 2)^3 voxels whatever the brick's valid extents, so strides are the
//! same for every brick of a grid; local indices run from -1 (lower ghost) to `edge` (upper ghost).

/// A brick's voxels and one ghost layer around them.
#[derive(Clone, Debug)]
pub struct HaloTile<T> {
    edge: usize,
    valid: [usize; 3],
    data: Vec<T>,
}

impl<T: Copy + Default> HaloTile<T> {
    /// A tile of zeros for bricks of `edge`^3 voxels.
    #[must_use]
    pub fn new(edge: usize) -> Self {
        Self { edge, valid: [edge; 3], data: vec![T::default(); (edge + 2).pow(3)] }
    }

    /// Voxels along the brick's edge.
    #[must_use]
    pub fn edge(&self) -> usize {
        self.edge
    }

    /// Voxels along an edge of the grown tile, ghosts included: the distance between rows in the buffer.
    #[must_use]
    pub fn pitch(&self) -> usize {
        self.edge + 2
    }

    /// Voxels inside the domain along each axis; less than the edge only in bricks cut short by the domain's end.
    #[must_use]
    pub fn valid(&self) -> [usize; 3] {
        self.valid
    }

    /// Says how much of the brick is inside the domain.
    pub fn set_valid(&mut self, valid: [usize; 3]) {
        self.valid = valid;
    }

    /// Place of a voxel in the buffer; local indices, -1 and `edge` are ghosts.
    #[inline]
    #[must_use]
    pub fn at(&self, x: isize, y: isize, z: isize) -> usize {
        let pitch = self.pitch() as isize;
        (((z + 1) * pitch + y + 1) * pitch + x + 1) as usize
    }

    /// The whole buffer, ghosts included.
    #[must_use]
    pub fn data(&self) -> &[T] {
        &self.data
    }

    /// The whole buffer, for writing.
    pub fn data_mut(&mut self) -> &mut [T] {
        &mut self.data
    }

    /// Repeats the outermost valid layer in the ghost layer beyond it (homogeneous Neumann), on the side `upper` of
    /// `axis`. Called for x, then y, then z, it fills edges and corners too.
    pub fn mirror(&mut self, axis: usize, upper: bool) {
        let pitch = self.pitch();
        let stride = [1, pitch, pitch * pitch];
        let from = if upper { self.valid[axis] } else { 1 };
        let to = if upper { from + 1 } else { 0 };
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        for j in 0..pitch {
            for i in 0..pitch {
                let line = i * stride[u] + j * stride[v];
                self.data[line + to * stride[axis]] = self.data[line + from * stride[axis]];
            }
        }
    }

    /// Fills the ghost layer beyond the valid box on the side `upper` of `axis` with one value.
    pub fn fill_beyond(&mut self, axis: usize, upper: bool, value: T) {
        let pitch = self.pitch();
        let stride = [1, pitch, pitch * pitch];
        let to = if upper { self.valid[axis] + 1 } else { 0 };
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        for j in 0..pitch {
            for i in 0..pitch {
                self.data[i * stride[u] + j * stride[v] + to * stride[axis]] = value;
            }
        }
    }
}
