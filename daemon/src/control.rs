//! The control socket: a Unix stream socket on which `axisctl` and others ask a running daemon.
//!
//! Each line is a request in JSON, `{"request":"status"}`, and is answered by lines: most by one, `{"status":{...}}` or
//! `{"error":"..."}`; what takes time by lines of progress and one at the end. docs/control.md describes them all.
//! Whoever may open the socket (mode 0660) may ask.
//!
//! It is served on the thread of [`crate::services`]. Between it and the core there are one cell ([`board`]), which the
//! core fills when somebody has asked and leaves alone otherwise, and one queue ([`orders`]). What moves an axis is a
//! sequence on this side ([`crate::motion`]), which ends with its client.

mod axes;
mod board;
mod errand;
mod faults;
mod lss;
mod motion;
mod objects;
mod operation;
mod orders;
mod owners;
mod place;
mod request;
mod server;
mod sheet;
mod signals;
mod traffic;

pub(crate) use axes::find as find_device;
pub use board::{Publisher, Reader, board};
pub use errand::{
    Commanded, Described, Errand, NmtOrder, NodePlace, ObjectError, ObjectOrder, ObjectTask, SendOrder,
    Target, Watched,
};
pub use faults::{AxisFaults, Order, Outcome, text};
pub use lss::LssResult;
pub use motion::{Ended, Progress};
pub use objects::ObjectValue;
pub use operation::{Operation, audit_text, levels_text};
pub use orders::{Inbox, Orders, Placed, Task, orders};
pub use owners::{AxisOwner, Claim, owners_text};
pub(crate) use place::directory_of_service;
pub use place::{ControlSocket, place_of_instance, places_to_ask, places_to_serve};
pub use request::{NMT_COMMANDS, PROTOCOL, Request, Response, Version};
pub use server::{ToCore, serve};
pub use sheet::DataSheet;
pub use signals::{AxisSignals, SignalOrder, signals_text};
pub use traffic::Traffic;

pub use crate::link::Tap;
