//! The socketcand server: buses over TCP, for whoever has no CAN hardware (python-can's `socketcand` interface).
//!
//! It runs on the thread of [`crate::services`]. To the core loop leads one bounded queue, on which clients that are too fast
//! have to wait; from it one ring per bus, in which clients that are too slow lose frames.

mod protocol;
mod server;

use std::net::{SocketAddr, TcpListener};

use canopen::Frame;
use od::Instant;
use tokio::sync::{broadcast, mpsc, watch};

use crate::alarm::Bell;
use crate::core::{LinkId, Sender};

pub use server::serve;

/// Frames of a bus that a client may be behind.
const RING: usize = 4096;
/// Frames from clients that may wait for the core.
const QUEUE: usize = 256;

/// A frame on a bus, for the clients.
#[derive(Clone, Copy, Debug)]
pub struct Passed {
    /// When it was on the bus.
    pub at: Instant,
    /// The client that sent it, if one did.
    pub sender: Option<u64>,
    /// The frame.
    pub frame: Frame,
}

/// A frame from a client.
#[derive(Clone, Copy, Debug)]
pub struct Inbound {
    /// The bus.
    pub link: LinkId,
    /// The number of the client, who does not hear it.
    pub client: u64,
    /// Who that is.
    pub sender: Sender,
    /// When it came.
    pub at: Instant,
    /// The frame.
    pub frame: Frame,
}

/// A bus as clients see it.
#[derive(Clone, Debug)]
pub struct Bus {
    /// Name to open it by.
    pub name: String,
    /// Its link.
    pub link: LinkId,
    /// What passes on it.
    pub frames: broadcast::Sender<Passed>,
}

impl Bus {
    /// Whether it is this very bus, not only one of the same name.
    fn is(&self, other: &Self) -> bool {
        self.name == other.name && self.frames.same_channel(&other.frames)
    }

    /// The bus `name` on `link`.
    #[must_use]
    pub fn new(name: &str, link: LinkId) -> Self {
        Self { name: name.to_owned(), link, frames: broadcast::Sender::new(RING) }
    }
}

/// A port that is to be served.
#[derive(Debug)]
pub struct Listening {
    listener: TcpListener,
    buses: watch::Receiver<Vec<Bus>>,
}

/// What clients of a port may open. When it is dropped, the port is closed, and so are their connections.
#[derive(Debug)]
pub struct Port(watch::Sender<Vec<Bus>>);

impl Listening {
    /// A port that serves these buses.
    #[must_use]
    pub fn new(listener: TcpListener, buses: Vec<Bus>) -> (Self, Port) {
        let (sender, buses) = watch::channel(buses);
        (Self { listener, buses }, Port(sender))
    }
}

impl Port {
    /// Makes these the buses that it serves. Clients of one that it serves no more are disconnected, the others notice
    /// nothing.
    pub fn serve(&self, buses: Vec<Bus>) {
        self.0.send_replace(buses);
    }
}

/// The server's way into the core loop.
#[derive(Clone, Debug)]
pub struct ToCore {
    frames: mpsc::Sender<Inbound>,
    bell: Bell,
}

impl ToCore {
    /// A way to the core loop that `bell` wakes, and its other end.
    #[must_use]
    pub fn new(bell: Bell) -> (Self, mpsc::Receiver<Inbound>) {
        let (frames, received) = mpsc::channel(QUEUE);
        (Self { frames, bell }, received)
    }

    /// Gives the core loop a frame, once there is room for it. Whether it is still there.
    pub(crate) async fn send(&self, inbound: Inbound) -> bool {
        let is_taken = self.frames.send(inbound).await.is_ok();
        self.bell.ring();
        is_taken
    }
}

/// Binds `address`.
///
/// # Errors
/// What the operating system says, for example that the port is taken.
pub fn listen(address: SocketAddr) -> std::io::Result<TcpListener> {
    let listener = TcpListener::bind(address)?;
    listener.set_nonblocking(true)?;
    Ok(listener)
}
