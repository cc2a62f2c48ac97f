//! Eigenvalues and eigenvectors of small symmetric matrices.

use glam::{DMat3, DVec3};

/// Rotations after which a symmetric matrix is diagonal: it converges quadratically.
const SWEEPS: usize = 12;

/// Eigenvalues and eigenvectors, as columns, of a symmetric matrix (Jacobi 1846).
pub(crate) fn eigen(mut matrix: DMat3) -> (DVec3, DMat3) {
    let mut vectors = DMat3::IDENTITY;
    for (p, q) in [(0, 1), (0, 2), (1, 2)].into_iter().cycle().take(3 * SWEEPS) {
        let off = matrix.col(q)[p];
        if off == 0.0 {
            continue;
        }
        let ratio = (matrix.col(q)[q] - matrix.col(p)[p]) / (2.0 * off);
        let tangent = ratio.signum() / (ratio.abs() + (ratio * ratio + 1.0).sqrt());
        let cosine = 1.0 / (tangent * tangent + 1.0).sqrt();
        let sine = tangent * cosine;
        let mut rotation = DMat3::IDENTITY;
        rotation.col_mut(p)[p] = cosine;
        rotation.col_mut(q)[q] = cosine;
        rotation.col_mut(q)[p] = sine;
        rotation.col_mut(p)[q] = -sine;
        matrix = rotation.transpose() * matrix * rotation;
        vectors *= rotation;
    }
    (DVec3::new(matrix.x_axis.x, matrix.y_axis.y, matrix.z_axis.z), vectors)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eigenvectors_make_a_matrix_diagonal() {
        for matrix in [
            DMat3::from_cols_array(&[2.0, 1.0, 0.5, 1.0, 3.0, -1.0, 0.5, -1.0, 1.0]),
            DMat3::from_cols_array(&[1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0]),
            DMat3::ZERO,
        ] {
            let (values, vectors) = eigen(matrix);
            let again = vectors * DMat3::from_diagonal(values) * vectors.transpose();
            assert!(again.abs_diff_eq(matrix, 1e-12), "{again}");
        }
    }
}
