//! Waking the core thread: by a signal or by another thread.

use std::io::{self, Read, Write};
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::os::unix::net::UnixStream;
use std::sync::Arc;

use nix::errno::Errno;
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};

/// The sleeper's end.
#[derive(Debug)]
pub struct Alarm {
    heard: UnixStream,
    bell: Bell,
}

/// The waker's end.
#[derive(Clone, Debug)]
pub struct Bell(Arc<UnixStream>);

impl Alarm {
    /// A silent alarm.
    ///
    /// # Errors
    /// The operating system has no descriptors left.
    pub fn new() -> io::Result<Self> {
        let (heard, rung) = UnixStream::pair()?;
        heard.set_nonblocking(true)?;
        rung.set_nonblocking(true)?;
        Ok(Self { heard, bell: Bell(Arc::new(rung)) })
    }

    /// A bell for another thread.
    #[must_use]
    pub fn bell(&self) -> Bell {
        self.bell.clone()
    }

    /// A descriptor that rings by any byte written to it.
    ///
    /// # Errors
    /// The operating system has no descriptors left.
    pub fn descriptor(&self) -> io::Result<OwnedFd> {
        self.bell.0.try_clone().map(OwnedFd::from)
    }

    /// What is readable while it rings.
    pub(crate) fn fd(&self) -> BorrowedFd<'_> {
        self.heard.as_fd()
    }

    /// Sleeps until it rings, and silences it.
    ///
    /// # Errors
    /// The operating system does not let it sleep.
    pub(crate) fn wait(&self) -> io::Result<()> {
        let mut fds = [PollFd::new(self.fd(), PollFlags::POLLIN)];
        loop {
            match poll(&mut fds, PollTimeout::NONE) {
                Ok(_) => break,
                Err(Errno::EINTR) => {}
                Err(error) => return Err(error.into()),
            }
        }
        self.silence();
        Ok(())
    }

    /// Silences it.
    pub(crate) fn silence(&self) {
        // Whatever is left, or whoever interrupts, rings again.
        let _ = (&self.heard).read(&mut [0; 512]);
    }
}

impl Bell {
    /// Wakes the sleeper, now or when it next wants to sleep.
    pub fn ring(&self) {
        // It fails when so many rings wait that one more says nothing, or when the sleeper is gone.
        let _ = (&*self.0).write(&[1]);
    }
}
