//! The audit trail: who commanded what, kept for good in files that never outgrow their bounds.
//!
//! The core tells it ([`crate::core::Core::poll_audit`]), the core loop hands it on without waiting, and a thread of its own
//! writes it ([`Files`]), one JSON object in each line ([`Line`]). Where it cannot keep up, entries are lost, counted, and
//! the trail says so itself.

mod files;
mod line;
mod words;

use core::time::Duration;
use std::collections::VecDeque;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::thread::{self, JoinHandle};

use config::{Audit, Gateway};
use od::Instant;
use profiles::Profile;
use tracing::warn;

use crate::clock::Clock;
use crate::core::AuditEntry;
use crate::log::module::AUDIT;
use crate::reload::Report;

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

/// Something for the writer.
#[derive(Debug)]
enum Told {
    Entry(AuditEntry),
    /// What the device at a position is from now on.
    Device(usize, String, Arc<Profile>),
    /// What the bus of a link is called from now on.
    Bus(usize, String),
    /// The configuration was reloaded at this time.
    Reload(Instant, Arc<Report>),
}

/// The core's end. When it is dropped, what waits is written.
#[derive(Debug)]
pub struct Trail {
    entries: Option<SyncSender<Told>>,
    /// What found no room and must not be lost: later entries would be told of others than they are of.
    owed: VecDeque<Told>,
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
        Ok(Self { entries: Some(entries), owed: VecDeque::new(), lost, lost_before: 0, writer: Some(writer) })
    }

    /// Takes an entry and does not wait for anything.
    pub fn submit(&mut self, entry: AuditEntry) {
        self.pay();
        if !self.owed.is_empty() || self.put(Told::Entry(entry)).is_some() {
            self.lost.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// The device at this position is called so from now on, and its objects as in this profile.
    pub fn name_device(&mut self, device: usize, name: &str, profile: &Arc<Profile>) {
        self.owe(Told::Device(device, name.to_owned(), Arc::clone(profile)));
    }

    /// The bus of this link is called so from now on.
    pub fn name_bus(&mut self, link: usize, name: &str) {
        self.owe(Told::Bus(link, name.to_owned()));
    }

    /// The configuration was reloaded.
    pub fn note_reload(&mut self, now: Instant, report: &Arc<Report>) {
        self.owe(Told::Reload(now, Arc::clone(report)));
    }

    /// Tells something at once or when there is room; there is only so much of it as reloads bring.
    fn owe(&mut self, told: Told) {
        self.owed.push_back(told);
        self.pay();
    }

    fn pay(&mut self) {
        while let Some(told) = self.owed.pop_front() {
            if let Some(told) = self.put(told) {
                return self.owed.push_front(told);
            }
        }
    }

    /// Passes it on; gives it back if there is no room.
    fn put(&self, told: Told) -> Option<Told> {
        match self.entries.as_ref()?.try_send(told) {
            Ok(()) => None,
            Err(TrySendError::Full(told) | TrySendError::Disconnected(told)) => Some(told),
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
    fn run(mut self, waiting: &Receiver<Told>) {
        loop {
            match waiting.recv_timeout(FLUSH) {
                Ok(Told::Device(device, name, profile)) => self.names.set_device(device, &name, &profile),
                Ok(Told::Bus(link, name)) => self.names.set_bus(link, name),
                Ok(Told::Reload(at, report)) => {
                    self.tell_losses();
                    let line = Line::reload(at, self.wall(at), &report).text();
                    self.put(line);
                }
                Ok(Told::Entry(entry)) => {
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
    fn wall(&self, moment: Instant) -> Duration {
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
