//! Files that are whole set out for the disk at once, so that who waits for them to be there waits less: a checkpoint before the
//! end, which has seconds, or the end of a run (Linux' `sync_file_range`).
#![allow(unsafe_code)]

use std::fs::File;
#[cfg(target_os = "linux")]
use std::os::fd::AsRawFd;

/// Has what was written of a file go to the disk, and does not wait for it. Where the system knows no such thing it goes later.
#[cfg(target_os = "linux")]
pub fn begin_writeback(file: &File) {
    // SAFETY: the descriptor is open as long as `file` is lent; the call reads and writes no memory of the process. What fails here
    // shows itself where the file is waited for.
    unsafe { libc::sync_file_range(file.as_raw_fd(), 0, 0, libc::SYNC_FILE_RANGE_WRITE) };
}

/// Has what was written of a file go to the disk, and does not wait for it. Where the system knows no such thing it goes later.
#[cfg(not(target_os = "linux"))]
pub fn begin_writeback(_file: &File) {}
