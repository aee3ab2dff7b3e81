//! How the core thread sleeps when it waits for more than one thing.

use core::time::Duration;

use nix::errno::Errno;
use nix::poll::{PollFd, PollFlags, ppoll};
use nix::sys::time::TimeSpec;
use smallvec::SmallVec;

use crate::alarm::Alarm;
use crate::link::{Link, SocketCan};
use crate::modbus_tcp::Sockets;

/// Links that have frames, by their positions.
pub(crate) type Readable = SmallVec<[usize; 8]>;

/// Makes the kernel wake this thread when it said, not up to 50 us later to save power.
pub(crate) fn wake_punctually() {
    // Without it rasters are a little less regular.
    let _ = nix::sys::prctl::set_timerslack(1);
}

/// What has something to read.
#[derive(Debug, Default)]
pub(crate) struct Woken {
    /// Links that have frames.
    pub(crate) links: Readable,
    /// Whether Modbus sockets are ready.
    pub(crate) modbus: bool,
}

/// Sleeps until a frame comes, a Modbus client, the alarm or a signal, or `time_out` is over.
pub(crate) fn wait(
    links: &[Link],
    modbus: Option<&Sockets>,
    alarm: &Alarm,
    time_out: Option<Duration>,
) -> nix::Result<Woken> {
    let mut fds: SmallVec<[PollFd<'_>; 10]> = SmallVec::new();
    let mut positions = Readable::new();
    for (position, link) in links.iter().enumerate() {
        if let Some(fd) = link.interface.as_ref().and_then(SocketCan::fd) {
            fds.push(PollFd::new(fd, PollFlags::POLLIN));
            positions.push(position);
        }
    }
    fds.push(PollFd::new(alarm.fd(), PollFlags::POLLIN));
    fds.extend(modbus.map(|modbus| PollFd::new(modbus.fd(), PollFlags::POLLIN)));
    match ppoll(&mut fds, time_out.map(TimeSpec::from_duration), None) {
        Ok(_) => {}
        Err(Errno::EINTR) => return Ok(Woken::default()),
        Err(error) => return Err(error),
    }
    // An event unknown to us is one all the same.
    let mut is_ready = fds.iter().map(|fd| fd.any().unwrap_or(true));
    positions.retain(|_| is_ready.next().unwrap_or(false));
    if is_ready.next().unwrap_or(false) {
        alarm.silence();
    }
    let modbus = is_ready.next().unwrap_or(false);
    Ok(Woken { links: positions, modbus })
}
