//! Which side of a cloud a place is on, told by the points around it and which way they face: the sign of implicit moving least
//! squares (Shen, O'Brien & Shewchuk, "Interpolating and approximating implicit surfaces from polygon soup", 2004; Kolluri,
//! "Provably good moving least squares", 2005; docs/algorithms.md, "Open surfaces").

use glam::DVec3;

use super::surfel::Surfel;
use crate::grid::{Box3, Geometry};

/// How far above the surface a place lies, below it less than 0: the mean of its heights over the points' tangent planes, weighed
/// by `1 / (r^2 + smooth^2)^2`. None without points.
#[must_use]
pub fn height(at: DVec3, near: &[Surfel], smooth: f64) -> Option<f64> {
    let (mut sum, mut all) = (0.0, 0.0);
    for point in near {
        let step = at - point.place;
        let weight = (step.length_squared() + smooth * smooth).powi(-2);
        sum += weight * step.dot(point.normal);
        all += weight;
    }
    (all > 0.0).then(|| sum / all)
}

/// The level set in some voxels of a brick, which is dense `[z][y][x]` with row length and plane height `edge`: 1/2 on the surface of the
/// points `near` them, from 1 below it to 0 above it over `width`, a physical length; 0 without points.
pub fn level_of_block(
    geometry: &Geometry,
    (brick, edge): (&Box3, i64),
    block: &Box3,
    (near, smooth, width): (&[Surfel], f64, f64),
    u: &mut [f32],
) {
    for voxel in (0..block.len()).map(|n| block.voxel_at(n)) {
        let height = height(DVec3::from(geometry.position(voxel)), near, smooth);
        let [x, y, z] = [0, 1, 2].map(|a| voxel[a] - brick.lo[a]);
        u[((z * edge + y) * edge + x) as usize] =
            height.map_or(0.0, |height| (0.5 - height / width).clamp(0.0, 1.0) as f32);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_has_its_height_and_a_ball_its_sides() {
        let normal = DVec3::new(1.0, 2.0, -2.0) / 3.0;
        let (u, v) = normal.any_orthonormal_pair();
        let plane: Vec<Surfel> =
            (0..400).map(|n| Surfel { place: u * f64::from(n % 20) + v * f64::from(n / 20), normal }).collect();
        for off in [-4.0, -0.3, 0.0, 2.5] {
            let found = height(u * 7.3 + v * 11.1 + normal * off, &plane, 0.3).unwrap();
            assert!((found - off).abs() < 1e-12, "{off}: {found}");
        }
        let ball: Vec<Surfel> = (0..900)
            .map(|n| {
                let z = 1.0 - (2.0 * f64::from(n) + 1.0) / 900.0;
                let (r, turn) = ((1.0 - z * z).sqrt(), 2.399_963 * f64::from(n));
                let normal = DVec3::new(r * libm::cos(turn), r * libm::sin(turn), z);
                Surfel { place: normal, normal }
            })
            .collect();
        for n in 0..40 {
            let (_, at) = (n, ball[7 + 20 * n].normal);
            assert!(height(at * 0.9, &ball, 0.03).unwrap() < -0.05 && height(at * 1.1, &ball, 0.03).unwrap() > 0.05);
        }
        assert_eq!(height(DVec3::ZERO, &[], 1.0), None);
    }
}
