//! `Patches`: triangles that are joined across edges which just two of them have, and which way round each lies.
//!
//! Where bodies share a wall or a rim, more than two triangles have an edge, and nothing says which of them belong together:
//! patches that end there are taken for one once each has its sides.

use crate::kernel::topology::union_find::Forest;

/// No patch, of a triangle without three corners; or no triangle.
const NONE: u32 = u32::MAX;

/// The patches of a mesh.
pub(crate) struct Patches {
    /// For each triangle its patch.
    of: Vec<u32>,
    /// For each patch its triangles.
    pub(crate) members: Vec<Vec<u32>>,
    /// For each patch whether each of its edges has as many of its triangles in one direction as in the other.
    pub(crate) closed: Vec<bool>,
    /// Patches whose triangles cannot agree on what is outside.
    one_sided: u64,
    /// For each triangle whether it has to be turned for that.
    turned: Vec<bool>,
}

/// A side of a triangle: the names of its ends, ascending; whether the triangle runs upwards; the triangle.
type Side = (u32, u32, bool, u32);

impl Patches {
    /// The patches of these triangles, whose vertices have these names.
    pub(crate) fn new(triangles: &[[u32; 3]], names: &[u32]) -> Self {
        let sides = sides(triangles, names);
        // For each side of each triangle the triangle beyond it, and whether that runs the same way through it.
        // Triangle numbers have 31 bits, and one is left to tell that.
        let mut beyond = vec![[NONE; 3]; triangles.len()];
        for edge in sides.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            if let [a, b] = edge {
                for (one, other) in [(a, b), (b, a)] {
                    let free = beyond[one.3 as usize].iter_mut().find(|slot| **slot == NONE);
                    if let Some(slot) = free {
                        *slot = other.3 << 1 | u32::from(one.2 == other.2);
                    }
                }
            }
        }
        let mut patches = Self {
            of: vec![NONE; triangles.len()],
            members: Vec::new(),
            closed: Vec::new(),
            one_sided: 0,
            turned: vec![false; triangles.len()],
        };
        for triangle in 0..triangles.len() as u32 {
            let [a, b, c] = triangles[triangle as usize].map(|v| names[v as usize]);
            if patches.of[triangle as usize] == NONE && a != b && b != c && a != c {
                patches.add(triangle, &beyond);
            }
        }
        patches.find_closed(&sides);
        patches.join_open(&sides);
        patches.find_closed(&sides);
        patches
    }

    /// Adds the patch of a triangle.
    fn add(&mut self, first: u32, beyond: &[[u32; 3]]) {
        let patch = self.members.len() as u32;
        let (mut members, mut two_sided) = (vec![first], true);
        self.of[first as usize] = patch;
        let mut at = 0;
        while let Some(&triangle) = members.get(at) {
            at += 1;
            for side in beyond[triangle as usize].into_iter().filter(|side| *side != NONE) {
                let (other, same_way) = (side >> 1, side & 1 == 1);
                let turned = self.turned[triangle as usize] ^ same_way;
                if self.of[other as usize] == NONE {
                    self.of[other as usize] = patch;
                    self.turned[other as usize] = turned;
                    members.push(other);
                } else {
                    two_sided &= self.turned[other as usize] == turned;
                }
            }
        }
        // The smaller part gives way, or none where they cannot agree.
        let turned = members.iter().filter(|&&n| self.turned[n as usize]).count();
        for &n in &members {
            let turn = &mut self.turned[n as usize];
            *turn = two_sided && (*turn ^ (2 * turned > members.len()));
        }
        self.members.push(members);
        self.one_sided += u64::from(!two_sided);
    }

    fn find_closed(&mut self, sides: &[Side]) {
        self.closed = vec![true; self.members.len()];
        let mut here = Vec::new();
        for edge in sides.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            here.clear();
            here.extend(edge.iter().map(|side| (self.of[side.3 as usize], side.2 ^ self.turned[side.3 as usize])));
            here.sort_unstable();
            for same in here.chunk_by(|a, b| a.0 == b.0) {
                if 2 * same.iter().filter(|side| side.1).count() != same.len() {
                    self.closed[same[0].0 as usize] = false;
                }
            }
        }
    }

    /// Makes open patches one that meet at edges.
    fn join_open(&mut self, sides: &[Side]) {
        let mut forest = Forest::of_singles(self.members.len());
        for edge in sides.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            let mut open = edge.iter().map(|side| self.of[side.3 as usize]).filter(|&n| !self.closed[n as usize]);
            let Some(first) = open.next() else { continue };
            open.for_each(|other| {
                forest.join(first, other);
            });
        }
        for n in 0..self.members.len() {
            let root = forest.root(n as u32);
            if root as usize != n {
                let moved = std::mem::take(&mut self.members[n]);
                for &triangle in &moved {
                    self.of[triangle as usize] = root;
                }
                self.members[root as usize].extend(moved);
            }
        }
    }

    /// Turns triangles so that those of a patch agree; the number of them, and of patches that cannot.
    pub(crate) fn agree(&self, triangles: &mut [[u32; 3]]) -> (u64, u64) {
        let mut count = 0;
        for (triangle, _) in triangles.iter_mut().zip(&self.turned).filter(|(_, turned)| **turned) {
            triangle.swap(1, 2);
            count += 1;
        }
        (count, self.one_sided)
    }
}

/// The sides of all triangles, those of one edge together.
fn sides(triangles: &[[u32; 3]], names: &[u32]) -> Vec<Side> {
    let mut sides = Vec::with_capacity(3 * triangles.len());
    for (n, triangle) in triangles.iter().enumerate() {
        let [a, b, c] = triangle.map(|v| names[v as usize]);
        // What a triangle without three corners runs there and back along has no side outside.
        if a != b && b != c && a != c {
            sides.extend([(a, b), (b, c), (c, a)].map(|(a, b)| (a.min(b), a.max(b), a < b, n as u32)));
        }
    }
    sides.sort_unstable();
    sides
}
