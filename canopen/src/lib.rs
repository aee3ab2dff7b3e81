//! A CANopen device (CiA 301 v4.2) without I/O: frames and the time go in, frames and events come out.
//!
//! One [`Node`] is one device on one network. Whoever drives it
//!
//! 1. hands it every frame it subscribed to ([`Node::handle_frame`]), together with the device's application
//!    dictionary, and every deadline it asked for ([`Node::poll_timeout`], [`Node::handle_timeout`]);
//! 2. lets the device act on what was written to its dictionary;
//! 3. calls [`Node::sample`], which samples the TPDOs that are due with what the device now shows;
//! 4. sends what [`Node::poll_transmit`] yields, in that order, and acts on [`Node::poll_event`].
//!
//! So the RPDOs of a SYNC act before that SYNC's TPDOs are sampled, and an SDO answer never waits for a tick.
//!
//! Beside a node may stand who asks others on the same bus, with the same verbs: an [`SdoClient`], and a [`Master`] that boots a
//! network.
//!
//! Several nodes on one link share a [`Router`], which knows who listens to which CAN-ID.
#![forbid(unsafe_code)]
#![warn(clippy::expect_used, clippy::indexing_slicing, clippy::panic, clippy::unwrap_used)]

pub mod ascii;
mod cob_id;
mod communication;
mod deadline;
mod emcy;
mod frame;
mod guarding;
mod heartbeat;
mod lss;
mod lss_master;
mod master;
mod monitor;
mod nmt;
mod node;
mod orders;
mod pdo;
mod recent;
mod router;
mod rules;
mod sdo;
mod sync;
mod time;
mod watch;

pub use cob_id::CobId;
pub use emcy::{Emergency, ErrorRegister};
pub use frame::{Frame, Id};
pub use lss::{LssAddress, LssSetting, UNCONFIGURED};
pub use lss_master::{LssFailure, LssFound, LssMaster, LssStep, LssTask};
pub use master::{BootStatus, DcfEntry, DcfError, Loss, Master, MasterEvent, decode_dcf, encode_dcf};
pub use monitor::{Message, Monitor, Pdo, SdoMessage, SdoStep};
pub use nmt::{NmtCommand, NmtState, is_boot_up};
pub use node::{Abort, BusState, Cause, Counters, Diagnostics, Event, Node, NodeError, Order, Traffic};
pub use orders::NetworkOrder;
pub use recent::Recent;
pub use router::Router;
pub use sdo::{SdoClient, SdoError, SdoEvent, SdoMode};
pub use time::TimeOfDay;
