//! What is to be kept of who commanded what: every acyclic command, and of cyclic data what changes in controlword and mode
//! and where a stream of set-points begins and ends.
//!
//! The trail beside it ([`super::trail`]) knows the last commands of each device; from here they go to whoever keeps them
//! for good.

use core::time::Duration;
use std::collections::VecDeque;

use od::{Address, Commanded, Instant, Slot};
use profiles::{Binding, Profile, Role};

use super::Core;
use super::trail::Who;

/// A stream of set-points is over when none came for so long.
const GAP: Duration = Duration::from_secs(1);
/// Streams at a time; of more the one that was silent longest counts as over.
const MAX_STREAMS: usize = 64;
/// Entries that may wait; more are lost, and counted.
const MAX_WAITING: usize = 1024;

/// Something to be kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AuditEntry {
    /// When it happened.
    pub at: Instant,
    /// Position of the device.
    pub device: usize,
    /// Who did it.
    pub who: Who,
    /// The Node-ID that was written to, from CANopen.
    pub node_id: Option<u8>,
    /// What was written.
    pub address: Address,
    /// The value.
    pub value: i128,
    /// What kind of command it is.
    pub what: What,
}

/// Kinds of entries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum What {
    /// An acyclic write.
    Write,
    /// Cyclic data hold another controlword or mode than before.
    Change,
    /// The first set-point of a stream.
    StreamStart,
    /// The last set-point of a stream.
    StreamEnd {
        /// How many there were.
        set_points: u64,
        /// From the first to the last.
        lasted: Duration,
    },
}

/// Set-points of one kind from one place.
#[derive(Debug)]
struct Stream {
    /// The last set-point, as the entry that is written when it was the last one.
    last: AuditEntry,
    since: Instant,
    set_points: u64,
}

/// See the module's documentation.
#[derive(Debug, Default)]
pub(super) struct Audit {
    /// For each device the entries that say what it does and not where to; none while nothing is kept.
    modes: Option<Vec<Vec<Slot>>>,
    entries: VecDeque<AuditEntry>,
    streams: Vec<Stream>,
    /// Not after the first end of a stream.
    pub(super) deadline: Option<Instant>,
    lost: u64,
}

impl Audit {
    /// Takes note of a command, of which `entry` says all but its kind.
    pub(super) fn note(&mut self, commanded: &Commanded, entry: AuditEntry) {
        let Some(modes) = &self.modes else { return };
        let is_mode = modes.get(entry.device).is_some_and(|modes| modes.contains(&commanded.slot));
        match (commanded.is_cyclic, is_mode) {
            (false, _) => self.keep(entry),
            (true, true) if commanded.has_changed => self.keep(AuditEntry { what: What::Change, ..entry }),
            (true, true) => {}
            (true, false) => self.stream(entry),
        }
    }

    fn stream(&mut self, entry: AuditEntry) {
        let is_same = |stream: &&mut Stream| {
            let last = &stream.last;
            (last.device, last.address, last.who) == (entry.device, entry.address, entry.who)
        };
        if let Some(stream) = self.streams.iter_mut().find(is_same) {
            stream.last = entry;
            stream.set_points += 1;
            return;
        }
        if self.streams.len() == MAX_STREAMS {
            let silent = self.streams.iter().enumerate().min_by_key(|(_, stream)| stream.last.at);
            if let Some(stream) = silent.map(|(position, _)| position).map(|p| self.streams.swap_remove(p)) {
                self.keep(stream.end());
            }
        }
        self.keep(AuditEntry { what: What::StreamStart, ..entry });
        self.streams.push(Stream { last: entry, since: entry.at, set_points: 1 });
        self.deadline = self.deadline.or(Some(entry.at + GAP));
    }

    /// Ends the streams that are silent at `now`.
    pub(super) fn handle_timeout(&mut self, now: Instant) {
        if self.deadline.is_none_or(|deadline| deadline > now) {
            return;
        }
        let mut next = 0;
        while let Some(stream) = self.streams.get(next) {
            if stream.last.at + GAP <= now {
                let stream = self.streams.remove(next);
                self.keep(stream.end());
            } else {
                next += 1;
            }
        }
        self.deadline = self.streams.iter().map(|stream| stream.last.at + GAP).min();
    }

    /// Learns what says what the device at this position does, of this profile.
    pub(super) fn join(&mut self, device: usize, profile: &Profile) {
        let Some(known) = &mut self.modes else { return };
        if known.len() <= device {
            known.resize_with(device + 1, Vec::new);
        }
        known.get_mut(device).into_iter().for_each(|known| *known = modes(profile));
    }

    /// Ends the streams of a device that is about to leave.
    fn end_streams(&mut self, device: usize) {
        while let Some(position) = self.streams.iter().position(|stream| stream.last.device == device) {
            let stream = self.streams.swap_remove(position);
            self.keep(stream.end());
        }
    }

    fn keep(&mut self, entry: AuditEntry) {
        if self.entries.len() < MAX_WAITING {
            self.entries.push_back(entry);
        } else {
            self.lost += 1;
        }
    }
}

impl Stream {
    fn end(&self) -> AuditEntry {
        let lasted = self.last.at.saturating_since(self.since);
        AuditEntry { what: What::StreamEnd { set_points: self.set_points, lasted }, ..self.last }
    }
}

impl Core {
    /// Makes the core tell what is to be kept of who commanded what, by [`Core::poll_audit`].
    pub fn keep_audit(&mut self) {
        self.audit.modes = Some(Vec::new());
        self.units.iter().for_each(|(device, unit)| self.audit.join(device, unit.device.profile()));
    }

    /// Ends what streams of set-points a device was given, so that all there is to be kept of it can be taken before it
    /// leaves.
    pub fn conclude_audit(&mut self, device: usize) {
        self.audit.end_streams(device);
    }

    /// The next entry to be kept.
    pub fn poll_audit(&mut self) -> Option<AuditEntry> {
        self.audit.entries.pop_front()
    }

    /// Entries that were lost because nobody took them.
    #[must_use]
    pub fn lost_audit(&self) -> u64 {
        self.audit.lost
    }
}

/// What says what a device does and not where to.
const MODES: [Binding; 4] =
    [Binding::Controlword, Binding::ModesOfOperation, Binding::JvlCommand, Binding::JvlFastMac];
/// The same among the registers of a motor and its module.
const MODE_REGISTERS: [Role; 3] = [Role::ModeReg, Role::Command, Role::ModuleCommand];

/// Where a device has them.
fn modes(profile: &Profile) -> Vec<Slot> {
    let bound = MODES.into_iter().flat_map(|binding| profile.bound_to(binding));
    let objects = bound.filter_map(|address| profile.application.slot(address));
    objects.chain(MODE_REGISTERS.into_iter().filter_map(|role| profile.registers.slot(role))).collect()
}
