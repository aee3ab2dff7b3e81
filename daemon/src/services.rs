//! What is not the bus and waits for the outside: the socketcand port and the control socket, served by tokio on one
//! thread beside the core.

use std::io;
use std::thread;

use tokio::net::UnixStream;
use tokio::runtime::Handle;

use crate::core::Peer;

/// Runs what `start` spawns, on a thread of its own, until the process ends; by the handle more can be spawned.
///
/// # Errors
/// `start` failed, or the thread or its runtime could not be made.
pub fn serve(start: impl FnOnce() -> io::Result<()>) -> io::Result<Handle> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    {
        let _guard = runtime.enter();
        start()?;
    }
    let handle = runtime.handle().clone();
    let run = move || runtime.block_on(core::future::pending::<()>());
    thread::Builder::new().name("services".to_owned()).spawn(run)?;
    Ok(handle)
}

/// Who is at the other end of a Unix socket (`SO_PEERCRED`, unix(7)): what it was when it connected.
pub(crate) fn peer(stream: &UnixStream) -> Option<Peer> {
    let credentials = stream.peer_cred().ok()?;
    Some(Peer::Process { uid: credentials.uid(), pid: credentials.pid().filter(|pid| *pid > 0) })
}
