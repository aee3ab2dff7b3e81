//! The server's side of the ASCII gateway: who comes in, and the task that has the engine.

use core::time::Duration;
use std::collections::BTreeMap;
use std::io;
use std::net::SocketAddr;
use std::sync::Arc;

use canopen::ascii::{AsciiGateway, Outgoing, Told};
use tokio::net::{TcpListener, TcpStream, UnixListener, UnixStream};
use tokio::sync::broadcast::error::RecvError;
use tokio::sync::{Semaphore, broadcast, mpsc};
use tokio::task::JoinSet;
use tokio::time::{sleep, timeout};

use super::client::{self, Client};
use super::{Listener, Listening, Said};
use crate::clock::Clock;
use crate::control::{Errand, Orders};
use crate::core::{LinkId, Peer, Sender};
use crate::services;
use crate::socketcand::{Bus, Inbound, Passed, ToCore};

/// Clients at the same time, at each place.
const MAX_CLIENTS: usize = 16;
/// What may wait for the engine's task: frames of a bus and lines of clients.
const QUEUE: usize = 1024;
/// How soon the core is asked again that has not answered.
const RETRY: Duration = Duration::from_millis(100);
/// The sender of what a gateway puts on a bus: clients of socketcand have numbers from 1.
const GATEWAY: u64 = u64::MAX;

/// Serves `listening` in the runtime that this is called in.
///
/// # Errors
/// The runtime does not take a socket.
pub fn serve(listening: Vec<Listening>, to_core: &ToCore, orders: &Orders, clock: Clock) -> io::Result<()> {
    for Listening { listener, buses } in listening {
        let door = match listener {
            Listener::Tcp(listener) => Door::Tcp(TcpListener::from_std(listener)?),
            Listener::Unix(listener) => Door::Unix(UnixListener::from_std(listener)?),
        };
        let (said, inbox) = mpsc::channel(QUEUE);
        let engine = AsciiGateway::new(buses.iter().map(|(number, _)| *number));
        let bus = |(number, bus): (u16, Bus)| (number, (bus.link, bus.frames.downgrade()));
        let buses = buses.into_iter().map(bus).collect();
        let (clients, hearers) = (BTreeMap::new(), JoinSet::new());
        let (to_core, orders) = (to_core.clone(), orders.clone());
        let (said_too, is_listening) = (said.clone(), false);
        let server =
            Server { engine, buses, clients, hearers, is_listening, said: said_too, to_core, orders, clock };
        tokio::spawn(server.run(inbox));
        tokio::spawn(accept(door, said));
    }
    Ok(())
}

/// Where clients come in.
enum Door {
    Tcp(TcpListener),
    Unix(UnixListener),
}

enum Guest {
    Tcp(TcpStream, SocketAddr),
    Unix(UnixStream),
}

impl Door {
    async fn accept(&self) -> io::Result<Guest> {
        match self {
            Self::Tcp(listener) => {
                let (stream, address) = listener.accept().await?;
                stream.set_nodelay(true)?;
                Ok(Guest::Tcp(stream, address))
            }
            Self::Unix(listener) => Ok(Guest::Unix(listener.accept().await?.0)),
        }
    }
}

async fn accept(door: Door, said: mpsc::Sender<Said>) {
    let places = Arc::new(Semaphore::new(MAX_CLIENTS));
    let mut number = 0;
    loop {
        let Ok(guest) = door.accept().await else {
            // Out of descriptors or the like: that passes when clients leave.
            sleep(Duration::from_millis(100)).await;
            continue;
        };
        // One that is too many sees its connection end.
        let Ok(place) = Arc::clone(&places).try_acquire_owned() else { continue };
        number += 1;
        let said = said.clone();
        tokio::spawn(async move {
            match guest {
                Guest::Tcp(stream, address) => {
                    client::serve(stream, (number, Some(Peer::Address(address))), said).await;
                }
                Guest::Unix(stream) => {
                    let peer = services::peer(&stream);
                    client::serve(stream, (number, peer), said).await;
                }
            }
            drop(place);
        });
    }
}

/// The engine and what is around it.
struct Server {
    engine: AsciiGateway,
    /// The links of the buses and what passes on them; one that has gone by a reload is not there any more.
    buses: BTreeMap<u16, (LinkId, broadcast::WeakSender<Passed>)>,
    clients: BTreeMap<u64, Client>,
    /// Who passes the frames of the buses on, while there are clients.
    hearers: JoinSet<()>,
    is_listening: bool,
    said: mpsc::Sender<Said>,
    to_core: ToCore,
    orders: Orders,
    clock: Clock,
}

impl Server {
    async fn run(mut self, mut inbox: mpsc::Receiver<Said>) {
        loop {
            let said = match self.engine.poll_timeout() {
                None => Ok(inbox.recv().await),
                Some(due) => timeout(due.saturating_since(self.clock.now()), inbox.recv()).await,
            };
            match said {
                Ok(Some(said)) => self.hear(said),
                Ok(None) => return,
                Err(_) => self.engine.handle_timeout(self.clock.now()),
            }
            self.flush().await;
            self.follow_clients().await;
        }
    }

    fn hear(&mut self, said: Said) {
        let now = self.clock.now();
        match said {
            Said::Came(client) => {
                self.engine.connect(client.number);
                self.clients.insert(client.number, client);
            }
            Said::Line(client, line) => {
                if !self.engine.handle_line(now, client, &line) {
                    // It may say the next one.
                    self.tell(client, Told::Answer(String::new()));
                }
            }
            Said::Left(client) => self.part(client),
            Said::Frame(bus, frame) => self.engine.handle_frame(now, bus, &frame),
        }
    }

    /// Listens to the buses as long as there are clients: what they say is done when everything is heard.
    async fn follow_clients(&mut self) {
        let is_wanted = !self.clients.is_empty();
        if core::mem::replace(&mut self.is_listening, is_wanted) == is_wanted {
            return;
        }
        match is_wanted {
            true => self.listen(),
            false => self.hearers = JoinSet::new(),
        }
        for (link, frames) in self.buses.values() {
            self.set_heard(*link, frames, is_wanted).await;
        }
    }

    /// Lets frames of the buses come from now on.
    fn listen(&mut self) {
        for (number, (_, frames)) in &self.buses {
            let Some(frames) = frames.upgrade() else { continue };
            let (number, mut frames, said) = (*number, frames.subscribe(), self.said.clone());
            self.hearers.spawn(async move {
                loop {
                    match frames.recv().await {
                        Ok(passed) if passed.sender == Some(GATEWAY) => {}
                        Ok(passed) if said.send(Said::Frame(number, passed.frame)).await.is_ok() => {}
                        // Frames were lost, as on a bus whose controller is overrun.
                        Err(RecvError::Lagged(_)) => {}
                        Ok(_) | Err(RecvError::Closed) => return,
                    }
                }
            });
        }
    }

    /// Lets the core take every frame of a bus from its interface, or only what our nodes listen to.
    async fn set_heard(&self, link: LinkId, frames: &broadcast::WeakSender<Passed>, is_heard: bool) {
        // Others order as much as there is room for.
        while frames.strong_count() > 0 && self.orders.place(Errand::Hear, (link, is_heard)).await.is_err() {
            sleep(RETRY).await;
        }
    }

    fn part(&mut self, client: u64) {
        self.clients.remove(&client);
        self.engine.disconnect(self.clock.now(), client);
    }

    fn tell(&mut self, client: u64, told: Told) {
        if self.clients.get_mut(&client).is_some_and(|client| !client.tell(told)) {
            self.part(client);
        }
    }

    /// Sends what the engine has to send, and tells what it has to tell.
    async fn flush(&mut self) {
        while let Some(Outgoing { network, client, frame }) = self.engine.poll_transmit() {
            let bus = self.buses.get(&network).filter(|(_, frames)| frames.strong_count() > 0);
            let Some((link, _)) = bus else { continue };
            let peer = |client| self.clients.get(&client)?.peer;
            let sender = client.map_or(Sender::Bus, |client| Sender::Gateway(peer(client)));
            let inbound = Inbound { link: *link, client: GATEWAY, sender, at: self.clock.now(), frame };
            if !self.to_core.send(inbound).await {
                return;
            }
        }
        while let Some((client, told)) = self.engine.poll_line() {
            self.tell(client, told);
        }
    }
}
