//! How near the triangles of a patch come to points.

use super::isosurface::Isosurface;
use crate::kernel::surface::{Patch, Triangle};

/// Lowers the squared distances of those `targets` that are `due` to what the triangles of a patch have, where these are nearer.
pub(super) fn approach(
    surface: &Isosurface<'_>,
    patch: &Patch,
    targets: &[[f64; 3]],
    (due, squared): (&[usize], &mut [f64]),
) {
    let geometry = surface.geometry;
    let world = |p: [f64; 3]| std::array::from_fn(|a| geometry.origin[a] + p[a] * geometry.spacing[a]);
    // A triangle has its corners in one cube of voxels, or moved from there: from its first corner none of it is farther than that.
    let cube = geometry.spacing.iter().map(|h| h * h).sum::<f64>().sqrt();
    let size = (cube + 2.0 * surface.farthest()) * (1.0 + 1e-9);
    let limit = |squared: f64| (squared.sqrt() + size) * (squared.sqrt() + size);
    let mut limits: Vec<f64> = due.iter().map(|&n| limit(squared[n])).collect();
    for corners in &patch.triangles {
        let triangle = Triangle::new(corners.map(|v| world(patch.positions[v as usize])));
        let corner = triangle.corner();
        for (&n, near) in due.iter().zip(&mut limits) {
            let (target, nearest) = (&targets[n], &mut squared[n]);
            let away = (0..3).map(|a| (corner[a] - target[a]) * (corner[a] - target[a])).sum::<f64>();
            if away > *near {
                continue;
            }
            let found = triangle.distance_squared(*target);
            if found < *nearest {
                (*nearest, *near) = (found, limit(found));
            }
        }
    }
}
