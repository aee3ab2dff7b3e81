//! What passes on the buses, for whoever watches.
//!
//! A [`Tap`] is a ring that one watcher empties by itself. The core puts frames in without a lock, an allocation or a
//! wake-up, and counts those that find no place. While nobody watches there is no tap.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Weak};

use canopen::Frame;
use od::Instant;

use crate::core::LinkId;
use crate::dump::Known;

/// Frames that may wait for a watcher: a quarter of a second of the fastest classic CAN bus.
const RING: usize = 4096;

/// Something for a watcher.
#[derive(Clone, Debug)]
pub(crate) enum Record {
    /// A frame was on the bus.
    Frame {
        /// When.
        at: Instant,
        /// Where.
        link: LinkId,
        /// Whether one of our nodes sent it.
        is_ours: bool,
        /// The frame.
        frame: Frame,
    },
    /// What our nodes on the bus are from now on.
    Nodes(LinkId, Vec<Known>),
}

/// The core's end.
#[derive(Clone, Debug)]
pub struct Tap {
    ring: SyncSender<Record>,
    dropped: Weak<AtomicU64>,
}

/// The watcher's end.
#[derive(Debug)]
pub(crate) struct Watch {
    ring: Receiver<Record>,
    dropped: Arc<AtomicU64>,
}

/// Both ends.
pub(crate) fn tap() -> (Tap, Watch) {
    let (sender, ring) = sync_channel(RING);
    let dropped = Arc::new(AtomicU64::new(0));
    (Tap { ring: sender, dropped: Arc::downgrade(&dropped) }, Watch { ring, dropped })
}

impl Tap {
    /// Gives the watcher a record, or counts it as lost. Whether somebody still watches.
    pub(crate) fn put(&self, record: Record) -> bool {
        match self.ring.try_send(record) {
            Ok(()) => true,
            Err(TrySendError::Full(_)) => {
                let dropped = self.dropped.upgrade();
                dropped.inspect(|dropped| _ = dropped.fetch_add(1, Ordering::Relaxed)).is_some()
            }
            Err(TrySendError::Disconnected(_)) => false,
        }
    }

    /// Whether somebody still watches.
    #[must_use]
    pub fn is_watched(&self) -> bool {
        self.dropped.strong_count() > 0
    }
}

impl Watch {
    /// The next record, if there is one.
    pub(crate) fn poll(&self) -> Option<Record> {
        self.ring.try_recv().ok()
    }

    /// How many were lost since this was asked last.
    pub(crate) fn take_dropped(&self) -> u64 {
        self.dropped.swap(0, Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_watcher_that_is_too_slow_loses_frames_and_is_told_how_many() {
        let (tap, watch) = tap();
        let frame = Frame::new(canopen::Id::Standard(0x80), &[]);
        let record = || Record::Frame { at: Instant::ZERO, link: LinkId(0), is_ours: true, frame };
        for _ in 0..RING + 3 {
            assert!(tap.put(record()));
        }
        assert_eq!((watch.take_dropped(), watch.take_dropped()), (3, 0));
        assert_eq!(core::iter::from_fn(|| watch.poll()).count(), RING);
        drop(watch);
        assert!(!tap.put(record()), "nobody watches any more");
    }
}
