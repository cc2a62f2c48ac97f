//! A polygon in space as seen along its area vector (Newell's formula): flat, and of the size of 1.

/// A corner is straight within this, in squares of the polygon's size: the rounding of the products.
pub(crate) const STRAIGHT: f64 = 1e-12;

/// A polygon as seen from where its area is largest.
pub(crate) enum Flattened {
    /// All corners lie on a line.
    Line,
    /// Parts of it are wound around one way and parts the other way, so that no area is left.
    Cancelled,
    /// The corners in the plane of two axes, counterclockwise, scaled by a power of two to the size of 1.
    Plane(Vec<[f64; 2]>),
}

/// A polygon's corners in the plane that shows most of it.
pub(crate) fn flattened(corners: &[[f64; 3]]) -> Flattened {
    let from = corners[0];
    let local: Vec<[f64; 3]> = corners.iter().map(|p| std::array::from_fn(|a| p[a] / 4.0 - from[a] / 4.0)).collect();
    let size = local.iter().flatten().fold(0.0_f64, |size, x| size.max(x.abs()));
    if size == 0.0 {
        return Flattened::Line;
    }
    let (_, exponent) = libm::frexp(size);
    let scaled: Vec<[f64; 3]> = local.iter().map(|p| p.map(|x| libm::ldexp(x, -exponent))).collect();
    let (mut area, mut plain) = ([0.0_f64; 3], 0.0);
    for (n, p) in scaled.iter().enumerate() {
        let q = scaled[(n + 1) % scaled.len()];
        for (a, sum) in area.iter_mut().enumerate() {
            let (i, j) = ((a + 1) % 3, (a + 2) % 3);
            let part = p[i] * q[j] - p[j] * q[i];
            *sum += part;
            plain += part.abs();
        }
    }
    let axis = (1..3).fold(0, |most, a| if area[a].abs() > area[most].abs() { a } else { most });
    if area[axis].abs() <= STRAIGHT {
        return if plain > 1e-9 { Flattened::Cancelled } else { Flattened::Line };
    }
    let (mut i, mut j) = ((axis + 1) % 3, (axis + 2) % 3);
    if area[axis] < 0.0 {
        (i, j) = (j, i);
    }
    Flattened::Plane(scaled.iter().map(|p| [p[i], p[j]]).collect())
}

/// Twice the area of a triangle, positive where its corners turn counterclockwise.
pub(crate) fn turn(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// False for a polygon that turns more or less than once in all, as no simple one does; a spike, which may turn either
/// way, tells nothing.
pub(crate) fn turns_once(points: &[[f64; 2]]) -> bool {
    let mut distinct = points.to_vec();
    distinct.dedup();
    if distinct.len() > 1 && distinct[0] == distinct[distinct.len() - 1] {
        distinct.pop();
    }
    let (mut sum, n) = (0.0, distinct.len());
    for at in 0..n {
        let [p, q, r] = [distinct[(at + n - 1) % n], distinct[at], distinct[(at + 1) % n]];
        let [u, v]: [[f64; 2]; 2] = [std::array::from_fn(|a| q[a] - p[a]), std::array::from_fn(|a| r[a] - q[a])];
        let angle = libm::atan2(u[0] * v[1] - u[1] * v[0], u[0] * v[0] + u[1] * v[1]);
        if angle.abs() > std::f64::consts::PI - 1e-6 {
            return true;
        }
        sum += angle;
    }
    (sum - std::f64::consts::TAU).abs() < 1.0
}

/// True when all of the polygon is seen from its first corner.
pub(crate) fn is_star(points: &[[f64; 2]]) -> bool {
    let first = points[0];
    let is_convex = turn(points[points.len() - 1], first, points[1]) >= -STRAIGHT;
    is_convex && points[1..].windows(2).all(|side| turn(first, side[0], side[1]) >= -STRAIGHT)
}
