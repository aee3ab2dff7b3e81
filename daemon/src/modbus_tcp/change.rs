//! Listeners that come, go and change while clients are served.

use std::net::{SocketAddr, TcpListener};

use nix::sys::epoll::{EpollEvent, EpollFlags};
use od::Instant;

use super::{IS_LISTENER, Listening, RETRY_ACCEPT, Socket, Sockets};
use crate::core::{Admission, Core, ListenerPlan};

/// What a listener is to be from now on, by its number.
#[derive(Debug)]
pub(crate) struct Change {
    pub(crate) number: usize,
    pub(crate) plan: ListenerPlan,
    /// Where clients connect; nowhere any more if it goes.
    pub(crate) listen: Vec<SocketAddr>,
    /// Who may connect, and the sockets of addresses that no listener has had before.
    pub(crate) listening: Listening,
}

impl Sockets {
    /// Makes the changes, in the order of their numbers. A socket that another listener takes over stays open. Those of no
    /// listener any more are to be closed elsewhere: whoever waits there to be let in is sent away by that, which takes its time.
    pub(crate) fn change(
        &mut self,
        now: Instant,
        core: &mut Core,
        mut changes: Vec<Change>,
    ) -> Vec<TcpListener> {
        let mut gone = Vec::new();
        for place in &mut self.sockets {
            let Some(socket) = place else { continue };
            match heir(socket, &changes) {
                Some(number) => socket.number = number,
                None => gone.extend(place.take().map(|socket| socket.listener)),
            }
        }
        // One that is no more listened on already is not in it.
        gone.iter().for_each(|listener| _ = self.epoll.delete(listener));
        for change in &mut changes {
            for (address, listener) in change.listening.listeners.drain(..) {
                self.listen(now, Socket::new(listener, address, change.number));
            }
        }
        for Change { number, plan, listen, listening } in changes {
            core.change_listener(number, plan, |peer| match listen.is_empty() {
                true => Admission::Refused,
                false => listening.admission(peer),
            });
            match self.listening.get_mut(number) {
                Some(known) => *known = listening,
                None => self.listening.push(listening),
            }
        }
        self.note_addresses();
        gone
    }

    /// Lets clients connect to one more socket.
    fn listen(&mut self, now: Instant, mut socket: Socket) {
        let free = self.sockets.iter().position(Option::is_none).unwrap_or(self.sockets.len());
        let event = EpollEvent::new(EpollFlags::EPOLLIN, IS_LISTENER | free as u64);
        if self.epoll.add(&socket.listener, event).is_err() {
            socket.retry = Some(now + RETRY_ACCEPT);
        }
        match self.sockets.get_mut(free) {
            Some(place) => *place = Some(socket),
            None => self.sockets.push(Some(socket)),
        }
    }

    /// Takes note of where the sockets of each listener are.
    pub(super) fn note_addresses(&mut self) {
        self.addresses = vec![Vec::new(); self.listening.len()];
        for Socket { listener, number, .. } in self.sockets.iter().flatten() {
            let shown = listener.local_addr().map_or_else(|error| error.to_string(), |own| own.to_string());
            self.addresses.get_mut(*number).into_iter().for_each(|addresses| addresses.push(shown.clone()));
        }
    }
}

/// The number of the listener that a socket is of after the changes, if of any.
fn heir(socket: &Socket, changes: &[Change]) -> Option<usize> {
    let wants = |change: &&Change| change.listen.contains(&socket.address);
    let Some(own) = changes.iter().find(|change| change.number == socket.number) else {
        return Some(socket.number);
    };
    if wants(&own) {
        return Some(own.number);
    }
    // Port 0 is one that is free, each time another.
    changes.iter().filter(|_| socket.address.port() != 0).find(wants).map(|change| change.number)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::net::TcpListener;

    fn socket(number: usize, address: &str) -> Socket {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        Socket::new(listener, address.parse().unwrap(), number)
    }

    fn change(number: usize, listen: &[&str]) -> Change {
        let listen = listen.iter().map(|address| address.parse().unwrap()).collect();
        Change { number, plan: ListenerPlan::default(), listen, listening: Listening::default() }
    }

    #[test]
    fn a_socket_stays_with_its_listener_goes_to_another_one_or_is_closed() {
        const PORT: &str = "127.0.0.1:502";
        const FREE: &str = "127.0.0.1:0";
        let keeps = [change(0, &[PORT, FREE])];
        assert_eq!(heir(&socket(0, PORT), &keeps), Some(0));
        assert_eq!(heir(&socket(0, FREE), &keeps), Some(0));
        assert_eq!(heir(&socket(1, PORT), &keeps), Some(1), "that listener does not change");
        let moves = [change(0, &["127.0.0.1:503"]), change(1, &[PORT, FREE])];
        assert_eq!(heir(&socket(0, PORT), &moves), Some(1));
        assert_eq!(heir(&socket(0, FREE), &moves), None, "it has a port of its own there");
        assert_eq!(heir(&socket(0, PORT), &[change(0, &[])]), None);
    }
}
