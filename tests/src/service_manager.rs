//! A service manager that listens, and only that.

use std::io::ErrorKind;
use std::os::unix::net::UnixDatagram;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use crate::{PATIENCE, TempDir};

const LONGEST_MESSAGE: usize = 4096;
/// A read time-out of nothing would be none at all.
const SHORTEST_WAIT: Duration = Duration::from_millis(1);

/// The receiving end of sd_notify(3), as a daemon under test meets it.
#[derive(Debug)]
pub struct ServiceManager {
    socket: UnixDatagram,
    watchdog: Duration,
    dir: TempDir,
}

impl ServiceManager {
    /// One that expects a sign of life in each `watchdog`.
    #[must_use]
    pub fn new(watchdog: Duration) -> Self {
        let dir = TempDir::new();
        let socket = UnixDatagram::bind(dir.path().join("notify")).expect("bind a socket");
        Self { socket, watchdog, dir }
    }

    /// What it tells a daemon in its environment.
    pub(crate) fn environment(&self) -> [(&'static str, PathBuf); 2] {
        let watchdog = self.watchdog.as_micros().to_string();
        [("NOTIFY_SOCKET", self.dir.path().join("notify")), ("WATCHDOG_USEC", watchdog.into())]
    }

    /// Waits until it is told this.
    pub fn expect(&self, line: &str) {
        let deadline = Instant::now() + PATIENCE;
        while let Some(message) = self.receive(deadline) {
            if message.lines().any(|said| said == line) {
                return;
            }
        }
        panic!("the service manager is not told {line} within {PATIENCE:?}");
    }

    /// Everything that it is told within this time, and what it had not read before.
    #[must_use]
    pub fn listen(&self, time: Duration) -> Vec<String> {
        let deadline = Instant::now() + time;
        let messages = std::iter::from_fn(|| self.receive(deadline));
        messages.flat_map(|message| message.lines().map(str::to_owned).collect::<Vec<_>>()).collect()
    }

    fn receive(&self, deadline: Instant) -> Option<String> {
        let left = deadline.saturating_duration_since(Instant::now()).max(SHORTEST_WAIT);
        self.socket.set_read_timeout(Some(left)).expect("set a time-out");
        let mut message = [0; LONGEST_MESSAGE];
        match self.socket.recv(&mut message) {
            Ok(length) => Some(String::from_utf8_lossy(&message[..length]).into_owned()),
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => None,
            Err(error) => panic!("receive from the daemon: {error}"),
        }
    }
}
