//! `Exchange`: what neighbouring ranks tell each other between waves: the faces of bricks that the other's halos read,
//! and a note about each such brick. It knows who reads what; [`Comm`] carries it.
//!
//! ```text
//! brick u64 | f64 for each number of the note | faces u8, a bit for each | edge^2 values for each of these |  brick ...
//! ```
//!
//! Little-endian, no padding.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::comm::messages::{Comm, Message, damaged};
use super::halo::{HaloPlan, Reach};
use super::ownership::Ownership;
use super::schedule::one_wave;
use crate::error::Result;
use crate::grid::{BrickId, BrickSet, FACES, Slot};
use crate::store::{BrickArray, Element};

/// What is said of a brick beside its faces: some numbers, `[f64; N]`.
pub trait Note: AsRef<[f64]> + AsMut<[f64]> + Default + Send {}

impl<N: AsRef<[f64]> + AsMut<[f64]> + Default + Send> Note for N {}

/// A rank's side of the exchange over one set of bricks.
pub struct Exchange<'a> {
    comm: &'a dyn Comm,
    set: Arc<BrickSet>,
    /// The ranks that own ghosts of this one: those that this one owns ghosts of.
    peers: Vec<usize>,
    /// Owned bricks that others read: by which peer (its place in `peers`), and which faces.
    readers: BTreeMap<Slot, BTreeMap<usize, u8>>,
}

impl<'a> Exchange<'a> {
    /// The exchange that halos filled by `plan` need. All ranks of `comm` make it at the same time.
    ///
    /// # Errors
    /// When another rank is gone.
    pub fn new(comm: &'a dyn Comm, set: &Arc<BrickSet>, plan: &HaloPlan) -> Result<Self> {
        let ownership = Ownership::agreed(comm, set)?;
        let owner = |slot: Slot| ownership.owner(set.id(slot));
        let mut peers: Vec<usize> = set.ghosts().map(owner).collect();
        peers.sort_unstable();
        peers.dedup();
        let peer = |ghost: Slot| peers.partition_point(|&rank| rank < owner(ghost));
        let mut readers = BTreeMap::<Slot, BTreeMap<usize, u8>>::new();
        for ghost in set.ghosts() {
            for (offset, face) in plan.reads() {
                if let Some(slot) = set.neighbour(ghost, offset).filter(|slot| set.owned().contains(slot)) {
                    *readers.entry(slot).or_default().entry(peer(ghost)).or_default() |= 1 << face.index();
                }
            }
        }
        Ok(Self { comm, set: set.clone(), peers, readers })
    }

    /// Whether another rank reads a brick of this one.
    #[must_use]
    pub fn is_read(&self, slot: Slot) -> bool {
        self.readers.contains_key(&slot)
    }

    /// Tells the others the faces of this rank's `bricks`, and writes what they tell into the faces of ghosts. Returns
    /// those ghosts. Bricks that nobody else reads, or that nothing was written to yet, are passed over.
    ///
    /// # Errors
    /// When another rank is gone.
    pub fn faces<T: Element>(&self, array: &BrickArray<T>, bricks: &[Slot]) -> Result<Vec<Slot>> {
        let written = bricks.iter().copied().filter(|&slot| array.unwritten(slot).is_none());
        self.post(array, &written.map(|slot| (slot, [0.0; 0])).collect::<Vec<_>>())?;
        Ok(self.collect::<T, [f64; 0]>(array)?.into_iter().map(|(slot, _)| slot).collect())
    }

    /// Sends the faces of this rank's bricks and a note about each to the ranks that read them, without waiting. All
    /// ranks post, and [`Exchange::collect`] before they post again.
    ///
    /// # Errors
    /// When another rank is gone.
    pub fn post<T: Element, N: Note>(&self, array: &BrickArray<T>, bricks: &[(Slot, N)]) -> Result<()> {
        let mut messages = vec![Vec::new(); self.peers.len()];
        for (slot, note) in bricks {
            let written = array.unwritten(*slot).is_none();
            for (&peer, &faces) in self.readers.get(slot).into_iter().flatten() {
                let (message, faces) = (&mut messages[peer], if written { faces } else { 0 });
                message.extend_from_slice(&self.set.id(*slot).to_le_bytes());
                note.as_ref().iter().for_each(|number| message.extend_from_slice(&number.to_le_bytes()));
                message.push(faces);
                for face in FACES.into_iter().filter(|face| faces >> face.index() & 1 == 1) {
                    array.read_face(*slot, face, |values| T::append_bytes(values, message));
                }
            }
        }
        self.comm.post(&self.peers, messages)
    }

    /// Waits for what the other ranks posted: writes the faces of ghosts, and returns these with the notes about them.
    ///
    /// # Errors
    /// When another rank is gone.
    pub fn collect<T: Element, N: Note>(&self, array: &BrickArray<T>) -> Result<Vec<(Slot, N)>> {
        let mut received = Vec::new();
        for message in self.comm.collect(&self.peers)? {
            let mut message = Message(&message);
            while !message.is_empty() {
                let ghost = self.slot(BrickId::from_le_bytes(message.word()?))?;
                let mut note = N::default();
                for number in note.as_mut() {
                    *number = f64::from_le_bytes(message.word()?);
                }
                self.take_faces(array, ghost, &mut message)?;
                received.push((ghost, note));
            }
        }
        Ok(received)
    }

    /// Writes the faces of one ghost brick.
    fn take_faces<T: Element>(&self, array: &BrickArray<T>, ghost: Slot, message: &mut Message<'_>) -> Result<()> {
        let [faces] = message.word()?;
        let area = (self.set.grid().edge() * self.set.grid().edge()) as usize;
        let told = message.take(faces.count_ones() as usize * area * size_of::<T>())?;
        if faces != 0 {
            array.write_faces(ghost, |values| {
                let sent = FACES.into_iter().filter(|face| faces >> face.index() & 1 == 1);
                for (face, bytes) in sent.zip(told.chunks_exact(area * size_of::<T>())) {
                    T::fill_from_bytes(&mut values[face.index() * area..][..area], bytes);
                }
            });
        }
        Ok(())
    }

    fn slot(&self, id: BrickId) -> Result<Slot> {
        let known = Some(id).filter(|&id| id < self.set.grid().len()).and_then(|id| self.set.slot(id));
        known.ok_or_else(damaged)
    }
}

/// Writes the faces of all ghosts of a field that is solved: what their owners have. All ranks do it at the same time.
///
/// # Errors
/// When another rank is gone.
pub fn tell_faces<T: Element>(comm: &dyn Comm, array: &BrickArray<T>) -> Result<()> {
    if comm.ranks() == 1 {
        return Ok(());
    }
    let plan = HaloPlan::new(*array.set().grid(), Reach::All);
    Exchange::new(comm, array.set(), &plan)?.faces(array, &one_wave(array.set()))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exec::{Boundary, ThreadComm};
    use crate::grid::{Box3, BrickGrid};
    use crate::store::Scratch;
    use crate::tile::HaloTile;

    /// Runs `check` on each of so many ranks, with its own set of the bricks that `keep` keeps.
    fn on_ranks(
        grid: BrickGrid,
        keep: fn(BrickId) -> bool,
        ranks: usize,
        plan: &HaloPlan,
        check: impl Fn(&ThreadComm, Arc<BrickSet>) + Sync,
    ) {
        let whole = BrickSet::from_fn(grid, keep);
        let ownership = Ownership::balanced(&whole, ranks);
        std::thread::scope(|scope| {
            for comm in ThreadComm::connected(ranks) {
                let (whole, ownership, check) = (&whole, &ownership, &check);
                scope.spawn(move || check(&comm, Arc::new(ownership.part(whole, comm.rank(), plan))));
            }
        });
    }

    /// The value of every voxel of a field; of those beyond the domain that of the nearest inside.
    fn value(shape: [i64; 3], voxel: [i64; 3]) -> f32 {
        let [x, y, z]: [i64; 3] = std::array::from_fn(|a| voxel[a].clamp(0, shape[a] - 1));
        (x + 40 * (y + 40 * z)) as f32
    }

    /// What `tile` holds for each voxel of the brick and the ghosts that the plan fills is what the whole volume has
    /// there.
    fn assert_halo(tile: &HaloTile<f32>, valid: &Box3, shape: [i64; 3], reach: Reach) {
        for (y, z) in valid.grow(1).rows() {
            for x in valid.lo[0] - 1..=valid.hi[0] {
                let voxel = [x, y, z];
                let outside = (0..3).filter(|&a| voxel[a] < valid.lo[a] || voxel[a] >= valid.hi[a]).count();
                if outside > 1 && reach == Reach::Faces {
                    continue;
                }
                let [i, j, k]: [isize; 3] = std::array::from_fn(|a| (voxel[a] - valid.lo[a]) as isize);
                assert_eq!(tile.data()[tile.at(i, j, k)], value(shape, voxel), "{voxel:?}");
            }
        }
    }

    #[test]
    fn halos_hold_what_other_ranks_have() {
        let dir = tempfile::tempdir().unwrap();
        for shape in [[19, 9, 8], [13, 1, 30], [4, 4, 4]] {
            for (reach, ranks) in [(Reach::Faces, 2), (Reach::Faces, 5), (Reach::All, 3), (Reach::All, 7)] {
                let grid = BrickGrid::new(shape, 4);
                let plan = HaloPlan::new(grid, reach);
                on_ranks(
                    grid,
                    |_| true,
                    ranks,
                    &plan,
                    |comm, set| {
                        let array = BrickArray::<f32>::with_faces(&Scratch::new(dir.path(), 1 << 30), &set).unwrap();
                        for slot in set.owned() {
                            let part = grid.brick_box(set.id(slot));
                            let voxels =
                                part.rows().flat_map(|(y, z)| (part.lo[0]..part.hi[0]).map(move |x| [x, y, z]));
                            array.write_box(&part, &voxels.map(|v| value(shape, v)).collect::<Vec<_>>());
                            array.refresh_faces(slot);
                        }
                        let exchange = Exchange::new(comm, &set, &plan).unwrap();
                        let mut told = exchange.faces(&array, &set.owned().collect::<Vec<_>>()).unwrap();
                        told.sort_unstable();
                        assert_eq!(told, set.ghosts().collect::<Vec<_>>(), "each ghost is told of once");
                        let mut tile = HaloTile::new(4);
                        for slot in set.owned() {
                            plan.gather(&array, slot, Boundary::Mirror, &mut tile);
                            assert_halo(&tile, &grid.brick_box(set.id(slot)), shape, reach);
                        }
                    },
                );
            }
        }
    }

    /// Unwritten bricks are not sent; what is told of a ghost makes it a written one, and no other.
    #[test]
    fn ghosts_stay_blank_until_they_are_told_of() {
        let dir = tempfile::tempdir().unwrap();
        let grid = BrickGrid::new([4, 4, 16], 4);
        let plan = HaloPlan::new(grid, Reach::Faces);
        on_ranks(
            grid,
            |_| true,
            4,
            &plan,
            |comm, set| {
                let array = BrickArray::blank(&Scratch::new(dir.path(), 1 << 30), &set, 7_u32).unwrap();
                let own = set.owned().start;
                let exchange = Exchange::new(comm, &set, &plan).unwrap();
                if comm.rank() == 2 {
                    array.write(own, |brick| brick.fill(3));
                    array.refresh_faces(own);
                }
                let told: Vec<BrickId> =
                    exchange.faces(&array, &[own]).unwrap().iter().map(|&ghost| set.id(ghost)).collect();
                assert_eq!(told, if matches!(comm.rank(), 1 | 3) { vec![2] } else { vec![] });
                let written = |id| set.slot(id).is_some_and(|slot| array.unwritten(slot).is_none());
                let known: Vec<BrickId> = (0..4).filter(|&id| written(id)).collect();
                assert_eq!(known, if comm.rank() == 0 { vec![] } else { vec![2] });
            },
        );
    }

    #[test]
    fn notes_about_bricks_reach_those_who_read_them_and_nobody_else() {
        let dir = tempfile::tempdir().unwrap();
        let grid = BrickGrid::new([3, 3, 4], 1);
        let plan = HaloPlan::new(grid, Reach::Faces);
        for ranks in [1, 2, 3, 6] {
            on_ranks(
                grid,
                |id| id % 5 != 4,
                ranks,
                &plan,
                |comm, set| {
                    let array = BrickArray::blank(&Scratch::new(dir.path(), 1 << 30), &set, 7_u32).unwrap();
                    let exchange = Exchange::new(comm, &set, &plan).unwrap();
                    let odd = |slot: &Slot| set.id(*slot) % 2 == 1;
                    let note = |slot: Slot| [set.id(slot) as f64, f64::INFINITY];
                    let told: Vec<_> = set.owned().filter(odd).map(|slot| (slot, note(slot))).collect();
                    exchange.post(&array, &told).unwrap();
                    let mut heard = exchange.collect::<u32, [f64; 2]>(&array).unwrap();
                    heard.sort_by_key(|(ghost, _)| *ghost);
                    assert_eq!(heard, set.ghosts().filter(odd).map(|ghost| (ghost, note(ghost))).collect::<Vec<_>>());
                    // Nothing was written, so no face was sent.
                    assert!(set.ghosts().all(|ghost| array.unwritten(ghost) == Some(7)));
                },
            );
        }
    }

    #[test]
    fn a_damaged_message_is_an_error() {
        struct Liar(Vec<u8>);
        impl Comm for Liar {
            fn rank(&self) -> usize {
                0
            }
            fn ranks(&self) -> usize {
                2
            }
            fn post(&self, _with: &[usize], _messages: Vec<Vec<u8>>) -> Result<()> {
                Ok(())
            }
            fn collect(&self, with: &[usize]) -> Result<Vec<Vec<u8>>> {
                Ok(vec![self.0.clone(); with.len()])
            }
        }
        let dir = tempfile::tempdir().unwrap();
        let grid = BrickGrid::new([2, 2, 8], 2);
        let plan = HaloPlan::new(grid, Reach::Faces);
        let set = Arc::new(BrickSet::dense(grid).part(&(0..2), &[[0, 0, 1]]));
        let array = BrickArray::<f64>::with_faces(&Scratch::new(dir.path(), 1 << 30), &set).unwrap();
        let face = [&2_u64.to_le_bytes()[..], &[1 << 4], &[0; 4 * 8]].concat();
        let far = [&3_u64.to_le_bytes()[..], &[1 << 4], &[0; 4 * 8]].concat();
        let beyond = u64::MAX.to_le_bytes().to_vec();
        for (message, good) in [(face.clone(), true), (face[..40].to_vec(), false), (far, false), (beyond, false)] {
            // What all tell is packed: its length, then it.
            let ownership = Liar([8_u64.to_le_bytes(), 4_u64.to_le_bytes()].concat());
            let mut exchange = Exchange::new(&ownership, &set, &plan).unwrap();
            let liar = Liar(message);
            exchange.comm = &liar;
            assert_eq!(exchange.faces(&array, &[]).is_ok(), good);
        }
    }
}
