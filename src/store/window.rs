//! The window of resident pages: how much of all scratch files may be mapped into memory at one time.
//!
//! Every mapped file is cut into segments of [`SEGMENT_BYTES`]. A segment becomes resident when a brick in it is
//! used; past the limit the segments that have not been used for longest are written back and dropped (a second
//! chance first-in-first-out queue). A dropped segment of a shared mapping loses nothing: its next use reads it again.
//! What counts of a segment are its blocks that were used: of two bricks in it, or the faces of twenty, often one alone is. The
//! system may map more around a fault than a block, as much as it has in one piece in its page cache (large folios, Linux 6.18):
//! a window that watches counts what the system says beyond its own account too, up to whole segments.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicI64, AtomicU8, AtomicU32, AtomicU64, Ordering::Relaxed};
use std::sync::{Arc, Mutex, PoisonError, Weak};

use super::mapped::mapped_bytes;

/// Bytes that are dropped together. The system may map a whole huge page of its page cache at one fault, so segments
/// are as large as those and aligned to them: else pages would become resident that nobody accounts for.
pub(super) const SEGMENT_BYTES: usize = 2 << 20;
/// Bytes that become resident together: the system maps what its page cache has around a fault, within as many bytes where that
/// is in small pieces.
const BLOCK_BYTES: usize = 64 << 10;
const _: () = assert!(SEGMENT_BYTES / BLOCK_BYTES == u32::BITS as usize, "a bit for each block");

/// So many more bytes are admitted between two looks at what the system has mapped.
const LOOK_BYTES: i64 = 1 << 20;
/// The program's own pages and those of its libraries that may come after the first look.
const OWN_BYTES: u64 = 8 << 20;
/// The first look of a window that does not watch.
const UNWATCHED: u64 = u64::MAX;

const DROPPED: u8 = 0;
const RESIDENT: u8 = 1;
const REFERENCED: u8 = 2;

/// A mapped file as the window sees it.
pub(super) trait Droppable: Send + Sync {
    /// Takes a range out of the process's memory; what it holds stays. With `write_back` the system is asked to begin
    /// writing it to the disk.
    fn drop_pages(&self, start: usize, len: usize, write_back: bool);
}

/// The residency of one mapped file, cut into segments.
pub(super) struct Segments {
    states: Vec<AtomicU8>,
    /// A bit for each block that was used since the segment was dropped.
    blocks: Vec<AtomicU32>,
    bytes: usize,
    pages: Box<dyn Droppable>,
    window: Arc<Window>,
    pinned: bool,
}

impl Segments {
    /// `pinned` ones are resident from the start and stay so: they are in no file.
    pub(super) fn new(bytes: usize, pages: Box<dyn Droppable>, window: Arc<Window>, pinned: bool) -> Arc<Self> {
        window.allocated.fetch_add(bytes as u64, Relaxed);
        if pinned {
            window.resident.fetch_add(bytes as i64, Relaxed);
        }
        let (state, used) = if pinned { (REFERENCED, u32::MAX) } else { (DROPPED, 0) };
        let count = bytes.div_ceil(SEGMENT_BYTES);
        let states = (0..count).map(|_| AtomicU8::new(state)).collect();
        let blocks = (0..count).map(|_| AtomicU32::new(used)).collect();
        let segments = Arc::new(Self { states, blocks, bytes, pages, window, pinned });
        segments.window.shrink();
        segments
    }

    /// Marks a range as in use; whether a segment of it was not resident.
    pub(super) fn touch(self: &Arc<Self>, start: usize, len: usize) -> bool {
        let mut loaded = false;
        let end = start + len;
        for segment in start / SEGMENT_BYTES..end.div_ceil(SEGMENT_BYTES) {
            let first = segment * SEGMENT_BYTES;
            let used = blocks_of(start.max(first) - first, end.min(first + SEGMENT_BYTES) - first);
            let (state, blocks) = (&self.states[segment], &self.blocks[segment]);
            if state.load(Relaxed) == REFERENCED && blocks.load(Relaxed) & used == used {
                continue;
            }
            let more = self.bytes_of(segment, used & !blocks.fetch_or(used, Relaxed));
            let is_new = state.swap(REFERENCED, Relaxed) == DROPPED;
            loaded |= is_new;
            self.window.admit(self, segment, more, is_new);
        }
        loaded
    }

    /// Bytes of some blocks of a segment.
    fn bytes_of(&self, segment: usize, blocks: u32) -> i64 {
        let whole = blocks.count_ones() as usize * BLOCK_BYTES;
        let len = self.segment_len(segment);
        let last = (len.max(1) - 1) / BLOCK_BYTES;
        let missing = if blocks >> last & 1 == 1 { (last + 1) * BLOCK_BYTES - len } else { 0 };
        (whole - missing) as i64
    }

    fn segment_len(&self, segment: usize) -> usize {
        (self.bytes - segment * SEGMENT_BYTES).min(SEGMENT_BYTES)
    }

    /// Drops the segment unless it was used since it was last looked at; the bytes that were resident.
    fn try_drop(&self, segment: usize) -> Option<i64> {
        if self.states[segment].compare_exchange(REFERENCED, RESIDENT, Relaxed, Relaxed).is_ok() {
            return None;
        }
        self.states[segment].store(DROPPED, Relaxed);
        let bytes = self.bytes_of(segment, self.blocks[segment].swap(0, Relaxed));
        self.pages.drop_pages(segment * SEGMENT_BYTES, self.segment_len(segment), self.window.writes_behind());
        self.window.whole.fetch_sub(self.segment_len(segment) as i64, Relaxed);
        Some(bytes)
    }

    fn forget(&self) {
        if self.pinned {
            self.window.pinned.fetch_sub(self.bytes as u64, Relaxed);
            self.window.resident.fetch_sub(self.bytes as i64, Relaxed);
        } else {
            let of_segment = |n: usize| self.bytes_of(n, self.blocks[n].load(Relaxed));
            self.window.resident.fetch_sub((0..self.blocks.len()).map(of_segment).sum(), Relaxed);
            let is_in = |n: &usize| self.states[*n].load(Relaxed) != DROPPED;
            let whole = (0..self.states.len()).filter(is_in).map(|n| self.segment_len(n) as i64).sum();
            self.window.whole.fetch_sub(whole, Relaxed);
        }
        self.window.allocated.fetch_sub(self.bytes as u64, Relaxed);
    }
}

/// The blocks that a range of a segment lies in.
fn blocks_of(start: usize, end: usize) -> u32 {
    let [first, last] = [start / BLOCK_BYTES, end.div_ceil(BLOCK_BYTES)];
    let below = |block: usize| if block < u32::BITS as usize { (1 << block) - 1 } else { u32::MAX };
    below(last) & !below(first)
}

impl Drop for Segments {
    fn drop(&mut self) {
        self.forget();
    }
}

/// The shared account of resident bytes, and the counters that reports are made of.
pub struct Window {
    limit: AtomicU64,
    /// Bytes that may be resident beyond it for a while.
    lent: AtomicU64,
    /// What is dropped may be counted before what was admitted: for a moment it can be negative.
    resident: AtomicI64,
    /// Bytes of all segments that are in, used or not.
    whole: AtomicI64,
    /// Bytes of mapped files that the process had when the window began to watch.
    first: AtomicU64,
    /// Bytes that are resident by the system's account and not by this one.
    unseen: AtomicU64,
    /// Bytes that were admitted since the system was asked.
    since: AtomicI64,
    /// Bytes in plain memory, which count as resident.
    pinned: AtomicU64,
    /// Bytes of all scratch files.
    allocated: AtomicU64,
    /// Bytes of scratch that the system can be expected to hold in its page cache.
    page_cache: AtomicU64,
    queue: Mutex<VecDeque<(Weak<Segments>, usize)>>,
    /// Bricks that were not resident when they were used.
    pub(super) loads: AtomicU64,
    /// Bytes read out of bricks and faces.
    pub(super) bytes_read: AtomicU64,
    /// Bytes written into bricks and faces.
    pub(super) bytes_written: AtomicU64,
}

/// What moved through a [`Window`] so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Traffic {
    /// Bricks that were not resident when they were used.
    pub brick_loads: u64,
    /// Bytes read out of bricks and faces.
    pub bytes_read: u64,
    /// Bytes written into bricks and faces.
    pub bytes_written: u64,
}

impl Traffic {
    /// What moved since `earlier`.
    #[must_use]
    pub fn since(&self, earlier: &Self) -> Self {
        Self {
            brick_loads: self.brick_loads - earlier.brick_loads,
            bytes_read: self.bytes_read - earlier.bytes_read,
            bytes_written: self.bytes_written - earlier.bytes_written,
        }
    }
}

impl Window {
    /// A window that keeps at most `limit` bytes resident.
    #[must_use]
    pub fn new(limit: u64) -> Arc<Self> {
        Arc::new(Self {
            limit: AtomicU64::new(limit),
            lent: AtomicU64::new(0),
            resident: AtomicI64::new(0),
            whole: AtomicI64::new(0),
            first: AtomicU64::new(UNWATCHED),
            unseen: AtomicU64::new(0),
            since: AtomicI64::new(0),
            pinned: AtomicU64::new(0),
            allocated: AtomicU64::new(0),
            page_cache: AtomicU64::new(0),
            queue: Mutex::default(),
            loads: AtomicU64::new(0),
            bytes_read: AtomicU64::new(0),
            bytes_written: AtomicU64::new(0),
        })
    }

    /// Changes the limit, and what is lent beyond it for a while: room for pages that can be dropped again, not for plain memory.
    pub fn set_limit(&self, limit: u64, lent: u64) {
        self.limit.store(limit, Relaxed);
        self.lent.store(lent, Relaxed);
        self.shrink();
    }

    /// Says how much scratch the system can hold in its page cache. Beyond that, dropped pages are written to the disk
    /// at once, so that they are clean when memory runs short; below it, writing them would only cost time.
    pub fn set_page_cache(&self, bytes: u64) {
        self.page_cache.store(bytes, Relaxed);
    }

    /// From now on what the system has mapped of files counts, where that is more than what was used. For a process with one
    /// window, and all its other maps made before.
    pub fn watch(&self) {
        self.first.store(mapped_bytes().unwrap_or(UNWATCHED), Relaxed);
    }

    /// Asks the system how much it has mapped. No more than whole segments can be: what lies beyond is somebody else's.
    fn look(&self) {
        self.since.store(0, Relaxed);
        let first = self.first.load(Relaxed);
        let Some(mapped) = (first != UNWATCHED).then(mapped_bytes).flatten() else { return };
        let counted = self.resident().saturating_sub(self.pinned.load(Relaxed));
        let whole = u64::try_from(self.whole.load(Relaxed)).unwrap_or(0);
        let unseen = mapped.saturating_sub(first.saturating_add(OWN_BYTES)).min(whole).saturating_sub(counted);
        self.unseen.store(unseen, Relaxed);
    }

    /// Whether so many more bytes may be in plain memory instead of a file; takes them into account if so. At most half
    /// of the window is, so that files always find room.
    pub(super) fn pins(&self, bytes: u64) -> bool {
        let half = self.limit() / 2;
        let taken = |pinned: u64| Some(pinned + bytes).filter(|&sum| sum <= half);
        self.pinned.fetch_update(Relaxed, Relaxed, taken).is_ok()
    }

    fn writes_behind(&self) -> bool {
        self.allocated.load(Relaxed) > self.page_cache.load(Relaxed)
    }

    /// How many bytes may be resident for as long as they are wanted.
    #[must_use]
    pub fn limit(&self) -> u64 {
        self.limit.load(Relaxed)
    }

    /// How many bytes may be resident now, those that are lent among them.
    #[must_use]
    pub fn resident_limit(&self) -> u64 {
        self.limit() + self.lent.load(Relaxed)
    }

    /// Bytes resident now, by the window's own account.
    #[must_use]
    pub fn resident(&self) -> u64 {
        u64::try_from(self.resident.load(Relaxed)).unwrap_or(0)
    }

    /// What moved so far.
    #[must_use]
    pub fn traffic(&self) -> Traffic {
        Traffic {
            brick_loads: self.loads.load(Relaxed),
            bytes_read: self.bytes_read.load(Relaxed),
            bytes_written: self.bytes_written.load(Relaxed),
        }
    }

    fn admit(&self, file: &Arc<Segments>, segment: usize, bytes: i64, is_new: bool) {
        self.resident.fetch_add(bytes, Relaxed);
        if is_new {
            self.whole.fetch_add(file.segment_len(segment) as i64, Relaxed);
            self.queue.lock().unwrap_or_else(PoisonError::into_inner).push_back((Arc::downgrade(file), segment));
        }
        if self.since.fetch_add(bytes, Relaxed) + bytes >= LOOK_BYTES {
            self.look();
        }
        self.shrink();
    }

    /// Drops segments until the limit holds. Each is looked at twice at most: in use since, it stays once.
    fn shrink(&self) {
        while self.resident() + self.unseen.load(Relaxed) > self.resident_limit() {
            let mut queue = self.queue.lock().unwrap_or_else(PoisonError::into_inner);
            let Some((file, segment)) = queue.pop_front() else { return };
            drop(queue);
            let Some(file) = file.upgrade() else { continue };
            if let Some(bytes) = file.try_drop(segment) {
                self.resident.fetch_sub(bytes, Relaxed);
                if self.unseen.load(Relaxed) > 0 {
                    self.look();
                }
            } else {
                let mut queue = self.queue.lock().unwrap_or_else(PoisonError::into_inner);
                queue.push_back((Arc::downgrade(&file), segment));
            }
        }
    }
}
