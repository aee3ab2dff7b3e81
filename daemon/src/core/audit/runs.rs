//! Rows of entries that are alike but for time and value. The first is told at once, the others by one that ends the row:
//! so a flood of them is two entries, and one more each minute.

use core::time::Duration;

use od::Instant;

use super::{Again, AuditEntry, What};
use crate::core::{Peer, Who};

/// A row is over when nothing came for so long.
pub(super) const GAP: Duration = Duration::from_secs(1);
/// What goes on is told again after so long.
const LONGEST: Duration = Duration::from_secs(60);
/// Rows at a time.
const MAX_RUNS: usize = 64;

/// The rows that go on.
#[derive(Debug, Default)]
pub(super) struct Runs(Vec<Run>);

/// One row.
#[derive(Debug)]
pub(super) struct Run {
    last: AuditEntry,
    since: Instant,
    times: u64,
}

impl Runs {
    /// Takes an entry that goes on with a row; whether it does.
    pub(super) fn goes_on(&mut self, entry: AuditEntry) -> bool {
        let run = self.0.iter_mut().find(|run| is_alike(&run.last, &entry));
        run.is_some_and(|run| {
            (run.last, run.times) = (entry, run.times + 1);
            true
        })
    }

    /// Begins a row; whether there is room for one more.
    pub(super) fn begin(&mut self, entry: AuditEntry) -> bool {
        let has_room = self.0.len() < MAX_RUNS;
        if has_room {
            self.0.push(Run { last: entry, since: entry.at, times: 1 });
        }
        has_room
    }

    /// Ends the row that was silent longest.
    pub(super) fn take_silent(&mut self) -> Option<Run> {
        let silent = self.0.iter().enumerate().min_by_key(|(_, run)| run.last.at);
        silent.map(|(position, _)| position).map(|position| self.0.swap_remove(position))
    }

    /// The next row that is over at `now`.
    pub(super) fn take_over(&mut self, now: Instant) -> Option<Run> {
        let position = self.0.iter().position(|run| run.end() <= now)?;
        Some(self.0.remove(position))
    }

    /// The next row that is about this device.
    pub(super) fn take_of(&mut self, device: usize) -> Option<Run> {
        let position = self.0.iter().position(|run| run.last.device == Some(device))?;
        Some(self.0.swap_remove(position))
    }

    /// When the first row may be over.
    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        self.0.iter().map(Run::end).min()
    }
}

impl Run {
    fn end(&self) -> Instant {
        let silent = self.last.at + GAP;
        match self.last.what {
            // However long it takes, it is one stream.
            What::StreamEnd(_) => silent,
            What::Write(_)
            | What::Change(_)
            | What::StreamStart(_)
            | What::Refused(..)
            | What::Network(..)
            | What::Claim(..)
            | What::Release(..)
            | What::Inject(..)
            | What::Repair(..)
            | What::Signal(..)
            | What::Motion(..) => silent.min(self.since + LONGEST),
        }
    }

    /// The entry that ends it, with all that there were.
    pub(super) fn all(&self) -> AuditEntry {
        self.ended(self.times)
    }

    /// The entry that ends it, with those that came after the first, if there were any.
    pub(super) fn more(&self) -> Option<AuditEntry> {
        (self.times > 1).then(|| self.ended(self.times - 1))
    }

    fn ended(&self, times: u64) -> AuditEntry {
        let lasted = self.last.at.saturating_since(self.since);
        AuditEntry { again: Some(Again { times, lasted }), ..self.last }
    }
}

fn is_alike(one: &AuditEntry, other: &AuditEntry) -> bool {
    one.device == other.device
        && is_one(one.who, other.who)
        && is_one_peer(one.peer, other.peer)
        && match (&one.what, &other.what) {
            (What::Refused(one, because), What::Refused(other, why)) => {
                (one.node_id, one.address, because) == (other.node_id, other.address, why)
            }
            (What::StreamEnd(one), What::StreamEnd(other)) => {
                (one.node_id, one.address) == (other.node_id, other.address)
            }
            (one, other) => one == other,
        }
}

/// Whether they are the same, also if a Modbus client has connected again meanwhile.
fn is_one(one: Who, other: Who) -> bool {
    match (one, other) {
        (Who::Modbus(one), Who::Modbus(other)) => one.ip() == other.ip(),
        (one, other) => one == other,
    }
}

fn is_one_peer(one: Option<Peer>, other: Option<Peer>) -> bool {
    match (one, other) {
        (Some(one), Some(other)) => one.is(other),
        (one, other) => one == other,
    }
}
