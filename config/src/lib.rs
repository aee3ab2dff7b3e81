//! The gateway file: which buses there are and which devices stand on them.
//!
//! [`load`] reads the TOML text, finds the device profiles it names and says everything that is wrong at once, each
//! with its position and what would be right. What a file may say is known in full from the start; what this
//! version only checks and does not act on is listed in [`Gateway::notes`].

#![forbid(unsafe_code)]
#![warn(clippy::expect_used, clippy::indexing_slicing, clippy::panic, clippy::unwrap_used)]

mod bus;
mod device;
mod gateway;
mod identity;
mod plant;
mod resolve;
mod switches;

pub use bus::{Bus, Link};
pub use device::{Attachment, Device, UNCONFIGURED};
pub use gateway::{Gateway, Note, load};
pub use profiles::{Diagnostic, Diagnostics};
pub use resolve::{PROFILE_DIRECTORY, ReadFile};

/// A gateway file that runs anywhere: two motors on a virtual bus that others join by socketcand.
pub const DEMO: &str = include_str!("../examples/demo.toml");
