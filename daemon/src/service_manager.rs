//! The service manager that started axisd: it is told when everything is served, when axisd stops, and that the core
//! loop is alive.
//!
//! The protocol is sd_notify(3): datagrams of text to the socket in `$NOTIFY_SOCKET`. They are sent from the core thread,
//! so no send may wait: one that finds no room is given up.

use core::time::Duration;
use std::env;
use std::ffi::OsString;
use std::io;
use std::os::linux::net::SocketAddrExt;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::net::{SocketAddr, UnixDatagram};

use od::Instant;
use sd_notify::NotifyState;
use tracing::warn;

use crate::log::module::SERVICE;

/// The manager, if there is one, and what it expects.
#[derive(Debug)]
pub(crate) struct ServiceManager {
    socket: Option<(UnixDatagram, SocketAddr)>,
    watchdog: Option<Watchdog>,
    /// Whether the last message was taken.
    is_heard: bool,
}

impl ServiceManager {
    /// What the environment says (`NOTIFY_SOCKET`, `WATCHDOG_USEC`, `WATCHDOG_PID`) at `now`.
    pub(crate) fn from_environment(now: Instant) -> Self {
        let socket = env::var_os("NOTIFY_SOCKET").and_then(|path| {
            let opened = open(&path);
            opened
                .map_err(|error| warn!(target: SERVICE, "the service manager at {} is not told: {error}", path.display()))
                .ok()
        });
        let time_out =
            sd_notify::watchdog_enabled().filter(|time_out| socket.is_some() && !time_out.is_zero());
        Self { socket, watchdog: time_out.map(|time_out| Watchdog::new(time_out, now)), is_heard: true }
    }

    /// The same manager for another thread, which has no part in the watchdog.
    pub(crate) fn for_another_thread(&self) -> io::Result<Self> {
        let socket = match &self.socket {
            Some((socket, address)) => Some((socket.try_clone()?, address.clone())),
            None => None,
        };
        Ok(Self { socket, watchdog: None, is_heard: true })
    }

    /// Tells it something.
    pub(crate) fn tell(&mut self, states: &[NotifyState<'_>]) {
        let Some((socket, address)) = &self.socket else { return };
        let text: String = states.iter().map(|state| format!("{state}\n")).collect();
        let sent = socket.send_to_addr(text.as_bytes(), address);
        if let (Err(error), true) = (&sent, self.is_heard) {
            warn!(target: SERVICE, "the service manager could not be told: {error}");
        }
        self.is_heard = sent.is_ok();
    }

    /// Shows that the core loop lives, if that is due.
    pub(crate) fn feed_watchdog(&mut self, now: Instant) {
        if self.watchdog.as_mut().is_some_and(|watchdog| watchdog.is_due(now)) {
            self.tell(&[NotifyState::Watchdog]);
        }
    }

    /// The watchdog, if the manager has one.
    pub(crate) fn watchdog(&self) -> Option<&Watchdog> {
        self.watchdog.as_ref()
    }
}

/// When the core loop shows that it lives.
#[derive(Debug)]
pub(crate) struct Watchdog {
    period: Duration,
    due: Instant,
}

impl Watchdog {
    /// The manager gives up after `time_out` of silence, so a sign of life is due after each half of that
    /// (sd_watchdog_enabled(3)). The first one is due at `now`.
    fn new(time_out: Duration, now: Instant) -> Self {
        Self { period: time_out / 2, due: now }
    }

    /// Whether a sign of life is due; the next one is then due a period after this one was.
    fn is_due(&mut self, now: Instant) -> bool {
        let is_due = self.due <= now;
        if is_due {
            self.due = self.due + self.period;
            // After a stall there is one sign of life, not one for each that was missed.
            if self.due <= now {
                self.due = now + self.period;
            }
        }
        is_due
    }

    /// When the next sign of life is due.
    pub(crate) fn due(&self) -> Instant {
        self.due
    }

    /// When it has to be there, for a sleep that would be disturbed by exactness: half of the reserve is left then.
    pub(crate) fn latest(&self) -> Instant {
        self.due + self.period / 2
    }
}

/// A socket that never waits, and where to send; a leading `@` is an abstract name (sd_notify(3)).
fn open(path: &OsString) -> io::Result<(UnixDatagram, SocketAddr)> {
    let address = match path.as_bytes().strip_prefix(b"@") {
        Some(name) => SocketAddr::from_abstract_name(name)?,
        None => SocketAddr::from_pathname(path)?,
    };
    let socket = UnixDatagram::unbound()?;
    socket.set_nonblocking(true)?;
    Ok((socket, address))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(millis: u64) -> Instant {
        Instant::from_nanos(millis * 1_000_000)
    }

    #[test]
    fn a_sign_of_life_is_due_after_each_half_of_the_time_out() {
        let mut watchdog = Watchdog::new(Duration::from_secs(4), at(0));
        let fed: Vec<u64> = (0..=10_000).filter(|&millis| watchdog.is_due(at(millis))).collect();
        assert_eq!(fed, [0, 2000, 4000, 6000, 8000, 10_000]);
        assert_eq!((watchdog.due(), watchdog.latest()), (at(12_000), at(13_000)));
    }

    #[test]
    fn a_late_sign_of_life_shifts_no_other_and_a_stall_is_not_made_up_for() {
        let mut watchdog = Watchdog::new(Duration::from_secs(4), at(0));
        assert!(watchdog.is_due(at(700)));
        assert_eq!(watchdog.due(), at(2000));
        assert!(watchdog.is_due(at(7000)));
        assert!(!watchdog.is_due(at(8999)));
        assert!(watchdog.is_due(at(9000)));
    }
}
