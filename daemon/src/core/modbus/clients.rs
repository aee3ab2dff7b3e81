//! The clients of all listeners, by number.

use std::collections::VecDeque;
use std::net::SocketAddr;
use std::sync::Arc;

use modbus::{Counters, Framing, Permissions, Server};
use od::{Bus, Instant, Origin};
use thiserror::Error;

use super::ListenerPlan;

/// A client by its number, which another gets when it has left.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ClientId(pub u16);

/// What becomes of a client that is one too many.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WhenFull {
    /// It is sent away.
    #[default]
    Refuse,
    /// It takes the place of the one that has been silent longest.
    Replace,
}

/// A listener has enough clients.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("there are too many clients")]
pub struct Refused;

/// What a listener has done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ListenerCounters {
    /// Clients that are there.
    pub clients: u16,
    /// Clients that have connected.
    pub accepted: u64,
    /// Clients that were sent away, because there were too many or they may not connect.
    pub refused: u64,
    /// Clients whose place another one took.
    pub replaced: u64,
    /// Clients that were silent for too long.
    pub idle: u64,
}

/// A client, for display.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClientStatus {
    /// Where it comes from.
    pub peer: SocketAddr,
    /// Its listener.
    pub listener: usize,
    /// When it connected.
    pub since: Instant,
    /// When it asked last.
    pub heard: Instant,
    /// What it has done.
    pub counters: Counters,
}

#[derive(Debug)]
struct Client {
    server: Server,
    peer: SocketAddr,
    listener: usize,
    since: Instant,
    heard: Instant,
    /// It is one of those that its listener counts.
    counts: bool,
}

/// What a client may do where it has connected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Admission {
    /// It may not connect.
    Refused,
    /// It may only read.
    Reads,
    /// It may do what its listener lets everybody do.
    Full,
}

#[derive(Debug)]
struct Listener {
    permissions: Arc<Permissions>,
    read_only: Arc<Permissions>,
    counters: ListenerCounters,
}

impl Listener {
    fn new(plan: &ListenerPlan) -> Self {
        Self {
            permissions: Arc::new(plan.permissions.clone()),
            read_only: Arc::new(Permissions { read_only: true, write: Vec::new() }),
            counters: ListenerCounters::default(),
        }
    }
}

/// All clients.
#[derive(Debug, Default)]
pub(super) struct Clients {
    clients: Vec<Option<Client>>,
    listeners: Vec<Listener>,
    /// Those whose connection is to be closed.
    closed: VecDeque<ClientId>,
}

impl Clients {
    pub(super) fn add_listener(&mut self, plan: &ListenerPlan) {
        self.listeners.push(Listener::new(plan));
    }

    /// Makes `plan` that of a listener; its clients get what `admission` says of where they come from.
    pub(super) fn change_listener(
        &mut self,
        number: usize,
        plan: &ListenerPlan,
        admission: impl Fn(SocketAddr) -> Admission,
    ) {
        let Some(listener) = self.listeners.get_mut(number) else { return };
        *listener = Listener { counters: listener.counters, ..Listener::new(plan) };
        let (permissions, read_only) = (Arc::clone(&listener.permissions), Arc::clone(&listener.read_only));
        for place in 0..self.clients.len() {
            let Some(Some(client)) = self.clients.get_mut(place) else { continue };
            if client.listener != number || !client.counts {
                continue;
            }
            match admission(client.peer) {
                Admission::Refused => self.close(place),
                Admission::Reads => client.server.set_permissions(Arc::clone(&read_only)),
                Admission::Full => client.server.set_permissions(Arc::clone(&permissions)),
            }
        }
    }

    pub(super) fn connect(
        &mut self,
        now: Instant,
        listener: usize,
        plan: &ListenerPlan,
        peer: SocketAddr,
        reads_only: bool,
    ) -> Result<ClientId, Refused> {
        let own = self.listeners.get(listener).ok_or(Refused)?;
        if own.counters.clients >= plan.max_clients {
            match plan.when_full {
                WhenFull::Refuse => {
                    self.turn_away(listener);
                    return Err(Refused);
                }
                WhenFull::Replace => self.replace(listener),
            }
        }
        let number = self.clients.iter().position(Option::is_none).unwrap_or(self.clients.len());
        let id = ClientId(u16::try_from(number).map_err(|_| Refused)?);
        let own = self.listeners.get_mut(listener).ok_or(Refused)?;
        own.counters.accepted += 1;
        own.counters.clients += 1;
        let permissions = Arc::clone(if reads_only { &own.read_only } else { &own.permissions });
        let origin = Origin { bus: Bus::Modbus, link: listener as u16, client: id.0 };
        let server = Server::new(now, Framing::Tcp, origin, permissions, plan.idle_timeout);
        let client = Client { server, peer, listener, since: now, heard: now, counts: true };
        match self.clients.get_mut(number) {
            Some(place) => *place = Some(client),
            None => self.clients.push(Some(client)),
        }
        Ok(id)
    }

    /// Sends the client away that has been silent longest. It does not count any more.
    fn replace(&mut self, listener: usize) {
        let own = |(number, client): (usize, &Option<Client>)| {
            let client = client.as_ref().filter(|c| c.listener == listener && c.counts)?;
            Some((client.heard, number))
        };
        let Some((_, number)) = self.clients.iter().enumerate().filter_map(own).min() else { return };
        if let Some(listener) = self.listeners.get_mut(listener) {
            listener.counters.replaced += 1;
        }
        self.close(number);
    }

    /// Closes a connection from our side: it does not count any more, and its requests are not served.
    fn close(&mut self, number: usize) {
        let Some(Some(client)) = self.clients.get_mut(number) else { return };
        client.server.close();
        let (listener, counted) = (client.listener, core::mem::replace(&mut client.counts, false));
        self.discount(listener, counted);
        self.closed.push_back(ClientId(number as u16));
    }

    fn discount(&mut self, listener: usize, counted: bool) {
        if let Some(listener) = self.listeners.get_mut(listener).filter(|_| counted) {
            listener.counters.clients = listener.counters.clients.saturating_sub(1);
        }
    }

    pub(super) fn turn_away(&mut self, listener: usize) {
        if let Some(listener) = self.listeners.get_mut(listener) {
            listener.counters.refused += 1;
        }
    }

    pub(super) fn disconnect(&mut self, ClientId(number): ClientId) {
        let Some(client) = self.clients.get_mut(usize::from(number)).and_then(Option::take) else { return };
        self.closed.retain(|closed| closed.0 != number);
        self.discount(client.listener, client.counts);
    }

    pub(super) fn get(&self, ClientId(number): ClientId) -> Option<&Server> {
        self.clients.get(usize::from(number))?.as_ref().map(|client| &client.server)
    }

    pub(super) fn get_mut(&mut self, ClientId(number): ClientId) -> Option<&mut Server> {
        self.clients.get_mut(usize::from(number))?.as_mut().map(|client| &mut client.server)
    }

    /// The server of a client that is about to be answered.
    pub(super) fn serve(&mut self, now: Instant, ClientId(number): ClientId) -> Option<&mut Server> {
        let client = self.clients.get_mut(usize::from(number))?.as_mut()?;
        client.heard = now;
        Some(&mut client.server)
    }

    pub(super) fn peer(&self, ClientId(number): ClientId) -> Option<SocketAddr> {
        self.clients.get(usize::from(number))?.as_ref().map(|client| client.peer)
    }

    pub(super) fn listener(&self, ClientId(number): ClientId) -> Option<usize> {
        self.clients.get(usize::from(number))?.as_ref().map(|client| client.listener)
    }

    /// Closes those that were silent for too long; when to look again.
    pub(super) fn handle_timeout(&mut self, now: Instant) -> Option<Instant> {
        for number in 0..self.clients.len() {
            let Some(Some(client)) = self.clients.get_mut(number) else { continue };
            let was_closing = client.server.is_closing();
            client.server.handle_timeout(now);
            if client.server.is_closing() && !was_closing {
                let listener = client.listener;
                if let Some(listener) = self.listeners.get_mut(listener) {
                    listener.counters.idle += 1;
                }
                self.close(number);
            }
        }
        self.clients.iter().flatten().filter_map(|client| client.server.poll_timeout()).min()
    }

    pub(super) fn poll_closed(&mut self) -> Option<ClientId> {
        self.closed.pop_front()
    }

    pub(super) fn closed(&self) -> usize {
        self.closed.len()
    }

    pub(super) fn status(&self) -> impl Iterator<Item = ClientStatus> {
        self.clients.iter().flatten().map(|client| ClientStatus {
            peer: client.peer,
            listener: client.listener,
            since: client.since,
            heard: client.heard,
            counters: client.server.counters(),
        })
    }

    pub(super) fn listeners(&self) -> impl Iterator<Item = ListenerCounters> {
        self.listeners.iter().map(|listener| listener.counters)
    }
}
