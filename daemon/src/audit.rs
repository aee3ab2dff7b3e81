//! The audit trail: who commanded what, kept for good in files that never outgrow their bounds.
//!
//! The core tells it ([`crate::core::Core::poll_audit`]), the core loop hands it on without waiting, and a thread of its own
//! writes it ([`Files`]), one JSON object in each line ([`Line`]). Where it cannot keep up, entries are lost, counted, and
//! the trail says so itself.

mod files;
mod line;

use core::time::Duration;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread::{self, JoinHandle};

use config::{Audit, Gateway};
use tracing::warn;

use crate::clock::Clock;
use crate::core::AuditEntry;
use crate::log::module::AUDIT;

pub use files::{Files, last_lines};
pub use line::{Line, Names};

/// Entries that may wait for the disk.
const MAX_WAITING: usize = 1024;
/// Entries are on the disk after this at the latest.
const FLUSH: Duration = Duration::from_secs(1);

/// Where it is kept: where the configuration says, else beside what devices store.
pub(crate) fn directory(gateway: &Gateway, storage: Option<&Path>) -> Option<PathBuf> {
    let Audit { is_on, path, .. } = &gateway.service.audit;
    let own = path.clone().or_else(|| storage.map(|storage| storage.join("audit")));
    own.filter(|_| *is_on)
}

/// The core's end. When it is dropped, what waits is written.
#[derive(Debug)]
pub struct Trail {
    entries: Option<SyncSender<AuditEntry>>,
    lost: Arc<AtomicU64>,
    lost_before: u64,
    writer: Option<JoinHandle<()>>,
}

impl Trail {
    /// Keeps entries in `files`, with these names for what they are about, until it is dropped.
    ///
    /// # Errors
    /// The operating system has no thread left.
    pub fn start(files: Files, names: Names, clock: Clock) -> io::Result<Self> {
        let (entries, waiting) = sync_channel(MAX_WAITING);
        let lost = Arc::new(AtomicU64::new(0));
        let writer = Writer { files, names, clock, lost: Arc::clone(&lost), told: 0, is_broken: false };
        let writer = thread::Builder::new().name("audit".to_owned()).spawn(move || writer.run(&waiting))?;
        Ok(Self { entries: Some(entries), lost, lost_before: 0, writer: Some(writer) })
    }

    /// Takes an entry and does not wait for anything.
    pub fn submit(&self, entry: AuditEntry) {
        if self.entries.as_ref().is_none_or(|entries| entries.try_send(entry).is_err()) {
            self.lost.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Counts entries that were lost on their way here, of which there were so many since the start.
    pub fn lost_before(&mut self, entries: u64) {
        let known = core::mem::replace(&mut self.lost_before, entries);
        self.lost.fetch_add(entries.saturating_sub(known), Ordering::Relaxed);
    }

    /// Entries that were lost.
    #[must_use]
    pub fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }
}

impl Drop for Trail {
    fn drop(&mut self) {
        self.entries = None;
        // It has nothing to say that the log does not have.
        self.writer.take().map(JoinHandle::join);
    }
}

struct Writer {
    files: Files,
    names: Names,
    clock: Clock,
    lost: Arc<AtomicU64>,
    /// Losses that the trail has told.
    told: u64,
    /// The last line could not be written, and the log says so.
    is_broken: bool,
}

impl Writer {
    fn run(mut self, waiting: &Receiver<AuditEntry>) {
        loop {
            match waiting.recv_timeout(FLUSH) {
                Ok(entry) => {
                    self.tell_losses();
                    let line = Line::of(&entry, &self.names, self.wall(entry.at)).text();
                    if !self.put(line) {
                        self.lost.fetch_add(1, Ordering::Relaxed);
                    }
                }
                Err(RecvTimeoutError::Timeout) => {
                    self.tell_losses();
                    let outcome = self.files.sync();
                    self.note(&outcome);
                }
                Err(RecvTimeoutError::Disconnected) => {
                    self.tell_losses();
                    let outcome = self.files.sync();
                    return self.note(&outcome);
                }
            }
        }
    }

    /// What the wall clock shows at a moment just past.
    fn wall(&self, moment: od::Instant) -> Duration {
        Clock::wall().saturating_sub(self.clock.now().saturating_since(moment))
    }

    /// Says in the trail itself that it has holes, as soon as it can be written.
    fn tell_losses(&mut self) {
        let lost = self.lost.load(Ordering::Relaxed);
        let more = lost - self.told;
        if more == 0 {
            return;
        }
        let now = self.clock.now();
        let line = Line::lost(more, now, self.wall(now)).text();
        if self.put(line) {
            warn!(target: AUDIT, "audit trail: {more} entries were lost");
            self.told = lost;
        }
    }

    /// Adds a line; whether that was possible.
    fn put(&mut self, line: io::Result<String>) -> bool {
        let outcome = line.and_then(|line| self.files.append(&line));
        self.note(&outcome);
        outcome.is_ok()
    }

    /// Says once that it cannot be written, and once that it can be again.
    fn note(&mut self, outcome: &io::Result<()>) {
        match outcome {
            Ok(()) => self.is_broken = false,
            Err(error) if !core::mem::replace(&mut self.is_broken, true) => {
                warn!(target: AUDIT, "audit trail: cannot be written: {error}");
            }
            Err(_) => {}
        }
    }
}
