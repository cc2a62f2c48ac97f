//! Buffers that threads work in, kept from one brick to the next.

use std::sync::{Mutex, PoisonError};

/// One set of work buffers for each thread, made when first needed.
pub struct Workers<W> {
    idle: Mutex<Vec<W>>,
    make: Box<dyn Fn() -> W + Send + Sync>,
}

impl<W: Send> Workers<W> {
    /// Buffers made by `make`, at most one set for each thread.
    pub fn new(make: impl Fn() -> W + Send + Sync + 'static) -> Self {
        Self { idle: Mutex::default(), make: Box::new(make) }
    }

    /// What a function tells of each set that is idle.
    pub fn idle<R>(&self, tell: impl FnMut(&W) -> R) -> Vec<R> {
        self.idle.lock().unwrap_or_else(PoisonError::into_inner).iter().map(tell).collect()
    }

    /// Lends out a set that is idle, or a new one.
    pub fn with<R>(&self, f: impl FnOnce(&mut W) -> R) -> R {
        let idle = self.idle.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let mut worker = idle.unwrap_or_else(|| (self.make)());
        let result = f(&mut worker);
        self.idle.lock().unwrap_or_else(PoisonError::into_inner).push(worker);
        result
    }
}

impl Workers<()> {
    /// For work that needs no buffers.
    #[must_use]
    pub fn none() -> Self {
        Self::new(|| ())
    }
}
