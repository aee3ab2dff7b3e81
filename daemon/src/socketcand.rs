//! The socketcand server: buses over TCP, for whoever has no CAN hardware (python-can's `socketcand` interface).
//!
//! It runs on the thread of [`crate::services`]. To the core loop leads one bounded queue, on which clients that are too fast
//! have to wait; from it one ring per bus, in which clients that are too slow lose frames.

mod protocol;
mod server;

use std::net::{SocketAddr, TcpListener};

use canopen::Frame;
use od::Instant;
use tokio::sync::{broadcast, mpsc};

use crate::alarm::Bell;
use crate::core::LinkId;

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
    /// The client.
    pub client: u64,
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
    /// The bus `name` on `link`.
    #[must_use]
    pub fn new(name: &str, link: LinkId) -> Self {
        Self { name: name.to_owned(), link, frames: broadcast::Sender::new(RING) }
    }
}

/// A port and the buses it serves.
#[derive(Debug)]
pub struct Listening {
    /// Where clients connect.
    pub listener: TcpListener,
    /// What they may open.
    pub buses: Vec<Bus>,
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
