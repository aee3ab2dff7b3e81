//! The control socket: a Unix stream socket on which `axisctl` and others ask a running daemon.
//!
//! Each line is a request in JSON, `{"request":"status"}`, and is answered by one line: `{"status":{...}}` or
//! `{"error":"..."}`. Whoever may open the socket (mode 0660) may ask.
//!
//! It is served on the thread of [`crate::services`]. Between it and the core there is one cell ([`board`]), which the
//! core fills when somebody has asked and leaves alone otherwise.

mod board;
mod place;
mod server;

use serde::{Deserialize, Serialize};

use crate::status::Status;

pub use board::{Publisher, Reader, board};
pub use place::{ControlSocket, default_places};
pub use server::serve;

/// What a client asks for.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "request", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Request {
    /// The state of everything.
    Status {},
}

/// What it is answered.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Response {
    /// The state of everything.
    Status(Status),
    /// The request was not understood or cannot be answered.
    Error(String),
}
