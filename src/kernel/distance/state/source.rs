//! Which of two sources is the nearer one.

/// The squared Euclidean distance of two positions.
#[inline]
#[must_use]
pub fn squared_distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    let [x, y, z]: [f64; 3] = std::array::from_fn(|k| a[k] - b[k]);
    x * x + y * y + z * z
}

/// Whether of two sources, each with its squared distance, the first counts: the nearer one, of equal distances that of
/// the lower label, then of the lower index.
pub(crate) fn counts_before(a: (f64, u32), b: (f64, u32), label: impl Fn(u32) -> u32) -> bool {
    a.0 < b.0 || (a.0 == b.0 && (label(a.1), a.1) < (label(b.1), b.1))
}
