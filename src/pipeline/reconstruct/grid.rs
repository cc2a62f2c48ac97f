//! The grid that a cloud is reconstructed on: as fine as half the cloud's spacing, which gives the best surfaces
//! (Kósa 2015, ch. 5.1).

use super::spacing::typical_spacing;
use crate::grid::Geometry;

/// Spacings of the grid to one of the cloud.
const VOXELS_PER_POINT: f64 = 2.0;

/// A grid around the cloud, its voxel 0 below all points; of the spacing that was asked for, or what follows from the
/// cloud. None for a cloud that tells no spacing.
#[must_use]
pub fn grid_for(points: &[[f64; 3]], spacing: Option<[f64; 3]>) -> Option<Geometry> {
    let spacing = match spacing {
        Some(spacing) => spacing,
        None => [typical_spacing(points)? / VOXELS_PER_POINT; 3],
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
    fn grids_hold_the_cloud() {
        let lattice: Vec<[f64; 3]> = (0..60)
            .map(|n| [0.5 * f64::from(n % 3), 0.5 * f64::from(n / 3 % 4), 7.0 + 0.7 * f64::from(n / 12)])
            .collect();
        let grid = grid_for(&lattice, None).unwrap();
        assert!((grid.spacing[1] - 0.25).abs() < 1e-12);
        assert_eq!((grid.shape, grid.origin), ([6, 8, 13], [0.0, 0.0, 7.0]));
        assert_eq!(grid_for(&lattice[..1], Some([2.0; 3])).unwrap().shape, [2; 3]);
    }
}
