//! The cell by which the status leaves the core.
//!
//! A reader says that it wants one and rings; the core looks at a flag in each of its turns, and only if that is set it
//! collects the status and puts it in the cell, at most 20 times a second. So while nobody asks there is no lock,
//! no allocation and no other thread in the path of a frame.

use core::time::Duration;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use od::Instant;
use tokio::sync::watch;
use tokio::time::timeout;

use crate::alarm::Bell;
use crate::status::Status;

/// The shortest time between two statuses.
const PERIOD: Duration = Duration::from_millis(50);
/// How often a reader asks: for three seconds in all, which covers a core that sleeps in a receiving system call.
const ATTEMPTS: u32 = 60;

/// The core's end.
#[derive(Debug)]
pub struct Publisher {
    is_wanted: Arc<AtomicBool>,
    cell: watch::Sender<Status>,
    not_before: Instant,
}

/// The end of whoever asks.
#[derive(Clone, Debug)]
pub struct Reader {
    is_wanted: Arc<AtomicBool>,
    cell: watch::Receiver<Status>,
    bell: Bell,
}

/// Both ends; `bell` wakes the core.
#[must_use]
pub fn board(bell: Bell) -> (Publisher, Reader) {
    let is_wanted = Arc::new(AtomicBool::new(false));
    let (cell, reading) = watch::channel(Status::default());
    let publisher = Publisher { is_wanted: Arc::clone(&is_wanted), cell, not_before: Instant::ZERO };
    (publisher, Reader { is_wanted, cell: reading, bell })
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
        self.cell.send_replace(status);
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
                Ok(Ok(())) => return Some(self.cell.borrow_and_update().clone()),
                Ok(Err(_)) => return None,
                // It had given one just before, or sleeps.
                Err(_) => {}
            }
        }
        None
    }
}
