//! `Cells`: the corners of a polygon sorted into squares of its plane, so that only those near a triangle are looked at.

/// Polygons of fewer corners are searched whole.
const FEW: usize = 32;

/// Corners by squares of the plane.
#[derive(Debug)]
pub(crate) struct Cells {
    lo: [f64; 2],
    /// Squares along each axis for each unit of length.
    scale: [f64; 2],
    side: usize,
    starts: Vec<u32>,
    order: Vec<u32>,
}

impl Cells {
    /// Sorts the corners at these places, one at least.
    pub(crate) fn new(points: &[[f64; 2]]) -> Self {
        let side = if points.len() < FEW { 1 } else { ((points.len() as f64).sqrt() as usize).min(1024) };
        let bound = |pick: fn(f64, f64) -> f64, start: f64| -> [f64; 2] {
            std::array::from_fn(|a| points.iter().fold(start, |best, p| pick(best, p[a])))
        };
        let (lo, hi) = (bound(f64::min, f64::INFINITY), bound(f64::max, f64::NEG_INFINITY));
        let scale = std::array::from_fn(|a| if hi[a] > lo[a] { side as f64 / (hi[a] - lo[a]) } else { 0.0 });
        let mut cells = Self { lo, scale, side, starts: vec![0; side * side + 1], order: vec![0; points.len()] };
        let square = |cells: &Self, p: [f64; 2]| cells.along(1, p[1]) * side + cells.along(0, p[0]);
        for &p in points {
            let at = square(&cells, p);
            cells.starts[at + 1] += 1;
        }
        for n in 1..cells.starts.len() {
            cells.starts[n] += cells.starts[n - 1];
        }
        let mut next = cells.starts.clone();
        for (n, &p) in points.iter().enumerate() {
            let at = square(&cells, p);
            cells.order[next[at] as usize] = n as u32;
            next[at] += 1;
        }
        cells
    }

    fn along(&self, axis: usize, x: f64) -> usize {
        (((x - self.lo[axis]) * self.scale[axis]).max(0.0) as usize).min(self.side - 1)
    }

    /// The corners of the squares that a box touches, square by square.
    pub(crate) fn beside(&self, lo: [f64; 2], hi: [f64; 2]) -> impl Iterator<Item = &[u32]> {
        let range = |a: usize| self.along(a, lo[a])..=self.along(a, hi[a]);
        let columns = range(0);
        range(1)
            .flat_map(move |y| columns.clone().map(move |x| y * self.side + x))
            .map(|at| &self.order[self.starts[at] as usize..self.starts[at + 1] as usize])
    }
}
