//! The control socket: a Unix stream socket on which `axisctl` and others ask a running daemon.
//!
//! Each line is a request in JSON, `{"request":"status"}`, and is answered by one line: `{"status":{...}}` or
//! `{"error":"..."}`. Whoever may open the socket (mode 0660) may ask.
//!
//! It is served on the thread of [`crate::services`]. Between it and the core there are one cell ([`board`]), which the
//! core fills when somebody has asked and leaves alone otherwise, and one queue ([`orders`]).

mod board;
mod faults;
mod orders;
mod place;
mod server;

use serde::{Deserialize, Serialize};

use crate::status::Status;

pub use board::{Publisher, Reader, board};
pub use faults::{AxisFaults, Order, Outcome, text};
pub use orders::{Errand, Inbox, Orders, orders};
pub(crate) use place::directory_of_service;
pub use place::{ControlSocket, place_of_instance, places_to_ask, places_to_serve};
pub use server::serve;

/// What a client asks for.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "request", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Request {
    /// The state of everything.
    Status {},
    /// Break something of a simulated plant.
    FaultInject {
        /// Name of the device.
        device: String,
        /// Number of the axis, from 1; all of the device without it.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        axis: Option<usize>,
        /// What breaks, such as `supply-dip:10`.
        fault: String,
    },
    /// Repair something of a simulated plant.
    FaultClear {
        /// Name of the device.
        device: String,
        /// Number of the axis, from 1; all of the device without it.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        axis: Option<usize>,
        /// What is repaired, such as `supply-dip`, or `all`.
        fault: String,
    },
    /// What is broken in the simulated plants.
    FaultList {
        /// Name of the device; all devices without it.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        device: Option<String>,
    },
}

/// What it is answered.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Response {
    /// The state of everything.
    Status(Status),
    /// What is broken now behind each axis that was asked about.
    Faults(Vec<AxisFaults>),
    /// The request was not understood or cannot be answered.
    Error(String),
}
