//! `SlotFile`: equal slots of plain numbers in a memory-mapped scratch file, or in plain memory where the window has
//! ample room: a volume that fits must not pay for the disk. Where the crate maps memory.
//!
//! ```text
//! file   | slot 0 | slot 1 | slot 2 | ...      slot = slot_len elements, native byte order, no padding
//!        |---- segment 0 ----|---- segment 1   2 MiB each: what the window drops together
//! ```
//!
//! A file has no name (it was unlinked when made), so it goes with the process whatever ends it, and nobody else
//! can shorten it. Its blocks are allocated before it is mapped: a full disk is an error here, not a bus error later.
//! Each slot has a lock of its own; uncontended in every schedule, it makes the safe interface sound for any caller.
#![allow(unsafe_code)]

use std::fs::File;
use std::marker::PhantomData;
use std::os::fd::AsRawFd;
use std::path::Path;
use std::sync::atomic::Ordering::Relaxed;
use std::sync::{Arc, PoisonError, RwLock};

use memmap2::{MmapMut, MmapRaw, UncheckedAdvice};

use super::Element;
use super::window::{Droppable, Segments, Window};
use crate::error::{Error, Result};

/// `count` slots of `slot_len` elements each; new slots hold zeros.
pub(super) struct SlotFile<T> {
    segments: Arc<Segments>,
    map: Arc<Mapping>,
    locks: Box<[RwLock<()>]>,
    slot_len: usize,
    window: Arc<Window>,
    element: PhantomData<T>,
}

struct Mapping {
    raw: MmapRaw,
    /// None for plain memory.
    file: Option<File>,
}

struct Pages(Arc<Mapping>);

impl Droppable for Pages {
    fn drop_pages(&self, start: usize, len: usize, write_back: bool) {
        let Some(file) = &self.0.file else { return };
        if write_back {
            start_write_back(file, start, len);
        }
        // SAFETY: the mapping is shared and backed by a file, so dropped pages keep their contents in the page cache
        // and the next access maps them again; no reference into the map can see a change.
        let dropped = unsafe { self.0.raw.unchecked_advise_range(UncheckedAdvice::DontNeed, start, len) };
        // A refused hint costs memory, never correctness.
        drop(dropped);
    }
}

impl Mapping {
    fn file(dir: &Path, bytes: usize) -> Result<Self> {
        let file = tempfile::tempfile_in(dir).map_err(|e| {
            Error::from_io("cannot make a scratch file; choose another folder with --scratch", &e).at(dir)
        })?;
        allocate(&file, bytes as u64).map_err(|e| {
            let need = bytes.div_ceil(1 << 20);
            let what =
                format!("no room for {need} MiB of scratch; free some disk or choose another folder with --scratch");
            Error::from_io(&what, &e).at(dir)
        })?;
        let raw = MmapRaw::map_raw(&file).map_err(|e| Error::from_io("cannot map a scratch file", &e).at(dir))?;
        #[cfg(target_os = "linux")]
        // A huge page would make resident what nobody used and the window does not count. A refused hint costs memory alone.
        drop(raw.advise(memmap2::Advice::NoHugePage));
        Ok(Self { raw, file: Some(file) })
    }

    fn memory(bytes: usize) -> Result<Self> {
        let map = MmapMut::map_anon(bytes.max(1)).map_err(|e| {
            let need = bytes.div_ceil(1 << 20);
            Error::from_io(&format!("no room for {need} MiB of memory; give a smaller --memory"), &e)
        })?;
        #[cfg(target_os = "linux")]
        // A refused hint costs time, never correctness.
        drop(map.advise(memmap2::Advice::HugePage));
        Ok(Self { raw: map.into(), file: None })
    }
}

impl<T: Element> SlotFile<T> {
    pub(super) fn create(dir: &Path, window: &Arc<Window>, slot_len: usize, count: usize) -> Result<Self> {
        let bytes = slot_len * count * size_of::<T>();
        let pinned = window.pins(bytes as u64);
        let map = Arc::new(if pinned { Mapping::memory(bytes)? } else { Mapping::file(dir, bytes)? });
        let segments = Segments::new(bytes, Box::new(Pages(map.clone())), window.clone(), pinned);
        let locks = (0..count).map(|_| RwLock::new(())).collect();
        Ok(Self { segments, map, locks, slot_len, window: window.clone(), element: PhantomData })
    }

    /// Lends out a part of a slot for reading.
    pub(super) fn read<R>(&self, slot: usize, part: std::ops::Range<usize>, f: impl FnOnce(&[T]) -> R) -> R {
        let _shared = self.locks[slot].read().unwrap_or_else(PoisonError::into_inner);
        let (start, len) = self.admit(slot, &part);
        self.window.bytes_read.fetch_add((len * size_of::<T>()) as u64, Relaxed);
        // SAFETY: `admit` checked the range against the slot, and the slot against the mapping; the mapping is page
        // aligned and `start` a multiple of the element's size; any bit pattern is a value of an `Element` (sealed);
        // writers of this slot are kept out by its lock for as long as the reference lives.
        let elements = unsafe { std::slice::from_raw_parts(self.map.raw.as_ptr().add(start).cast::<T>(), len) };
        f(elements)
    }

    /// Lends out a slot for writing.
    pub(super) fn write<R>(&self, slot: usize, f: impl FnOnce(&mut [T]) -> R) -> R {
        let _alone = self.locks[slot].write().unwrap_or_else(PoisonError::into_inner);
        let (start, len) = self.admit(slot, &(0..self.slot_len));
        self.window.bytes_written.fetch_add((len * size_of::<T>()) as u64, Relaxed);
        // SAFETY: as in `read`; the lock is held for writing, so no other reference into this slot exists.
        let elements = unsafe { std::slice::from_raw_parts_mut(self.map.raw.as_mut_ptr().add(start).cast::<T>(), len) };
        f(elements)
    }

    /// Checks a range of a slot and brings it into the window; returns its first byte and its length in elements.
    fn admit(&self, slot: usize, part: &std::ops::Range<usize>) -> (usize, usize) {
        assert!(part.start <= part.end && part.end <= self.slot_len, "a range outside its slot");
        let start = (slot * self.slot_len + part.start) * size_of::<T>();
        let len = part.end - part.start;
        if self.segments.touch(start, len * size_of::<T>()) {
            self.window.loads.fetch_add(1, Relaxed);
        }
        (start, len)
    }
}

/// Allocates the file's blocks, so that later writes through the map cannot run out of disk.
fn allocate(file: &File, bytes: u64) -> std::io::Result<()> {
    let bytes = bytes.max(1);
    file.set_len(bytes)?;
    #[cfg(target_os = "linux")]
    {
        // SAFETY: plain system call on an open descriptor with a length that fits the type.
        let code = unsafe { libc::posix_fallocate(file.as_raw_fd(), 0, bytes as libc::off_t) };
        // Some network file systems cannot allocate ahead; they are used as they are.
        if code != 0 && code != libc::EOPNOTSUPP && code != libc::EINVAL {
            return Err(std::io::Error::from_raw_os_error(code));
        }
    }
    Ok(())
}

/// Asks the system to begin writing a range to disk, so that its pages are clean when memory runs short.
fn start_write_back(file: &File, start: usize, len: usize) {
    #[cfg(target_os = "linux")]
    // SAFETY: plain system call on an open descriptor; it touches no memory of ours.
    unsafe {
        libc::sync_file_range(
            file.as_raw_fd(),
            start as libc::off64_t,
            len as libc::off64_t,
            libc::SYNC_FILE_RANGE_WRITE,
        );
    }
    #[cfg(not(target_os = "linux"))]
    let _ = (file, start, len);
}
