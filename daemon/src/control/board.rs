//! The cell by which the status leaves the core.
//!
//! A reader says that it wants one and rings; the core looks at a flag in each of its turns, and only if that is set it
//! collects the status and puts it in the cell, at most 20 times a second. So while nobody asks there is no lock,
//! no allocation and no other thread in the path of a frame. The lock of the cell is held for as long as it takes to count a
//! reference, and the memory of an old status is given back by whoever reads the next one.

use core::time::Duration;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex};

use od::Instant;
use tokio::sync::watch;
use tokio::time::timeout;

use crate::alarm::Bell;
use crate::status::Status;

/// The shortest time between two statuses.
const PERIOD: Duration = Duration::from_millis(50);
/// How often a reader asks: for three seconds in all, which covers a core that sleeps in a receiving system call.
const ATTEMPTS: u32 = 60;
/// Old statuses that may wait for a reader to give their memory back.
const MAX_OLD: usize = 4;

/// The core's end.
#[derive(Debug)]
pub struct Publisher {
    is_wanted: Arc<AtomicBool>,
    cell: watch::Sender<Arc<Status>>,
    old: SyncSender<Arc<Status>>,
    not_before: Instant,
}

/// The end of whoever asks.
#[derive(Clone, Debug)]
pub struct Reader {
    is_wanted: Arc<AtomicBool>,
    cell: watch::Receiver<Arc<Status>>,
    old: Arc<Mutex<Receiver<Arc<Status>>>>,
    bell: Bell,
}

/// Both ends; `bell` wakes the core.
#[must_use]
pub fn board(bell: Bell) -> (Publisher, Reader) {
    let is_wanted = Arc::new(AtomicBool::new(false));
    let (cell, reading) = watch::channel(Arc::default());
    let (old, waiting) = sync_channel(MAX_OLD);
    let publisher = Publisher { is_wanted: Arc::clone(&is_wanted), cell, old, not_before: Instant::ZERO };
    (publisher, Reader { is_wanted, cell: reading, old: Arc::new(Mutex::new(waiting)), bell })
}

impl Publisher {
    /// Whether somebody wants a status and may have one at `now`.
    #[must_use]
    pub fn is_wanted(&self, now: Instant) -> bool {
        self.is_wanted.load(Ordering::Relaxed) && now >= self.not_before
    }

    /// Gives everybody who asked this one.
    pub fn publish(&mut self, now: Instant, status: Status) {
        self.not_before = now + PERIOD;
        let old = self.cell.send_replace(Arc::new(status));
        // Without room its memory is given back here: readers that ask for so many at a time have not come to it yet.
        let _ = self.old.try_send(old);
        // Whoever has asked since wants a newer one, and asks again.
        self.is_wanted.store(false, Ordering::SeqCst);
    }
}

impl Reader {
    /// A status that is newer than this call; `None` if the core gives none.
    pub async fn read(&mut self) -> Option<Status> {
        self.cell.mark_unchanged();
        for _ in 0..ATTEMPTS {
            self.is_wanted.store(true, Ordering::SeqCst);
            self.bell.ring();
            match timeout(PERIOD, self.cell.changed()).await {
                Ok(Ok(())) => {
                    let status = Arc::clone(&self.cell.borrow_and_update());
                    self.forget_old();
                    return Some(Status::clone(&status));
                }
                Ok(Err(_)) => return None,
                // It had given one just before, or sleeps.
                Err(_) => {}
            }
        }
        None
    }

    /// Gives back the memory of statuses that have been replaced; the core takes no part in this lock.
    fn forget_old(&self) {
        let old = self.old.lock();
        old.into_iter().for_each(|old| old.try_iter().for_each(drop));
    }
}
