//! Says in a live store, now and then, how far its run is.

use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use crate::exec::{Engine, Outlook};
use crate::io::ome_zarr::{LiveState, Root, StoreWriter};

/// How often it is said.
const BETWEEN: Duration = Duration::from_secs(1);

/// Goes on until it is dropped.
pub(crate) struct Telling {
    ended: Arc<(Mutex<bool>, Condvar)>,
    thread: Option<JoinHandle<()>>,
}

impl Telling {
    /// Says how far an engine's run is, in its store; nothing where that is not live.
    #[must_use]
    pub(crate) fn of(store: &StoreWriter, engine: &Engine) -> Option<Self> {
        store.live().map(|root| Self::new(root, engine.outlook().clone()))
    }

    fn new(root: Arc<Root>, outlook: Arc<Outlook>) -> Self {
        let ended = Arc::new((Mutex::new(false), Condvar::new()));
        let until = ended.clone();
        let tell = move || {
            let (ended, woken) = &*until;
            let mut held = ended.lock().unwrap_or_else(PoisonError::into_inner);
            while !*held {
                let waited = woken.wait_timeout(held, BETWEEN).unwrap_or_else(PoisonError::into_inner);
                held = waited.0;
                if !*held {
                    // A disk that is full ends the run where it matters.
                    let _ = root.tell(LiveState::Running, outlook.done());
                }
            }
        };
        // A machine without another thread has a store that does not say how far it is.
        Self { ended, thread: thread::Builder::new().name("strandline-live".into()).spawn(tell).ok() }
    }
}

impl Drop for Telling {
    fn drop(&mut self) {
        let (ended, woken) = &*self.ended;
        *ended.lock().unwrap_or_else(PoisonError::into_inner) = true;
        woken.notify_all();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}
