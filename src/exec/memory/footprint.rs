//! What a stage states of its memory before it starts, and the account of what is held: the contract behind `--memory`.
//!
//! A kernel states the halo and the scratch of a tile ([`crate::tile::TileCost`]); a stage adds what it holds whatever the
//! tiles ([`Footprint`]). What is told before a run starts and what it reserves is made of the same footprints. What is held
//! is taken off the budget; the window of mapped pages gets the rest, and a run is refused where that is too little.

use std::sync::{Arc, Mutex, PoisonError};

use super::budget::Budget;
use crate::error::Result;
use crate::store::Scratch;

/// Bytes in memory at one time, bricks left out: these lie in the window.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Footprint {
    /// Whatever the number of threads: tables, lists, trees.
    pub held: u64,
    /// Of each thread: its tiles and a kernel's scratch.
    pub per_thread: u64,
    /// So many of these bytes are there for boxes that may still grow: what these turn out to take is told with
    /// [`Engine::hold`](crate::exec::Engine::hold).
    pub growing: u64,
}

impl Footprint {
    /// Of what is held whatever the threads.
    #[must_use]
    pub const fn of_all(held: u64) -> Self {
        Self { held, per_thread: 0, growing: 0 }
    }

    /// Of the buffers of each thread.
    #[must_use]
    pub const fn of_thread(per_thread: u64) -> Self {
        Self { held: 0, per_thread, growing: 0 }
    }

    /// Of boxes that may grow.
    #[must_use]
    pub const fn of_boxes(held: u64) -> Self {
        Self { held, per_thread: 0, growing: held }
    }

    /// This and another at the same time.
    #[must_use]
    pub const fn and(self, other: Self) -> Self {
        Self {
            held: self.held.saturating_add(other.held),
            per_thread: self.per_thread.saturating_add(other.per_thread),
            growing: self.growing.saturating_add(other.growing),
        }
    }

    /// This and another one after the other, on so many threads: the larger of both. Boxes of the smaller may also have what
    /// the larger takes more.
    #[must_use]
    pub fn or(self, other: Self, threads: u64) -> Self {
        let larger = if other.bytes(threads) > self.bytes(threads) { other } else { self };
        let has_boxes = [self, other].into_iter().filter(|footprint| footprint.growing > 0);
        let rooms = has_boxes.map(|footprint| footprint.growing + (larger.bytes(threads) - footprint.bytes(threads)));
        Self { growing: rooms.min().unwrap_or(0), ..larger }
    }

    /// All bytes on so many threads.
    #[must_use]
    pub fn bytes(self, threads: u64) -> u64 {
        self.held.saturating_add(self.per_thread.saturating_mul(threads))
    }
}

/// Who holds how much of a budget. Engines beside each other share one.
pub(in crate::exec) struct Account {
    budget: Budget,
    scratch: Scratch,
    /// The window is never more than it was made with.
    widest: u64,
    held: Mutex<Held>,
}

/// Bytes that are held.
#[derive(Clone, Copy, Default)]
struct Held {
    /// By jobs, for as long as they run.
    reserved: u64,
    /// The part of it that is meant for boxes.
    growing: u64,
    /// By boxes.
    boxes: u64,
    /// The part of all that nobody takes yet, which mapped pages have meanwhile.
    lent: u64,
}

impl Held {
    fn bytes(self) -> u64 {
        self.reserved.saturating_add(self.boxes.saturating_sub(self.growing))
    }
}

impl Account {
    pub(in crate::exec) fn new(budget: Budget, scratch: Scratch) -> Arc<Self> {
        let widest = scratch.window();
        Arc::new(Self { budget, scratch, widest, held: Mutex::default() })
    }

    /// Takes a job's footprint off the window for as long as the guard lives.
    pub(in crate::exec) fn reserve(self: &Arc<Self>, footprint: Footprint, threads: u64) -> Result<Hold> {
        let more = Held { reserved: footprint.bytes(threads), growing: footprint.growing, ..Held::default() };
        self.add(more, |held| self.budget.window(held))
    }

    /// Takes what a box holds off what is reserved for boxes, and what goes beyond that off the window.
    pub(in crate::exec) fn hold(self: &Arc<Self>, bytes: u64) -> Result<Hold> {
        self.add(Held { boxes: bytes, ..Held::default() }, |held| self.budget.window_under_way(held))
    }

    fn add(self: &Arc<Self>, more: Held, window: impl Fn(u64) -> Result<u64>) -> Result<Hold> {
        let mut held = self.held.lock().unwrap_or_else(PoisonError::into_inner);
        let sum = Held {
            reserved: held.reserved.saturating_add(more.reserved),
            growing: held.growing.saturating_add(more.growing),
            boxes: held.boxes.saturating_add(more.boxes),
            lent: held.lent,
        };
        let window = window(sum.bytes())?;
        *held = sum;
        self.share(sum, window);
        Ok(Hold { account: self.clone(), held: more })
    }

    /// What is lent may be resident, but not for good: what is put into plain memory has to stay within the window.
    fn share(&self, held: Held, window: u64) {
        self.scratch.set_window(window.min(self.widest), held.lent.min(self.widest.saturating_sub(window)));
    }

    /// What is held now, changed; the window follows.
    fn change(&self, change: impl FnOnce(&mut Held)) {
        let mut held = self.held.lock().unwrap_or_else(PoisonError::into_inner);
        change(&mut held);
        // No change asks for more than fitted before.
        if let Ok(window) = self.budget.window_under_way(held.bytes()) {
            self.share(*held, window);
        }
    }
}

/// Bytes of the budget that somebody holds, until this goes.
#[must_use]
pub struct Hold {
    account: Arc<Account>,
    held: Held,
}

impl Hold {
    /// Lends so many of the held bytes to mapped pages, for a stage that does not take them yet, until the guard goes.
    pub fn lend(&self, bytes: u64) -> Lent {
        self.account.change(|held| held.lent += bytes);
        Lent { account: self.account.clone(), bytes }
    }
}

impl Drop for Hold {
    fn drop(&mut self) {
        self.account.change(|held| {
            held.reserved -= self.held.reserved;
            held.growing -= self.held.growing;
            held.boxes -= self.held.boxes;
        });
    }
}

/// Bytes that are held and not taken yet.
#[must_use]
pub struct Lent {
    account: Arc<Account>,
    bytes: u64,
}

impl Drop for Lent {
    fn drop(&mut self) {
        self.account.change(|held| held.lent -= self.bytes);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MIB: u64 = 1 << 20;

    #[test]
    fn footprints_add_up_or_follow_each_other() {
        let tables = Footprint::of_all(100).and(Footprint::of_boxes(20));
        let tiles = Footprint::of_thread(50);
        assert_eq!(tables.and(tiles).bytes(3), 270);
        assert_eq!(tables.or(tiles, 2), tables);
        assert_eq!(
            tables.or(tiles, 3),
            Footprint { growing: 50, ..tiles },
            "30 more than tables, of which 20 are boxes"
        );
        assert_eq!(Footprint::of_all(200).or(tables, 1), Footprint { growing: 100, ..Footprint::of_all(200) });
        assert_eq!(tiles.or(Footprint::of_all(200), 9), tiles, "where nothing grows nothing may");
        assert_eq!(Footprint::of_thread(u64::MAX).and(tables).bytes(2), u64::MAX);
    }

    #[test]
    fn what_is_held_narrows_the_window_until_it_goes() {
        let dir = tempfile::tempdir().unwrap();
        let scratch = Scratch::new(dir.path(), 1 << 40);
        let account = Account::new(Budget { total: 256 * MIB }, scratch.clone());
        let job = account.reserve(Footprint { held: 40 * MIB, per_thread: 10 * MIB, growing: 30 * MIB }, 2).unwrap();
        let all = 256 * MIB - 60 * MIB - 48 * MIB;
        assert_eq!(scratch.window(), all);
        let first = account.hold(20 * MIB).unwrap();
        assert_eq!(scratch.window(), all, "this was reserved");
        let second = account.hold(20 * MIB).unwrap();
        assert_eq!(scratch.window(), all - 10 * MIB);
        let third = account.hold(100 * MIB).unwrap();
        assert_eq!(scratch.window(), all - 110 * MIB, "less than a run may start with");
        drop(third);
        let error = account.hold(120 * MIB).err().unwrap().to_string();
        assert!(error.contains("give at least --memory 302MiB"), "{error}");
        assert_eq!(scratch.window(), all - 10 * MIB, "what was refused is not held");
        drop(first);
        assert_eq!(scratch.window(), all);
        drop((second, job));
        assert_eq!(scratch.window(), 208 * MIB);
    }

    #[test]
    fn what_is_lent_is_pages_until_it_is_taken() {
        let dir = tempfile::tempdir().unwrap();
        let scratch = Scratch::new(dir.path(), 1 << 40);
        let account = Account::new(Budget { total: 256 * MIB }, scratch.clone());
        let job = account.reserve(Footprint::of_all(100 * MIB), 1).unwrap();
        let lent = job.lend(60 * MIB);
        assert_eq!(
            (scratch.window(), scratch.resident_limit()),
            (108 * MIB, 168 * MIB),
            "no more is put into plain memory"
        );
        let error = account.hold(100 * MIB).err().unwrap().to_string();
        assert!(error.contains("give at least --memory 312MiB"), "what is lent is still held: {error}");
        drop(lent);
        assert_eq!((scratch.window(), scratch.resident_limit()), (108 * MIB, 108 * MIB));
        drop(job.lend(60 * MIB));
        drop(job);
        assert_eq!((scratch.window(), scratch.resident_limit()), (208 * MIB, 208 * MIB));
    }

    #[test]
    fn the_window_is_no_wider_than_it_was_made() {
        let dir = tempfile::tempdir().unwrap();
        let scratch = Scratch::new(dir.path(), MIB);
        let account = Account::new(Budget { total: 1 << 30 }, scratch.clone());
        let job = account.reserve(Footprint::of_all(MIB), 1).unwrap();
        let lent = job.lend(MIB / 2);
        assert_eq!((scratch.window(), scratch.resident_limit()), (MIB, MIB));
        drop(lent);
        drop(job);
        assert_eq!(scratch.window(), MIB);
    }
}
