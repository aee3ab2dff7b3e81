//! Links: how the frames of a bus leave the process, and who beside our nodes hears them.

mod filters;
mod gauge;
mod kinds;
mod load;
mod queue;
mod socketcan;
mod stopwatch;
mod tap;
mod wire_format;

use std::sync::Arc;

use canopen::Frame;
use od::Instant;
use tokio::sync::broadcast;

use crate::core::LinkId;
use crate::socketcand::Passed;

pub(crate) use gauge::{Gauge, measure};
pub(crate) use kinds::Kinds;
pub(crate) use load::Load;
pub(crate) use queue::Kind;
pub(crate) use socketcan::{LONGEST_BLOCK, Patience, Received, SocketCan};
pub use tap::Tap;
pub(crate) use tap::{Record, Watch, tap};

/// A bus of this gateway.
#[derive(Debug)]
pub(crate) struct Link {
    /// Its number.
    pub(crate) id: LinkId,
    /// Where it stands among the buses of the configuration.
    pub(crate) place: usize,
    /// Name of the bus.
    pub(crate) name: String,
    /// The interface, unless the bus is virtual.
    pub(crate) interface: Option<SocketCan>,
    /// Clients of socketcand and the ASCII gateway, if the bus has either.
    pub(crate) clients: Option<broadcast::Sender<Passed>>,
    /// It has socketcand, whose clients hear every frame at any time.
    has_socketcand: bool,
    /// The ASCII gateway has clients, who hear every frame.
    is_heard: bool,
    /// Frames from outside.
    pub(crate) received: u64,
    /// Frames of our nodes.
    pub(crate) sent: u64,
    /// How busy a virtual bus is; an interface has its own gauge.
    pub(crate) load: Load,
    /// Who watches it.
    pub(crate) taps: Vec<Tap>,
    /// Frames from outside by kind, then those of our nodes.
    pub(crate) kinds: [Kinds; 2],
}

impl Link {
    /// A bus that nobody has sent anything on, with its number.
    pub(crate) fn new(id: LinkId, name: &str, interface: Option<SocketCan>) -> Self {
        let (name, load, taps) = (name.to_owned(), Load::default(), Vec::new());
        let (place, clients, kinds) = (usize::from(id.0), None, Default::default());
        let (has_socketcand, is_heard) = (false, false);
        Self {
            id,
            place,
            name,
            interface,
            clients,
            has_socketcand,
            is_heard,
            received: 0,
            sent: 0,
            load,
            taps,
            kinds,
        }
    }

    /// What is at the number of a bus that has gone, until another one gets it.
    pub(crate) fn gone(id: LinkId) -> Self {
        Self::new(id, "", None)
    }

    /// Whether there is a bus; every one has a name.
    pub(crate) fn is_there(&self) -> bool {
        !self.name.is_empty()
    }

    /// The interface and what measures how busy it is, unless the bus is virtual.
    pub(crate) fn gauge(&self) -> Option<(String, Arc<Gauge>)> {
        let interface = self.interface.as_ref()?;
        Some((interface.interface().to_owned(), Arc::clone(interface.gauge())))
    }

    /// Lets clients hear it, or none; an interface is then listened to accordingly with the next subscription.
    pub(crate) fn set_clients(&mut self, clients: Option<broadcast::Sender<Passed>>, has_socketcand: bool) {
        (self.clients, self.has_socketcand) = (clients, has_socketcand);
        self.set_heard(self.is_heard);
    }

    /// Takes note that the ASCII gateway has clients, or none any more. Whether an interface is to be listened to otherwise,
    /// which it is with the next subscription.
    pub(crate) fn set_heard(&mut self, is_heard: bool) -> bool {
        self.is_heard = is_heard;
        let hears_all = self.clients.is_some() && (self.has_socketcand || is_heard);
        self.interface.as_mut().is_some_and(|interface| interface.set_hears_all(hears_all))
    }

    /// Sends a frame of one of our nodes to everybody outside.
    pub(crate) fn send(&mut self, at: Instant, frame: &Frame, kind: Kind) {
        self.sent += 1;
        let [_, sent] = &mut self.kinds;
        sent.count(frame);
        if let Some(interface) = &mut self.interface {
            interface.queue(frame, kind);
        }
        self.show(at, None, frame, true);
    }

    /// Sends a frame of a client on to everybody outside but that client.
    pub(crate) fn pass_on(&mut self, at: Instant, client: u64, frame: &Frame) {
        self.received += 1;
        let [received, _] = &mut self.kinds;
        received.count(frame);
        if let Some(interface) = &mut self.interface {
            interface.queue(frame, Kind::Foreign);
        }
        self.show(at, Some(client), frame, false);
    }

    /// Whether the interface has no room, so that it matters what a frame is.
    pub(crate) fn is_stuck(&self) -> bool {
        self.interface.as_ref().is_some_and(|interface| interface.waiting().is_stuck())
    }

    /// Whether so many frames are to be sent that the interface must have some before there is room for more.
    pub(crate) fn is_full(&self) -> bool {
        let waiting = self.interface.as_ref().map(SocketCan::waiting);
        waiting.is_some_and(|waiting| waiting.is_full() && !waiting.is_stuck())
    }

    /// Takes note of a frame from the interface.
    pub(crate) fn receive(&mut self, at: Instant, frame: &Frame) {
        self.received += 1;
        let [received, _] = &mut self.kinds;
        received.count(frame);
        self.show(at, None, frame, false);
    }

    /// Lets clients and watchers hear a frame that is on the bus.
    fn show(&mut self, at: Instant, sender: Option<u64>, frame: &Frame, is_ours: bool) {
        if self.interface.is_none() {
            self.load.count(at, frame);
        }
        if let Some(clients) = self.clients.as_ref().filter(|clients| clients.receiver_count() > 0) {
            // Without receivers nobody misses it.
            let _ = clients.send(Passed { at, sender, frame: *frame });
        }
        if !self.taps.is_empty() {
            let link = self.id;
            self.taps.retain(|tap| tap.put(Record::Frame { at, link, is_ours, frame: *frame }));
        }
    }
}

/// The buses that there are, with their positions among `links`, in the order of the configuration.
pub(crate) fn in_order(links: &[Link]) -> impl Iterator<Item = (usize, &Link)> {
    let mut there: Vec<(usize, &Link)> =
        links.iter().enumerate().filter(|(_, link)| link.is_there()).collect();
    there.sort_by_key(|(_, link)| link.place);
    there.into_iter()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn buses_are_listed_by_their_places_whichever_numbers_they_have() {
        let mut links = ["b", "", "c", "a"].map(|name| Link::new(LinkId(0), name, None));
        for (link, place) in links.iter_mut().zip([1, 0, 2, 0]) {
            link.place = place;
        }
        let listed: Vec<_> = in_order(&links).map(|(position, link)| (position, &*link.name)).collect();
        assert_eq!(listed, [(3, "a"), (0, "b"), (2, "c")]);
    }

    #[test]
    fn an_interface_is_heard_for_clients_of_the_gateway_while_there_are_some_and_always_for_socketcand() {
        let interface = SocketCan::new("none", false, Instant::ZERO);
        let mut link = Link::new(LinkId(0), "can0", Some(interface));
        assert!(!link.set_heard(true), "nobody can hear it");
        link.set_heard(false);
        link.set_clients(Some(broadcast::Sender::new(1)), false);
        let changes = [true, true, false, false, true].map(|is_heard| link.set_heard(is_heard));
        assert_eq!(changes, [true, false, true, false, true]);
        link.set_clients(Some(broadcast::Sender::new(1)), true);
        assert!([false, true].map(|is_heard| link.set_heard(is_heard)) == [false; 2], "it is heard anyway");
        link.set_clients(None, false);
        assert!(!link.set_heard(false));
    }
}
