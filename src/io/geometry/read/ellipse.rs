//! Ellipses as closed polygons.

/// Points along an ellipse.
pub(crate) const ALONG_ELLIPSE: usize = 48;

/// Points along the ellipse that touches a box, of which the corners are given in order.
pub(crate) fn ellipse(corners: [[f64; 3]; 4]) -> Vec<[f64; 3]> {
    let centre: [f64; 3] = std::array::from_fn(|a| corners.iter().map(|c| c[a]).sum::<f64>() / 4.0);
    let half =
        |from: usize, to: usize| -> [f64; 3] { std::array::from_fn(|a| 0.5 * (corners[to][a] - corners[from][a])) };
    let (u, v) = (half(0, 1), half(1, 2));
    let at = |n: usize| {
        let angle = n as f64 * std::f64::consts::TAU / ALONG_ELLIPSE as f64;
        let (sine, cosine) = libm::sincos(angle);
        std::array::from_fn(|a| centre[a] + cosine * u[a] + sine * v[a])
    };
    (0..ALONG_ELLIPSE).map(at).collect()
}
