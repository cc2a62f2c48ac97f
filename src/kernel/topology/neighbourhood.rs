//! The 26 voxels around one as bits, and how many pieces of a set touch it (Bertrand and Malandain 1994; Bertrand 1994, "Simple points,
//! topological numbers and geodesic neighbourhoods in cubic grids").
//!
//! Inside voxels are joined across faces, outside ones across faces and edges, as marching cubes joins them: it separates two opposite inside
//! corners of a face, and two opposite outside corners of a cell. Of such a pair (6, 18) geodesic neighbourhoods are of order 3 and 2.
//!
//! Bit `(z + 1) * 9 + (y + 1) * 3 + x + 1` is the voxel at `[x, y, z]` from the middle.

/// The middle's own bit.
pub const MIDDLE: usize = 13;

/// Which voxels of a set are joined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Joined {
    /// Those that share a face.
    Faces,
    /// Those that share a face or an edge.
    Edges,
}

/// Where a bit lies from the middle.
#[must_use]
pub const fn offset(bit: usize) -> [i64; 3] {
    [(bit % 3) as i64 - 1, (bit / 3 % 3) as i64 - 1, (bit / 9) as i64 - 1]
}

/// For each bit those that differ by 1 along at most `axes` axes and by 0 along the others.
const fn beside(axes: usize) -> [u32; 27] {
    let mut all = [0; 27];
    let mut a = 0;
    while a < 27 {
        let mut b = 0;
        while b < 27 {
            let (p, q) = (offset(a), offset(b));
            let (mut differ, mut far, mut axis) = (0, false, 0);
            while axis < 3 {
                let by = (p[axis] - q[axis]).abs();
                differ += (by == 1) as usize;
                far |= by > 1;
                axis += 1;
            }
            if !far && differ >= 1 && differ <= axes {
                all[a] |= 1 << b;
            }
            b += 1;
        }
        a += 1;
    }
    all
}

const ACROSS_FACES: [u32; 27] = beside(1);
const ACROSS_EDGES: [u32; 27] = beside(2);

impl Joined {
    /// For each of the 27 the bits that are joined to it.
    #[must_use]
    pub const fn beside(self) -> &'static [u32; 27] {
        match self {
            Self::Faces => &ACROSS_FACES,
            Self::Edges => &ACROSS_EDGES,
        }
    }

    /// The pieces of a set that touch the middle, each by its voxels joined to it; the set is given by its bits. Returns how many there are.
    #[must_use]
    pub fn pieces(self, set: u32, pieces: &mut [u32; 8]) -> usize {
        let set = set & !(1 << MIDDLE);
        let touching = set & self.beside()[MIDDLE];
        let steps = match self {
            Self::Faces => 2,
            Self::Edges => 1,
        };
        let near = (0..steps).fold(touching, |near, _| self.grown(near) & set);
        let (mut left, mut count) = (touching, 0);
        while left != 0 && count < pieces.len() {
            let mut piece = left & left.wrapping_neg();
            loop {
                let more = self.grown(piece) & near;
                if more == piece {
                    break;
                }
                piece = more;
            }
            pieces[count] = piece & touching;
            left &= !piece;
            count += 1;
        }
        count
    }

    /// A set with all that is joined to it.
    #[inline]
    fn grown(self, set: u32) -> u32 {
        let rows = [0, 1, 2].map(|axis| along(axis, set));
        match self {
            Self::Faces => rows[0] | rows[1] | rows[2],
            Self::Edges => along(1, rows[0]) | along(2, rows[1]) | along(0, rows[2]),
        }
    }
}

/// For each axis the bits that are the last along it, and the first.
const ENDS: [[u32; 2]; 3] = [ends(0), ends(1), ends(2)];

const fn ends(axis: usize) -> [u32; 2] {
    let mut all = [0; 2];
    let mut bit = 0;
    while bit < 27 {
        match offset(bit)[axis] {
            1 => all[0] |= 1 << bit,
            -1 => all[1] |= 1 << bit,
            _ => {}
        }
        bit += 1;
    }
    all
}

/// A set with what is beside it along an axis.
#[inline]
fn along(axis: usize, set: u32) -> u32 {
    const STEPS: [u32; 3] = [1, 3, 9];
    let [last, first] = ENDS[axis];
    set | (set & !last) << STEPS[axis] | (set & !first) >> STEPS[axis]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::topology::union_find::Forest;

    /// The pieces among the neighbours by their definition: joined pairs of those within so many steps of the middle.
    fn plain(joined: Joined, set: u32) -> usize {
        let near = |a: usize, b: usize| {
            let by: Vec<i64> = (0..3).map(|n| (offset(a)[n] - offset(b)[n]).abs()).collect();
            let axes = if joined == Joined::Faces { 1 } else { 2 };
            by.iter().all(|&d| d <= 1) && (1..=axes).contains(&by.iter().sum::<i64>())
        };
        let members: Vec<usize> = (0..27).filter(|&bit| bit != MIDDLE && set >> bit & 1 == 1).collect();
        let mut reached: Vec<usize> = members.iter().copied().filter(|&a| near(a, MIDDLE)).collect();
        let touching = reached.clone();
        for _ in 0..if joined == Joined::Faces { 2 } else { 1 } {
            let more: Vec<usize> = members.iter().copied().filter(|&a| reached.iter().any(|&b| near(a, b))).collect();
            reached.extend(more);
            reached.sort_unstable();
            reached.dedup();
        }
        let mut forest = Forest::of_singles(27);
        for &a in &reached {
            for &b in reached.iter().filter(|&&b| near(a, b)) {
                forest.join(a as u32, b as u32);
            }
        }
        let mut roots: Vec<u32> = touching.iter().map(|&a| forest.root(a as u32)).collect();
        roots.sort_unstable();
        roots.dedup();
        roots.len()
    }

    #[test]
    fn pieces_are_those_of_the_definition() {
        let mut state = 1_u64;
        for n in 0..3000 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let mut set = (state >> 33) as u32 & ((1 << 27) - 1);
            if n % 2 == 1 {
                set &= (state >> 7) as u32;
            }
            for joined in [Joined::Faces, Joined::Edges] {
                let mut pieces = [0; 8];
                assert_eq!(joined.pieces(set, &mut pieces), plain(joined, set), "{joined:?} {set:b}");
            }
        }
    }
}
