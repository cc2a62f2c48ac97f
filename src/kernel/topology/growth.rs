//! One side of a surface grown from its depths, without loops that are not there far from the surface: where two fronts of one piece meet a
//! voxel is left out, and what is left out in the end are *seams*, discs that close the loops.
//!
//! Voxels come by how much of their side is around them (`sides`), those with most first. One is added where the pieces of the grown set that touch it
//! (`neighbourhood`) are different pieces of the whole grown set: then no loop closes through it. The others wait, and are looked at again when
//! something beside them was added (Aktouf, Bertrand and Perroton 2002, "A three-dimensional holes closing algorithm", grown on the other
//! side, with pieces joined as by Kruskal). Order: level, then place; so the seams depend on nothing else.

use std::collections::BTreeMap;
use std::ops::Range;

use super::blocks::{Beside, Blocks, EDGE, FAR, INSIDE, LEN, PARTS, STRIDES, Where, is_deep};
use super::levels::Levels;
use super::neighbourhood::{Joined, MIDDLE};
use super::union_find::Forest;

/// A voxel that is not in the grown set.
const OUT: u32 = 0;
/// A voxel that waits.
const WAITS: u32 = u32::MAX;

/// In which order a side is grown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// By distance from the other side.
    Distance,
    /// Of those as far, the ones with more of their side around them first.
    Level,
}

/// One side, grown.
pub struct Grown {
    /// For each voxel the name of its piece and one; see [`OUT`], [`WAITS`].
    names: Vec<u32>,
    /// The pieces' names.
    pieces: Forest,
    /// For each name how many voxels were given it; those of rooms have as many as there can be.
    voxels: Vec<u64>,
}

impl Grown {
    /// Grows the inside, or the outside; `check` is asked now and then whether to go on.
    ///
    /// # Errors
    /// Those of `check`.
    pub fn new<E>(
        blocks: &Blocks,
        inside: bool,
        order: Order,
        mut check: impl FnMut() -> Result<(), E>,
    ) -> Result<Self, E> {
        let rooms = blocks.rooms.len();
        let mut grown = Self {
            names: vec![OUT; blocks.states.len()],
            pieces: Forest::of_singles(rooms),
            voxels: vec![u64::MAX / 2; rooms],
        };
        grown.name_far(blocks, inside);
        let levels = Levels::new(blocks, inside, |state| match order {
            Order::Distance => ((state & FAR) - 1) / PARTS,
            Order::Level => state & FAR,
        });
        let joined = if inside { Joined::Faces } else { Joined::Edges };
        let mut again = Vec::new();
        for level in (0..FAR).rev() {
            check()?;
            for place in levels.places(level) {
                again.push(place);
                while let Some(place) = again.pop() {
                    if matches!(grown.names[place], OUT | WAITS) {
                        grown.add(blocks, joined, inside, place, &mut again);
                    }
                }
            }
        }
        Ok(grown)
    }

    /// Voxels that were left out, in order.
    pub fn left_out(&self) -> impl Iterator<Item = usize> + '_ {
        self.names.iter().enumerate().filter(|(_, name)| **name == WAITS).map(|(place, _)| place)
    }

    /// Whether a voxel is in the grown set.
    #[must_use]
    pub fn holds(&self, place: usize) -> bool {
        !matches!(self.names[place], OUT | WAITS)
    }

    /// The pieces of at most so many voxels, each by its places in order, if there are larger ones; what fills a room is no such piece.
    pub fn small_pieces(&mut self, most: u64) -> Vec<Vec<usize>> {
        let mut sizes = vec![0_u64; self.voxels.len()];
        for name in 0..self.voxels.len() as u32 {
            let root = self.pieces.root(name) as usize;
            sizes[root] = sizes[root].saturating_add(self.voxels[name as usize]);
        }
        let mut small: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        let is_small = |size: &u64| (1..=most).contains(size);
        if !sizes.iter().any(is_small) || !sizes.iter().any(|&size| size > most) {
            return Vec::new();
        }
        for place in 0..self.names.len() {
            if self.holds(place) {
                let root = self.pieces.root(self.names[place] - 1);
                if sizes[root as usize] <= most {
                    small.entry(root).or_default().push(place);
                }
            }
        }
        small.into_values().collect()
    }

    fn new_name(&mut self) -> u32 {
        self.voxels.push(0);
        self.pieces.push()
    }

    /// Voxels far from the other side have the pieces that they have: run by run of each row.
    fn name_far(&mut self, blocks: &Blocks, inside: bool) {
        let far = FAR | if inside { INSIDE } else { 0 };
        for (row, states) in blocks.states.chunks_exact(EDGE).enumerate() {
            let mut left = (0..EDGE).fold(0_u32, |mask, x| mask | u32::from(states[x] == far) << x);
            while left != 0 {
                let from = left.trailing_zeros() as usize;
                let len = (!(left >> from)).trailing_zeros() as usize;
                left &= !(((1 << len) - 1) << from);
                let name = self.name_of_run(blocks, inside, (row * EDGE, from..from + len));
                self.names[row * EDGE + from..][..len].fill(name + 1);
                self.voxels[name as usize] += len as u64;
            }
        }
    }

    /// The name of the pieces beside a run of voxels that is named next, which are one by it, or a new one.
    fn name_of_run(&mut self, blocks: &Blocks, inside: bool, (row, run): (usize, Range<usize>)) -> u32 {
        const BESIDE: [usize; 4] = [MIDDLE - 9, MIDDLE - 3, MIDDLE + 3, MIDDLE + 9];
        let mut known = None;
        let mut join = |pieces: &mut Forest, other: u32| pieces.join(*known.get_or_insert(other), other);
        for bit in BESIDE {
            match blocks.neighbour(row, bit) {
                Where::Voxel(beside) => {
                    let mut last = OUT;
                    for &name in &self.names[beside + run.start..beside + run.end] {
                        if name != last && name != OUT {
                            join(&mut self.pieces, name - 1);
                        }
                        last = name;
                    }
                }
                Where::Room(room) if blocks.rooms[room as usize] == inside => _ = join(&mut self.pieces, room),
                Where::Room(_) => {}
            }
        }
        let ends = [(run.start == 0, row, MIDDLE - 1), (run.end == EDGE, row + EDGE - 1, MIDDLE + 1)];
        for (_, place, bit) in ends.into_iter().filter(|(is_end, ..)| *is_end) {
            match blocks.neighbour(place, bit) {
                Where::Voxel(other) if self.names[other] != OUT => _ = join(&mut self.pieces, self.names[other] - 1),
                Where::Room(room) if blocks.rooms[room as usize] == inside => _ = join(&mut self.pieces, room),
                _ => {}
            }
        }
        known.unwrap_or_else(|| self.new_name())
    }

    /// The names of the voxels around one.
    fn names_around(&self, blocks: &Blocks, inside: bool, place: usize) -> [u32; 27] {
        let mut names = if is_deep(place) {
            STRIDES.map(|by| self.names[place.wrapping_add_signed(by)])
        } else {
            self.names_across(blocks, inside, place)
        };
        names[MIDDLE] = OUT;
        names
    }

    /// The same at the border of a block.
    fn names_across(&self, blocks: &Blocks, inside: bool, place: usize) -> [u32; 27] {
        let at = [place % EDGE, place / EDGE % EDGE, place / (EDGE * EDGE) % EDGE];
        // For each step along an axis the block beside and the voxel's place in it.
        let steps = at.map(|at| [EDGE - 1, EDGE, EDGE + 1].map(|step| ((at + step) / EDGE, (at + step) % EDGE)));
        let around = &blocks.around[place / LEN];
        std::array::from_fn(|bit| {
            let [x, y, z] = [steps[0][bit % 3], steps[1][bit / 3 % 3], steps[2][bit / 9]];
            match around[(z.0 * 3 + y.0) * 3 + x.0] {
                Beside::Block(block) => self.names[block as usize * LEN + (z.1 * EDGE + y.1) * EDGE + x.1],
                Beside::Room(room) if blocks.rooms[room as usize] == inside => room + 1,
                Beside::Room(_) => OUT,
            }
        })
    }

    /// Adds a voxel if no loop closes through it; those that wait beside it are to be looked at again.
    fn add(&mut self, blocks: &Blocks, joined: Joined, inside: bool, place: usize, again: &mut Vec<usize>) {
        let names = self.names_around(blocks, inside, place);
        let (mut set, mut waiting) = (0_u32, 0_u32);
        for (bit, &name) in names.iter().enumerate() {
            set |= u32::from(!matches!(name, OUT | WAITS)) << bit;
            waiting |= u32::from(name == WAITS) << bit;
        }
        let mut pieces = [0; 8];
        let count = joined.pieces(set, &mut pieces);
        let mut roots = [0; 8];
        for (n, piece) in pieces[..count].iter().enumerate() {
            roots[n] = self.pieces.root(names[piece.trailing_zeros() as usize] - 1);
            if roots[..n].contains(&roots[n]) {
                self.names[place] = WAITS;
                return;
            }
        }
        let name = if count == 0 { self.new_name() } else { roots[0] };
        roots[..count].iter().for_each(|&root| {
            self.pieces.join(name, root);
        });
        self.names[place] = name + 1;
        self.voxels[name as usize] += 1;
        while waiting != 0 {
            if let Where::Voxel(other) = blocks.neighbour(place, waiting.trailing_zeros() as usize) {
                again.push(other);
            }
            waiting &= waiting - 1;
        }
    }
}
