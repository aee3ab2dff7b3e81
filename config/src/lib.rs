//! The gateway file: which buses there are and which devices stand on them.
//!
//! [`load`] reads the TOML text, finds the device profiles it names and says everything that is wrong at once, each
//! with its position and what would be right.

#![forbid(unsafe_code)]
#![warn(clippy::expect_used, clippy::indexing_slicing, clippy::panic, clippy::unwrap_used)]

mod bus;
mod changes;
mod defaults;
mod device;
mod gateway;
mod identity;
mod modbus;
mod network;
mod plant;
mod resolve;
mod service;
mod switches;

pub use bus::{Bus, Endpoint, Link};
pub use changes::Changes;
pub use defaults::LIMITS;
pub use device::{Attachment, Device, Owner, UNCONFIGURED};
pub use gateway::{Gateway, load};
pub use modbus::{Listener, ModbusDialect, ModbusView, WhenFull, WordOrder};
pub use network::{Network, NoNetwork};
pub use profiles::{Diagnostic, Diagnostics, Severity};
pub use resolve::{PROFILE_DIRECTORY, ReadFile};
pub use service::{Audit, LOG_MODULES, Level, Log, LogFormat, Realtime, Service};

/// A gateway file that runs anywhere: two motors on a virtual bus that others join by socketcand.
pub const DEMO: &str = include_str!("../examples/demo.toml");
