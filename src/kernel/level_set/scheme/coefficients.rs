//! Coefficients of one plane of voxels from the norms on its faces (Kósa PhD, eq. 3.12, 3.14; docs/algorithms.md,
//! "Co-volume scheme").
//!
//! ```text
//! c_pq = tau / h_s^2 * ( max(theta (d_q - d_p) + r_p (g_q - g_p), 0) + max(F_p (u_q - u_p), 0) / 4 * S_pq
//!                        + delta / 4 * M_p * S_pq )
//! ```
//!
//! for all voxels and faces of the plane's rows, solved or not, open or not: as in `gradients`, everything runs along
//! flat planes at the grown cell's pitch, and what lies between the rows is computed and not read. `scheme` picks out
//! of it. In: grown cells of d and g, planes of norms. Out: seven planes. Cost: about 60 operations and two roots per
//! voxel.

use super::gradients::{FaceNorms, Metric, whole_vectors};
use super::mask::CellMask;
use super::velocity::{Fields, Velocity};
use crate::kernel::level_set::cell::{CELL, FLAT, GROWN, PLANE};

/// What one plane of voxels gets, row y from `y * GROWN` on: the coefficients towards the neighbours across -x, +x, -y,
/// +y, -z, +z, then `M_p`. One array, not seven: nothing else can overlap it, which the vectoriser has to know.
pub(crate) type Coefficients = [[f32; FLAT]; 7];
/// Room for them.
pub(crate) const NO_COEFFICIENTS: Coefficients = [[0.0; FLAT]; 7];

/// The norms on the faces of one plane of voxels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlaneNorms<'a> {
    pub(crate) x: &'a FaceNorms,
    pub(crate) y: &'a FaceNorms,
    pub(crate) z: [&'a FaceNorms; 2],
}

/// The values of a quantity across the six faces of a run of voxels, each slice as long as the run.
///
/// Fields, not an array: only what is not looked up in a loop is vectorised.
#[derive(Clone, Copy)]
struct Around<'a> {
    x: [&'a [f32]; 2],
    y: [&'a [f32]; 2],
    z: [&'a [f32]; 2],
}

impl<'a> Around<'a> {
    /// Of `len` voxels of a grown cell from place `center` on.
    #[inline(always)]
    fn voxels(values: &'a [f32], center: usize, len: usize) -> Self {
        Self {
            x: [&values[center - 1..][..len], &values[center + 1..][..len]],
            y: [&values[center - GROWN..][..len], &values[center + GROWN..][..len]],
            z: [&values[center - PLANE..][..len], &values[center + PLANE..][..len]],
        }
    }

    /// Of the faces of `len` voxels from place `start` of a plane on: `x`, `y`, `z` are the planes of their lower faces
    /// and `upper` the one of the upper z-faces.
    #[inline(always)]
    fn faces([x, y, z, upper]: [&'a [f32]; 4], start: usize, len: usize) -> Self {
        Self {
            x: [&x[start..][..len], &x[start + 1..][..len]],
            y: [&y[start..][..len], &y[start + GROWN..][..len]],
            z: [&z[start..][..len], &upper[start..][..len]],
        }
    }

    /// The six values at place `n`.
    #[inline(always)]
    fn at(&self, n: usize) -> [f32; 6] {
        [self.x[0][n], self.x[1][n], self.y[0][n], self.y[1][n], self.z[0][n], self.z[1][n]]
    }
}

impl<'a> PlaneNorms<'a> {
    #[inline(always)]
    fn norm(&self, start: usize, len: usize) -> Around<'a> {
        Around::faces([&self.x.norm, &self.y.norm, &self.z[0].norm, &self.z[1].norm], start, len)
    }

    #[inline(always)]
    fn inverse(&self, start: usize, len: usize) -> Around<'a> {
        Around::faces([&self.x.inverse, &self.y.inverse, &self.z[0].inverse, &self.z[1].inverse], start, len)
    }
}

/// `M_p` on the given rows: the mean of the 24 norms, regularised.
#[inline(always)]
pub(crate) fn mean_norms(rows: [usize; 2], norms: PlaneNorms<'_>, epsilon_squared: f32, mean: &mut [f32; FLAT]) {
    let (start, len) = flat(rows);
    let around = norms.norm(start, len);
    let mean = &mut mean[start..][..len];
    for n in 0..len {
        mean[n] = mean_norm(around.at(n), epsilon_squared);
    }
}

#[inline(always)]
fn mean_norm([x0, x1, y0, y1, z0, z1]: [f32; 6], epsilon_squared: f32) -> f32 {
    let m = ((x0 + x1) + (y0 + y1) + (z0 + z1)) * (1.0 / 24.0);
    (epsilon_squared + m * m).sqrt()
}

/// What the image gives, told when the coefficients are compiled: nothing, an edge detector, a speed.
pub(crate) const NO_IMAGE: u8 = 0;
pub(crate) const EDGES: u8 = 1;
pub(crate) const SPEED: u8 = 2;

/// Fills the given rows of plane `z`; `step` is `tau / h^2` along each axis.
#[inline(always)]
pub(crate) fn coefficients<const IMAGE: u8>(
    fields: Fields<'_>,
    (z, rows): (usize, [usize; 2]),
    (norms, solved): (PlaneNorms<'_>, &[f32; FLAT]),
    (metric, velocity, step): (Metric, Velocity, [f32; 3]),
    out: &mut Coefficients,
) {
    let (start, len) = flat(rows);
    let center = (z + 1) * PLANE + GROWN + 1 + start;
    let (distances, distance) = (Around::voxels(fields.d, center, len), &fields.d[center..][..len]);
    let image_of = if IMAGE == NO_IMAGE { fields.d } else { fields.g };
    // A speed counts where it is; what it moves are differences of u.
    let edges_of = if IMAGE == SPEED { fields.u } else { image_of };
    let (edges, edge) = (Around::voxels(edges_of, center, len), &edges_of[center..][..len]);
    let speed = &image_of[center..][..len];
    let (norm, inverse) = (norms.norm(start, len), norms.inverse(start, len));
    let [c0, c1, c2, c3, c4, c5, means] = out;
    let (c0, c1, c2) = (&mut c0[start..][..len], &mut c1[start..][..len], &mut c2[start..][..len]);
    let (c3, c4, c5) = (&mut c3[start..][..len], &mut c4[start..][..len], &mut c5[start..][..len]);
    let (means, solved) = (&mut means[start..][..len], &solved[start..][..len]);
    let curvature = 0.25 * velocity.delta;
    for n in 0..len {
        let mean = mean_norm(norm.at(n), metric.epsilon_squared);
        let (d, g, inverse) = (distances.at(n), edges.at(n), inverse.at(n));
        let (d_here, g_here) = (distance[n], edge[n]);
        let pull = if IMAGE == EDGES { edge_pull(g, g_here, &metric, &velocity) } else { 0.0 };
        let outward = if IMAGE == SPEED { 0.25 * velocity.rho * speed[n] } else { 0.0 };
        let towards = |d: f32, g: f32, inverse: f32, step: f32| {
            let edge = if IMAGE == EDGES { pull * (g - g_here) } else { 0.0 };
            let attraction = velocity.theta * (d - d_here) + edge;
            let flow = if IMAGE == SPEED { (outward * (g - g_here)).max(0.0) * inverse } else { 0.0 };
            solved[n] * step * (attraction.max(0.0) + flow + curvature * mean * inverse)
        };
        c0[n] = towards(d[0], g[0], inverse[0], step[0]);
        c1[n] = towards(d[1], g[1], inverse[1], step[0]);
        c2[n] = towards(d[2], g[2], inverse[2], step[1]);
        c3[n] = towards(d[3], g[3], inverse[3], step[1]);
        c4[n] = towards(d[4], g[4], inverse[4], step[2]);
        c5[n] = towards(d[5], g[5], inverse[5], step[2]);
        means[n] = solved[n] * mean;
    }
}

/// Takes the flags of a plane's rows over into the flat plane; nothing is solved between the rows.
#[inline(always)]
pub(crate) fn spread(flags: &[u8], z: usize, rows: [usize; 2], solved: &mut [f32; FLAT]) {
    for y in rows[0]..rows[1] {
        let flags = &flags[(z * CELL + y) * CELL..][..CELL];
        for (solved, &flag) in solved[y * GROWN..][..CELL].iter_mut().zip(flags) {
            *solved = f32::from(flag);
        }
    }
}

/// Adds up `M_p` column by column, in the order of the rows.
#[inline(always)]
pub(crate) fn add_means(rows: [usize; 2], means: &[f32; FLAT], sums: &mut [f32; CELL]) {
    for y in rows[0]..rows[1] {
        for (sum, mean) in sums.iter_mut().zip(&means[y * GROWN..][..CELL]) {
            *sum += mean;
        }
    }
}

/// Nothing passes through the faces that `mask` has closed.
#[inline(always)]
pub(crate) fn close(out: &mut Coefficients, mask: &CellMask, z: usize, rows: [usize; 2]) {
    for (axis, sides) in mask.open.iter().enumerate() {
        for (side, open) in sides.iter().enumerate().filter(|(_, open)| **open != [1.0; CELL]) {
            let layer = &mut out[2 * axis + side];
            for y in rows[0]..rows[1] {
                for x in 0..CELL {
                    layer[y * GROWN + x] *= open[[x, y, z][axis]];
                }
            }
        }
    }
}

/// Puts the old values of a grown cell where `M_p` was.
#[inline(always)]
pub(crate) fn old_values(u: &[f32], (z, rows): (usize, [usize; 2]), out: &mut Coefficients) {
    let (start, len) = flat(rows);
    out[6][start..][..len].copy_from_slice(&u[(z + 1) * PLANE + GROWN + 1 + start..][..len]);
}

/// Divides coefficients by the diagonal, `1 + sum c`.
#[inline(always)]
pub(crate) fn normalise(rows: [usize; 2], out: &mut Coefficients) {
    let (start, len) = flat(rows);
    let [c0, c1, c2, c3, c4, c5, _] = out;
    let (c0, c1, c2) = (&mut c0[start..][..len], &mut c1[start..][..len], &mut c2[start..][..len]);
    let (c3, c4, c5) = (&mut c3[start..][..len], &mut c4[start..][..len], &mut c5[start..][..len]);
    for n in 0..len {
        let inverse = 1.0 / (1.0 + c0[n] + c1[n] + c2[n] + c3[n] + c4[n] + c5[n]);
        c0[n] *= inverse;
        c1[n] *= inverse;
        c2[n] *= inverse;
        c3[n] *= inverse;
        c4[n] *= inverse;
        c5[n] *= inverse;
    }
}

/// Start and length of rows as one flat piece of whole vectors: nothing is left over for a slow loop at its end.
#[inline(always)]
fn flat([first, end]: [usize; 2]) -> (usize, usize) {
    (first * GROWN, whole_vectors(((end - first) * GROWN).saturating_sub(2)))
}

/// `r_p`, which weighs the differences of g.
#[inline(always)]
fn edge_pull([x0, x1, y0, y1, z0, z1]: [f32; 6], here: f32, metric: &Metric, velocity: &Velocity) -> f32 {
    let [x, y, z] = metric.inverse_spacing;
    let square = |there: f32, inverse: f32| ((there - here) * inverse) * ((there - here) * inverse);
    let sum = square(x0, x) + square(x1, x) + square(y0, y) + square(y1, y) + square(z0, z) + square(z1, z);
    let norm = if velocity.normalised { (metric.epsilon_squared + 0.5 * sum).sqrt() } else { 1.0 };
    velocity.rho / norm
}
