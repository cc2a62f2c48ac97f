//! Red-black successive over-relaxation of `u_p = r_p + sum w_pq u_q` inside one cell (Kósa 2015, sec. 3.5).
//!
//! A cell is relaxed a few times with its ghosts held, then handed back; cells of even and odd parity take turns, so
//! that two cells of one turn share no face. Cells are fixed on the grid, so neither bricks nor threads nor ranks
//! can change a bit. The values stay in [0, 1]: the solution does (maximum principle), and the clamp keeps
//! over-relaxed iterates there on their way.

use super::covolume::CellMask;
use super::{CELL, CELL_LEN, GROWN, PLANE};

/// Sums over the solved voxels of a cell after it was relaxed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CellSums {
    /// `|u - u_old|`.
    pub moved: f64,
    /// `(u - u_old)^2`.
    pub moved_squared: f64,
    /// `u - u_old`.
    pub grown: f64,
    /// The largest `|u - u_old|`.
    pub largest: f32,
}

/// Relaxes a cell `iterations` times. `u` is the grown cell, ghosts current; returns the squares of first corrections.
pub fn relax(u: &mut [f32], scheme: &[f32], mask: &CellMask, omega: f32, iterations: usize) -> f64 {
    vectorised!({ u: &mut [f32], scheme: &[f32], mask: &CellMask, omega: f32, iterations: usize }
        => relax_cell -> f64)
}

#[inline(always)]
fn relax_cell(u: &mut [f32], scheme: &[f32], mask: &CellMask, omega: f32, iterations: usize) -> f64 {
    let mut first = [0.0f32; CELL];
    half_sweep(u, scheme, mask, omega, 0, &mut first);
    half_sweep(u, scheme, mask, omega, 1, &mut first);
    let mut rest = [0.0f32; CELL];
    for _ in 1..iterations {
        half_sweep(u, scheme, mask, omega, 0, &mut rest);
        half_sweep(u, scheme, mask, omega, 1, &mut rest);
    }
    first.iter().map(|&s| f64::from(s)).sum()
}

/// Corrects the voxels of one colour, those with `x + y + z` of parity `colour`.
#[inline(always)]
fn half_sweep(u: &mut [f32], scheme: &[f32], mask: &CellMask, omega: f32, colour: usize, squares: &mut [f32; CELL]) {
    // Omega on the voxels of the colour, 0 between and beyond the domain, for rows that start with either colour.
    let turns: [[f32; CELL]; 2] = std::array::from_fn(|start| {
        std::array::from_fn(|x| if (x + start) % 2 == 0 { omega * mask.columns[x] } else { 0.0 })
    });
    let inverse_square = 1.0 / (omega * omega);
    for z in mask.planes[0]..mask.planes[1] {
        for y in mask.rows[z][0]..mask.rows[z][1] {
            let at = (z * CELL + y) * CELL;
            let center = (z + 1) * PLANE + (y + 1) * GROWN + 1;
            let turn = &turns[(colour + y + z) % 2];
            let mut sum = *row(scheme, 6 * CELL_LEN + at);
            let places = [center - 1, center + 1, center - GROWN, center + GROWN, center - PLANE, center + PLANE];
            for (layer, place) in places.into_iter().enumerate() {
                let (weights, neighbour) = (row(scheme, layer * CELL_LEN + at), row(u, place));
                for x in 0..CELL {
                    sum[x] += weights[x] * neighbour[x];
                }
            }
            let here: &mut [f32; CELL] = u[center..center + CELL].first_chunk_mut().expect("a row of the cell");
            for x in 0..CELL {
                let correction = turn[x] * (sum[x] - here[x]);
                squares[x] += correction * correction * inverse_square;
                here[x] = (here[x] + correction).clamp(0.0, 1.0);
            }
        }
    }
}

#[inline(always)]
fn row(values: &[f32], start: usize) -> &[f32; CELL] {
    values[start..start + CELL].first_chunk().expect("a row of the cell")
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
    let mut grown = [0.0f32; CELL];
    let mut largest = [0.0f32; CELL];
    for z in mask.planes[0]..mask.planes[1] {
        for y in mask.rows[z][0]..mask.rows[z][1] {
            let center = (z + 1) * PLANE + (y + 1) * GROWN + 1;
            let (u, old) = (row(u, center), row(old, (z * CELL + y) * CELL));
            for x in 0..CELL {
                let step = mask.columns[x] * (u[x] - old[x]);
                moved[x] += step.abs();
                squared[x] += step * step;
                grown[x] += step;
                largest[x] = largest[x].max(step.abs());
            }
        }
    }
    let sum = |lanes: [f32; CELL]| lanes.iter().map(|&s| f64::from(s)).sum();
    CellSums {
        moved: sum(moved),
        moved_squared: sum(squared),
        grown: sum(grown),
        largest: largest.iter().copied().fold(0.0, f32::max),
    }
}
