//! Points that stand alone: what a scanner or a tracker takes for surface where there is none.

use rstar::RTree;

/// A point that belongs to a surface has so many others near it.
const NEIGHBOURS: usize = 3;

/// The points that have at least three others within a distance, in their order.
#[must_use]
pub fn without_isolated(points: &[[f64; 3]], within: f64) -> Vec<[f64; 3]> {
    let tree = RTree::bulk_load(points.to_vec());
    let near = |p: &[f64; 3]| tree.locate_within_distance(*p, within * within).take(NEIGHBOURS + 1).count();
    points.iter().copied().filter(|p| near(p) > NEIGHBOURS).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_alone_and_in_pairs_go() {
        let plane: Vec<[f64; 3]> = (0..100).map(|n| [f64::from(n % 10), f64::from(n / 10), 0.0]).collect();
        let noisy = [&plane[..50], &[[5.0, 5.0, 9.0], [4.0, 4.0, -4.0], [4.0, 4.5, -4.0]], &plane[50..]].concat();
        assert_eq!(without_isolated(&noisy, 3.0), plane);
        assert_eq!(without_isolated(&noisy, 20.0), noisy);
    }
}
