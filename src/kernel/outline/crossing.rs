//! Does a closed polygon cross itself? Then what it encloses is not what was meant.

/// True when two edges of the polygon that are no neighbours cross.
#[must_use]
pub fn crosses_itself(polygon: &[[f64; 2]]) -> bool {
    let count = polygon.len();
    let edge = |n: usize| (polygon[n], polygon[(n + 1) % count]);
    (0..count).any(|n| {
        (n + 2..count).filter(|m| (m + 1) % count != n).any(|m| {
            let ((a, b), (c, d)) = (edge(n), edge(m));
            side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0
        })
    })
}

/// Twice the signed area of a triangle.
fn side(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_eight_crosses_itself_and_a_square_does_not() {
        assert!(!crosses_itself(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]));
        assert!(crosses_itself(&[[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]]));
        assert!(!crosses_itself(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]));
    }
}
