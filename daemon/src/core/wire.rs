//! The wires: frames on their way to our nodes, from the bus and from each other, and who has sent them.

use core::time::Duration;
use std::collections::VecDeque;

use canopen::{Frame, Id, Router};
use od::Instant;

use super::reset::{self, Resetting, resets_all};
use super::unit::Member;
use super::{Core, Hearer, LinkId, Peer, SOON};

/// Frames that pass the wires before everything else that is due has its turn again.
const PASSING_AT_ONCE: usize = 16;
/// Frames that may pass the wires on end, and how long the rest then waits: more than the fastest classic
/// CAN bus carries, so only nodes that answer each other without end ever meet it.
pub(super) const MAX_PASSING: usize = 1024;
const PAUSE: Duration = Duration::from_millis(20);
/// Frames that may wait to pass the wires.
const MAX_ON_WIRE: usize = 8 * MAX_PASSING;

/// Who has sent a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sender {
    /// Somebody on the bus.
    Bus,
    /// A client of socketcand, who is as good as on the bus.
    Client(Peer),
    /// A client of the ASCII gateway, who has it sent by us.
    Gateway(Option<Peer>),
    /// An operator on this machine.
    Operator(Option<Peer>),
    /// One of our nodes, by its number in the routers.
    Member(u16),
}

impl Sender {
    /// By which connection it came, if it came by one.
    pub(super) fn peer(self) -> Option<Peer> {
        match self {
            Self::Client(peer) => Some(peer),
            Self::Gateway(peer) | Self::Operator(peer) => peer,
            Self::Bus | Self::Member(_) => None,
        }
    }
}

/// A frame on its way to our nodes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Passing {
    pub(super) link: LinkId,
    pub(super) sender: Sender,
    pub(super) frame: Frame,
}

impl Core {
    /// Lets what is on the wires reach our nodes, and what they answer to it.
    pub(super) fn pass(&mut self, now: Instant) {
        if self.resume.is_some_and(|resume| now < resume) {
            return;
        }
        self.resume = None;
        for _ in 0..PASSING_AT_ONCE {
            if self.resetting.is_some() {
                return self.reset_some(now);
            }
            let Some(passing) = self.wire.pop_front() else { break };
            self.deliver(now, &passing);
            self.passed += 1;
        }
        if self.wire.is_empty() && self.resetting.is_none() {
            self.passed = 0;
            return;
        }
        let pause = if self.passed < MAX_PASSING { SOON } else { PAUSE };
        self.passed %= MAX_PASSING;
        self.resume = Some(now + pause);
    }

    fn deliver(&mut self, now: Instant, passing: &Passing) {
        let mut hearers = core::mem::take(&mut self.hearers);
        hearers.clear();
        hearers.extend(others(&self.routers, passing.link, passing.frame.id, passing.sender));
        self.note_network(now, passing, &hearers);
        if hearers.len() > reset::AT_ONCE && resets_all(&passing.frame) {
            let hearers = hearers.iter().copied().collect();
            self.resetting = Some(Resetting { passing: *passing, hearers });
        } else {
            let peer = core::mem::replace(&mut self.audit.peer, passing.sender.peer());
            for hearer in &hearers {
                self.hear(now, usize::from(*hearer), &passing.frame);
            }
            self.audit.peer = peer;
            hearers.iter().for_each(|hearer| self.speak_for(now, *hearer));
        }
        self.hearers = hearers;
    }

    /// Queues what a node and its device have to say, now that it has heard something.
    pub(super) fn speak_for(&mut self, now: Instant, hearer: u16) {
        if let Some(Hearer { unit, .. }) = self.members.get(usize::from(hearer)).copied() {
            self.speak(now, unit);
        }
    }

    /// Queues what the nodes of a device have to send.
    pub(super) fn send(&mut self, unit: usize) {
        let Self { units, routers, outbox, wire, dropped_on_wire, .. } = self;
        for Member { node, number, link, .. } in units.get_mut(unit).into_iter().flat_map(|u| &mut u.members)
        {
            let (link, sender) = (*link, Sender::Member(*number));
            while let Some(frame) = node.poll_transmit() {
                outbox.push_back((link, frame));
                if others(routers, link, frame.id, sender).next().is_some() {
                    put_on_wire(wire, dropped_on_wire, Passing { link, sender, frame });
                }
            }
        }
    }
}

/// Lets a frame pass the wire of its link, if there is room.
pub(super) fn put_on_wire(wire: &mut VecDeque<Passing>, dropped: &mut [u64], passing: Passing) {
    if wire.len() < MAX_ON_WIRE {
        wire.push_back(passing);
    } else {
        let dropped = dropped.get_mut(usize::from(passing.link.0));
        dropped.into_iter().for_each(|dropped| *dropped += 1);
    }
}

/// The nodes on `link` beside the sender that hear `id`.
fn others(routers: &[Router], link: LinkId, id: Id, sender: Sender) -> impl Iterator<Item = u16> {
    let receivers = routers.get(usize::from(link.0)).map_or(&[][..], |router| router.receivers(id));
    receivers.iter().copied().filter(move |receiver| Sender::Member(*receiver) != sender)
}
