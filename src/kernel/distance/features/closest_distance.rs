//! Distances held against the closest points that are stored beside them.

use crate::grid::{Box3, Geometry};

/// How far a distance may be from that to its closest point.
#[derive(Clone, Copy, Debug)]
pub struct Slack {
    /// Of the distance: the last place of its type, some times over.
    pub relative: f64,
    /// Beyond this voxels have no closest point that counts.
    pub farthest: f64,
}

/// A distance that is not that to its closest point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Off {
    /// Its place in the array.
    pub place: usize,
    /// The point, physical.
    pub point: [f64; 3],
    /// How far that is.
    pub away: f64,
}

/// The first voxel whose distance is not that to its closest point. `distances` and the coordinates `points`, physical, are dense
/// `[z][y][x]` over `part`; voxels without a point are passed over.
#[must_use]
pub fn first_off(
    geometry: &Geometry,
    part: &Box3,
    distances: &[f64],
    points: &[Vec<f64>; 3],
    slack: Slack,
) -> Option<Off> {
    let off = |(place, &distance): (usize, &f64)| {
        let point = [0, 1, 2].map(|a| points[a][place]);
        if point.iter().any(|v| !v.is_finite()) || distance.abs() >= slack.farthest {
            return None;
        }
        let here = geometry.position(part.voxel_at(place));
        let away = (0..3).map(|a| (here[a] - point[a]).powi(2)).sum::<f64>().sqrt();
        // Coordinates are stored in single precision.
        let reach = (0..3).map(|a| here[a].abs() + point[a].abs()).fold(0.0, f64::max);
        let allowed = slack.relative * (away + distance.abs()) + f64::from(f32::EPSILON) * reach;
        ((distance.abs() - away).abs() > allowed).then_some(Off { place, point, away })
    };
    distances.iter().enumerate().find_map(off)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_the_distance_is_found() {
        let geometry = Geometry::new([5, 4, 3], [0.5, 0.25, 1.0], [1.0, -2.0, 0.0]);
        let part = Box3::new([1, 0, 1], [5, 4, 3]);
        let point = [1.1_f32, -1.7, 0.3].map(f64::from);
        let to_point = |place| {
            let here = geometry.position(part.voxel_at(place));
            (0..3).map(|a| (here[a] - point[a]).powi(2)).sum::<f64>().sqrt()
        };
        let points = point.map(|v| vec![v; part.len()]);
        let mut distances: Vec<f64> = (0..part.len()).map(|place| f64::from(to_point(place) as f32)).collect();
        let slack = Slack { relative: 1e-6, farthest: f64::INFINITY };
        let first = |distances: &[f64], slack| first_off(&geometry, &part, distances, &points, slack);
        assert_eq!(first(&distances, slack), None);
        // Negative within.
        distances[2] *= -1.0;
        assert_eq!(first(&distances, slack), None);
        distances[7] *= 1.0 + 1e-4;
        assert_eq!(first(&distances, slack).map(|off| off.place), Some(7));
        assert_eq!(first(&distances, Slack { farthest: distances[7], ..slack }), None);
    }
}
