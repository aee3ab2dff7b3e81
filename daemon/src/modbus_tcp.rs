//! The sockets of Modbus clients, served by the core thread itself.
//!
//! Readiness is asked for once for all sockets, by an epoll descriptor among those that the core thread sleeps on. Those
//! that are ready wait in a queue. What is done for them is done in pieces ([`Sockets::serve_next`]), and the core thread looks
//! at its other duties after each: one request is served, or one client let in, or one connection closed.

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

use crate::alarm::Alarm;
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
/// The number of the alarm.
const ALARM: u64 = u64::MAX;

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
    is_queued: bool,
}

impl Socket {
    fn new(listener: TcpListener, address: SocketAddr, number: usize) -> Self {
        Self { listener, address, number, retry: None, is_queued: false }
    }
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

/// Who waits for a turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Waiting {
    /// A client for whatever it has sent.
    Client(ClientId),
    /// Clients who want to be let in where this socket listens.
    Listener(usize),
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
    ready: VecDeque<Waiting>,
    chunk: Vec<u8>,
    /// The alarm is among the events.
    hears_alarm: bool,
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
                sockets.push(Some(Socket::new(listener, address, number)));
            }
        }
        let (addresses, connections, ready) = (Vec::new(), Vec::new(), VecDeque::new());
        let (chunk, hears_alarm) = (vec![0; CHUNK], false);
        let mut sockets =
            Self { epoll, listening, addresses, sockets, connections, ready, chunk, hears_alarm };
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

    /// How many wait for [`Sockets::serve_next`].
    pub(crate) fn ready(&self, core: &Core) -> usize {
        core.closed() + self.ready.len()
    }

    /// Sleeps until something is ready, the alarm or a signal comes or `time_out` is over, of which whole milliseconds count,
    /// and queues what is ready.
    ///
    /// # Errors
    /// The operating system has no descriptors left.
    pub(crate) fn sleep(&mut self, alarm: &Alarm, time_out: Option<Duration>) -> io::Result<()> {
        if !self.hears_alarm {
            self.epoll.add(alarm.fd(), EpollEvent::new(EpollFlags::EPOLLIN, ALARM))?;
            self.hears_alarm = true;
        }
        let longest = |time_out| EpollTimeout::try_from(time_out).unwrap_or(EpollTimeout::MAX);
        if self.take(time_out.map_or(EpollTimeout::NONE, longest)) {
            alarm.silence();
        }
        Ok(())
    }

    /// Queues what is ready.
    pub(crate) fn take_events(&mut self) {
        // An alarm that rings now ends the next sleep.
        self.take(EpollTimeout::ZERO);
    }

    /// Queues what is ready within `time_out`; whether the alarm rings.
    fn take(&mut self, time_out: EpollTimeout) -> bool {
        let mut events = [EpollEvent::empty(); EVENTS];
        let mut rings = false;
        // An interrupted look is made again.
        let count = self.epoll.wait(&mut events, time_out).unwrap_or(0);
        for event in events.iter().take(count) {
            match event.data() {
                ALARM => rings = true,
                listener if listener & IS_LISTENER != 0 => {
                    self.queue_listener((listener & !IS_LISTENER) as usize);
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
        rings
    }

    /// Tries listeners again.
    pub(crate) fn handle_timeout(&mut self, now: Instant) {
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
    }

    /// Does the next piece of work: closes a connection that the core has given up, or lets a client in, or serves one request of
    /// the client that has waited longest. The core thread looks at its other duties then.
    pub(crate) fn serve_next(&mut self, now: Instant, core: &mut Core) {
        if let Some(client) = core.poll_closed() {
            self.flush(core, client);
            return self.close(core, client);
        }
        match self.ready.pop_front() {
            None => {}
            Some(Waiting::Listener(position)) => self.accept(now, core, position),
            Some(Waiting::Client(client)) => self.serve(now, core, client),
        }
    }

    /// Serves one request of a client, and queues it again if it has asked for more.
    fn serve(&mut self, now: Instant, core: &mut Core, client: ClientId) {
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
            self.ready.push_back(Waiting::Client(client));
        }
    }

    fn queue_listener(&mut self, position: usize) {
        if let Some(Some(socket)) = self.sockets.get_mut(position)
            && !core::mem::replace(&mut socket.is_queued, true)
        {
            self.ready.push_back(Waiting::Listener(position));
        }
    }

    /// Lets one client in; others that wait make the socket ready again.
    fn accept(&mut self, now: Instant, core: &mut Core, position: usize) {
        let Some(Some(socket)) = self.sockets.get_mut(position) else { return };
        socket.is_queued = false;
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
        self.ready.retain(|waiting| *waiting != Waiting::Client(client));
        core.disconnect(client);
    }
}

fn is_temporary(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::sync::Arc;

    use ::modbus::{Dialect, WordOrder, tcp_adu};
    use profiles::{PlantSetup, Profile};

    use super::*;
    use crate::core::{LinkId, ListenerPlan, ModbusPlan, Plan, WhenFull, identification, map};

    /// A request of every function and dialect, of every kind of mistake, and bytes that are no request.
    fn messages() -> Vec<Vec<u8>> {
        let pdus: [&[u8]; 17] = [
            &[1, 0, 0, 0x07, 0xD0],
            &[2, 0, 0, 0x07, 0xD0],
            &[3, 0x10, 0, 0, 125],
            &[4, 0x10, 0, 0, 125],
            &[5, 0, 0, 0xFF, 0],
            &[6, 0x10, 0, 0, 7],
            &[8, 0, 0, 1, 2],
            &[15, 0, 0, 0, 8, 1, 0xFF],
            &[16, 0x10, 0, 0, 2, 4, 0, 0, 0, 0],
            &[17],
            &[22, 0x10, 0, 0, 0, 0, 0],
            &[23, 0x10, 0, 0, 2, 0x10, 0, 0, 2, 4, 0, 0, 0, 0],
            &[0x2B, 0x0E, 3, 0],
            &[0x2B, 0x0D, 0, 0, 0, 0x60, 0x41, 0, 0, 0, 0, 2],
            &[99],
            &[3, 0x10],
            &[16, 0x10, 0, 0, 2, 5, 0],
        ];
        let mut messages: Vec<_> = pdus.map(|pdu| tcp_adu(7, 1, pdu)).into();
        let all = messages.concat();
        // Many of them on end, whole and cut off, after others that are skipped, for nobody, and after which nothing is sure.
        messages.extend([all.clone(), all.repeat(3), all[..all.len() - 3].to_vec(), tcp_adu(7, 9, &[17])]);
        messages.push([[0, 1, 0, 9, 0, 2, 1, 3].repeat(100), all].concat());
        messages.push(vec![0, 1, 0, 0, 0xFF, 0xFF, 1, 3]);
        messages
    }

    struct Gateway {
        core: Core,
        sockets: Sockets,
        now: Instant,
        ports: Vec<SocketAddr>,
    }

    /// What has been done so far.
    struct Done {
        /// By listener and address: clients of different listeners may have one address.
        requests: BTreeMap<(usize, SocketAddr), u64>,
        accepted: u64,
        refused: u64,
        connections: u64,
    }

    impl Gateway {
        /// One listener for many clients, one that gives the place of its only client to the next, one that refuses.
        fn new() -> Self {
            let profile = Arc::new(Profile::embedded("cia402-servo", None).unwrap().unwrap());
            let nodes = vec![(LinkId(0), 1)];
            let (plant, name) = (PlantSetup::default(), "axis".into());
            let plan = Plan { name, profile: Arc::clone(&profile), nodes, plant, serial: None };
            let now = Instant::ZERO;
            let mut core = Core::new(1, &[plan], now).unwrap();
            let map = Arc::new(map(&profile, Dialect::Full, WordOrder::LowFirst));
            let identification = identification(&profile, "axis");
            core.show_on_modbus(0, ModbusPlan { unit: Some(1), map, identification, timeout: None });
            let mut listening = Vec::new();
            for (max_clients, when_full) in
                [(64, WhenFull::Refuse), (1, WhenFull::Replace), (1, WhenFull::Refuse)]
            {
                let idle_timeout = (max_clients > 1).then_some(Duration::from_secs(1));
                core.add_listener(ListenerPlan {
                    max_clients,
                    when_full,
                    idle_timeout,
                    ..ListenerPlan::default()
                });
                let listener = TcpListener::bind("127.0.0.1:0").unwrap();
                listener.set_nonblocking(true).unwrap();
                let listeners = vec![(listener.local_addr().unwrap(), listener)];
                listening.push(Listening { listeners, allow: Vec::new(), read_only: Vec::new() });
            }
            let ports = listening.iter().map(|own| own.listeners[0].0).collect();
            Self { core, sockets: Sockets::new(listening).unwrap(), now, ports }
        }

        fn done(&self) -> Done {
            let counters = || self.core.modbus_listeners();
            Done {
                requests: self
                    .core
                    .modbus_clients()
                    .map(|own| ((own.listener, own.peer), own.counters.requests))
                    .collect(),
                accepted: counters().map(|own| own.accepted).sum(),
                refused: counters().map(|own| own.refused).sum(),
                connections: self.sockets.connections.iter().flatten().count() as u64,
            }
        }

        /// What has been done since: requests that were served, clients let in or sent away, connections closed.
        fn since(&self, before: &Done) -> [u64; 3] {
            let done = self.done();
            let served = |(client, count): (&_, &u64)| count - before.requests.get(client).unwrap_or(&0);
            let (accepted, refused) = (done.accepted - before.accepted, done.refused - before.refused);
            let closed = before.connections + accepted - done.connections;
            [done.requests.iter().map(served).sum(), accepted + refused, closed]
        }

        /// Does what is ready, and sees to it that every piece of it is one thing.
        fn serve(&mut self, pieces: &mut [u64; 3]) {
            self.sockets.take_events();
            self.core.handle_timeout(self.now);
            self.sockets.handle_timeout(self.now);
            for _ in 0..self.sockets.ready(&self.core) {
                let before = self.done();
                self.sockets.serve_next(self.now, &mut self.core);
                let done = self.since(&before);
                // A connection may end with its request.
                assert!(matches!(done, [0, 0 | 1, 0] | [0 | 1, 0, 0 | 1]), "{done:?}");
                pieces.iter_mut().zip(done).for_each(|(all, done)| *all += done);
            }
        }
    }

    #[test]
    fn one_piece_of_work_is_one_request_or_one_client_let_in_or_one_closed() {
        let (mut gateway, messages) = (Gateway::new(), messages());
        let mut clients: VecDeque<TcpStream> = VecDeque::new();
        let mut pieces = [0; 3];
        for round in 0..400 {
            let port = gateway.ports[[0, 0, 0, 1, 2][round % 5]];
            let client = TcpStream::connect(port).unwrap();
            client.set_nonblocking(true).unwrap();
            clients.push_back(client);
            for (number, client) in clients.iter_mut().enumerate() {
                // One that was sent away takes nothing, and one that reads no answers is not read from in the end.
                let _ = client.write_all(&messages[(round + 5 * number) % messages.len()]);
            }
            // Some leave in the midst of it, a dozen at once; all are idle for too long now and then.
            if round % 40 == 39 {
                clients.drain(..12);
            }
            if round % 97 == 96 {
                gateway.now = gateway.now + Duration::from_secs(2);
            }
            gateway.serve(&mut pieces);
        }
        clients.clear();
        while gateway.done().connections > 0 {
            gateway.serve(&mut pieces);
        }
        let counters: Vec<_> = gateway.core.modbus_listeners().collect();
        let [all, replacing, refusing] = &counters[..] else { panic!("{counters:?}") };
        assert!(all.idle > 20 && replacing.replaced > 20 && refusing.refused > 20, "{counters:?}");
        assert!(pieces[0] > 1000 && pieces[1] > 300 && pieces[2] > 100, "{pieces:?}");
    }
}
