//! The sockets of Modbus clients, served by the core thread itself.
//!
//! Readiness is asked for once for all sockets, by an epoll descriptor among those that the core thread sleeps on. Those
//! that are ready wait in a queue; of each one request is served in turn ([`Sockets::serve_next`]), and the core
//! thread looks at its other duties after each.

mod change;
mod listen;
mod setup;

use core::time::Duration;
use std::collections::VecDeque;
use std::io::{self, ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::os::fd::{AsFd, BorrowedFd};

use config::Network;
use nix::sys::epoll::{Epoll, EpollCreateFlags, EpollEvent, EpollFlags, EpollTimeout};
use od::Instant;

use crate::core::{Admission, ClientId, Core};

pub(crate) use change::Change;
use listen::listen;
pub(crate) use setup::{bind, dialect, introduce, listen_all, owner, plan, view};

/// Events that are taken at once.
const EVENTS: usize = 64;
/// Bytes that are read at once: more requests than a client has under way.
const CHUNK: usize = 2048;
/// When a listener is tried again that could not let a client in, for want of descriptors.
const RETRY_ACCEPT: Duration = Duration::from_millis(500);
/// What the client of a connection is watched for: what changes is told once.
const WATCHED: EpollFlags =
    EpollFlags::EPOLLIN.union(EpollFlags::EPOLLOUT).union(ENDED).union(EpollFlags::EPOLLET);
/// That it sends no more.
const ENDED: EpollFlags = EpollFlags::EPOLLRDHUP.union(EpollFlags::EPOLLHUP).union(EpollFlags::EPOLLERR);
/// The highest bit of an event's number tells a listener from a client.
const IS_LISTENER: u64 = 1 << 63;

/// Addresses on which clients are served alike, listened on.
#[derive(Debug, Default)]
pub(crate) struct Listening {
    /// Each with its address in the configuration.
    pub(crate) listeners: Vec<(SocketAddr, TcpListener)>,
    pub(crate) allow: Vec<Network>,
    pub(crate) read_only: Vec<Network>,
}

impl Listening {
    /// What a client may do that comes from `peer`.
    fn admission(&self, peer: SocketAddr) -> Admission {
        let is_in = |networks: &[Network]| networks.iter().any(|network| network.contains(peer.ip()));
        match (self.allow.is_empty() || is_in(&self.allow), is_in(&self.read_only)) {
            (false, _) => Admission::Refused,
            (true, true) => Admission::Reads,
            (true, false) => Admission::Full,
        }
    }
}

#[derive(Debug)]
struct Socket {
    listener: TcpListener,
    /// Its address in the configuration.
    address: SocketAddr,
    /// Its number in the core.
    number: usize,
    /// When it is listened on again.
    retry: Option<Instant>,
}

#[derive(Debug)]
struct Connection {
    stream: TcpStream,
    is_queued: bool,
    /// There may be something to read.
    is_readable: bool,
    /// The client sends no more, so that nothing more is told of it.
    is_ended: bool,
    /// Waits for the client to take its answers.
    is_blocked: bool,
}

impl Connection {
    fn note(&mut self, flags: EpollFlags) {
        self.is_ended |= flags.intersects(ENDED);
        self.is_readable |= self.is_ended || flags.contains(EpollFlags::EPOLLIN);
    }
}

/// See the module's documentation.
#[derive(Debug)]
pub(crate) struct Sockets {
    epoll: Epoll,
    listening: Vec<Listening>,
    /// For each of the core's listeners, its addresses.
    addresses: Vec<Vec<String>>,
    /// By their numbers among the events; a place is free when its socket has gone.
    sockets: Vec<Option<Socket>>,
    /// By the numbers of the clients.
    connections: Vec<Option<Connection>>,
    ready: VecDeque<ClientId>,
    chunk: Vec<u8>,
}

/// What reading or writing led to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Outcome {
    Done,
    /// The other side has to do something first.
    Blocked,
    Over,
}

impl Sockets {
    /// The sockets of all listeners, in the order of the core's.
    ///
    /// # Errors
    /// The operating system has no descriptors left.
    pub(crate) fn new(mut listening: Vec<Listening>) -> io::Result<Self> {
        let epoll = Epoll::new(EpollCreateFlags::EPOLL_CLOEXEC)?;
        let mut sockets = Vec::new();
        for (number, own) in listening.iter_mut().enumerate() {
            for (address, listener) in own.listeners.drain(..) {
                let event = EpollEvent::new(EpollFlags::EPOLLIN, IS_LISTENER | sockets.len() as u64);
                epoll.add(&listener, event)?;
                sockets.push(Some(Socket { listener, address, number, retry: None }));
            }
        }
        let (addresses, connections, ready) = (Vec::new(), Vec::new(), VecDeque::new());
        let mut sockets =
            Self { epoll, listening, addresses, sockets, connections, ready, chunk: vec![0; CHUNK] };
        sockets.note_addresses();
        Ok(sockets)
    }

    /// What becomes readable when [`Sockets::take_events`] has something to take.
    pub(crate) fn fd(&self) -> BorrowedFd<'_> {
        self.epoll.0.as_fd()
    }

    /// When a listener is to be tried again.
    pub(crate) fn poll_timeout(&self) -> Option<Instant> {
        self.sockets.iter().flatten().filter_map(|socket| socket.retry).min()
    }

    /// For each of the core's listeners, its addresses.
    pub(crate) fn addresses(&self) -> &[Vec<String>] {
        &self.addresses
    }

    /// Whether a client waits to be served.
    pub(crate) fn has_ready(&self) -> bool {
        !self.ready.is_empty()
    }

    /// How many clients wait to be served.
    pub(crate) fn ready(&self) -> usize {
        self.ready.len()
    }

    /// Lets clients in, and queues those that are ready.
    pub(crate) fn take_events(&mut self, now: Instant, core: &mut Core) {
        let mut events = [EpollEvent::empty(); EVENTS];
        // An interrupted look is made again.
        let count = self.epoll.wait(&mut events, EpollTimeout::ZERO).unwrap_or(0);
        for event in events.iter().take(count) {
            match event.data() {
                listener if listener & IS_LISTENER != 0 => {
                    self.accept(now, core, (listener & !IS_LISTENER) as usize);
                }
                client => {
                    let client = ClientId(client as u16);
                    self.connection(client)
                        .into_iter()
                        .for_each(|connection| connection.note(event.events()));
                    self.queue(client);
                }
            }
        }
    }

    /// Tries listeners again, and closes connections that the core has given up.
    pub(crate) fn handle_timeout(&mut self, now: Instant, core: &mut Core) {
        for position in 0..self.sockets.len() {
            let Some(Some(socket)) = self.sockets.get_mut(position) else { continue };
            if socket.retry.is_some_and(|retry| retry <= now) {
                socket.retry = None;
                let event = EpollEvent::new(EpollFlags::EPOLLIN, IS_LISTENER | position as u64);
                if self.epoll.add(&socket.listener, event).is_err() {
                    socket.retry = Some(now + RETRY_ACCEPT);
                }
            }
        }
        while let Some(client) = core.poll_closed() {
            self.flush(core, client);
            self.close(core, client);
        }
    }

    /// Serves one request of the client that has waited longest, and queues it again if it has asked for more.
    pub(crate) fn serve_next(&mut self, now: Instant, core: &mut Core) {
        let Some(client) = self.ready.pop_front() else { return };
        let Some(connection) = self.connection(client) else { return };
        connection.is_queued = false;
        if connection.is_blocked && self.flush(core, client) != Outcome::Done {
            return;
        }
        if !core.has_request(client) && self.read(now, core, client) == Outcome::Over {
            return self.close(core, client);
        }
        core.serve(now, client);
        let outcome = self.flush(core, client);
        if outcome == Outcome::Over {
            return;
        }
        let is_readable = self.connection(client).is_some_and(|connection| connection.is_readable);
        let has_more = is_readable || core.has_request(client);
        if core.is_closing(client) {
            self.close(core, client);
        } else if has_more && outcome == Outcome::Done {
            self.queue(client);
        }
    }

    fn connection(&mut self, client: ClientId) -> Option<&mut Connection> {
        self.connections.get_mut(usize::from(client.0))?.as_mut()
    }

    fn queue(&mut self, client: ClientId) {
        if let Some(connection) = self.connection(client)
            && !core::mem::replace(&mut connection.is_queued, true)
        {
            self.ready.push_back(client);
        }
    }

    /// Lets one client in; others that wait make the socket ready again.
    fn accept(&mut self, now: Instant, core: &mut Core, position: usize) {
        let Some(Some(socket)) = self.sockets.get_mut(position) else { return };
        let number = socket.number;
        match socket.listener.accept() {
            Ok((stream, peer)) => self.admit(now, core, number, stream, peer),
            // There is none any more.
            Err(error) if is_temporary(&error) || error.kind() == ErrorKind::ConnectionAborted => {}
            Err(_) => {
                // Otherwise the core thread would be woken by it again and again.
                let _ = self.epoll.delete(&socket.listener);
                socket.retry = Some(now + RETRY_ACCEPT);
            }
        }
    }

    /// Lets a client in, if it may connect and has a place. One that has not is closed by being dropped.
    fn admit(&mut self, now: Instant, core: &mut Core, number: usize, stream: TcpStream, peer: SocketAddr) {
        let admission = self.listening.get(number).map_or(Admission::Refused, |own| own.admission(peer));
        if admission == Admission::Refused {
            core.turn_away(number);
            return;
        }
        let reads_only = admission == Admission::Reads;
        if listen::prepare(&stream).is_err() {
            return;
        }
        let Ok(client) = core.connect(now, number, peer, reads_only) else { return };
        // Its place may be that of the client whom it replaces.
        self.handle_timeout(now, core);
        let event = EpollEvent::new(WATCHED, client.0.into());
        if self.epoll.add(&stream, event).is_err() {
            core.disconnect(client);
            return;
        }
        let place = usize::from(client.0);
        if self.connections.len() <= place {
            self.connections.resize_with(place + 1, || None);
        }
        if let Some(connection) = self.connections.get_mut(place) {
            *connection = Some(Connection {
                stream,
                is_queued: false,
                is_readable: false,
                is_ended: false,
                is_blocked: false,
            });
        }
    }

    fn read(&mut self, now: Instant, core: &mut Core, client: ClientId) -> Outcome {
        let Self { connections, chunk, .. } = self;
        let Some(Some(connection)) = connections.get_mut(usize::from(client.0)) else { return Outcome::Over };
        if !connection.is_readable {
            return Outcome::Blocked;
        }
        let room = core.room(client).min(CHUNK);
        match connection.stream.read(chunk.get_mut(..room).unwrap_or_default()) {
            Ok(0) if room > 0 => Outcome::Over,
            Ok(length) => {
                // What did not fill the room was all.
                connection.is_readable = connection.is_ended || length == room;
                core.receive(now, client, chunk.get(..length).unwrap_or_default());
                Outcome::Done
            }
            Err(error) if is_temporary(&error) => {
                connection.is_readable = error.kind() == ErrorKind::Interrupted;
                Outcome::Blocked
            }
            Err(_) => Outcome::Over,
        }
    }

    /// Sends what a client is to be told. One that does not take it is read from no more until it does; a connection
    /// that is over is closed.
    fn flush(&mut self, core: &mut Core, client: ClientId) -> Outcome {
        let Some(connection) = self.connection(client) else { return Outcome::Over };
        let outcome = loop {
            let output = core.output(client);
            if output.is_empty() {
                break Outcome::Done;
            }
            match connection.stream.write(output) {
                Ok(length) => core.sent(client, length),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) if error.kind() == ErrorKind::WouldBlock => break Outcome::Blocked,
                Err(_) => break Outcome::Over,
            }
        };
        connection.is_blocked = outcome == Outcome::Blocked;
        if outcome == Outcome::Over {
            self.close(core, client);
        }
        outcome
    }

    /// Closing a descriptor takes it out of the epoll descriptor, too.
    fn close(&mut self, core: &mut Core, client: ClientId) {
        if let Some(connection) = self.connections.get_mut(usize::from(client.0)) {
            *connection = None;
        }
        self.ready.retain(|waiting| *waiting != client);
        core.disconnect(client);
    }
}

fn is_temporary(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted)
}
