//! `Scratch`: the folder of temporary fields, and how much of them may be in memory.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::window::{Traffic, Window};

/// Where scratch files are made, and the window of pages they share.
#[derive(Clone)]
pub struct Scratch {
    pub(super) dir: PathBuf,
    pub(super) window: Arc<Window>,
}

impl Scratch {
    /// Scratch files in `dir`, at most `window_bytes` of them resident.
    #[must_use]
    pub fn new(dir: &Path, window_bytes: u64) -> Self {
        Self { dir: dir.to_path_buf(), window: Window::new(window_bytes) }
    }

    /// From now on what the system has mapped counts, where that is more than what was used: for a process with one window.
    #[must_use]
    pub fn watching(self) -> Self {
        self.window.watch();
        self
    }

    /// What moved between scratch and memory so far.
    #[must_use]
    pub fn traffic(&self) -> Traffic {
        self.window.traffic()
    }

    /// Changes how many bytes may be resident: the window, and what is lent to it for a while.
    pub fn set_window(&self, bytes: u64, lent: u64) {
        self.window.set_limit(bytes, lent);
    }

    /// Says how much scratch the system can hold in its page cache; what goes beyond is written behind.
    pub fn set_page_cache(&self, bytes: u64) {
        self.window.set_page_cache(bytes);
    }

    /// How many bytes may be resident for as long as they are wanted.
    #[must_use]
    pub fn window(&self) -> u64 {
        self.window.limit()
    }

    /// How many bytes may be resident now, those that are lent among them.
    #[must_use]
    pub fn resident_limit(&self) -> u64 {
        self.window.resident_limit()
    }

    /// The folder the files are in.
    #[must_use]
    pub fn dir(&self) -> &Path {
        &self.dir
    }
}
