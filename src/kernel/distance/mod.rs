//! Distance to point sources on one tile: where sources fix voxels, and how sweeps carry them outward.

pub mod fast_sweeping;
pub mod initialise;
pub mod vector_distance;

/// The eight sweep orders: for each axis, whether it runs from low to high; x changes fastest.
pub const SWEEPS: [[bool; 3]; 8] = {
    let mut orders = [[true; 3]; 8];
    let mut n = 0;
    while n < 8 {
        orders[n] = [n & 1 == 0, n & 2 == 0, n & 4 == 0];
        n += 1;
    }
    orders
};

/// The local indices of one axis in sweep order.
pub(crate) fn ordered(count: usize, upward: bool) -> impl Iterator<Item = isize> {
    (0..count as isize).map(move |i| if upward { i } else { count as isize - 1 - i })
}
