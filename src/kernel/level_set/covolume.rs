//! Coefficients of the semi-implicit co-volume scheme on one cell (Kósa PhD, eq. 3.12, 3.14; algorithms: section 5).
//!
//! The scheme for a voxel p with face neighbours q is `u_p + sum a_pq (u_q - u_p) = u_p^old`. With `c_pq = -a_pq >= 0`
//!
//! ```text
//! c_pq = tau / h_s^2 * ( max(theta (d_q - d_p) + r_p (g_q - g_p), 0) + delta / 4 * M_p * S_pq )
//! S_pq = sum over the face's tetrahedra of 1 / sqrt(eps^2 + G_T^2)      M_p = sqrt(eps^2 + (mean of the 24 G_T)^2)
//! r_p  = rho / |grad g_p|_eps   (rho where the edge term is not normalised)
//! ```
//!
//! which is the printed scheme with `A_q / m = 1 / h_s` and the velocity written out. The solver gets it divided by
//! the diagonal, `u_p = r_p + sum w_pq u_q` with `w = c / (1 + sum c)`: an average, so the maximum principle is plain
//! to see. Voxels outside of the band have w = 0 and keep their value; faces on the domain's border have c = 0.
//!
//! In: grown cells of u, d, g (f32; d in physical units, g in 0..1). Halo 1, all 26 directions for u. Work buffers:
//! a few planes. Cost: 12 tetrahedra norms and about 60 operations per voxel.

use super::gradients::{FaceNorms, Metric, faces, vertex_plane};
use super::scheme::{LANES, SCHEME_LAYERS, write_part};
use super::{CELL, CELL_LEN, GROWN, PLANE};

/// What moves the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Velocity {
    /// Weight of the attraction to the points, `-grad d`.
    pub theta: f32,
    /// Weight of the attraction to the image's edges, `-grad g`.
    pub rho: f32,
    /// Weight of the curvature, a length.
    pub delta: f32,
    /// Regularisation of gradient norms, in units of one over length.
    pub epsilon: f32,
    /// Length of the time step.
    pub tau: f32,
    /// True when the edge term is divided by the norm of grad g.
    pub normalised: bool,
}

/// The fields of one grown cell. The edge detector may be empty when `rho` is 0.
#[derive(Clone, Copy, Debug)]
pub struct Fields<'a> {
    /// Segmentation function at the old time step.
    pub u: &'a [f32],
    /// Distance to the cloud, physical.
    pub d: &'a [f32],
    /// Edge detector.
    pub g: &'a [f32],
}

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
    fn rows_around(&self, z: usize) -> [usize; 2] {
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

/// Planes that the assembly rolls through.
#[derive(Clone, Debug)]
pub struct Planes {
    low: Vec<f32>,
    high: Vec<f32>,
    x: FaceNorms,
    y: FaceNorms,
    z_low: FaceNorms,
    z_high: FaceNorms,
}

impl Planes {
    /// Room for one cell.
    #[must_use]
    pub fn new() -> Self {
        let plane = || vec![0.0; PLANE];
        let norms = FaceNorms::new;
        Self { low: plane(), high: plane(), x: norms(), y: norms(), z_low: norms(), z_high: norms() }
    }
}

impl Default for Planes {
    fn default() -> Self {
        Self::new()
    }
}

/// Assembles the scheme of one cell (rows without solved voxels are left as they are) and returns the sum of `M_p`, the
/// norm of the gradient of u, over the solved voxels.
///
/// Runs on the widest vector unit the processor has; the bits are the same on any.
///
/// # Panics
/// When a field is not a grown cell (g may be empty when `rho` is 0).
pub fn assemble(
    fields: Fields<'_>,
    mask: &CellMask,
    spacing: [f64; 3],
    velocity: &Velocity,
    work: &mut Planes,
    scheme: &mut [f32],
) -> f64 {
    vectorised!({ fields: Fields<'_>, mask: &CellMask, spacing: [f64; 3], velocity: &Velocity, work: &mut Planes,
        scheme: &mut [f32] } => assemble_cell -> f64)
}

#[inline(always)]
fn assemble_cell(
    fields: Fields<'_>,
    mask: &CellMask,
    spacing: [f64; 3],
    velocity: &Velocity,
    work: &mut Planes,
    scheme: &mut [f32],
) -> f64 {
    let metric = Metric {
        inverse_spacing: spacing.map(|h| (1.0 / h) as f32),
        epsilon_squared: velocity.epsilon * velocity.epsilon,
    };
    let step = spacing.map(|h| (f64::from(velocity.tau) / (h * h)) as f32);
    let mut sums = [0.0f32; CELL];
    let [first, end] = mask.planes;
    if first < end {
        let rows = mask.rows_around(first);
        vertex_plane(fields.u, first, rows, &mut work.low);
        faces::<2>(fields.u, first, rows, [&work.low, &work.low[GROWN..]], &metric, &mut work.z_low);
    }
    for z in first..end {
        let (rows, next) = (mask.rows[z], mask.rows_around(z + 1));
        vertex_plane(fields.u, z + 1, next, &mut work.high);
        faces::<0>(fields.u, z, rows, [&work.low, &work.high], &metric, &mut work.x);
        faces::<1>(fields.u, z, rows, [&work.low, &work.high], &metric, &mut work.y);
        faces::<2>(fields.u, z + 1, next, [&work.high, &work.high[GROWN..]], &metric, &mut work.z_high);
        for y in rows[0]..rows[1] {
            let row = Row { y, z, work, mask, metric: &metric, step, velocity };
            if velocity.rho == 0.0 {
                row.assemble::<false>(fields, scheme, &mut sums);
            } else {
                row.assemble::<true>(fields, scheme, &mut sums);
            }
        }
        std::mem::swap(&mut work.low, &mut work.high);
        std::mem::swap(&mut work.z_low, &mut work.z_high);
    }
    sums.iter().map(|&s| f64::from(s)).sum()
}

/// One row of voxels of the cell being assembled.
struct Row<'a> {
    y: usize,
    z: usize,
    work: &'a Planes,
    mask: &'a CellMask,
    metric: &'a Metric,
    step: [f32; 3],
    velocity: &'a Velocity,
}

/// `N` consecutive values from `start`.
#[inline(always)]
fn window<const N: usize>(values: &[f32], start: usize) -> &[f32; N] {
    values[start..start + N].first_chunk().expect("the slice has N values")
}

/// Values of a grown cell from the lower z-neighbour of a part of a row to the upper one.
const AROUND: usize = 2 * PLANE + LANES;

/// What the coefficients of a part of a row are made of.
struct Part<'a> {
    d: &'a [f32; AROUND],
    g: &'a [f32; AROUND],
    /// `r_p`.
    pull: [f32; LANES],
    /// `M_p`.
    mean: [f32; LANES],
    solved: [f32; LANES],
    /// The part's first column.
    start: usize,
}

/// How much more neighbour Q has than the voxel.
#[inline(always)]
fn differences<const Q: usize>(values: &[f32; AROUND]) -> [f32; LANES] {
    let place = [PLANE - 1, PLANE + 1, PLANE - GROWN, PLANE + GROWN, 0, 2 * PLANE][Q];
    let (mut there, here) = (*window::<LANES>(values, place), window::<LANES>(values, PLANE));
    for x in 0..LANES {
        there[x] -= here[x];
    }
    there
}

impl Row<'_> {
    /// Assembles the row in two parts, each of which fills a vector; one without solved voxels stays as it is.
    #[inline(always)]
    fn assemble<const EDGES: bool>(&self, fields: Fields<'_>, scheme: &mut [f32], sums: &mut [f32; CELL]) {
        let at = (self.z * CELL + self.y) * CELL;
        for start in [0, LANES] {
            let solved = *self.mask.solved[at + start..].first_chunk::<LANES>().expect("half a row");
            let mut terms = [[0.0f32; LANES]; SCHEME_LAYERS];
            if u64::from_ne_bytes(solved) == 0 {
                terms[6] = *window(fields.u, self.center() + start);
            } else {
                let mean = self.terms::<EDGES>(fields, start, solved, &mut terms);
                for x in 0..LANES {
                    sums[start + x] += f32::from(solved[x]) * mean[x];
                }
            }
            write_part(scheme, [start, self.y, self.z], &mut terms);
        }
    }

    /// Place of the row's first voxel in a grown cell.
    #[inline(always)]
    fn center(&self) -> usize {
        (self.z + 1) * PLANE + (self.y + 1) * GROWN + 1
    }

    /// The coefficients and the old values from voxel `start` on. Returns `M_p`.
    #[inline(always)]
    fn terms<const EDGES: bool>(
        &self,
        fields: Fields<'_>,
        start: usize,
        solved: [u8; LANES],
        terms: &mut [[f32; LANES]; SCHEME_LAYERS],
    ) -> [f32; LANES] {
        let center = self.center() + start;
        let d = window(fields.d, center - PLANE);
        let g = if EDGES { window(fields.g, center - PLANE) } else { &[0.0; AROUND] };
        let mean = self.mean_norms(self.y * GROWN + start);
        let pull = if EDGES { self.edge_pull(g) } else { [0.0; LANES] };
        let part = Part { d, g, pull, mean, solved: solved.map(f32::from), start };
        // Written out: a loop over the six would look up everything that is known here.
        terms[0] = self.coefficients::<0>(&part);
        terms[1] = self.coefficients::<1>(&part);
        terms[2] = self.coefficients::<2>(&part);
        terms[3] = self.coefficients::<3>(&part);
        terms[4] = self.coefficients::<4>(&part);
        terms[5] = self.coefficients::<5>(&part);
        terms[6] = *window(fields.u, center);
        mean
    }

    /// The coefficients towards neighbour Q.
    #[inline(always)]
    fn coefficients<const Q: usize>(&self, part: &Part<'_>) -> [f32; LANES] {
        let (v, step, open) = (self.velocity, self.step[Q / 2], &self.mask.open[Q / 2][Q % 2]);
        let open: [f32; LANES] = match Q / 2 {
            0 => *window(open, part.start),
            1 => [open[self.y]; LANES],
            _ => [open[self.z]; LANES],
        };
        let (d, g, s) = (differences::<Q>(part.d), differences::<Q>(part.g), self.face_inverses::<Q>(part.start));
        let mut c = [0.0; LANES];
        for x in 0..LANES {
            let on = part.solved[x] * open[x] * step;
            let attraction = v.theta * d[x] + part.pull[x] * g[x];
            let curvature = 0.25 * v.delta * part.mean[x] * s[x];
            c[x] = on * (attraction.max(0.0) + curvature);
        }
        c
    }

    /// `M_p` along the row: the mean over the tetrahedra of the six faces, regularised.
    #[inline(always)]
    fn mean_norms<const N: usize>(&self, flat: usize) -> [f32; N] {
        let work = self.work;
        let faces: [&[f32; N]; 6] = [
            window(&work.x.norm, flat),
            window(&work.x.norm, flat + 1),
            window(&work.y.norm, flat),
            window(&work.y.norm, flat + GROWN),
            window(&work.z_low.norm, flat),
            window(&work.z_high.norm, flat),
        ];
        let mut mean = [0.0f32; N];
        for x in 0..N {
            let sum = (faces[0][x] + faces[1][x]) + (faces[2][x] + faces[3][x]) + (faces[4][x] + faces[5][x]);
            let m = sum * (1.0 / 24.0);
            mean[x] = (self.metric.epsilon_squared + m * m).sqrt();
        }
        mean
    }

    /// `S_pq` towards neighbour Q.
    #[inline(always)]
    fn face_inverses<const Q: usize>(&self, start: usize) -> &[f32; LANES] {
        let (work, flat) = (self.work, self.y * GROWN + start);
        match Q {
            0 => window(&work.x.inverse, flat),
            1 => window(&work.x.inverse, flat + 1),
            2 => window(&work.y.inverse, flat),
            3 => window(&work.y.inverse, flat + GROWN),
            4 => window(&work.z_low.inverse, flat),
            _ => window(&work.z_high.inverse, flat),
        }
    }

    /// `r_p`, which weighs the differences of g.
    #[inline(always)]
    fn edge_pull(&self, g: &[f32; AROUND]) -> [f32; LANES] {
        let slopes = [
            differences::<0>(g),
            differences::<1>(g),
            differences::<2>(g),
            differences::<3>(g),
            differences::<4>(g),
            differences::<5>(g),
        ];
        let mut square = [0.0f32; LANES];
        for (q, slope) in slopes.iter().enumerate() {
            let inverse = self.metric.inverse_spacing[q / 2];
            for x in 0..LANES {
                square[x] += (slope[x] * inverse) * (slope[x] * inverse);
            }
        }
        let mut norm = [1.0f32; LANES];
        if self.velocity.normalised {
            for x in 0..LANES {
                norm[x] = (self.metric.epsilon_squared + 0.5 * square[x]).sqrt();
            }
        }
        for norm in &mut norm {
            *norm = self.velocity.rho / *norm;
        }
        norm
    }
}

/// The mean of the 24 tetrahedral gradient norms of every voxel of a grown cell: what the edge detector is made of.
///
/// # Panics
/// When `u` is not a grown cell or `out` not a cell.
pub fn mean_gradient(u: &[f32], spacing: [f64; 3], work: &mut Planes, out: &mut [f32]) {
    vectorised!({ u: &[f32], spacing: [f64; 3], work: &mut Planes, out: &mut [f32] } => mean_gradient_cell);
}

#[inline(always)]
fn mean_gradient_cell(u: &[f32], spacing: [f64; 3], work: &mut Planes, out: &mut [f32]) {
    let metric = Metric { inverse_spacing: spacing.map(|h| (1.0 / h) as f32), epsilon_squared: f32::MIN_POSITIVE };
    let mask = CellMask::new();
    let velocity = Velocity { theta: 0.0, rho: 0.0, delta: 0.0, epsilon: 0.0, tau: 0.0, normalised: false };
    let rows = [0, CELL];
    vertex_plane(u, 0, rows, &mut work.low);
    faces::<2>(u, 0, rows, [&work.low, &work.low[GROWN..]], &metric, &mut work.z_low);
    for z in 0..CELL {
        vertex_plane(u, z + 1, rows, &mut work.high);
        faces::<0>(u, z, rows, [&work.low, &work.high], &metric, &mut work.x);
        faces::<1>(u, z, rows, [&work.low, &work.high], &metric, &mut work.y);
        faces::<2>(u, z + 1, rows, [&work.high, &work.high[GROWN..]], &metric, &mut work.z_high);
        for y in 0..CELL {
            let row = Row { y, z, work, mask: &mask, metric: &metric, step: [0.0; 3], velocity: &velocity };
            out[(z * CELL + y) * CELL..][..CELL].copy_from_slice(&row.mean_norms::<CELL>(y * GROWN));
        }
        std::mem::swap(&mut work.low, &mut work.high);
        std::mem::swap(&mut work.z_low, &mut work.z_high);
    }
}
