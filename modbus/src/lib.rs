//! A Modbus server (Modbus Application Protocol V1.1b3) without I/O: bytes and the time go in, bytes come out.
//!
//! One [`Server`] is one connection. Whoever drives it
//!
//! 1. hands it what came in ([`Server::handle_bytes`], as much as there is [`Server::room`] for) and each deadline it
//!    asked for ([`Server::poll_timeout`], [`Server::handle_timeout`]);
//! 2. asks for the unit of the next whole request ([`Server::poll_request`]), looks the device up and has the request
//!    answered ([`Server::answer`]), one at a time, so that everything else can have its turn in between;
//! 3. lets the device act on what was written to its dictionary;
//! 4. sends what [`Server::output`] holds and says how much of it has left ([`Server::sent`]), until
//!    [`Server::is_closing`] and nothing is left.
//!
//! A [`Map`] says which registers and coils stand for which entries of the dictionary. What a request reads or writes
//! is described in [`Request`]; a batch of written registers passes the write gate as a whole or not at all.
#![forbid(unsafe_code)]
#![warn(clippy::expect_used, clippy::indexing_slicing, clippy::panic, clippy::unwrap_used)]

mod exception;
mod framing;
mod identification;
mod map;
mod pdu;
mod permissions;
mod server;
mod service;

pub use exception::Exception;
pub use framing::{Framing, MAX_ADU, crc16, rtu_adu, tcp_adu};
pub use identification::Identification;
pub use map::{Dialect, Flag, JVL_MIRROR, JVL_MODULE, Listed, Map, WordOrder};
pub use pdu::{Bits, IdentificationCode, MAX_PDU, Registers, Request, SdoRequest, function};
pub use permissions::Permissions;
pub use server::{Counters, Server};
pub use service::Target;
