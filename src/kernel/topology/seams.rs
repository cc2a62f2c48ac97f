//! Seams of a grown side: what was left out, disc by disc, how wide each is, and how long the way is that leads from one of its sides to the
//! other.

use std::collections::{HashMap, VecDeque};

use super::blocks::{Blocks, Where};
use super::growth::Grown;
use super::neighbourhood::{Joined, MIDDLE};

/// What was left out of a grown side in one place.
#[derive(Clone, Debug, PartialEq)]
pub struct Seam {
    /// Its voxels, in order.
    pub places: Vec<usize>,
    /// The largest distance between two of them and a voxel's spacing.
    pub width: f64,
}

/// The seams that are no wider than that, in order of their first voxels.
#[must_use]
pub fn seams(blocks: &Blocks, grown: &Grown, spacing: [f64; 3], widest: f64) -> Vec<Seam> {
    let left: Vec<usize> = grown.left_out().collect();
    let mut seen = vec![false; left.len()];
    let mut found = Vec::new();
    for first in 0..left.len() {
        if std::mem::replace(&mut seen[first], true) {
            continue;
        }
        let (mut due, mut places) = (vec![first], Vec::new());
        while let Some(n) = due.pop() {
            places.push(left[n]);
            for bit in (0..27).filter(|&bit| bit != MIDDLE) {
                let Where::Voxel(other) = blocks.neighbour(left[n], bit) else { continue };
                if let Ok(m) = left.binary_search(&other)
                    && !std::mem::replace(&mut seen[m], true)
                {
                    due.push(m);
                }
            }
        }
        places.sort_unstable();
        if let Some(width) = width(blocks, &places, spacing, widest) {
            found.push(Seam { places, width });
        }
    }
    found
}

/// The largest distance between two voxels and a spacing, where that is no more than `widest`.
fn width(blocks: &Blocks, places: &[usize], spacing: [f64; 3], widest: f64) -> Option<f64> {
    let largest = spacing.into_iter().fold(0.0, f64::max);
    let voxels: Vec<[i64; 3]> = places.iter().map(|&place| blocks.voxel(place)).collect();
    let mut most = 0.0_f64;
    for (n, a) in voxels.iter().enumerate() {
        for b in &voxels[..n] {
            let squared = (0..3).map(|axis| ((a[axis] - b[axis]) as f64 * spacing[axis]).powi(2)).sum::<f64>();
            most = most.max(squared);
        }
        if most.sqrt() + largest > widest {
            return None;
        }
    }
    Some(most.sqrt() + largest)
}

/// What is around the handle that a seam cuts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ends {
    /// Whether a way of at most so many steps leads from one end to the other.
    pub meet: bool,
    /// Voxels within so many steps of the end that has least of them.
    pub voxels: usize,
}

/// Looks around the two ends of a handle that is cut by a seam: `far` steps across faces for a way from one to the other, `near` steps for how
/// much there is. None where the seam has not two ends.
#[must_use]
pub fn ends_of(blocks: &Blocks, grown: &Grown, seam: &Seam, near: u32, far: u32) -> Option<Ends> {
    let ends = seam.places.iter().map(|&place| ends_beside(blocks, grown, place)).find(|ends| ends.len() > 1)?;
    let mut found = Ends { meet: false, voxels: usize::MAX };
    for (n, &end) in ends.iter().enumerate() {
        let mut steps = HashMap::from([(end, 0)]);
        let mut due = VecDeque::from([end]);
        let most = if n == 0 { far } else { near };
        let mut count = 0;
        while let Some(place) = due.pop_front() {
            let taken = steps[&place];
            found.meet |= n == 0 && ends[1..].contains(&place);
            count += usize::from(taken <= near);
            if found.meet || taken == most {
                continue;
            }
            for bit in (0..27).filter(|&bit| Joined::Faces.beside()[MIDDLE] >> bit & 1 == 1) {
                if let Where::Voxel(other) = blocks.neighbour(place, bit)
                    && grown.holds(other)
                    && !steps.contains_key(&other)
                {
                    steps.insert(other, taken + 1);
                    due.push_back(other);
                }
            }
        }
        found.voxels = found.voxels.min(count);
        if found.meet {
            break;
        }
    }
    Some(found)
}

/// A voxel of each piece of a grown inside that touches a voxel.
fn ends_beside(blocks: &Blocks, grown: &Grown, place: usize) -> Vec<usize> {
    let mut beside = [None; 27];
    let mut set = 0;
    for bit in (0..27).filter(|&bit| bit != MIDDLE) {
        if let Where::Voxel(other) = blocks.neighbour(place, bit)
            && grown.holds(other)
        {
            beside[bit] = Some(other);
            set |= 1 << bit;
        }
    }
    let mut pieces = [0; 8];
    let count = Joined::Faces.pieces(set, &mut pieces);
    pieces[..count].iter().filter_map(|piece| beside[piece.trailing_zeros() as usize]).collect()
}
