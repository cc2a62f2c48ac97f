//! What says which source a voxel has: an index below [`NO_SOURCE`], the top bit set where a source fixed the voxel;
//! and which of two sources is the nearer one.

/// A voxel without a source.
pub const NO_SOURCE: u32 = u32::MAX >> 1;

/// Set on the source index of a fixed voxel.
pub const FIXED: u32 = 1 << 31;

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
