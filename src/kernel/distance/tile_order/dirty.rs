//! Which diagonals of a tile a sweep has to look at: those beside a voxel that fell since they were looked at last.
//!
//! No voxel of a diagonal asks another of it (`diagonals`), but those on the two beside it in its plane, and on its own
//! in the planes beside. Of these, the two that a sweep comes to later are due once any voxel has fallen; the two that
//! it passed before, when one of their voxels is to be carried something back to. What is left out would have changed
//! nothing: sweeps end with the same bits.

use super::directions::{CHANGED, Swept};

/// Bits of [`Swept`]: along x or y, and along z.
const IN_PLANE: Swept = 3;
const ACROSS: Swept = 4;

/// The diagonals of all planes, by x + y and z counted from the lower ghosts.
#[derive(Clone, Debug)]
pub(crate) struct Dirty {
    flags: Vec<bool>,
    /// Diagonals of a plane and of its ghosts.
    row: usize,
    /// The last diagonal that holds a voxel.
    last: usize,
}

/// The first diagonal that holds a voxel.
const FIRST: usize = 2;

impl Dirty {
    /// For a tile of `edge`^3 voxels.
    pub(crate) fn new(edge: usize) -> Self {
        Self { flags: vec![false; Self::len(edge)], row: 2 * (edge + 2), last: 2 * edge }
    }

    /// Diagonals of all planes of such a tile.
    pub(crate) fn len(edge: usize) -> usize {
        2 * (edge + 2) * (edge + 2)
    }

    /// All of a tile of which so many voxels are in use are due.
    pub(crate) fn all(&mut self, valid: [usize; 3]) {
        self.flags.fill(true);
        self.last = valid[0] + valid[1];
    }

    /// Planes are laid out along other diagonals: all of one are due where any was.
    pub(crate) fn turn(&mut self) {
        for plane in self.flags.chunks_exact_mut(self.row) {
            let any = plane[FIRST..=self.last].iter().fold(false, |any, dirty| any | dirty);
            plane.fill(any);
        }
    }

    /// Whether diagonal `s` of plane `z` is due; it no longer is.
    #[inline(always)]
    pub(crate) fn take(&mut self, z: usize, s: usize) -> bool {
        std::mem::take(&mut self.flags[z * self.row + s])
    }

    /// What a sweep told of it; `upward` along the plane's diagonals, and along z.
    #[inline(always)]
    pub(crate) fn mark(&mut self, z: usize, s: usize, swept: Swept, upward: [bool; 2]) {
        if swept & CHANGED == 0 {
            return;
        }
        let at = z * self.row + s;
        let beside = |step: usize, up: bool| if up { [at + step, at - step] } else { [at - step, at + step] };
        let ([next, passed], [next_plane, passed_plane]) = (beside(1, upward[0]), beside(self.row, upward[1]));
        (self.flags[next], self.flags[next_plane]) = (true, true);
        self.flags[passed] |= swept & IN_PLANE != 0;
        self.flags[passed_plane] |= swept & ACROSS != 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_beside_a_fall_is_due() {
        let mut dirty = Dirty::new(4);
        dirty.all([4, 4, 4]);
        let is_due = |dirty: &mut Dirty| {
            let all = (1..5).flat_map(|z| (2..9).map(move |s| (z, s)));
            all.filter(|&(z, s)| dirty.take(z, s)).collect::<Vec<_>>()
        };
        assert_eq!(is_due(&mut dirty).len(), 28);
        dirty.mark(2, 5, 0, [true; 2]);
        assert_eq!(is_due(&mut dirty), []);
        dirty.mark(2, 5, CHANGED, [true, false]);
        assert_eq!(is_due(&mut dirty), [(1, 5), (2, 6)]);
        dirty.mark(2, 5, CHANGED | 2, [true; 2]);
        assert_eq!(is_due(&mut dirty), [(2, 4), (2, 6), (3, 5)]);
        dirty.mark(2, 5, CHANGED | 4, [false, true]);
        dirty.turn();
        assert_eq!(is_due(&mut dirty).len(), 21);
    }
}
