//! The co-volume scheme as the diploma thesis prints it, one voxel at a time, in f64 (Kósa 2015, sec. 3.3, with the
//! errata of its points P1..P8 and of G14; the velocity of Kósa PhD, eq. 3.14, 3.18). Shared by tests and the bench.
//!
//! The thesis counts i along y, j along x and k along z, and calls the faces B, T (k), N, S (i), E, W (j). With unequal
//! spacing each derivative is divided by the spacing of the axis it is taken along.

/// What moves the surface; see the kernel's velocity of the same fields.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlainVelocity {
    pub(crate) theta: f64,
    pub(crate) rho: f64,
    pub(crate) delta: f64,
    pub(crate) epsilon: f64,
    pub(crate) tau: f64,
    pub(crate) normalised: bool,
}

/// The norms G1..G24, without regularisation; `u(i, j, k)` are the values around the voxel, offsets -1, 0, 1.
#[inline]
pub(crate) fn gradient_norms(u: impl Fn(i64, i64, i64) -> f64, [hj, hi, hk]: [f64; 3]) -> [f64; 24] {
    let corner = |i: i64, j: i64, k: i64| {
        0.125 * (u(0, 0, 0) + u(i, 0, 0) + u(0, j, 0) + u(0, 0, k) + u(i, j, 0) + u(i, 0, k) + u(0, j, k) + u(i, j, k))
    };
    let (p1, p2, p3, p4) = (corner(-1, -1, -1), corner(1, -1, -1), corner(1, 1, -1), corner(-1, 1, -1));
    let (p5, p6, p7, p8) = (corner(-1, -1, 1), corner(1, -1, 1), corner(1, 1, 1), corner(-1, 1, 1));
    let half = |a: f64, b: f64| 0.5 * (a + b);
    let (p12, p14, p15, p23) = (half(p1, p2), half(p1, p4), half(p1, p5), half(p2, p3));
    let (p26, p34, p37, p48) = (half(p2, p6), half(p3, p4), half(p3, p7), half(p4, p8));
    let (p56, p58, p67, p78) = (half(p5, p6), half(p5, p8), half(p6, p7), half(p7, p8));
    let centre = u(0, 0, 0);
    let (n0, s0) = (half(centre, u(1, 0, 0)), half(centre, u(-1, 0, 0)));
    let (e0, w0) = (half(centre, u(0, 1, 0)), half(centre, u(0, -1, 0)));
    let (t0, b0) = (half(centre, u(0, 0, 1)), half(centre, u(0, 0, -1)));
    let (d_b, d_t) = ((centre - u(0, 0, -1)) / hk, (u(0, 0, 1) - centre) / hk);
    let (d_n, d_s) = ((u(1, 0, 0) - centre) / hi, (centre - u(-1, 0, 0)) / hi);
    let (d_e, d_w) = ((u(0, 1, 0) - centre) / hj, (centre - u(0, -1, 0)) / hj);
    let g = |across: f64, edge: f64, h_edge: f64, inward: f64, h_inward: f64| {
        let (along, inward) = (edge / h_edge, inward / (0.5 * h_inward));
        (across * across + along * along + inward * inward).sqrt()
    };
    [
        g(d_b, p2 - p1, hi, b0 - p12, hj),
        g(d_b, p4 - p1, hj, b0 - p14, hi),
        g(d_b, p3 - p4, hi, p34 - b0, hj),
        g(d_b, p3 - p2, hj, p23 - b0, hi),
        g(d_t, p6 - p5, hi, t0 - p56, hj),
        g(d_t, p8 - p5, hj, t0 - p58, hi),
        g(d_t, p7 - p8, hi, p78 - t0, hj),
        g(d_t, p7 - p6, hj, p67 - t0, hi),
        g(d_n, p7 - p6, hj, p67 - n0, hk),
        g(d_n, p7 - p3, hk, p37 - n0, hj),
        g(d_n, p3 - p2, hj, n0 - p23, hk),
        g(d_n, p6 - p2, hk, n0 - p26, hj),
        g(d_s, p8 - p5, hj, p58 - s0, hk),
        g(d_s, p8 - p4, hk, p48 - s0, hj),
        g(d_s, p4 - p1, hj, s0 - p14, hk),
        g(d_s, p5 - p1, hk, s0 - p15, hj),
        g(d_e, p3 - p4, hi, e0 - p34, hk),
        g(d_e, p7 - p3, hk, p37 - e0, hi),
        g(d_e, p8 - p7, hi, p78 - e0, hk),
        g(d_e, p8 - p4, hk, e0 - p48, hi),
        g(d_w, p2 - p1, hi, w0 - p12, hk),
        g(d_w, p6 - p2, hk, p26 - w0, hi),
        g(d_w, p6 - p5, hi, p56 - w0, hk),
        g(d_w, p5 - p1, hk, w0 - p15, hi),
    ]
}

/// The mean of the 24 norms, without regularisation.
#[inline]
pub(crate) fn mean_norm(norms: &[f64; 24]) -> f64 {
    norms.iter().sum::<f64>() / 24.0
}

/// The coefficients `a_pq` towards -x, +x, -y, +y, -z, +z; `d(q)`, `g(q)` are the differences to the six neighbours.
#[inline]
pub(crate) fn coefficients(
    norms: &[f64; 24],
    d: [f64; 6],
    g: [f64; 6],
    spacing: [f64; 3],
    v: &PlainVelocity,
) -> [f64; 6] {
    // Where W, E, S, N, B, T start among the norms.
    const FIRST: [usize; 6] = [20, 16, 12, 8, 0, 4];
    let m = spacing[0] * spacing[1] * spacing[2];
    let mean = mean_norm(norms);
    let m_p = (v.epsilon * v.epsilon + mean * mean).sqrt();
    let squares: f64 = (0..6).map(|q| (g[q] / spacing[q / 2]).powi(2)).sum();
    let norm_g = if v.normalised { (v.epsilon * v.epsilon + 0.5 * squares).sqrt() } else { 1.0 };
    std::array::from_fn(|q| {
        let h = spacing[q / 2];
        let area = m / h;
        let v_pq = -v.theta * area * d[q] / h - v.rho * area * (g[q] / h) / norm_g;
        let tetrahedra = &norms[FIRST[q]..FIRST[q] + 4];
        let sum: f64 = tetrahedra.iter().map(|g| 1.0 / (v.epsilon * v.epsilon + g * g).sqrt()).sum();
        (v.tau / m) * (v_pq.min(0.0) - v.delta * m_p * (area / 4.0) / h * sum)
    })
}

/// What a speed F outwards adds to `a_pq`: `F |grad u|` is `F (grad u / |grad u|) . grad u`, upwind; `u` are the
/// differences to the six neighbours.
#[inline]
pub(crate) fn speed_coefficients(
    norms: &[f64; 24],
    u: [f64; 6],
    speed: f64,
    spacing: [f64; 3],
    v: &PlainVelocity,
) -> [f64; 6] {
    const FIRST: [usize; 6] = [20, 16, 12, 8, 0, 4];
    std::array::from_fn(|q| {
        let tetrahedra = &norms[FIRST[q]..FIRST[q] + 4];
        let inverse = tetrahedra.iter().map(|g| 1.0 / (v.epsilon * v.epsilon + g * g).sqrt()).sum::<f64>() / 4.0;
        -v.tau / spacing[q / 2].powi(2) * (speed * u[q]).max(0.0) * inverse
    })
}
