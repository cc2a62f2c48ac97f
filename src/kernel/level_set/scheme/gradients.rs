//! Gradient norms on the tetrahedra of the co-volume mesh (Kósa 2015, sec. 3.3; docs/algorithms.md, "Gradient on a
//! tetrahedron").
//!
//! Each face between voxels p and q carries four tetrahedra, one for each of its edges (z1, z2). With vertex values
//! the mean of the eight voxels around the vertex, the gradient on a tetrahedron has the components
//! `(u_q - u_p) / h_pq`, `(u_z2 - u_z1) / h_edge` and `(u_x - u_y) / (h_across / 2)`, where `u_x` is the mean of p and
//! q at the face's centre and `u_y` the mean of z1 and z2 at the edge's centre. A face belongs to both its voxels, so
//! twelve norms for each voxel (its three lower faces) serve all 24.
//!
//! Everything runs along flat planes with the grown cell's row pitch: at the row ends a few values are computed that
//! nobody reads, and in return no row has a remainder that would not fill a vector. In: one grown cell of f32.
//! Cost per face: 4 square roots and 4 inverse ones.

use crate::kernel::level_set::cell::{CELL, GROWN, PLANE};

/// What the coefficients need of the four tetrahedra of a face, for one plane of faces at grown-cell pitch.
#[derive(Clone, Debug)]
pub(crate) struct FaceNorms {
    /// Sum over the four tetrahedra of `1 / sqrt(eps^2 + G_T^2)`.
    pub(crate) inverse: Vec<f32>,
    /// Sum over the four tetrahedra of `G_T`.
    pub(crate) norm: Vec<f32>,
}

impl FaceNorms {
    pub(crate) fn new() -> Self {
        Self { inverse: vec![0.0; PLANE], norm: vec![0.0; PLANE] }
    }
}

/// One over the spacing along each axis, and the square of the regularisation `eps`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Metric {
    pub(crate) inverse_spacing: [f32; 3],
    pub(crate) epsilon_squared: f32,
}

/// Rows of a plane that hold voxels or their upper vertices, as a flat length.
const VERTICES: usize = (CELL + 1) * GROWN;

/// The length of a flat piece made up to whole vectors, so that no remainder runs value by value. All planes reach so
/// far.
#[inline(always)]
pub(crate) fn whole_vectors(len: usize) -> usize {
    len.next_multiple_of(CELL)
}

/// Vertex values of plane `k` of vertices, on and one beyond the given rows: the mean of the eight voxels around each.
///
/// Vertex (i, j, k) is the lower corner of voxel (i, j, k); its place in `out` is that voxel's in a grown plane.
#[inline(always)]
pub(crate) fn vertex_plane(u: &[f32], k: usize, rows: [usize; 2], out: &mut [f32]) {
    // The very last place would be a vertex that nobody reads.
    let (start, end) = (rows[0] * GROWN, (rows[1] * GROWN + GROWN).min(VERTICES - 1));
    if start >= end {
        return;
    }
    // Made up to whole vectors at the front: behind the last vertex the grown cell ends.
    let start = end.saturating_sub(whole_vectors(end - start));
    let len = end - start;
    // Local voxel (i, j) lies at (i + 1, j + 1): the four voxels around vertex (i, j) start at the vertex's own place.
    let below = &u[k * PLANE + start..][..len + GROWN + 1];
    let above = &u[(k + 1) * PLANE + start..][..len + GROWN + 1];
    let out = &mut out[start..end];
    for n in 0..len {
        let low = (below[n] + below[n + 1]) + (below[n + GROWN] + below[n + GROWN + 1]);
        let high = (above[n] + above[n + 1]) + (above[n + GROWN] + above[n + GROWN + 1]);
        out[n] = 0.125 * (low + high);
    }
}

/// The four tetrahedra of one face: `step` across the face; `v00, v10, v01, v11` its vertices, first index along the
/// first tangent, second along the second; `mean` the value at its centre. Inverse spacings of the two tangents.
#[inline(always)]
fn face_sums(step: f32, mean: f32, v: [f32; 4], inverse: [f32; 2], epsilon_squared: f32) -> (f32, f32) {
    let [v00, v10, v01, v11] = v;
    let square = step * step;
    // Edges along the first tangent, at the lower and the upper end of the second, then the other way round.
    let g = [
        tetrahedron(square, v00, v10, mean, inverse[0], inverse[1]),
        tetrahedron(square, v01, v11, mean, inverse[0], inverse[1]),
        tetrahedron(square, v00, v01, mean, inverse[1], inverse[0]),
        tetrahedron(square, v10, v11, mean, inverse[1], inverse[0]),
    ];
    let norm = (g[0].sqrt() + g[1].sqrt()) + (g[2].sqrt() + g[3].sqrt());
    let r = g.map(|square| inverse_root(epsilon_squared + square));
    ((r[0] + r[1]) + (r[2] + r[3]), norm)
}

/// `1 / sqrt(x)` for normal positive x, to 9e-7 of its value.
///
/// A guess from the bits of x and two Newton steps, each scaled to spread its one-sided error to both sides. Unlike the
/// processors' own estimates it has the same bits everywhere, and it runs beside the unit for square roots, which is
/// busy with the norms.
#[inline(always)]
fn inverse_root(x: f32) -> f32 {
    const FIRST: f32 = 1.0 + 8.75e-4;
    const SECOND: f32 = 1.0 + 5.8e-7;
    let guess = f32::from_bits(0x5f37_5a86 - (x.to_bits() >> 1));
    let better = guess * (1.5 * FIRST - (0.5 * FIRST * x) * (guess * guess));
    better * (1.5 * SECOND - (0.5 * SECOND * x) * (better * better))
}

/// The squared gradient norm on the tetrahedron of the edge from `z1` to `z2`.
#[inline(always)]
fn tetrahedron(across: f32, z1: f32, z2: f32, mean: f32, inverse_edge: f32, inverse_side: f32) -> f32 {
    let along = (z2 - z1) * inverse_edge;
    let inward = (mean - 0.5 * (z1 + z2)) * (2.0 * inverse_side);
    across + along * along + inward * inward
}

/// Norms of the lower faces across `AXIS` of voxel plane `k`: place n holds the face between a voxel and the one below
/// it.
///
/// Of y-faces the upper ones of the last row come with them; for z, `k == CELL` gives the upper ones of the last plane.
/// `vertices` are the planes of vertices on both sides along z; for z-faces the plane itself, and again from its next
/// row on: the vertices on both sides along y.
#[inline(always)]
pub(crate) fn faces<const AXIS: usize>(
    u: &[f32],
    k: usize,
    rows: [usize; 2],
    vertices: [&[f32]; 2],
    metric: &Metric,
    out: &mut FaceNorms,
) {
    if rows[0] >= rows[1] {
        return;
    }
    let tangents = [[1, 2], [0, 2], [0, 1]][AXIS];
    // The first tangent lies within a plane of vertices, or within a row of it.
    let (below, side) = ([1, GROWN, PLANE][AXIS], [GROWN, 1, 1][AXIS]);
    let (start, rows) = (rows[0] * GROWN, rows[1] - rows[0] + usize::from(AXIS == 1));
    let len = whole_vectors(rows * GROWN - 1);
    let first = (k + 1) * PLANE + GROWN + 1 + start;
    let (p, q) = (&u[first..][..len], &u[first - below..][..len]);
    let [low, high] = vertices.map(|v| &v[start..][..len + side]);
    let (across, along) = (metric.inverse_spacing[AXIS], tangents.map(|t| metric.inverse_spacing[t]));
    let (inverse, norm) = (&mut out.inverse[start..][..len], &mut out.norm[start..][..len]);
    for n in 0..len {
        let corners = [low[n], low[n + side], high[n], high[n + side]];
        let (step, mean) = ((q[n] - p[n]) * across, 0.5 * (p[n] + q[n]));
        (inverse[n], norm[n]) = face_sums(step, mean, corners, along, metric.epsilon_squared);
    }
}

#[cfg(test)]
mod tests {
    use super::inverse_root;

    #[test]
    fn inverse_roots_are_as_near_as_said() {
        // Two octaves are all there is: beyond, the bits repeat with another exponent.
        for start in [1.0_f32, 1e-12, 1e12, f32::MIN_POSITIVE] {
            let bits = start.to_bits();
            for x in (bits..bits + (2 << 23)).step_by(61).map(f32::from_bits) {
                let exact = 1.0 / f64::from(x).sqrt();
                let error = (f64::from(inverse_root(x)) / exact - 1.0).abs();
                assert!(error < 9e-7, "{x}: {error}");
            }
        }
    }
}
