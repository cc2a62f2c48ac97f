//! Geodesic distance from labelled voxels through a field of weights, on one tile: a watershed with markers (Beucher &
//! Meyer 1993; the image foresting transform of Falcao, Stolfi & Lotufo 2004 with additive cost).
//!
//! A step between neighbours p and q, one of 26, costs its length times `w_p + w_q`; lengths are whole numbers that keep
//! the proportions 10 : 14 : 17 of Borgefors (1986) where voxels are cubes. A voxel takes the least `(cost, label)`, in
//! that order, that a neighbour offers. Whole numbers add up without rounding and the order of pairs is kept by adding,
//! so the fixed point is the shortest path from any seed: one for each voxel, whatever the order, bricks or threads.
//!
//! In: costs and labels with their halo, weights with theirs; 0 is a voxel that nothing enters. Out: lower costs.

use crate::grid::NEIGHBOURS_26;
use crate::tile::HaloTile;

/// The cost of a voxel that nothing has reached.
pub const UNREACHED: u32 = u32::MAX;
/// The length of a step across a face, along the axis of the smallest spacing.
const UNIT: f64 = 10.0;

/// The lengths of the steps to the 26 neighbours.
#[derive(Clone, Copy, Debug)]
pub struct Lengths([u32; 26]);

impl Lengths {
    /// The lengths for a spacing.
    #[must_use]
    pub fn new(spacing: [f64; 3]) -> Self {
        let least = spacing.iter().copied().fold(f64::INFINITY, f64::min);
        Self(NEIGHBOURS_26.map(|step| {
            let squared: f64 = (0..3).map(|a| (step[a] as f64 * spacing[a] / least).powi(2)).sum();
            (UNIT * squared.sqrt()).round() as u32
        }))
    }
}

/// Relaxes the tile until nothing falls; returns whether anything fell.
pub fn relax([cost, label]: [&mut HaloTile<u32>; 2], weight: &HaloTile<u16>, Lengths(lengths): &Lengths) -> bool {
    let pitch = cost.pitch() as isize;
    let steps: Vec<(isize, u32)> = NEIGHBOURS_26
        .iter()
        .zip(lengths)
        .map(|(step, &length)| ((step[2] as isize * pitch + step[1] as isize) * pitch + step[0] as isize, length))
        .collect();
    let [width, height, depth] = cost.valid();
    let mut fell = false;
    let mut upward = true;
    loop {
        let mut moved = false;
        for row in 0..height * depth {
            let row = if upward { row } else { height * depth - 1 - row };
            let start = cost.at(0, (row % height) as isize, (row / height) as isize);
            for x in 0..width {
                let at = start + if upward { x } else { width - 1 - x };
                moved |= lower(at, &steps, cost.data_mut(), label.data_mut(), weight.data());
            }
        }
        fell |= moved;
        // Twice in either direction is one more than needed, but for what turns.
        if !moved {
            return fell;
        }
        upward = !upward;
    }
}

/// Takes the least that the neighbours of a voxel offer.
fn lower(at: usize, steps: &[(isize, u32)], cost: &mut [u32], label: &mut [u32], weight: &[u16]) -> bool {
    let own = u32::from(weight[at]);
    // A seed has no cost to lower.
    if own == 0 || cost[at] == 0 {
        return false;
    }
    let mut best = (cost[at], label[at]);
    for &(offset, length) in steps {
        let from = (at as isize + offset) as usize;
        if cost[from] < best.0 {
            let offered = cost[from].saturating_add(length * (own + u32::from(weight[from])));
            // One that cannot be told from unreached any more is not entered.
            if offered < UNREACHED {
                best = best.min((offered, label[from]));
            }
        }
    }
    let fell = best != (cost[at], label[at]);
    (cost[at], label[at]) = best;
    fell
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_keep_the_proportions_of_the_chamfer() {
        let sorted = |spacing| {
            let Lengths(mut lengths) = Lengths::new(spacing);
            lengths.sort_unstable();
            (lengths[0], lengths[6], lengths[18])
        };
        assert_eq!(sorted([0.3; 3]), (10, 14, 17));
        let Lengths(lengths) = Lengths::new([1.0, 1.0, 2.5]);
        assert_eq!(lengths[NEIGHBOURS_26.iter().position(|s| *s == [0, 0, 1]).unwrap()], 25);
    }

    #[test]
    fn fronts_meet_on_the_ridge_and_ties_go_to_the_lower_label() {
        let edge = 9;
        let [mut cost, mut label] = [HaloTile::new(edge), HaloTile::new(edge)];
        let mut weight = HaloTile::new(edge);
        cost.data_mut().fill(UNREACHED);
        cost.set_valid([9, 1, 1]);
        for x in 0..9 {
            let at = cost.at(x, 0, 0);
            // A wall at 6, nearer to the seed on the right.
            weight.data_mut()[at] = if x == 6 { 100 } else { 1 };
        }
        for (x, name) in [(0, 7), (8, 3)] {
            let at = cost.at(x, 0, 0);
            cost.data_mut()[at] = 0;
            label.data_mut()[at] = name;
        }
        assert!(relax([&mut cost, &mut label], &weight, &Lengths::new([1.0; 3])));
        let names: Vec<u32> = (0..9).map(|x| label.data()[label.at(x, 0, 0)]).collect();
        assert_eq!(names, [7, 7, 7, 7, 7, 7, 3, 3, 3]);
        assert!(!relax([&mut cost, &mut label], &weight, &Lengths::new([1.0; 3])));
    }
}
