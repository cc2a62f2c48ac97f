//! Where the regions of steepest ascent meet in one brick, and how large they are there; only comparisons and counts,
//! so no result depends on bricks.

use serde::{Deserialize, Serialize};

use super::ascent::rows;
use crate::tile::HaloTile;

/// Where two regions meet.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Contact {
    /// The smaller of the two numbers first.
    pub regions: [u32; 2],
    /// The largest distance to the cloud on the border between them: half as wide as the opening.
    pub pass: f32,
    /// The voxel that has it, the first in the brick; as a place of the dense brick.
    pub place: u32,
    /// Number of faces between voxels of the one and the other.
    pub faces: u32,
}

/// Where regions meet in a brick and across its upper faces, and across those lower ones that `lower` names; in no
/// order. `d` and `regions` have their ghosts across faces.
#[must_use]
pub fn contacts(d: &HaloTile<f32>, regions: &HaloTile<u32>, lower: [bool; 3]) -> Vec<Contact> {
    let (edge, pitch, valid) = (d.edge(), d.pitch(), d.valid());
    let strides = [1, pitch, pitch * pitch];
    let mut found: Vec<Contact> = Vec::new();
    for (row, start) in rows(d) {
        let mut compare = |x: usize, next: usize| {
            let at = start + x;
            let (a, b) = (regions.data()[at], regions.data()[next]);
            if a != b {
                let (pass, place) = (d.data()[at].min(d.data()[next]), (row + x) as u32);
                add(&mut found, Contact { regions: [a.min(b), a.max(b)], pass, place, faces: 1 });
            }
        };
        for stride in strides {
            (0..valid[0]).for_each(|x| compare(x, start + x + stride));
        }
        if lower[0] {
            compare(0, start - 1);
        }
        for (axis, at) in [(1, row / edge % edge), (2, row / (edge * edge))] {
            if at == 0 && lower[axis] {
                (0..valid[0]).for_each(|x| compare(x, start + x - strides[axis]));
            }
        }
    }
    found.shrink_to_fit();
    found
}

/// Few regions meet in one brick: a list is searched faster than anything else, from its end.
fn add(found: &mut Vec<Contact>, contact: Contact) {
    match found.iter_mut().rev().find(|known| known.regions == contact.regions) {
        Some(known) => {
            known.faces += 1;
            if contact.pass > known.pass {
                (known.pass, known.place) = (contact.pass, contact.place);
            }
        }
        None => found.push(contact),
    }
}

/// Number of voxels of each region in a brick, in the order in which they come.
#[must_use]
pub fn count(regions: &HaloTile<u32>) -> Vec<(u32, u64)> {
    let valid = regions.valid();
    let mut counts: Vec<(u32, u64)> = Vec::new();
    for (z, y) in (0..valid[2]).flat_map(|z| (0..valid[1]).map(move |y| (z, y))) {
        for &region in &regions.data()[regions.at(0, y as isize, z as isize)..][..valid[0]] {
            match counts.iter_mut().rev().find(|(known, _)| *known == region) {
                Some((_, count)) => *count += 1,
                None => counts.push((region, 1)),
            }
        }
    }
    counts
}
