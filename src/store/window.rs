//! The window of resident pages: how much of all scratch files may be mapped into memory at one time.
//!
//! Every mapped file is cut into segments of [`SEGMENT_BYTES`]. A segment becomes resident when a brick in it is
//! used; past the limit the segments that have not been used for longest are written back and dropped (a second
//! chance first-in-first-out queue). A dropped segment of a shared mapping loses nothing: its next use reads it again.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicU8, AtomicU64, Ordering::Relaxed};
use std::sync::{Arc, Mutex, PoisonError, Weak};

/// Bytes that are dropped together. The system may map a whole huge page of its page cache at one fault, so segments
/// are as large as those and aligned to them: else pages would become resident that nobody accounts for.
pub(super) const SEGMENT_BYTES: usize = 2 << 20;

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
            window.resident.fetch_add(bytes as u64, Relaxed);
        }
        let start = if pinned { REFERENCED } else { DROPPED };
        let states = (0..bytes.div_ceil(SEGMENT_BYTES)).map(|_| AtomicU8::new(start)).collect();
        let segments = Arc::new(Self { states, bytes, pages, window, pinned });
        segments.window.shrink();
        segments
    }

    /// Marks a range as in use; what was not resident is counted as loaded.
    pub(super) fn touch(self: &Arc<Self>, start: usize, len: usize) -> bool {
        let mut loaded = false;
        for segment in start / SEGMENT_BYTES..(start + len).div_ceil(SEGMENT_BYTES) {
            let state = &self.states[segment];
            if state.load(Relaxed) == REFERENCED {
                continue;
            }
            if state.swap(REFERENCED, Relaxed) == DROPPED {
                loaded = true;
                self.window.admit(self, segment);
            }
        }
        loaded
    }

    fn segment_len(&self, segment: usize) -> usize {
        (self.bytes - segment * SEGMENT_BYTES).min(SEGMENT_BYTES)
    }

    /// Drops the segment unless it was used since it was last looked at.
    fn try_drop(&self, segment: usize) -> bool {
        if self.states[segment].compare_exchange(REFERENCED, RESIDENT, Relaxed, Relaxed).is_ok() {
            return false;
        }
        self.states[segment].store(DROPPED, Relaxed);
        self.pages.drop_pages(segment * SEGMENT_BYTES, self.segment_len(segment), self.window.writes_behind());
        true
    }

    fn forget(&self) {
        let resident: u64 = (0..self.states.len())
            .filter(|&s| self.states[s].load(Relaxed) != DROPPED)
            .map(|s| self.segment_len(s) as u64)
            .sum();
        self.window.resident.fetch_sub(resident, Relaxed);
        if self.pinned {
            self.window.pinned.fetch_sub(self.bytes as u64, Relaxed);
        }
        self.window.allocated.fetch_sub(self.bytes as u64, Relaxed);
    }
}

impl Drop for Segments {
    fn drop(&mut self) {
        self.forget();
    }
}

/// The shared account of resident bytes, and the counters that reports are made of.
pub struct Window {
    limit: AtomicU64,
    resident: AtomicU64,
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
            resident: AtomicU64::new(0),
            pinned: AtomicU64::new(0),
            allocated: AtomicU64::new(0),
            page_cache: AtomicU64::new(0),
            queue: Mutex::default(),
            loads: AtomicU64::new(0),
            bytes_read: AtomicU64::new(0),
            bytes_written: AtomicU64::new(0),
        })
    }

    /// Changes the limit; takes effect as further bricks are used.
    pub fn set_limit(&self, limit: u64) {
        self.limit.store(limit, Relaxed);
        self.shrink();
    }

    /// Says how much scratch the system can hold in its page cache. Beyond that, dropped pages are written to the disk
    /// at once, so that they are clean when memory runs short; below it, writing them would only cost time.
    pub fn set_page_cache(&self, bytes: u64) {
        self.page_cache.store(bytes, Relaxed);
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

    /// How many bytes may be resident.
    #[must_use]
    pub fn limit(&self) -> u64 {
        self.limit.load(Relaxed)
    }

    /// Bytes resident now, by the window's own account.
    #[must_use]
    pub fn resident(&self) -> u64 {
        self.resident.load(Relaxed)
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

    fn admit(&self, file: &Arc<Segments>, segment: usize) {
        self.resident.fetch_add(file.segment_len(segment) as u64, Relaxed);
        self.queue.lock().unwrap_or_else(PoisonError::into_inner).push_back((Arc::downgrade(file), segment));
        self.shrink();
    }

    /// Drops segments until the limit holds. Each is looked at twice at most: in use since, it stays once.
    fn shrink(&self) {
        while self.resident.load(Relaxed) > self.limit.load(Relaxed) {
            let mut queue = self.queue.lock().unwrap_or_else(PoisonError::into_inner);
            let Some((file, segment)) = queue.pop_front() else { return };
            drop(queue);
            let Some(file) = file.upgrade() else { continue };
            if file.try_drop(segment) {
                self.resident.fetch_sub(file.segment_len(segment) as u64, Relaxed);
            } else {
                let mut queue = self.queue.lock().unwrap_or_else(PoisonError::into_inner);
                queue.push_back((Arc::downgrade(&file), segment));
            }
        }
    }
}
