//! Which sweeps a tile needs until nothing in it can fall.
//!
//! In a sweep every voxel takes what its neighbours know at that moment. So after it only a voxel can fall that was
//! passed before a neighbour fell below it, and then the next sweep has to go from that neighbour back to it. A sweep
//! reports those axes; one that reports none was the last, without another to confirm it.

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
