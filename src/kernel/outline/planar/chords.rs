//! A closed polygon with fewer corners: chords that the corners between their ends are near to.

/// The most edges that a chord stands for.
const MOST: usize = 16;

/// The corners of a polygon that are kept so that no other is farther than `within` from the chord over it, in order
/// from the first one.
#[must_use]
pub fn chords(polygon: &[[f64; 2]], within: f64) -> Vec<[f64; 2]> {
    let corner = |n: usize| polygon[n % polygon.len()];
    let mut kept = Vec::new();
    let mut from = 0;
    while from < polygon.len() {
        kept.push(corner(from));
        let most = MOST.min(polygon.len() - from);
        let follows = |&edges: &usize| {
            (1..edges).all(|n| is_near([corner(from), corner(from + edges)], corner(from + n), within))
        };
        from += (2..=most).take_while(follows).last().unwrap_or(1);
    }
    kept
}

/// Whether a point lies beside a chord, no farther away than `within`.
fn is_near([a, b]: [[f64; 2]; 2], p: [f64; 2], within: f64) -> bool {
    let (along, to) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
    let squared = along[0] * along[0] + along[1] * along[1];
    let (dot, cross) = (to[0] * along[0] + to[1] * along[1], to[0] * along[1] - to[1] * along[0]);
    (0.0..=squared).contains(&dot) && cross * cross <= within * within * squared
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_circle_keeps_its_sag_and_a_square_its_corners() {
        let turn = std::f64::consts::TAU / 1000.0;
        let circle: Vec<[f64; 2]> =
            (0..1000).map(|n| f64::from(n) * turn).map(|t| [50.0 * t.cos(), 50.0 * t.sin()]).collect();
        let kept = chords(&circle, 0.01);
        assert!((100..200).contains(&kept.len()), "{}", kept.len());
        let middle = |n: usize| [0, 1].map(|a| 0.5 * (kept[n][a] + kept[(n + 1) % kept.len()][a]));
        let sags = (0..kept.len()).map(middle).map(|m| 50.0 - m[0].hypot(m[1]));
        assert!(sags.fold(0.0, f64::max) <= 0.0101);
        let side = |n: i32| f64::from(n) / 10.0;
        let along =
            |from: [f64; 2], by: [f64; 2]| (0..10).map(move |n| [from[0] + by[0] * side(n), from[1] + by[1] * side(n)]);
        let square: Vec<[f64; 2]> = along([0.0, 0.0], [1.0, 0.0])
            .chain(along([1.0, 0.0], [0.0, 1.0]))
            .chain(along([1.0, 1.0], [-1.0, 0.0]))
            .chain(along([0.0, 1.0], [0.0, -1.0]))
            .collect();
        assert_eq!(chords(&square, 1e-9), [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
        // A spike back to where it came from is no straight line.
        let spike = [[0.0, 0.0], [2.0, 0.0], [1.0, 0.0], [1.0, 1.0]];
        assert_eq!(chords(&spike, 0.1), spike);
    }
}
