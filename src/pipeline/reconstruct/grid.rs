//! The grid that a cloud is reconstructed on: as fine as half the cloud's mean spacing, which gives the best surfaces
//! (Kósa 2015, ch. 5.1).

use rstar::RTree;

use crate::grid::Geometry;

/// Spacings of the grid to one of the cloud.
const VOXELS_PER_POINT: f64 = 2.0;

/// The mean distance from a place of the cloud to the nearest other place; none for fewer than two places.
#[must_use]
pub fn mean_spacing(points: &[[f64; 3]]) -> Option<f64> {
    let mut places = points.to_vec();
    places.sort_by(|p, q| p[2].total_cmp(&q[2]).then(p[1].total_cmp(&q[1])).then(p[0].total_cmp(&q[0])));
    places.dedup();
    let count = places.len();
    let tree = RTree::bulk_load(places.clone());
    let nearest = |p: &[f64; 3]| {
        let (_, squared) = tree.nearest_neighbor_iter_with_distance_2(*p).nth(1)?;
        Some(squared.sqrt())
    };
    let sum: f64 = places.iter().filter_map(nearest).sum();
    (count > 1).then(|| sum / count as f64)
}

/// A grid around the cloud, its voxel 0 below all points; of the spacing that was asked for, or what follows from the
/// cloud. None for a cloud that tells no spacing.
#[must_use]
pub fn grid_for(points: &[[f64; 3]], spacing: Option<[f64; 3]>) -> Option<Geometry> {
    let spacing = match spacing {
        Some(spacing) => spacing,
        None => [mean_spacing(points)? / VOXELS_PER_POINT; 3],
    };
    let first = *points.first()?;
    let (low, high) = points.iter().fold((first, first), |(lo, hi): ([f64; 3], [f64; 3]), p| {
        (std::array::from_fn(|a| lo[a].min(p[a])), std::array::from_fn(|a| hi[a].max(p[a])))
    });
    // Counts that no index could hold are left to the caller to refuse.
    let count = |a: usize| ((high[a] - low[a]) / spacing[a]).floor().min(1e15) as i64 + 2;
    let shape = [count(0), count(1), count(2)];
    Some(Geometry { shape, spacing, origin: low, unit: None })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spacings_are_those_of_a_lattice() {
        let lattice: Vec<[f64; 3]> = (0..60)
            .map(|n| [0.5 * f64::from(n % 3), 0.5 * f64::from(n / 3 % 4), 7.0 + 0.7 * f64::from(n / 12)])
            .collect();
        let twice = [&lattice[..], &lattice[7..9]].concat();
        assert!((mean_spacing(&twice).unwrap() - 0.5).abs() < 1e-12, "points at the same place count once");
        assert_eq!(mean_spacing(&lattice[..1]), None);
        assert_eq!(mean_spacing(&[[1.0; 3]; 9]), None);
        let grid = grid_for(&lattice, None).unwrap();
        assert!((grid.spacing[1] - 0.25).abs() < 1e-12);
        assert_eq!((grid.shape, grid.origin), ([6, 8, 13], [0.0, 0.0, 7.0]));
        assert_eq!(grid_for(&lattice[..1], Some([2.0; 3])).unwrap().shape, [2; 3]);
    }
}
