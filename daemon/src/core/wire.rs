//! Frames on their way to our nodes, and who has sent them.

use std::collections::VecDeque;

use canopen::{Frame, Id, Router};

use super::{LinkId, MAX_PASSING, Peer};

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
pub(super) fn others(routers: &[Router], link: LinkId, id: Id, sender: Sender) -> impl Iterator<Item = u16> {
    let receivers = routers.get(usize::from(link.0)).map_or(&[][..], |router| router.receivers(id));
    receivers.iter().copied().filter(move |receiver| Sender::Member(*receiver) != sender)
}
