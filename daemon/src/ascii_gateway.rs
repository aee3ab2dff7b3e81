//! The ASCII gateway (CiA 309-3): buses for clients that speak in lines of text, over TCP or a Unix socket.
//!
//! It runs on the thread of [`crate::services`]. One task for each place has the engine ([`AsciiGateway`]), each client has a
//! task of its own. Frames pass by the same two ways as those of socketcand clients: one bounded queue to the core loop,
//! one ring per bus from it, to which the gateway listens only while it has clients.

mod client;
mod server;

use std::collections::BTreeMap;
use std::io;
use std::net::TcpListener;
use std::os::unix::net::UnixListener;

use canopen::ascii::Told;
use config::{Endpoint, Gateway};

use crate::cli::Failure;
use crate::control::ControlSocket;
use crate::socketcand::Bus;

pub use server::serve;

/// Where clients connect, and the buses that they may use by their numbers.
#[derive(Debug)]
pub struct Listening {
    /// Where clients connect.
    pub listener: Listener,
    /// The buses, each with its number.
    pub buses: Vec<(u16, Bus)>,
}

/// What clients connect to.
#[derive(Debug)]
pub enum Listener {
    /// A TCP port.
    Tcp(TcpListener),
    /// A Unix socket.
    Unix(UnixListener),
}

/// The gateways of a configuration.
#[derive(Debug, Default)]
pub(crate) struct Gateways {
    /// Each place once, whichever buses share it.
    pub(crate) listening: Vec<Listening>,
    /// Unix sockets, in the file system as long as these live.
    pub(crate) sockets: Vec<ControlSocket>,
}

impl Gateways {
    /// Listens wherever the buses of `gateway` say, which are `served` by their names.
    pub(crate) fn listen(gateway: &Gateway, served: &BTreeMap<String, Bus>) -> Result<Self, Failure> {
        let mut places: BTreeMap<&Endpoint, Vec<(u16, Bus)>> = BTreeMap::new();
        let mut gateways = Self::default();
        for (number, bus) in (1..).zip(&gateway.buses) {
            if let (Some(endpoint), Some(served)) = (&bus.gateway, served.get(&bus.name)) {
                places.entry(endpoint).or_default().push((number, served.clone()));
            }
        }
        for (endpoint, buses) in places {
            let (listener, socket) = listen(endpoint).map_err(|error| {
                Failure::Other(format!("cannot serve the ASCII gateway on {endpoint}: {error}"))
            })?;
            gateways.sockets.extend(socket);
            gateways.listening.push(Listening { listener, buses });
        }
        Ok(gateways)
    }
}

/// Listens at `endpoint`. A Unix socket is in the file system as long as what is beside the listener lives.
///
/// # Errors
/// What the operating system says, for example that the port is taken.
pub fn listen(endpoint: &Endpoint) -> io::Result<(Listener, Option<ControlSocket>)> {
    match endpoint {
        Endpoint::Tcp(address) => {
            let listener = TcpListener::bind(address)?;
            listener.set_nonblocking(true)?;
            Ok((Listener::Tcp(listener), None))
        }
        Endpoint::Unix(path) => {
            let (socket, listener) = ControlSocket::bind(path)?;
            Ok((Listener::Unix(listener), Some(socket)))
        }
    }
}

/// Something for the task that has the engine.
#[derive(Debug)]
enum Said {
    /// A client has come.
    Came(client::Client),
    /// A client has said a line, which stands here without its end.
    Line(u64, Vec<u8>),
    /// A client has left.
    Left(u64),
    /// A frame was on the bus with this number.
    Frame(u16, canopen::Frame),
}

/// The way to a client.
type Lines = tokio::sync::mpsc::Sender<Told>;
