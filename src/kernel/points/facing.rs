//! Which side of a cloud a place is on, told by the points around it and which way they face: the sign of implicit moving least
//! squares (Shen, O'Brien & Shewchuk, "Interpolating and approximating implicit surfaces from polygon soup", 2004; Kolluri,
//! "Provably good moving least squares", 2005; docs/algorithms.md, "Open surfaces").

use glam::DVec3;

use super::surfel::Surfel;

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
