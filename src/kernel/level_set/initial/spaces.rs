//! Which regions of steepest ascent are inside of a cloud and which are outside (docs/algorithms.md, "Steepest ascent
//! and spaces": basins, saddles and persistence, here of all spaces against each other, not of the outside alone).
//!
//! Regions merge across their passes, the widest first. Where two spaces meet that are both so much deeper than the
//! pass between them, a wall of points stands there, and they stay apart. Spaces that are left are told sides so that
//! points have the inside on one hand and the outside on the other: the outermost is outside, and each that follows is
//! opposite to what most of its border meets. So bodies may hold hollows, and these bodies again.
//!
//! *Pockets* are what a large ball cannot reach from outside. They stay apart from what is not a pocket, and their
//! borders tell their side too: a dent meets the inside with most of its border, the bell of an open body the outside.

use super::ascent::OUTSIDE;
use super::contacts::Contact;
use super::persistence::PERSISTENCE;
use crate::kernel::topology::union_find::Forest;

/// What a region of steepest ascent is like.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Region {
    /// Its largest distance to the cloud.
    pub depth: f32,
    /// Number of voxels.
    pub voxels: u64,
    /// How deep a pocket it is; 0 for none.
    pub pocket: f32,
}

/// A space that persists, inside of the cloud.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Space {
    /// Its largest distance to the cloud.
    pub depth: f32,
    /// Number of voxels.
    pub voxels: u64,
    /// The contact at its widest pass to the outside: its place in the list that was given.
    pub hole: usize,
}

/// Sorts contacts by their regions and makes those between the same two one; of equal passes the first stays.
#[must_use]
pub fn joined(mut contacts: Vec<(Contact, u64)>) -> Vec<(Contact, u64)> {
    // No two of a brick are of the same regions, so that none are equal.
    contacts
        .sort_unstable_by(|(a, m), (b, n)| a.regions.cmp(&b.regions).then(b.pass.total_cmp(&a.pass)).then(m.cmp(n)));
    contacts.dedup_by(|(next, _), (kept, _)| {
        let same = next.regions == kept.regions;
        if same {
            kept.faces = kept.faces.saturating_add(next.faces);
        }
        same
    });
    contacts
}

/// Tells which regions are inside, and the spaces they form, deepest first. Region [`OUTSIDE`] is outside whatever
/// happens; no space less deep than `least_depth` stays apart, and no pocket less deep than `least_pocket`. Pockets
/// meet where no wall of points is between them: where the distance to the cloud is at least `wall`.
#[must_use]
pub fn inside(
    regions: &[Region],
    contacts: &[(Contact, u64)],
    least_depth: f32,
    least_pocket: f32,
    wall: f32,
) -> (Vec<bool>, Vec<Space>) {
    let mut order: Vec<usize> = (0..contacts.len()).collect();
    order.sort_by(|&a, &b| contacts[b].0.pass.total_cmp(&contacts[a].0.pass).then(a.cmp(&b)));
    let mut merged = Merged::new(regions);
    let deep = |pass: f32| (PERSISTENCE * pass).max(least_depth);
    // Pockets first, for how deep they are is that of all of them.
    for Contact { regions: [a, b], pass, .. } in order.iter().map(|&n| contacts[n].0) {
        if pass >= wall && [a, b].iter().all(|&region| regions[region as usize].pocket > 0.0) {
            merged.meet(a, b, deep(pass));
        }
    }
    merged.fill_shallow_pockets(least_pocket);
    for Contact { regions: [a, b], pass, .. } in order.iter().map(|&n| contacts[n].0) {
        if !merged.is_pocket(a) && !merged.is_pocket(b) {
            merged.meet(a, b, deep(pass));
        }
    }
    let roots = merged.forest.roots();
    let sides = sides_of(&roots, contacts);
    let inside: Vec<bool> = roots.iter().map(|&root| sides[root as usize] == Side::Inside).collect();
    // A pocket inside is part of the body that it opens into.
    for [a, b] in contacts.iter().map(|(contact, _)| contact.regions) {
        if inside[a as usize] && inside[b as usize] && merged.is_pocket(a) != merged.is_pocket(b) {
            merged.meet(a, b, f32::INFINITY);
        }
    }
    let roots = merged.forest.roots();
    let spaces = spaces_of(regions, &roots, &inside, contacts);
    (inside, spaces)
}

/// Bytes that a region takes until its side is known: itself, what it is merged to, its side, and its row of neighbours.
pub const REGION_BYTES: u64 = 64;
/// Bytes that a contact takes: in its brick and in the list of all, then there with its place in the order and in two rows.
pub const CONTACT_BYTES: u64 = 64;

/// Tells each voxel its side, 1 inside and 0 outside, from its region.
pub fn mark_sides(regions: &[u32], is_inside: &[bool], side: &mut [u8]) {
    for (side, &region) in side.iter_mut().zip(regions) {
        *side = side_of(region, is_inside);
    }
}

/// The side of a region, 1 inside and 0 outside; what is no region is outside.
#[must_use]
pub fn side_of(region: u32, is_inside: &[bool]) -> u8 {
    u8::from(is_inside.get(region as usize).copied().unwrap_or(false))
}

/// Regions merged to spaces; what a space is like stands at its root.
struct Merged {
    forest: Forest,
    depth: Vec<f32>,
    pocket: Vec<f32>,
}

impl Merged {
    fn new(regions: &[Region]) -> Self {
        let mut depth: Vec<f32> = regions.iter().map(|region| region.depth).collect();
        if let Some(outside) = depth.get_mut(OUTSIDE as usize) {
            *outside = f32::INFINITY;
        }
        let pocket = regions.iter().map(|region| region.pocket).collect();
        Self { forest: Forest::of_singles(regions.len()), depth, pocket }
    }

    fn is_pocket(&mut self, region: u32) -> bool {
        self.pocket[self.forest.root(region) as usize] > 0.0
    }

    /// Makes pockets less deep than that nothing special.
    fn fill_shallow_pockets(&mut self, least: f32) {
        self.pocket.iter_mut().filter(|pocket| **pocket < least).for_each(|pocket| *pocket = 0.0);
    }

    /// Makes two spaces one, unless both are at least so deep.
    fn meet(&mut self, a: u32, b: u32, deep: f32) {
        let (a, b) = (self.forest.root(a), self.forest.root(b));
        let depths = [self.depth[a as usize], self.depth[b as usize]];
        if depths[0].min(depths[1]) < deep && self.forest.join(a, b) {
            let kept = self.forest.root(a) as usize;
            self.depth[kept] = depths[0].max(depths[1]);
            self.pocket[kept] = self.pocket[a as usize].max(self.pocket[b as usize]);
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Side {
    Unknown,
    Inside,
    Outside,
}

/// The spaces beside each space, with the faces between them: in rows, since a cloud of noise has millions.
struct Beside {
    /// Where the row of each root begins.
    start: Vec<usize>,
    rows: Vec<(u32, u32)>,
}

impl Beside {
    fn new(roots: &[u32], contacts: &[(Contact, u64)]) -> Self {
        let pairs = || {
            let of_roots =
                contacts.iter().map(|(contact, _)| (contact.regions.map(|n| roots[n as usize]), contact.faces));
            of_roots.filter(|([a, b], _)| a != b)
        };
        // The row of a root ends where that of the next begins; counted one place further on, it begins there.
        let mut start = vec![0; roots.len() + 2];
        for ([a, b], _) in pairs() {
            start[a as usize + 2] += 1;
            start[b as usize + 2] += 1;
        }
        (2..start.len()).for_each(|n| start[n] += start[n - 1]);
        let mut rows = vec![(0, 0); start.last().copied().unwrap_or(0)];
        for ([a, b], faces) in pairs() {
            for (from, to) in [(a, b), (b, a)] {
                let place = &mut start[from as usize + 1];
                rows[*place] = (to, faces);
                *place += 1;
            }
        }
        Self { start, rows }
    }

    fn of(&self, root: u32) -> &[(u32, u32)] {
        &self.rows[self.start[root as usize]..self.start[root as usize + 1]]
    }
}

/// The side of each space, by its root: one after the other, the one whose border says most clearly.
fn sides_of(roots: &[u32], contacts: &[(Contact, u64)]) -> Vec<Side> {
    let beside = Beside::new(roots, contacts);
    let mut sides = vec![Side::Unknown; roots.len()];
    // Faces beside the outside less those beside the inside, of the spaces that are next.
    let mut votes: std::collections::BTreeMap<u32, i64> = std::collections::BTreeMap::new();
    let mut next = Some((OUTSIDE, Side::Outside));
    while let Some((space, side)) = next {
        sides[space as usize] = side;
        votes.remove(&space);
        let sign = if side == Side::Outside { 1 } else { -1 };
        for &(other, faces) in beside.of(space).iter().filter(|(other, _)| sides[*other as usize] == Side::Unknown) {
            *votes.entry(other).or_default() += sign * i64::from(faces);
        }
        let clearest = votes.iter().max_by_key(|(name, vote)| (vote.abs(), std::cmp::Reverse(**name)));
        next = clearest.map(|(&name, &vote)| (name, if vote > 0 { Side::Inside } else { Side::Outside }));
    }
    sides
}

fn spaces_of(regions: &[Region], roots: &[u32], inside: &[bool], contacts: &[(Contact, u64)]) -> Vec<Space> {
    let mut spaces: std::collections::BTreeMap<u32, (Region, Option<usize>)> = std::collections::BTreeMap::new();
    for (n, region) in regions.iter().enumerate().filter(|(n, _)| inside[*n]) {
        let (whole, _) = spaces.entry(roots[n]).or_default();
        whole.voxels += region.voxels;
        whole.depth = whole.depth.max(region.depth);
    }
    for (n, (contact, _)) in contacts.iter().enumerate() {
        let [a, b] = contact.regions.map(|region| region as usize);
        if inside[a] != inside[b] {
            let root = roots[if inside[a] { a } else { b }];
            let (_, hole) = spaces.entry(root).or_default();
            if hole.is_none_or(|known| contact.pass > contacts[known].0.pass) {
                *hole = Some(n);
            }
        }
    }
    let space = |(whole, hole): &(Region, Option<usize>)| {
        Some(Space { depth: whole.depth, voxels: whole.voxels, hole: (*hole)? })
    };
    let mut spaces: Vec<Space> = spaces.values().filter_map(space).collect();
    spaces.sort_by(|a, b| b.depth.total_cmp(&a.depth).then(b.voxels.cmp(&a.voxels)).then(a.hole.cmp(&b.hole)));
    spaces
}

#[cfg(test)]
mod tests {
    use super::*;

    fn region(depth: f32) -> Region {
        Region { depth, voxels: 10, pocket: 0.0 }
    }

    fn contact(regions: [u32; 2], pass: f32, faces: u32) -> (Contact, u64) {
        (Contact { regions, pass, place: 0, faces }, 0)
    }

    #[test]
    fn a_body_of_two_lobes_and_the_noise_around_it() {
        // The outside; two lobes with a neck of 4; a dent of the outside; a lobe behind a narrow neck, with walls.
        let regions = [region(9.0), region(8.0), region(6.0), region(1.2), region(5.0)];
        let contacts = [
            contact([0, 1], 0.7, 100),
            contact([0, 2], 0.8, 60),
            contact([0, 3], 1.1, 20),
            contact([0, 4], 0.6, 40),
            contact([1, 2], 4.0, 30),
            contact([1, 3], 0.5, 15),
            contact([1, 4], 2.0, 8),
        ];
        let (sides, spaces) = inside(&regions, &contacts, 1.0, 1.0, 2.0);
        assert_eq!(sides, [false, true, true, false, true]);
        assert_eq!(spaces, [Space { depth: 8.0, voxels: 20, hole: 1 }, Space { depth: 5.0, voxels: 10, hole: 3 }]);
    }

    #[test]
    fn a_hollow_is_outside_and_a_body_within_it_inside_again() {
        let regions = [region(9.0), region(3.0), region(4.0), region(2.0)];
        let contacts = [contact([0, 1], 0.7, 300), contact([1, 2], 0.8, 200), contact([2, 3], 0.6, 50)];
        let (sides, spaces) = inside(&regions, &contacts, 1.0, 1.0, 2.0);
        assert_eq!(sides, [false, true, false, true]);
        assert_eq!(spaces.iter().map(|s| (s.depth, s.hole)).collect::<Vec<_>>(), [(3.0, 1), (2.0, 2)]);
    }

    #[test]
    fn what_is_open_or_shallow_is_outside() {
        let regions = [region(9.0), region(5.0), region(0.9)];
        let contacts = [contact([0, 1], 2.6, 300), contact([0, 2], 0.1, 20)];
        assert_eq!(inside(&regions, &contacts, 1.0, 1.0, 2.0), (vec![false; 3], Vec::new()));
    }

    /// An open body: its depth, its bell in two parts of one pocket, and a dent of its side.
    #[test]
    fn a_bell_is_inside_and_a_dent_is_not() {
        let pocket = |pocket: f32| Region { pocket, ..region(6.0) };
        let regions = [region(20.0), region(9.0), pocket(4.0), pocket(0.5), pocket(3.0), pocket(0.9)];
        let contacts = [
            contact([0, 1], 0.7, 500),
            contact([0, 2], 6.0, 300),
            contact([0, 3], 5.0, 90),
            contact([0, 4], 4.0, 40),
            contact([0, 5], 4.0, 40),
            contact([1, 2], 4.2, 30),
            contact([1, 4], 0.8, 70),
            contact([1, 5], 0.7, 20),
            contact([2, 3], 5.5, 80),
        ];
        let (sides, spaces) = inside(&regions, &contacts, 1.0, 1.0, 2.0);
        assert_eq!(sides, [false, true, true, true, false, false]);
        assert_eq!(spaces, [Space { depth: 9.0, voxels: 30, hole: 1 }]);
    }

    #[test]
    fn contacts_of_two_bricks_are_one() {
        let (a, b) = (contact([1, 2], 0.5, 3), contact([1, 2], 0.75, 4));
        let joined = joined(vec![(a.0, 9), (contact([0, 9], 0.1, 1).0, 5), (b.0, 4)]);
        assert_eq!(
            joined,
            [contact([0, 9], 0.1, 1), contact([1, 2], 0.75, 7)]
                .map(|(c, _)| c)
                .into_iter()
                .zip([5, 4])
                .collect::<Vec<_>>()
        );
    }
}
