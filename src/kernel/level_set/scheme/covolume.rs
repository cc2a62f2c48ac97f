//! Coefficients of the semi-implicit co-volume scheme on one cell (Kósa PhD, eq. 3.12, 3.14; docs/algorithms.md,
//! "Co-volume scheme").
//!
//! The scheme for a voxel p with face neighbours q is `u_p + sum a_pq (u_q - u_p) = u_p^old`. With `c_pq = -a_pq >= 0`
//!
//! ```text
//! c_pq = tau / h_s^2 * ( max(theta (d_q - d_p) + r_p (g_q - g_p), 0) + delta / 4 * M_p * S_pq )
//! S_pq = sum over the face's tetrahedra of 1 / sqrt(eps^2 + G_T^2)      M_p = sqrt(eps^2 + (mean of the 24 G_T)^2)
//! r_p  = rho / |grad g_p|_eps   (rho where the edge term is not normalised)
//! ```
//!
//! Where the image gives a speed F along the outward normal in place of g, its term is `max(F (u_q - u_p), 0) S_pq / 4`
//! in place of that with `r_p`: `F |grad u|` by upwind differences (Osher & Sethian 1988), over the norms at the faces.
//!
//! which is the printed scheme with `A_q / m = 1 / h_s` and the velocity written out. The solver gets it divided by the
//! diagonal, `u_p = old_p + sum w_pq (u_q - old_p)` with `w = c / (1 + sum c)`: an average of `u_q` and `old_p`, so the
//! maximum principle is plain to see. Voxels outside of the band have w = 0 and keep their value; faces on the domain's
//! border have c = 0.
//!
//! In: grown cells of u, d, g (f32; d in physical units, g in 0..1). Halo 1, all 26 directions for u. Work buffers:
//! a few planes. Cost: 12 tetrahedra norms and about 60 operations per voxel.

use super::coefficients::{
    Coefficients, EDGES, NO_COEFFICIENTS, NO_IMAGE, PlaneNorms, SPEED, add_means, close, coefficients, mean_norms,
    normalise, old_values, spread,
};
use super::gradients::{FaceNorms, Metric, faces, vertex_plane};
use super::mask::CellMask;
use super::system::write_plane;
use super::velocity::{Fields, Velocity};
use crate::kernel::level_set::cell::{CELL, FLAT, GROWN, PLANE};

/// Planes that the assembly rolls through.
#[derive(Clone, Debug)]
pub struct Planes {
    low: Vec<f32>,
    high: Vec<f32>,
    x: FaceNorms,
    y: FaceNorms,
    z_low: FaceNorms,
    z_high: FaceNorms,
    solved: Box<[f32; FLAT]>,
    coefficients: Box<Coefficients>,
}

impl Planes {
    /// Room for one cell.
    #[must_use]
    pub fn new() -> Self {
        let plane = || vec![0.0; PLANE];
        let norms = FaceNorms::new;
        let (x, y, z_low, z_high) = (norms(), norms(), norms(), norms());
        Self {
            low: plane(),
            high: plane(),
            x,
            y,
            z_low,
            z_high,
            solved: Box::new([0.0; FLAT]),
            coefficients: Box::new(NO_COEFFICIENTS),
        }
    }

    /// Makes what lies below the first plane that is needed.
    #[inline(always)]
    fn enter(&mut self, u: &[f32], z: usize, rows: [usize; 2], metric: &Metric) {
        vertex_plane(u, z, rows, &mut self.low);
        faces::<2>(u, z, rows, [&self.low, &self.low[GROWN..]], metric, &mut self.z_low);
    }

    /// Makes the faces of plane z, for its `rows`, and those above it, for the `next` ones.
    #[inline(always)]
    fn make(&mut self, u: &[f32], z: usize, [rows, next]: [[usize; 2]; 2], metric: &Metric) {
        vertex_plane(u, z + 1, next, &mut self.high);
        faces::<0>(u, z, rows, [&self.low, &self.high], metric, &mut self.x);
        faces::<1>(u, z, rows, [&self.low, &self.high], metric, &mut self.y);
        faces::<2>(u, z + 1, next, [&self.high, &self.high[GROWN..]], metric, &mut self.z_high);
    }

    /// What was above is below the next plane.
    #[inline(always)]
    fn advance(&mut self) {
        std::mem::swap(&mut self.low, &mut self.high);
        std::mem::swap(&mut self.z_low, &mut self.z_high);
    }

    /// The norms around the plane that was made, and where its coefficients go.
    #[inline(always)]
    fn split(&mut self) -> (PlaneNorms<'_>, &mut [f32; FLAT], &mut Coefficients) {
        let norms = PlaneNorms { x: &self.x, y: &self.y, z: [&self.z_low, &self.z_high] };
        (norms, &mut self.solved, &mut self.coefficients)
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
    let by = (metric, *velocity, spacing.map(|h| (f64::from(velocity.tau) / (h * h)) as f32));
    let mut sums = [0.0f32; CELL];
    let [first, end] = mask.planes;
    if first < end {
        work.enter(fields.u, first, mask.rows_around(first), &metric);
    }
    for z in first..end {
        let rows = mask.rows[z];
        work.make(fields.u, z, [rows, mask.rows_around(z + 1)], &metric);
        if rows[0] < rows[1] {
            let (norms, solved, out) = work.split();
            spread(&mask.solved, z, rows, solved);
            if velocity.rho == 0.0 {
                coefficients::<NO_IMAGE>(fields, (z, rows), (norms, solved), by, out);
            } else if velocity.speed {
                coefficients::<SPEED>(fields, (z, rows), (norms, solved), by, out);
            } else {
                coefficients::<EDGES>(fields, (z, rows), (norms, solved), by, out);
            }
            add_means(rows, &out[6], &mut sums);
            close(out, mask, z, rows);
            old_values(fields.u, (z, rows), out);
            normalise(rows, out);
            write_plane(scheme, z, rows, out);
        }
        work.advance();
    }
    sums.iter().map(|&s| f64::from(s)).sum()
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
    let rows = [0, CELL];
    work.enter(u, 0, rows, &metric);
    for z in 0..CELL {
        work.make(u, z, [rows; 2], &metric);
        let (norms, _, [.., mean]) = work.split();
        mean_norms(rows, norms, metric.epsilon_squared, mean);
        for y in 0..CELL {
            out[(z * CELL + y) * CELL..][..CELL].copy_from_slice(&mean[y * GROWN..][..CELL]);
        }
        work.advance();
    }
}
