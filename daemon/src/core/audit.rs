//! What is to be kept of who commanded what: every acyclic command, and of cyclic data what changes in controlword and mode
//! and where a stream of set-points begins and ends; commands that were refused; orders of the networks' masters and of
//! operators.
//!
//! The trail beside it ([`super::trail`]) knows the last commands of each device; from here they go to whoever keeps them
//! for good. What others could let it grow by without end is told when it begins and when it is over ([`runs`]).

mod orders;
mod runs;

use core::time::Duration;
use std::collections::VecDeque;

use canopen::NetworkOrder;
use od::{AbortCode, Address, Commanded, Instant, Owner, Slot};
use profiles::{Binding, PlantFault, Profile, Repair, Role, Signal};

use super::trail::{Peer, Who};
use super::{Core, LinkId};
use crate::motion::Goal;
use runs::Runs;

/// Entries that may wait; more are lost, and counted.
const MAX_WAITING: usize = 1024;

/// Something to be kept.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AuditEntry {
    /// When it happened; the last time, if it happened again and again.
    pub at: Instant,
    /// Position of the device, if it is about a single one of ours.
    pub device: Option<usize>,
    /// Who did it.
    pub who: Who,
    /// By which connection it came, if it came by one and was no cyclic data.
    pub peer: Option<Peer>,
    /// What it is.
    pub what: What,
    /// How often it happened since it was first told, if this ends a row of equal entries.
    pub again: Option<Again>,
}

/// What happens again and again, and was told when it began.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Again {
    /// How often: all set-points of a stream; how often more of everything else.
    pub times: u64,
    /// From the first to the last.
    pub lasted: Duration,
}

/// An entry of a device, written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Item {
    /// The Node-ID that was written to, from CANopen.
    pub node_id: Option<u8>,
    /// The entry.
    pub address: Address,
    /// What was written; none if it was refused for its length.
    pub value: Option<i128>,
}

/// Kinds of entries. Axes have numbers from 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum What {
    /// An acyclic command.
    Write(Item),
    /// Cyclic data hold another controlword or mode than before.
    Change(Item),
    /// The first set-point of a stream.
    StreamStart(Item),
    /// The last set-point of a stream.
    StreamEnd(Item),
    /// An acyclic command that was refused, of a batch the item that was.
    Refused(Item, AbortCode),
    /// An NMT command that changes a node, or a configuration by LSS that one takes; from here, whoever takes it.
    Network(LinkId, NetworkOrder),
    /// An axis was given to this owner alone.
    Claim(usize, Owner),
    /// An axis was given back to whom the configuration names; `None` is everybody.
    Release(usize, Option<Owner>),
    /// Something was broken behind an axis.
    Inject(usize, PlantFault),
    /// Something was repaired there.
    Repair(usize, Repair),
    /// Something else comes to an axis from outside of its machine.
    Signal(usize, Signal),
    /// An operator has an axis moved, or stopped.
    Motion(usize, Goal),
}

/// See the module's documentation.
#[derive(Debug, Default)]
pub(super) struct Audit {
    /// For each device the entries that say what it does and not where to; none while nothing is kept.
    modes: Option<Vec<Vec<Slot>>>,
    /// Who is at the other end of the connection that what happens now comes by.
    pub(super) peer: Option<Peer>,
    entries: VecDeque<AuditEntry>,
    /// Streams of set-points.
    streams: Runs,
    /// What is refused or ordered.
    repeats: Runs,
    /// Not after the first end of a stream or a row of equal entries.
    pub(super) deadline: Option<Instant>,
    lost: u64,
}

impl Audit {
    /// Whether anybody keeps it.
    pub(super) fn is_kept(&self) -> bool {
        self.modes.is_some()
    }

    /// Takes note of a command to `device`, which was written to `item`.
    pub(super) fn note_command(
        &mut self,
        (at, who, device): (Instant, Who, usize),
        commanded: &Commanded,
        item: Item,
    ) {
        let Some(modes) = &self.modes else { return };
        let is_mode = modes.get(device).is_some_and(|modes| modes.contains(&commanded.slot));
        let entry = |what| AuditEntry { at, device: Some(device), who, peer: None, what, again: None };
        match (commanded.is_cyclic, is_mode) {
            (false, _) => self.keep(AuditEntry { peer: self.peer, ..entry(What::Write(item)) }),
            (true, true) if commanded.has_changed => self.keep(entry(What::Change(item))),
            (true, true) => {}
            (true, false) => self.stream(entry(What::StreamStart(item)), item),
        }
    }

    /// Takes note of what others may do again and again.
    pub(super) fn note(&mut self, entry: AuditEntry) {
        if self.modes.is_none() || self.repeats.goes_on(entry) {
            return;
        }
        if self.repeats.begin(entry) {
            self.keep(entry);
            self.wake(entry.at);
        } else {
            self.lost += 1;
        }
    }

    fn stream(&mut self, first: AuditEntry, item: Item) {
        let last = AuditEntry { what: What::StreamEnd(item), ..first };
        if self.streams.goes_on(last) {
            return;
        }
        if !self.streams.begin(last) {
            // The one that was silent longest counts as over.
            if let Some(stream) = self.streams.take_silent() {
                self.keep(stream.all());
            }
            self.streams.begin(last);
        }
        self.keep(first);
        self.wake(first.at);
    }

    /// Ends what is silent at `now`.
    pub(super) fn handle_timeout(&mut self, now: Instant) {
        if self.deadline.is_none_or(|deadline| deadline > now) {
            return;
        }
        while let Some(stream) = self.streams.take_over(now) {
            self.keep(stream.all());
        }
        while let Some(row) = self.repeats.take_over(now) {
            row.more().into_iter().for_each(|entry| self.keep(entry));
        }
        self.deadline =
            [self.streams.poll_timeout(), self.repeats.poll_timeout()].into_iter().flatten().min();
    }

    /// Makes sure that what began at `now` is ended.
    fn wake(&mut self, now: Instant) {
        self.deadline = self.deadline.or(Some(now + runs::GAP));
    }

    /// Learns what says what the device at this position does, of this profile.
    pub(super) fn join(&mut self, device: usize, profile: &Profile) {
        let Some(known) = &mut self.modes else { return };
        if known.len() <= device {
            known.resize_with(device + 1, Vec::new);
        }
        known.get_mut(device).into_iter().for_each(|known| *known = modes(profile));
    }

    /// Ends what goes on of a device that is about to leave.
    fn conclude(&mut self, device: usize) {
        while let Some(stream) = self.streams.take_of(device) {
            self.keep(stream.all());
        }
        while let Some(row) = self.repeats.take_of(device) {
            row.more().into_iter().for_each(|entry| self.keep(entry));
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

impl Core {
    /// Makes the core tell what is to be kept of who commanded what, by [`Core::poll_audit`].
    pub fn keep_audit(&mut self) {
        self.audit.modes = Some(Vec::new());
        self.units.iter().for_each(|(device, unit)| self.audit.join(device, unit.device.profile()));
    }

    /// Whatever somebody on this machine does from now on comes by a connection to `peer`, until that is somebody else or
    /// nobody.
    pub fn act_for(&mut self, peer: Option<Peer>) {
        self.audit.peer = peer;
    }

    /// Ends what streams of set-points a device was given and what it refused again and again, so that all there is to be
    /// kept of it can be taken before it leaves.
    pub fn conclude_audit(&mut self, device: usize) {
        self.audit.conclude(device);
    }

    /// The next entry to be kept.
    pub fn poll_audit(&mut self) -> Option<AuditEntry> {
        self.audit.entries.pop_front()
    }

    /// Entries that were lost because nobody took them, or because there were too many kinds of them at a time.
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
