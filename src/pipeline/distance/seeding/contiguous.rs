//! The contiguous start (Kósa & Mikula 2023, Sec. 4.0.1; docs/algorithms.md, "Contiguous start"): a point fixes all
//! voxels in a cube so large that the cubes of a data set leave no gap.

use rstar::primitives::GeomWithData;
use rstar::{PointDistance, RTree};

use crate::grid::Geometry;

/// Voxels by which the cube around a point's cell is larger than the cell, along each axis: the largest distance from
/// a point of the set to its nearest other one, in whole spacings. Points at the same place are neighbours at 0.
pub(crate) fn contiguous_margin(geometry: &Geometry, points: &[[f64; 3]]) -> [i64; 3] {
    let gap = largest_gap(points);
    let margin = geometry.spacing.map(|h| (gap / h).floor() as i64);
    // More than the grid is no use.
    std::array::from_fn(|a| margin[a].min(geometry.shape[a]))
}

/// The largest distance from a point to its nearest other one; 0 for a single point.
fn largest_gap(points: &[[f64; 3]]) -> f64 {
    let numbered = points.iter().enumerate().map(|(n, &p)| GeomWithData::new(p, n)).collect();
    let tree = RTree::bulk_load(numbered);
    let nearest = |(n, p): (usize, &[f64; 3])| {
        let others = tree.nearest_neighbor_iter(*p).find(|other| other.data != n);
        others.map_or(0.0, |other| other.geom().distance_2(p))
    };
    points.iter().enumerate().map(nearest).fold(0.0, f64::max).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_are_those_of_a_plain_search() {
        let points: Vec<[f64; 3]> =
            (0..300).map(|n| [f64::from(n * 37 % 101), f64::from(n * 53 % 89), f64::from(n * 71 % 97)]).collect();
        let squared = |p: [f64; 3], q: [f64; 3]| (0..3).map(|a| (p[a] - q[a]).powi(2)).sum::<f64>();
        let nearest = |n: usize| {
            let others = (0..points.len()).filter(|&m| m != n);
            others.map(|m| squared(points[n], points[m])).fold(f64::INFINITY, f64::min)
        };
        let expected = (0..points.len()).map(nearest).fold(0.0, f64::max).sqrt();
        assert_eq!(largest_gap(&points), expected);
        assert_eq!(largest_gap(&points[..1]), 0.0);
        assert_eq!(largest_gap(&vec![[1.0; 3]; 5000]), 0.0);
    }
}
