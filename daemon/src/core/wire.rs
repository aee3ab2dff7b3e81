//! Frames on their way to our nodes, and who has sent them.

use core::time::Duration;
use std::collections::VecDeque;

use canopen::{Frame, Id, Router};
use od::Instant;

use super::unit::Member;
use super::{Core, Hearer, LinkId, Peer};

/// Frames that may pass the wires in one wake-up, and how long the rest then waits: more than the fastest classic
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
#[derive(Debug)]
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
        for _ in 0..MAX_PASSING {
            let Some(passing) = self.wire.pop_front() else { return };
            self.deliver(now, &passing);
        }
        self.resume = (!self.wire.is_empty()).then(|| now + PAUSE);
    }

    fn deliver(&mut self, now: Instant, passing: &Passing) {
        let mut hearers = core::mem::take(&mut self.hearers);
        hearers.clear();
        hearers.extend(others(&self.routers, passing.link, passing.frame.id, passing.sender));
        self.note_network(now, passing, &hearers);
        let peer = core::mem::replace(&mut self.audit.peer, passing.sender.peer());
        for hearer in &hearers {
            self.hear(now, usize::from(*hearer), &passing.frame);
        }
        self.audit.peer = peer;
        for hearer in &hearers {
            if let Some(Hearer { unit, .. }) = self.members.get(usize::from(*hearer)).copied() {
                self.speak(now, unit);
            }
        }
        self.hearers = hearers;
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
