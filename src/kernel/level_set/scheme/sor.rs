//! Red-black successive over-relaxation of `u_p = u_p_old + sum w_pq (u_q - u_p_old)` inside one cell (Kósa 2015, sec.
//! 3.5).
//!
//! Written in differences, which are exact where they are small: a constant stays to the last bit however long the
//! step, where weights that sum to one but for their rounding would pull it away.
//!
//! A cell is relaxed a few times with its ghosts held, then handed back; cells of even and odd parity take turns, so
//! that two cells of one turn share no face. Cells are fixed on the grid, so neither bricks nor threads nor ranks
//! can change a bit. The values stay in [0, 1]: the solution does (maximum principle), and the clamp keeps
//! over-relaxed iterates there on their way.

use super::mask::CellMask;
use super::system::{HALF, HALF_LEN, half_start};
use crate::kernel::level_set::cell::{CELL, GROWN, PLANE};

/// Sums over the solved voxels of a cell after it was relaxed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CellSums {
    /// `|u - u_old|`.
    pub moved: f64,
    /// `(u - u_old)^2`.
    pub moved_squared: f64,
}

/// Squares of the corrections in a cell, summed over its solved voxels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Corrections {
    /// In the first iteration: how far from solved the cell was when it was taken up.
    pub first: f64,
    /// In the last: how far it still is, if its ghosts stay.
    pub last: f64,
}

/// What a cell is relaxed by.
#[derive(Clone, Copy, Debug)]
pub struct Relaxation<'a> {
    /// The linear system, as `scheme` lays it out.
    pub scheme: &'a [f32],
    /// Which voxels are solved.
    pub mask: &'a CellMask,
    /// Over-relaxation.
    pub omega: f32,
    /// How often; at least once.
    pub iterations: usize,
}

/// Relaxes a cell. `u` is the grown cell, ghosts current.
pub fn relax(u: &mut [f32], halves: &mut Halves, by: Relaxation<'_>) -> Corrections {
    if by.mask.count == 0 {
        return Corrections::default();
    }
    vectorised!({ u: &mut [f32], halves: &mut Halves, by: Relaxation<'_> } => relax_cell -> Corrections)
}

/// Half-sweeps of both colours follow each other through the planes, each one plane behind the last: every value is
/// the same as if they ran one after the other, and a plane's weights are read from memory once for all of them.
#[inline(always)]
fn relax_cell(u: &mut [f32], halves: &mut Halves, by: Relaxation<'_>) -> Corrections {
    let Relaxation { scheme, mask, omega, iterations } = by;
    halves.split(u);
    // Of the first iteration, of those between, of the last.
    let mut squares = [[0.0f32; HALF]; 3];
    let turns = std::array::from_fn(|parity| std::array::from_fn(|i| omega * mask.columns[2 * i + parity]));
    let [first, end] = mask.planes;
    let sweeps = 2 * iterations;
    for front in first..end + sweeps - 1 {
        for sweep in front.saturating_sub(end - 1)..sweeps.min(front + 1 - first) {
            let z = front - sweep;
            let part = usize::from(sweep >= 2) + usize::from(sweep >= 2 && sweep + 2 >= sweeps);
            let mut lanes = squares[part];
            for y in mask.rows[z][0]..mask.rows[z][1] {
                let weights = &scheme[half_start(sweep % 2, y, z)..][..HALF_LEN];
                halves.relax((sweep + y + z) % 2, [y, z], weights, &turns, &mut lanes);
            }
            squares[part] = lanes;
        }
    }
    halves.join(u);
    let sum = |lanes: [f32; HALF]| lanes.iter().map(|&s| f64::from(s)).sum::<f64>() / f64::from(omega * omega);
    let first = sum(squares[0]);
    Corrections { first, last: if iterations > 1 { sum(squares[2]) } else { first } }
}

/// Voxels of one parity in a row of the grown cell, and in all of it.
const HALF_PITCH: usize = GROWN / 2;
const HALVES_LEN: usize = GROWN * PLANE / 2;

/// Room for a grown cell as two halves of each row: voxels with even x, and those with odd x, which start with the
/// ghost at -1.
#[derive(Clone, Debug)]
pub struct Halves(Box<[[f32; HALVES_LEN]; 2]>);

impl Halves {
    /// Room for one cell.
    ///
    /// # Panics
    /// Never: the box has the length that it is made with.
    #[must_use]
    pub fn new() -> Self {
        Self(vec![[0.0; HALVES_LEN]; 2].try_into().expect("made with this length"))
    }

    #[inline(always)]
    fn split(&mut self, u: &[f32]) {
        let [even, odd] = &mut *self.0;
        for (n, pair) in u.as_chunks::<2>().0.iter().enumerate().take(HALVES_LEN) {
            (odd[n], even[n]) = (pair[0], pair[1]);
        }
    }

    #[inline(always)]
    fn join(&self, u: &mut [f32]) {
        let [even, odd] = &*self.0;
        for (n, pair) in u.as_chunks_mut::<2>().0.iter_mut().enumerate().take(HALVES_LEN) {
            *pair = [odd[n], even[n]];
        }
    }

    /// Corrects the voxels of one parity in a row.
    #[inline(always)]
    fn relax(
        &mut self,
        parity: usize,
        [y, z]: [usize; 2],
        weights: &[f32],
        turns: &[[f32; HALF]; 2],
        squares: &mut [f32; HALF],
    ) {
        let [even, odd] = &mut *self.0;
        let (own, other) = if parity == 0 { (even, &*odd) } else { (odd, &*even) };
        // In the odd half the ghost comes first.
        let start = (z + 1) * PLANE / 2 + (y + 1) * HALF_PITCH;
        let at = start + parity;
        let neighbours = [
            half(other, start),
            half(other, start + 1),
            half(own, at - HALF_PITCH),
            half(own, at + HALF_PITCH),
            half(own, at - PLANE / 2),
            half(own, at + PLANE / 2),
        ];
        let old = half(weights, 6 * HALF);
        let mut here = *half(own, at);
        let mut sum: [f32; HALF] = std::array::from_fn(|i| old[i] - here[i]);
        for (layer, neighbour) in neighbours.into_iter().enumerate() {
            let weights = half(weights, layer * HALF);
            for i in 0..HALF {
                sum[i] += weights[i] * (neighbour[i] - old[i]);
            }
        }
        for i in 0..HALF {
            sum[i] *= turns[parity][i];
        }
        for i in 0..HALF {
            squares[i] += sum[i] * sum[i];
        }
        for i in 0..HALF {
            here[i] = (here[i] + sum[i]).clamp(0.0, 1.0);
        }
        own[at..at + HALF].copy_from_slice(&here);
    }
}

impl Default for Halves {
    fn default() -> Self {
        Self::new()
    }
}

#[inline(always)]
fn half(values: &[f32], start: usize) -> &[f32; HALF] {
    values[start..start + HALF].first_chunk().expect("half a row of the cell")
}

#[inline(always)]
fn row(values: &[f32], start: usize) -> &[f32; CELL] {
    values[start..start + CELL].first_chunk().expect("a row of the cell")
}

/// Moves the values on as far as they have come since `older`: fewer iterations are left to do from there. They stay in
/// [0, 1].
pub fn extrapolate(u: &mut [f32], older: &[f32]) {
    for (u, older) in u.iter_mut().zip(older) {
        *u = (2.0 * *u - older).clamp(0.0, 1.0);
    }
}

/// Compares a relaxed cell, grown, with the old one, dense over the cell.
#[must_use]
pub fn motion(u: &[f32], old: &[f32], mask: &CellMask) -> CellSums {
    vectorised!({ u: &[f32], old: &[f32], mask: &CellMask } => motion_cell -> CellSums)
}

#[inline(always)]
fn motion_cell(u: &[f32], old: &[f32], mask: &CellMask) -> CellSums {
    let mut moved = [0.0f32; CELL];
    let mut squared = [0.0f32; CELL];
    for z in mask.planes[0]..mask.planes[1] {
        for y in mask.rows[z][0]..mask.rows[z][1] {
            let center = (z + 1) * PLANE + (y + 1) * GROWN + 1;
            let (u, old) = (row(u, center), row(old, (z * CELL + y) * CELL));
            for x in 0..CELL {
                let step = mask.columns[x] * (u[x] - old[x]);
                moved[x] += step.abs();
                squared[x] += step * step;
            }
        }
    }
    let sum = |lanes: [f32; CELL]| lanes.iter().map(|&s| f64::from(s)).sum();
    CellSums { moved: sum(moved), moved_squared: sum(squared) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::level_set::cell::{CELL_LEN, GROWN_LEN};
    use crate::kernel::level_set::scheme::system::{SCHEME_LEN, scheme_place};

    /// Numbers in [0, 1) that look random.
    fn noise(seed: u32, len: usize) -> Vec<f32> {
        let mut state = seed;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        (0..len).map(|_| next()).collect()
    }

    /// Kósa 2015, sec. 3.5: one voxel after the other, all of one colour, then all of the other.
    fn textbook(u: &mut [f32], weights: &dyn Fn(usize, [usize; 3]) -> f32, solved: &[u8], omega: f32, colour: usize) {
        for at in (0..CELL_LEN).filter(|&at| solved[at] == 1) {
            let p = [at % CELL, at / CELL % CELL, at / (CELL * CELL)];
            if p.iter().sum::<usize>() % 2 != colour {
                continue;
            }
            let here = (p[2] + 1) * PLANE + (p[1] + 1) * GROWN + p[0] + 1;
            let around = [here - 1, here + 1, here - GROWN, here + GROWN, here - PLANE, here + PLANE];
            let old = weights(6, p);
            let way = (0..6).fold(old - u[here], |sum, q| sum + weights(q, p) * (u[around[q]] - old));
            u[here] = (u[here] + omega * way).clamp(0.0, 1.0);
        }
    }

    #[test]
    fn overlapping_half_sweeps_give_the_textbooks_bits() {
        for (iterations, share) in [(1, 1.0), (2, 0.3), (3, 0.02), (5, 1.0), (12, 0.001)] {
            let solved: Vec<u8> = noise(7, CELL_LEN).iter().map(|&v| u8::from(v < share)).collect();
            let value = |layer: usize, at: usize| noise((layer * CELL_LEN + at) as u32, 1)[0] / 6.0;
            let weights = |layer: usize, [x, y, z]: [usize; 3]| {
                let at = (z * CELL + y) * CELL + x;
                if solved[at] == 1 { value(layer, at) } else { 0.0 }
            };
            let mut u = noise(3, GROWN_LEN);
            let mut scheme = vec![0.0; SCHEME_LEN];
            for at in 0..CELL_LEN {
                let p = [at % CELL, at / CELL % CELL, at / (CELL * CELL)];
                let held = u[(p[2] + 1) * PLANE + (p[1] + 1) * GROWN + p[0] + 1];
                for layer in 0..7 {
                    scheme[scheme_place(layer, p)] = weights(layer, p);
                }
                if solved[at] == 0 {
                    scheme[scheme_place(6, p)] = held;
                }
            }
            let mut mask = CellMask::new();
            mask.set(&solved, [CELL; 3], [[false; 2]; 3]);
            let mut plain = u.clone();
            for sweep in 0..2 * iterations {
                textbook(&mut plain, &weights, &solved, 1.3, sweep % 2);
            }
            relax(&mut u, &mut Halves::new(), Relaxation { scheme: &scheme, mask: &mask, omega: 1.3, iterations });
            assert!(u.iter().zip(&plain).all(|(a, b)| a.to_bits() == b.to_bits()), "{iterations} times, {share}");
        }
    }

    #[test]
    fn a_cell_without_solved_voxels_stays() {
        let (mut u, scheme) = (noise(5, GROWN_LEN), vec![0.5; SCHEME_LEN]);
        let before = u.clone();
        let by = Relaxation { scheme: &scheme, mask: &CellMask::new(), omega: 1.3, iterations: 20 };
        assert_eq!(relax(&mut u, &mut Halves::new(), by), Corrections::default());
        assert_eq!(u, before);
    }
}
