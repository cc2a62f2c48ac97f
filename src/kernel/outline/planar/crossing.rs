//! Does a closed polygon cross itself? Then what it encloses is not what was meant.

/// True when two edges of the polygon that are no neighbours cross. Edges are taken by their lowest coordinate along the
/// polygon's longer side: only those that overlap along it are compared.
#[must_use]
pub fn crosses_itself(polygon: &[[f64; 2]]) -> bool {
    let count = polygon.len();
    let edge = |n: usize| [polygon[n], polygon[(n + 1) % count]];
    let along = longer_side(polygon);
    let span = |n: usize, axis: usize| {
        let [a, b] = edge(n).map(|end| end[axis]);
        [a.min(b), a.max(b)]
    };
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|&n, &m| span(n, along)[0].total_cmp(&span(m, along)[0]));
    order.iter().enumerate().any(|(place, &n)| {
        let ([_, end], [low, high]) = (span(n, along), span(n, 1 - along));
        let overlapping = order[place + 1..].iter().take_while(|&&m| span(m, along)[0] <= end);
        let beside = |&&m: &&usize| (n + 1) % count == m || (m + 1) % count == n;
        overlapping.filter(|m| !beside(m)).any(|&m| {
            let [least, most] = span(m, 1 - along);
            least <= high && low <= most && cross(edge(n), edge(m))
        })
    })
}

fn longer_side(polygon: &[[f64; 2]]) -> usize {
    let extent = |axis: usize| {
        let values = || polygon.iter().map(|p| p[axis]);
        values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
    };
    usize::from(extent(1) > extent(0))
}

fn cross([a, b]: [[f64; 2]; 2], [c, d]: [[f64; 2]; 2]) -> bool {
    side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0
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

    #[test]
    fn all_pairs_compared_tell_the_same() {
        let mut state = 7u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f64 / (1u64 << 24) as f64
        };
        let mut found = [0, 0];
        for round in 0..200 {
            // Stars, whose corners change places along the outline now and then.
            let corners = 5 + round % 9;
            let turn = |n: usize| n as f64 / corners as f64 * std::f64::consts::TAU;
            let mut star: Vec<[f64; 2]> = (0..corners)
                .map(|n| (turn(n), 1.0 + random()))
                .map(|(t, r)| [r * t.cos(), 3.0 * r * t.sin()])
                .collect();
            if round % 2 == 0 {
                star.swap(1, 2 + round % (corners - 2));
            }
            let edge = |n: usize| [star[n], star[(n + 1) % corners]];
            let pairs = (0..corners).flat_map(|n| (n + 2..corners).map(move |m| (n, m)));
            let wanted = pairs.filter(|(n, m)| (m + 1) % corners != *n).any(|(n, m)| cross(edge(n), edge(m)));
            assert_eq!(crosses_itself(&star), wanted, "{star:?}");
            found[usize::from(wanted)] += 1;
        }
        assert!(found[0] > 50 && found[1] > 50, "{found:?}");
    }
}
