//! What this process has begun to write and not finished, so that it can be removed by whoever ends the process in the
//! middle of that.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Of the whole process: so is its end.
static UNFINISHED: Mutex<Vec<Entry>> = Mutex::new(Vec::new());

/// What is unfinished, and what is done with it at the end of the process; removed where nobody says.
struct Entry {
    path: PathBuf,
    settle: Option<Box<dyn Fn() + Send>>,
}

/// A file or folder that is to be removed when the process ends before this goes.
#[derive(Debug)]
pub struct Unfinished(PathBuf);

impl Unfinished {
    /// From now on.
    #[must_use]
    pub fn new(path: &Path) -> Self {
        Self::entered(path, None)
    }

    /// What stays, and is settled by something else than being removed, when the process ends before this goes.
    #[must_use]
    pub fn settled_by(path: &Path, settle: impl Fn() + Send + 'static) -> Self {
        Self::entered(path, Some(Box::new(settle)))
    }

    fn entered(path: &Path, settle: Option<Box<dyn Fn() + Send>>) -> Self {
        // By its full name, wherever the process goes.
        let path = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
        lock().push(Entry { path: path.clone(), settle });
        Self(path)
    }

    /// Does what finishes it: the process does not end in the middle of that.
    pub fn finish<R>(&self, finish: impl FnOnce() -> R) -> R {
        let _held = lock();
        finish()
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        let mut all = lock();
        if let Some(at) = all.iter().position(|entry| entry.path == self.0) {
            all.swap_remove(at);
        }
    }
}

fn lock() -> MutexGuard<'static, Vec<Entry>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Threads may still write into a folder while it is removed.
const TRIES: usize = 20;

/// Removes all that is unfinished; from here on nothing can be begun or finished any more. For a process that ends.
pub fn remove_all() {
    let all = lock();
    for Entry { path, settle } in all.iter() {
        if let Some(settle) = settle {
            settle();
            continue;
        }
        let gone = || fs::remove_file(path).or_else(|_| fs::remove_dir_all(path)).is_ok() || !path.exists();
        // What cannot be removed is found by the next run.
        let _ = (0..TRIES).any(|_| gone());
    }
    std::mem::forget(all);
}
