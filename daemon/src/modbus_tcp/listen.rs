//! Opening sockets.

use std::io;
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::os::fd::AsRawFd;

use nix::sys::socket::{
    AddressFamily, Backlog, SockFlag, SockType, SockaddrStorage, bind, setsockopt, socket, sockopt,
};

/// Clients that may wait to be let in.
const BACKLOG: i32 = 128;
/// A client that has vanished is noticed after about a minute.
const KEEP_IDLE_S: u32 = 30;
const KEEP_INTERVAL_S: u32 = 10;
const KEEP_COUNT: u32 = 3;

/// Listens on `address`. An IPv6 address is that alone, so that the same port may be listened on by IPv4, too.
///
/// # Errors
/// The address is not one of this machine, or taken, or may not be used.
pub(crate) fn listen(address: SocketAddr) -> io::Result<TcpListener> {
    let family = if address.is_ipv4() { AddressFamily::Inet } else { AddressFamily::Inet6 };
    let flags = SockFlag::SOCK_CLOEXEC | SockFlag::SOCK_NONBLOCK;
    let socket = socket(family, SockType::Stream, flags, None)?;
    setsockopt(&socket, sockopt::ReuseAddr, &true)?;
    if address.is_ipv6() {
        setsockopt(&socket, sockopt::Ipv6V6Only, &true)?;
    }
    bind(socket.as_raw_fd(), &SockaddrStorage::from(address))?;
    nix::sys::socket::listen(&socket, Backlog::new(BACKLOG)?)?;
    Ok(TcpListener::from(socket))
}

/// Makes the socket of a client one that never waits, sends at once and notices when the other side has vanished.
///
/// # Errors
/// The connection is over.
pub(super) fn prepare(stream: &TcpStream) -> io::Result<()> {
    stream.set_nonblocking(true)?;
    stream.set_nodelay(true)?;
    setsockopt(stream, sockopt::KeepAlive, &true)?;
    setsockopt(stream, sockopt::TcpKeepIdle, &KEEP_IDLE_S)?;
    setsockopt(stream, sockopt::TcpKeepInterval, &KEEP_INTERVAL_S)?;
    setsockopt(stream, sockopt::TcpKeepCount, &KEEP_COUNT)?;
    Ok(())
}
