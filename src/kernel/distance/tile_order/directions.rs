//! Which sweeps a tile needs until nothing in it can fall.
//!
//! In a sweep every voxel takes what its neighbours know at that moment. So after it only a voxel can fall that was
//! passed before a neighbour fell below it, and then the next sweep has to go from that neighbour back to it. A sweep
//! reports those axes; one that reports none was the last, without another to confirm it.

use crate::tile::HaloTile;

/// What a sweep tells: bit a says that something is to be carried back along axis a, [`CHANGED`] that any voxel fell.
pub(crate) type Swept = u32;

/// Set in [`Swept`] when any voxel fell.
pub(crate) const CHANGED: Swept = 8;

/// Repeats `sweep(direction)`, the first along `first`, turning the axes along which something is to be carried back.
/// Returns whether anything changed.
pub(crate) fn sweep_until_quiet(first: [bool; 3], mut sweep: impl FnMut([bool; 3]) -> Swept) -> bool {
    let mut direction = first;
    let mut changed = false;
    loop {
        let swept = sweep(direction);
        changed |= swept & CHANGED != 0;
        if swept & (CHANGED - 1) == 0 {
            return changed;
        }
        direction = std::array::from_fn(|a| direction[a] ^ (swept >> a & 1 == 1));
    }
}

/// The direction away from the smallest value around the tile, of voxels and what they hold: where most of what enters
/// it goes.
pub(crate) fn downhill<T: Copy + Default>(tile: &HaloTile<T>, value: impl Fn([isize; 3], T) -> f64) -> [bool; 3] {
    let valid = tile.valid().map(|n| n as isize);
    let middle = valid.map(|n| n / 2);
    let mut least = (f64::INFINITY, middle);
    let mut visit = |at: [isize; 3]| {
        let value = value(at, tile.data()[tile.at(at[0], at[1], at[2])]);
        if value < least.0 {
            least = (value, at);
        }
    };
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        for layer in [-1, valid[axis]] {
            for i in (0..valid[u]).step_by(4).chain([valid[u] - 1]) {
                for j in (0..valid[v]).step_by(4).chain([valid[v] - 1]) {
                    let mut at = [layer; 3];
                    (at[u], at[v]) = (i, j);
                    visit(at);
                }
            }
        }
    }
    std::array::from_fn(|a| least.1[a] <= middle[a])
}
