//! The harness of the end-to-end tests: a daemon, its peers and its bus, each a process of its own.
//!
//! * [`Daemon`] runs `axisd` with a configuration and ends it by SIGTERM; [`axisd`] runs the short commands,
//!   [`axisctl`] those that ask a running daemon.
//! * [`Client`] is a socketcand client of our own.
//! * [`ServiceManager`] is what systemd would be to it.
//! * [`system`] is a Debian system in which the package is installed.
//! * [`Master`] runs the Python scripts of `tests/peers`, which are python-canopen masters, on one bus.
//! * [`Vcan`] is a virtual CAN interface of the kernel, [`Wire`] a `candump` on it with `cansend` beside it.
//! * [`story`] makes of a recording what may stand in a snapshot.
//!
//! Whatever is waited for has a deadline, and a failed wait panics with all that the process has said.

// A harness that meets what it did not expect has failed the test, and says so at once.
#![allow(clippy::expect_used, clippy::panic)]

mod capture;
mod client;
mod daemon;
pub mod guide;
pub mod parameters;
mod peer;
mod process;
mod service_manager;
pub mod system;
mod temp;
mod vcan;

pub use capture::story;
pub use client::Client;
pub use daemon::{Bus, Daemon, Stall, axisctl, axisctl_command, axisd, config, free_port};
pub use peer::{Master, Peer, objects_in_eds, run_peer, run_python};
pub use service_manager::ServiceManager;
pub use temp::TempDir;
pub use vcan::{Vcan, Wire};

use std::time::Duration;

/// How long anything may take that is not a whole peer script. A user-mode Linux with one slow core counts.
pub const PATIENCE: Duration = Duration::from_secs(30);
